//! Distances by the model itself (`[estimate] theory = "exact"`), against scans of the reference and against rigs.

use crate::common::measuring::{REAL, calibrated, fresh, locator, prototype, score, table};
use crate::common::program::{Desk, says};
use crate::common::scan::Scan;
use crate::common::searching::{layout, parse, search};
use crate::common::specs;
use crate::common::sweeping::{CPU, CPU_F64, GPU, Place, REFERENCE, number, sweep, tap};
use vibrissa::design::Design;
use vibrissa::estimator::Estimator;
use vibrissa::optimise::evaluate::Scorer;
use vibrissa::optimise::score::Limit;
use vibrissa::optimise::score::deviations;
use vibrissa::plan::{Plan, Way};
use vibrissa::scene::Tuple;
use vibrissa::simulate::Settings;

const NOISE: f64 = 15e-6;
const LINEAR: &str = "[model]\ngeometry = \"linear\"\nshear = true\n";
const EXACT: &str = "[estimate]\ntheory = \"exact\"\n";
const FRICTION: &str = "[model]\nextension = true\nsurface = true\ncontact = { coulomb = 0.3 }\nmaterial = { neo-hookean = 3.2 }\n";

fn spec(d: f64, gauge: &str, tap: &str, more: &str) -> String {
    format!(
        "[whisker]\nD = 10\nd = {d}\nL_a = 50\n[gauge]\nl = 2\nnoise_strain = {NOISE:e}\n{gauge}\n[tap]\n{tap}\n{more}{EXACT}"
    )
}

/// Every tap must have the distance and word of a scan, on each of `places`; returns the largest relative difference of σ on each.
fn told_as_scanned(text: &str, places: [Place; 3]) -> [f64; 3] {
    let setup = specs::parse(text).expect("a spec").study.setup;
    let mut scans: Vec<(f64, Scan)> = Vec::new();
    places.map(|place| {
        let swept = sweep(text, place);
        let distances: Vec<f64> = swept.tuples.numbers("a_mm").into_iter().flatten().collect();
        let range = [f64::min, f64::max].map(|f| distances.iter().copied().reduce(f).expect("a tap"));
        let mut worst: f64 = 0.0;
        for row in &swept.tuples.rows {
            let tap = tap(row);
            let at = scans.iter().position(|(drive, _)| *drive == tap.drive).unwrap_or_else(|| {
                scans.push((tap.drive, Scan::new(&setup, tap, 0.0)));
                scans.len() - 1
            });
            let taken = scans[at].1.own(tap.a, range);
            let (distance, sigma) = (number(row, "distance_mm").unwrap(), number(row, "sigma_mm").unwrap());
            let said = format!("{place:?} {row:?} {taken:?}");
            let slack = if taken.a == tap.a { 0.0 } else { 1e-4 * taken.a };
            assert!((distance - taken.a).abs() <= slack, "{said}");
            assert_eq!(number(row, "error_mm"), Some(distance - tap.a), "{said}");
            assert_eq!(row["status"].contains("ambiguous"), taken.ambiguous, "{said}");
            worst = worst.max((sigma * taken.slope.abs() / NOISE - 1.0).abs());
        }
        worst
    })
}

#[test]
fn sweeps_tell_taps_as_a_scan_does() {
    let far = "a = { from = 21, to = 48, step = 3 }";
    let cases = [
        ("tapered", spec(4.0, "x_ss = 5", &format!("{far}\ntheta = [1, 8]"), "")),
        ("real", spec(7.0, "x_ss = 5", &format!("{far}\ntheta = [1, 8]"), REAL)),
        ("far side", spec(7.0, "x_ss = 5\nside = \"far\"", &format!("{far}\ntheta = [4]"), REAL)),
        ("displaced", spec(4.0, "x_ss = 5", &format!("drive = \"displacement\"\n{far}\ndelta = [1, 5]"), "")),
        ("friction", spec(7.0, "x_ss = 5", &format!("{far}\ntheta = [2, 8]"), FRICTION)),
        ("stick and slide", spec(4.0, "x_ss = 5", &format!("{far}\ntheta = [12]"), FRICTION)),
        ("one distance", spec(4.0, "x_ss = 5", "a = 30\ntheta = [4]", "")),
        ("narrow", spec(4.0, "x_ss = 5", "a = [30, 30.5, 31]\ntheta = [4]", "")),
        // A cylinder's peak is at twice the gauge position: the reading of 20 mm has no second distance on the whisker, that of 25 mm has.
        ("before the peak", spec(10.0, "x_ss = 15", "a = [20, 25, 40, 48]\ntheta = [1, 5]", "")),
        ("next to the gauge", spec(10.0, "x_ss = 15", "a = [16, 18, 48]\ntheta = [1]", "")),
        ("linear", spec(4.0, "x_ss = 5", &format!("{far}\ntheta = [4]"), LINEAR)),
    ];
    for (name, text) in &cases {
        // A device compiles a kernel for each model: it gets one.
        let (last, most) = if *name == "real" { (GPU, 1e-3) } else { (REFERENCE, 1e-5) };
        let worst = told_as_scanned(text, [CPU_F64, CPU, last]);
        println!("{name}: {worst:?}");
        assert!(worst[0] <= 1e-5 && worst[1] <= 1e-3 && worst[2] <= most, "{name}: {worst:?}");
    }
}

#[test]
fn what_is_no_distance_stays_as_it_is() {
    let text = spec(4.0, "x_ss = 5", "a = [21, 30, 48]\ntheta = [1, 8]", "");
    let (own, paper) = (sweep(&text, CPU), sweep(&text.replace("\"exact\"", "\"euler-bernoulli\""), CPU));
    assert_eq!(own.distances.text, paper.distances.text);
    for column in ["K_mean", "K_sd", "strain_max", "force_max_N"] {
        assert_eq!(own.designs.numbers(column), paper.designs.numbers(column), "{column}");
    }
    for column in ["strain", "strain_linear", "K", "K_deviation", "contact_arc_mm"] {
        assert_eq!(own.tuples.numbers(column), paper.tuples.numbers(column), "{column}");
    }
    let one = sweep(&text.replace("[21, 30, 48]", "30"), CPU).designs.rows;
    assert_eq!((number(&one[0], "K_sd"), number(&one[0], "error_rms_mm")), (None, Some(0.0)));
    assert!(number(&one[0], "total_rms_mm").unwrap() > 0.0);
}

/// Charts contain the paper's estimate only: no ranking from charts, also in `--plan`.
#[test]
fn no_chart_ranks_what_the_model_tells() {
    let text = |theory: &str| {
        format!(
            "[whisker]\nD = {{ from = 8, to = 12, steps = 30 }}\nd = {{ from = 3, to = 7, steps = 30 }}\nL_a = 50\n\
             [gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-5\n[tap]\na = {{ from = 21, to = 48, step = 3 }}\n\
             theta = {{ from = 1, to = 8, steps = 15 }}\n[estimate]\ntheory = \"{theory}\"\n\
             [output]\ntuples = false\ndistances = false\ntop = 3\nby = \"total_rms_mm\"\n"
        )
    };
    let way = |theory: &str| {
        let spec = specs::parse(&text(theory)).unwrap();
        let plan = Plan::new(&spec.study, &CPU.choice()).unwrap();
        (plan.way, plan.curves)
    };
    assert_eq!((way("euler-bernoulli"), way("exact")), ((Way::Charted, 0), (Way::Solved, 13500)));
    let desk = Desk::new(&text("exact"));
    let plan = desk.ok("sweep spec.toml --backend cpu --plan").stdout;
    assert!(plan.contains("13500 designs rows too") && !plan.contains("ranked from a chart"), "{plan}");
    let best = sweep(&text("exact"), CPU).designs.rows;
    let all = sweep(&text("exact").replace("top = 3\n", ""), CPU).designs.numbers("total_rms_mm");
    let least = all.into_iter().flatten().reduce(f64::min).unwrap();
    assert_eq!((best.len(), number(&best[0], "total_rms_mm")), (3, Some(least)));
}

fn scanned_noise(text: &str, drive: f64, distances: &[f64]) -> f64 {
    let spec = specs::parse(text).expect("a spec");
    let whisker = Tuple { drive, ..spec.study.space.whisker().expect("one whisker") };
    let squares = distances.iter().map(|a| (NOISE / Scan::slope(&spec.study.setup, whisker, *a)).powi(2));
    (squares.sum::<f64>() / distances.len() as f64).sqrt()
}

#[test]
fn the_best_angle_is_that_of_a_scan() {
    let distances: Vec<f64> = (0..10).map(|i| 21.0 + 3.0 * f64::from(i)).collect();
    let text = spec(4.0, "x_ss = 5", "a = { from = 21, to = 48, step = 3 }\ntheta = [0.1, 20]", "");
    let desk = Desk::new(&text);
    let tap = |more: &str| desk.json(format!("tap spec.toml --force --out found {more}"))["result"].clone();
    let found = tap("");
    let [theta, total, bias] =
        ["theta_deg", "total_rms_mm", "bias_rms_mm"].map(|key| found["optimum"][key].as_f64().unwrap());
    assert!(found["estimator"] == "exact" && found["limited_by"] == "strain_limit" && bias == 0.0, "{found}");
    let scanned = scanned_noise(&text, theta, &distances);
    assert!((total / scanned - 1.0).abs() < 1e-5, "{total} against {scanned}");
    let strain = found["optimum"]["strain_max"].as_f64().unwrap();
    assert!(strain <= 0.05 && strain > 0.05 * (1.0 - 1e-8), "{strain}");

    let other = &found["other"];
    desk.write("spec.toml", text.replace("\"exact\"", "\"euler-bernoulli\""));
    let paper = tap("");
    let alike = |a: &serde_json::Value, b: &serde_json::Value| {
        let number = |key: &str| a[key].as_f64().zip(b[key].as_f64());
        ["theta_deg", "total_rms_mm", "K_mean", "K_sd", "noise_rms_mm", "strain_max"]
            .iter()
            .all(|key| number(key).is_some_and(|(a, b)| (a - b).abs() <= 1e-6 * b.abs()))
    };
    assert!(other["estimator"] == "paper" && alike(&other["optimum"], &paper["optimum"]), "{found} {paper}");
    let other = &paper["other"];
    assert!(other["estimator"] == "exact" && alike(&other["optimum"], &found["optimum"]), "{found} {paper}");
    assert!(paper["optimum"]["total_rms_mm"].as_f64().unwrap() > total);
    let said = desk.ok("tap spec.toml --force --out found").stdout;
    says(&said, &["this holds for locate --estimator paper; with --estimator exact it would be"]);
    assert!(tap("--objective sd")["other"].is_null());
    desk.write("spec.toml", text.replace("{ from = 21, to = 48, step = 3 }", "30"));
    assert!(tap("")["other"]["why_not"].is_string());
}

const SEARCH: &str = "[whisker]\nD = 10\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 15e-6\n\
                      [tap]\na = { from = 21, to = 48, step = 9 }\n[estimate]\ntheory = \"exact\"\n\
                      [optimise]\nvariables = { d = [3, 10], theta = [1, 10] }\nlimits = { strain = 0.03 }\n";

#[test]
fn searches_find_what_a_scan_finds() {
    let distances = [21.0, 30.0, 39.0, 48.0];
    let report = search(&format!("{SEARCH}objective = \"distance\"\n"), CPU);
    let at = |d: f64, theta: f64| {
        scanned_noise(&spec(d, "x_ss = 5", &format!("a = 30\ntheta = {theta:?}"), ""), theta, &distances)
    };
    let best = report.best.point;
    assert!((report.value / at(best.d, best.drive) - 1.0).abs() < 1e-5, "{report:?}");
    assert_eq!(report.best.row.figures().error_rms, Some(0.0));
    let other = report.other.as_ref().expect("a distance is told");
    assert_eq!(other.theory.estimator(), "paper");
    let suited = other.best.expect("a drive").score.figures[1];
    assert!(suited > report.value && suited <= other.here.score.figures[1] * (1.0 + 1e-9), "{other:?}");
    for objective in ["weighted", "pareto"] {
        let text = format!("{SEARCH}objective = \"{objective}\"\nbudget = {{ evaluations = 1500 }}\n");
        assert!(search(&text, CPU).best.row.figures().total_rms() >= Some(report.value * (1.0 - 1e-6)));
    }
}

/// The nominal model inverts the strains of the built whisker; a whisker calibrated itself has no bias.
#[test]
fn tolerances_are_read_with_the_nominal_model() {
    let robust = |calibrated: &str| {
        format!(
            "{SEARCH}objective = \"distance\"\nbudget = {{ evaluations = 300 }}\n\
             robust = {{ D = 0.05, x_ss = 0.1, theta = 0.02, samples = 4, calibrated = \"{calibrated}\" }}\n"
        )
        .replace("15e-6", "0")
    };
    let each = search(&robust("each"), CPU);
    assert_eq!(each.value, 0.0);
    let report = search(&robust("nominal"), CPU);
    let (spec, _) = parse(&robust("nominal"));
    let nominal = report.best.point;
    let scan = Scan::new(&spec.study.setup, nominal, 15.0);
    let mut total = 0.0;
    for z in deviations(1, 4) {
        let mut built = nominal.to_array();
        for (value, (sd, z)) in
            built.iter_mut().zip([0.05, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.02].iter().zip(z))
        {
            *value += sd * z;
        }
        let built = Scan::new(&spec.study.setup, Tuple::from_array(built), 15.0);
        let squares = [21.0, 30.0, 39.0, 48.0].map(|a| (scan.other(built.at(a).0).unwrap() - a).powi(2));
        total += (squares.iter().sum::<f64>() / 4.0).sqrt() / 4.0;
    }
    assert!((report.value / total - 1.0).abs() < 1e-4, "{} against {total}", report.value);
}

/// `unambiguous` refers to the peak of the model's strain, which differs from that of f.
#[test]
fn distances_are_unambiguous_beyond_the_models_own_peak() {
    let text = SEARCH.replace("strain = 0.03", "unambiguous = true").replace("x_ss = 5", "x_ss = 12");
    let (spec, wanted) = parse(&(text + "objective = \"distance\"\n[model]\nsurface = true\n"));
    let setup = &spec.study.setup;
    let mut scorer = Scorer::new(setup, &layout(&spec), &wanted, CPU_F64.open(setup));
    for d in [6.0, 10.0] {
        let point = Tuple { d, drive: 8.0, ..spec.study.space.whisker().unwrap() };
        let limit = scorer.scores(&[point]).unwrap()[0].limit(Limit::Unambiguous);
        let (peak, scanned) = (21.0 / (1.0 - limit), Scan::new(setup, point, 15.0).peak_at());
        let linear = Design::new(setup, point).shared.unwrap().theory.peak().0;
        assert!((peak - scanned).abs() < 0.06 && (peak - linear).abs() > 0.2, "{peak}, {scanned}, {linear}");
    }
}

#[test]
fn a_rig_is_as_good_as_predicted() {
    let taps = |a: &str| format!("[tap]\na = {a}\ntheta = [2, 4, 7]\n");
    let noise = format!("noise_strain = {NOISE:e}\n");
    let rig = prototype(7.0, &[&noise, &taps("{ from = 21, to = 48, step = 3 }"), REAL]);
    let settings = Settings { repeats: 20, noise: NOISE, ..Settings::default() };
    let done = calibrated(&table(&rig, &settings), &rig, &[]);
    let locate = locator(&done, Estimator::named("exact"));
    let settings = Settings { noise: NOISE, seed: 9, ..Settings::default() };
    let measured = score(&locate, &table(&fresh(&rig, [21.0, 48.0], 400), &settings), NOISE);
    let text = prototype(7.0, &[&noise, &taps("{ from = 21, to = 48, steps = 109 }"), REAL, EXACT]);
    let totals = sweep(&text, CPU).designs.numbers("total_rms_mm");
    let predicted = (totals.iter().map(|t| t.unwrap().powi(2)).sum::<f64>() / totals.len() as f64).sqrt();
    println!("measured {:.5} mm, predicted {predicted:.5} mm over {} taps", measured.rms, measured.taps);
    assert!((measured.rms / predicted - 1.0).abs() < 0.2, "{measured:?}, {predicted}");
    assert_eq!(measured.unanswered, 0);
}

#[test]
fn a_given_k_is_not_used() {
    let text = specs::GOOD.replace("[estimate]", &format!("{EXACT}K = 1.1"));
    let warned = specs::parse(&text).expect("a spec").warnings;
    assert!(warned.iter().any(|w| w.contains("K is not used")), "{warned:?}");
}
