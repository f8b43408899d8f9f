//! Variance shares in the report of a search: in [0, 1], and a grid's shares lie within their intervals.

use serde_json::Value;

use crate::common::program::Desk;
use crate::common::sweeping::{CPU_F64, Table, number, sweep};
use vibrissa::optimise::sensitivity::{LINES, Line, Share, Shares, level, shares};
use vibrissa::scene::sampler::Sampler;

const STEPS: [usize; 2] = [60, 60];

/// The paper's estimate far from its peak; `ENDS` are the ranges of place and angle.
const CALM: &str = "[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nl = 2\nnoise_strain = 20e-6\n[tap]\na = { from = 24, to = 48, step = 6 }\n";
const ENDS: [[f64; 2]; 2] = [[2.0, 6.0], [2.0, 8.0]];

/// First-order and total shares of each variable for the logarithm of a column, from a grid.
fn by_grid(table: &Table, column: &str) -> [[f64; 2]; 2] {
    let [n, m] = STEPS;
    let values: Vec<f64> = table.numbers(column).into_iter().map(|x| x.unwrap().ln()).collect();
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let middle = mean(&values);
    let all: f64 = values.iter().map(|x| (x - middle).powi(2)).sum();
    let of = |groups: usize, at: &dyn Fn(usize) -> usize| {
        let group = |g: usize| (0..n * m).filter(|r| at(*r) == g).map(|r| values[r]).collect::<Vec<f64>>();
        let between = |g: Vec<f64>| g.len() as f64 * (mean(&g) - middle).powi(2);
        (0..groups).map(group).map(between).sum::<f64>() / all
    };
    let [first, second] = [of(n, &|r| r / m), of(m, &|r| r % m)];
    [[first, 1.0 - second], [second, 1.0 - first]]
}

/// Heavy-tailed and partly undefined functions are tested below, with known shares.
#[test]
fn a_search_says_of_what_its_shares_are_and_a_grid_has_them_within_their_intervals() {
    let search = format!(
        "{CALM}[optimise]\nobjective = \"distance\"\nvariables = {{ x_ss = {:?}, theta = {:?} }}\nlimits = {{ strain = 1 }}\nbudget = {{ evaluations = 200 }}\n",
        ENDS[0], ENDS[1]
    );
    let middles = |k: usize| {
        let ([lo, hi], n) = (ENDS[k], STEPS[k]);
        let half = 0.5 * (hi - lo) / n as f64;
        format!("{{ from = {:?}, to = {:?}, steps = {n} }}", lo + half, hi - half)
    };
    let grid = CALM.replace("[tap]", &format!("x_ss = {}\n[tap]\ntheta = {}", middles(0), middles(1)));
    let designs = sweep(&(grid + "[output]\ntuples = false\n"), CPU_F64).designs;
    assert_eq!(designs.rows.len(), STEPS[0] * STEPS[1]);
    let desk = Desk::new(&search);
    let json = desk.json("optimise spec.toml --backend cpu --out found");
    let told = &json["result"]["sensitivity"];
    assert_eq!((told["scale"].as_str(), told["confidence"].as_f64()), (Some("ln"), Some(0.95)), "{told}");
    let table = desk.table("found/sensitivity.csv");
    for (k, parameter) in ["x_ss", "theta"].into_iter().enumerate() {
        let row = table.rows.iter().find(|row| row["parameter"] == parameter).unwrap();
        assert_eq!(row["scale"], "ln");
        let at = |name: &str| number(row, name).unwrap();
        for (column, name) in [("K_sd", "K_sd"), ("total_rms_mm", "total_rms")] {
            for (order, wanted) in ["first", "total"].into_iter().zip(by_grid(&designs, column)[k]) {
                let [low, share, high] = ["_low", "", "_high"].map(|end| at(&format!("{name}_{order}{end}")));
                assert!(0.0 <= low && low <= share && share <= high && high <= 1.0, "{row:?}");
                // 2e-3 is the error of the grid.
                let holds = low - 2e-3 <= wanted && wanted <= high + 2e-3 && high - low < 0.5;
                assert!(holds, "{column} by {parameter}: {row:?}, a grid has {wanted}");
                // The JSON reader may round the last digit differently.
                let same = |a: &Value, b: f64| (a.as_f64().unwrap() - b).abs() < 1e-12;
                let (one, ends) = (&told["sobol"][parameter], format!("{order}_interval"));
                assert!(same(&one[order][column], share), "{one}");
                assert!(same(&one[&ends][column][0], low) && same(&one[&ends][column][1], high), "{one}");
            }
        }
    }
    let fixed = table.rows.iter().find(|row| row["parameter"] == "D").unwrap();
    assert!(fixed["scale"].is_empty() && number(fixed, "total_rms_first").is_none());
    assert_ne!(json["result"]["best"]["error_rms_mm"], Value::Null);
}

fn lines(seed: u64, f: &dyn Fn([f64; 3]) -> f64) -> Vec<Line> {
    let at =
        |i: usize, c: u32| (f64::from(Sampler::Sobol.coordinate(seed, c, i as u32)) + 0.5) / 4_294_967_296.0;
    let line = |i| std::array::from_fn(|j| f([level(i, j), at(i, 1), at(i, 2)]));
    (0..LINES).map(line).collect()
}

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
        // A function of x alone: share 1, others 0.
        let exact = |s: Shares, known: f64| {
            let share = Share { value: known, interval: [known; 2] };
            assert_eq!(s, Shares { first: share, total: share });
        };
        exact(of(&|[x, ..]| x * x), 1.0);
        exact(of(&|[_, y, z]| y + z), 0.0);
        // Half of a sum; a pure interaction.
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
        // 1/|x − x₀| has infinite variance, its logarithm 1.0195.
        let tail = of(&|[x, y, _]| -(x - 0.43).abs().ln() + 12.0f64.sqrt() * y);
        holds(tail.total, 0.5048);
    }
}

#[test]
fn what_has_no_value_is_left_out() {
    // Over the triangle x + y < 1, the mean of x + y given x is (1 + x)/2; its variance is a quarter of that of x + y.
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
