//! Shares of variance in what a search reports: in [0, 1], and a grid has them within their intervals.

use serde_json::Value;

use crate::common::program::Desk;
use crate::common::searching::search;
use crate::common::sweeping::{CPU, CPU_F64, Table, number, sweep};
use vibrissa::optimise::shares::{LINES, Line, Share, Shares, level, shares};
use vibrissa::scene::sampler::Sampler;

/// Steps of both variables of a grid.
const STEPS: [usize; 2] = [60, 60];

/// Total error next to folds, where readings have no distance: 1/|x − x₀|, whose variance no grid finds.
const HEAVY: (&str, [f64; 2], [f64; 2]) = (
    "[whisker]\nD = 6\nd = 1.5\nL_a = 80\n[gauge]\nl = 3\nnoise_strain = 15e-6\nX\n\
     [tap]\na = { from = 25, to = 70, step = 5 }\nT\n[estimate]\ntheory = \"exact\"\n",
    [2.0, 20.0],
    [0.5, 15.0],
);

/// The paper's estimate far from its peak.
const CALM: (&str, [f64; 2], [f64; 2]) = (
    "[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nl = 2\nnoise_strain = 20e-6\nX\n\
     [tap]\na = { from = 24, to = 48, step = 6 }\nT\n",
    [2.0, 6.0],
    [2.0, 8.0],
);

/// Contacts that end before the gauge begins: a third of the box has no figures.
const OPEN: (&str, [f64; 2], [f64; 2]) = (
    "[whisker]\nD = 9\nd = 4\nL_a = 50\n[gauge]\nl = 2\nnoise_strain = 20e-6\nX\n\
     [tap]\na = { from = 21, to = 45, step = 6 }\nT\n",
    [4.0, 28.0],
    [1.0, 8.0],
);

/// `spec` searched over both variables, and swept over a grid of them.
fn both((spec, place, drive): (&str, [f64; 2], [f64; 2])) -> [String; 2] {
    let search = format!(
        "[optimise]\nobjective = \"distance\"\nvariables = {{ x_ss = {place:?}, theta = {drive:?} }}\nlimits = {{ strain = 1 }}\nbudget = {{ evaluations = 200 }}\n"
    );
    let middles = |[lo, hi]: [f64; 2], n: usize| {
        let half = 0.5 * (hi - lo) / n as f64;
        format!("{{ from = {:?}, to = {:?}, steps = {n} }}", lo + half, hi - half)
    };
    let grid = spec.replace('X', &format!("x_ss = {}", middles(place, STEPS[0])));
    let grid = grid.replace('T', &format!("theta = {}", middles(drive, STEPS[1])));
    let none = |spec: &str| spec.replace("\nX\n", "\n").replace("\nT\n", "\n");
    [none(spec) + &search, grid + "[output]\ntuples = false\n"]
}

/// First and total shares of each variable, of the logarithms of a column, by a grid that leaves out what has no value.
fn by_grid(table: &Table, column: &str) -> [[f64; 2]; 2] {
    let [n, m] = STEPS;
    let value = |r: usize| number(&table.rows[r], column).filter(|x| *x > 0.0).map(f64::ln);
    let values: Vec<Option<f64>> = (0..n * m).map(value).collect();
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let squares = |all: &[f64]| all.iter().map(|x| (x - mean(all)).powi(2)).sum::<f64>();
    let whole: Vec<f64> = values.iter().flatten().copied().collect();
    let (all, middle) = (squares(&whole), mean(&whole));
    let of = |groups: usize, at: &dyn Fn(usize) -> usize| {
        let group = |g: usize| -> Vec<f64> {
            values.iter().enumerate().filter(|(r, _)| at(*r) == g).filter_map(|(_, x)| *x).collect()
        };
        let between =
            |g: Vec<f64>| if g.is_empty() { 0.0 } else { g.len() as f64 * (mean(&g) - middle).powi(2) };
        (0..groups).map(group).map(between).sum::<f64>() / all
    };
    let [first, second] = [of(n, &|r| r / m), of(m, &|r| r % m)];
    [[first, 1.0 - second], [second, 1.0 - first]]
}

#[test]
fn shares_of_variance_lie_in_0_to_1_and_a_grid_has_them_within_their_intervals() {
    for case in [HEAVY, CALM, OPEN] {
        let [spec, grid] = both(case);
        let report = search(&spec, CPU);
        let designs = sweep(&grid, CPU_F64).designs;
        assert_eq!(designs.rows.len(), STEPS[0] * STEPS[1]);
        for (f, column) in ["K_sd", "total_rms_mm"].into_iter().enumerate() {
            let wanted = by_grid(&designs, column);
            for ((variable, found), wanted) in report.sensitivity.global.iter().zip(wanted) {
                let found = found[f].unwrap();
                for (share, wanted) in [found.first, found.total].into_iter().zip(wanted) {
                    let [low, high] = share.interval;
                    assert!(
                        0.0 <= low && low <= share.value && share.value <= high && high <= 1.0,
                        "{share:?}"
                    );
                    // A grid has its own error.
                    let holds = low - 2e-3 <= wanted && wanted <= high + 2e-3 && high - low < 0.5;
                    assert!(holds, "{column} by {variable:?}: {share:?}, a grid has {wanted}\n{spec}");
                }
            }
        }
    }
}

#[test]
fn a_search_says_of_what_its_shares_are_and_how_sure() {
    let [spec, _] = both(CALM);
    let desk = Desk::new(&spec);
    let json = desk.json("optimise spec.toml --backend cpu --out found");
    let told = &json["result"]["sensitivity"];
    assert_eq!((told["scale"].as_str(), told["confidence"].as_f64()), (Some("ln"), Some(0.95)), "{told}");
    let table = Table::read(&desk.path("found/sensitivity.csv"));
    let row = table.rows.iter().find(|row| row["parameter"] == "theta").unwrap();
    assert_eq!(row["scale"], "ln");
    for (order, name) in [("first", "total_rms_first"), ("total", "total_rms_total")] {
        let one = &told["sobol"]["theta"];
        let ends: Vec<f64> =
            serde_json::from_value(one[format!("{order}_interval")]["total_rms_mm"].clone()).unwrap();
        let at = |end: &str| number(row, &format!("{name}{end}")).unwrap();
        // The reader of JSON may round the last digit otherwise.
        let same = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(same(one[order]["total_rms_mm"].as_f64().unwrap(), at("")), "{one}");
        assert!(same(ends[0], at("_low")) && same(ends[1], at("_high")), "{one}");
    }
    let fixed = table.rows.iter().find(|row| row["parameter"] == "D").unwrap();
    assert!(fixed["scale"].is_empty() && number(fixed, "total_rms_first").is_none());
    assert_ne!(json["result"]["best"]["error_rms_mm"], Value::Null);
}

/// Lines of `f` along the first of three variables.
fn lines(seed: u64, f: &dyn Fn([f64; 3]) -> f64) -> Vec<Line> {
    let at =
        |i: usize, c: u32| (f64::from(Sampler::Sobol.coordinate(seed, c, i as u32)) + 0.5) / 4_294_967_296.0;
    let line = |i| std::array::from_fn(|j| f([level(i, j), at(i, 1), at(i, 2)]));
    (0..LINES).map(line).collect()
}

/// A share that is known lies in its interval, which is narrow.
#[track_caller]
fn holds(share: Share, known: f64) {
    let Share { value, interval: [low, high] } = share;
    assert!((0.0..=1.0).contains(&value) && low <= value && value <= high, "{share:?}");
    assert!(low - 1e-9 <= known && known <= high + 1e-9 && high - low < 0.35, "{share:?}, known {known}");
}

#[test]
fn shares_that_are_known_lie_in_their_intervals() {
    for seed in [1, 3, 5, 7, 9, 11] {
        let of = |f: &dyn Fn([f64; 3]) -> f64| shares(&lines(seed, f)).unwrap();
        // Alone, and not at all.
        let exact = |s: Shares, known: f64| {
            let share = Share { value: known, interval: [known; 2] };
            assert_eq!(s, Shares { first: share, total: share });
        };
        exact(of(&|[x, ..]| x * x), 1.0);
        exact(of(&|[_, y, z]| y + z), 0.0);
        // Half of a sum; only together.
        let sum = of(&|[x, y, _]| x + y);
        holds(sum.first, 0.5);
        holds(sum.total, 0.5);
        let product = of(&|[x, y, _]| (x - 0.5) * (y - 0.5));
        holds(product.first, 0.0);
        holds(product.total, 1.0);
        // sin x + 7 sin² y + z⁴ sin x/10 on [−π, π] (T. Ishigami and T. Homma 1990).
        let ishigami = of(&|u| {
            let [x, y, z] = u.map(|u| std::f64::consts::PI * (2.0 * u - 1.0));
            x.sin() + 7.0 * y.sin().powi(2) + 0.1 * z.powi(4) * x.sin()
        });
        holds(ishigami.first, 0.3139);
        holds(ishigami.total, 0.5576);
        // 1/|x − x₀| has no variance, its logarithm has 1.0195.
        let tail = of(&|[x, y, _]| -(x - 0.43).abs().ln() + 12.0f64.sqrt() * y);
        holds(tail.total, 0.5048);
    }
}

#[test]
fn what_has_no_value_is_left_out() {
    // Over the triangle x + y < 1 the mean of x + y given x is (1 + x)/2: its variance is a quarter of that of x + y.
    let half = |[x, y, _]: [f64; 3]| if x + y < 1.0 { x + y } else { f64::NAN };
    for seed in [1, 3, 5] {
        let found = shares(&lines(seed, &half)).unwrap();
        holds(found.first, 0.25);
        holds(found.total, 0.75);
    }
    assert_eq!(shares(&lines(1, &|_| f64::NAN)), None);
    assert_eq!(shares(&lines(1, &|_| 2.0)), None);
    assert_eq!(shares(&[]), None);
}
