//! `vibrissa tap`: the optimum against a scan, and the reason that limits it.

use crate::common::program::{Desk, says};
use crate::common::sweeping::{CPU_F64, sweep};
use serde_json::Value;

const WHISKER: &str = "[whisker]\nD = 9\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n";
const DISTANCES: &str = "a = { from = 21, to = 48, step = 3 }\n";

fn tap(text: &str, more: &[&str]) -> (Desk, Value) {
    let desk = Desk::new(text);
    let json = desk.run(&[&["tap", "spec.toml", "--json", "--out", "found"], more].concat()).exits(0).json();
    (desk, json["result"].clone())
}

#[test]
fn the_optimum_is_that_of_a_scan() {
    let models = [
        "",
        "[model]\nsurface = true\n",
        "[model]\nshear = true\nextension = true\n[estimate]\ntheory = \"timoshenko\"\n",
    ];
    for model in models {
        let head = format!("{WHISKER}noise_strain = 15e-6\n");
        let (desk, result) = tap(&format!("{head}[tap]\n{DISTANCES}{model}"), &[]);
        let theta = result["optimum"]["theta_deg"].as_f64().unwrap();
        let total = result["optimum"]["total_rms_mm"].as_f64().unwrap();
        let (from, to) = (theta - 0.3, theta + 0.3);
        let scan = sweep(
            &format!(
                "{head}[tap]\n{DISTANCES}theta = {{ from = {from:?}, to = {to:?}, step = 0.001 }}\n{model}"
            ),
            CPU_F64,
        );
        let values = scan.designs.numbers("total_rms_mm");
        let thetas = scan.designs.numbers("theta_deg");
        let least =
            (0..values.len()).min_by(|&a, &b| values[a].unwrap().total_cmp(&values[b].unwrap())).unwrap();
        let (scanned, at) = (values[least].unwrap(), thetas[least].unwrap());
        assert!((theta - at).abs() <= 0.0005001, "{model}: {theta} against {at}");
        assert!(
            total <= scanned * (1.0 + 1e-7) && total > scanned * (1.0 - 1e-6),
            "{model}: {total} against {scanned}"
        );
        // The scan is solved to 1e-8 of strain; a parabola through it is accurate to 1e-4°.
        let (left, mid, right) = (values[least - 20].unwrap(), scanned, values[least + 20].unwrap());
        let vertex = at + 0.02 * 0.5 * (left - right) / (left - 2.0 * mid + right);
        assert!((theta - vertex).abs() < 1e-4, "{model}: {theta} against {vertex}");
        assert_eq!(desk.names("found"), ["run.json", "tap.csv"]);
        let curve = desk.table("found/tap.csv");
        let names =
            "theta_deg,K_mean,K_sd,bias_rms_mm,noise_rms_mm,total_rms_mm,strain_max,error_rms_mm,status";
        assert_eq!(curve.columns.join(","), names);
        assert!(curve.rows.len() > 500);
        let tapped = curve.column("theta_deg");
        assert_eq!((tapped[0], tapped[tapped.len() - 1]), ("0.1", "10"));
        assert!(curve.numbers("total_rms_mm").iter().all(|t| t.unwrap() >= total));
    }
}

#[test]
fn it_says_what_limits_the_angle() {
    let spec = |noise: &str, more: &str| format!("{WHISKER}noise_strain = {noise}\n{more}[tap]\n{DISTANCES}");
    let check = |text: &str, more: &[&str], by: &str, bound: Option<f64>| {
        let (_, r) = tap(text, more);
        assert_eq!((&r["limited_by"], &r["at_bound"]), (&by.into(), &bound.is_some().into()), "{text}");
        assert!(bound.is_none_or(|theta| r["optimum"]["theta_deg"] == theta), "{r}");
        r
    };
    let r = check(&spec("15e-6", ""), &[], "noise", None);
    assert_eq!(r["optimum"], r["unconstrained"]);
    check(&spec("0", ""), &[], "bound", Some(0.1));
    check(&spec("15e-6", ""), &["--objective", "sd"], "bound", Some(0.1));
    // A tight strain limit stops before the same unconstrained optimum.
    let r = check(&spec("15e-6", "strain_limit = 0.02\n"), &[], "strain_limit", None);
    let [free, theta] = ["unconstrained", "optimum"].map(|which| r[which]["theta_deg"].as_f64().unwrap());
    let strain = r["optimum"]["strain_max"].as_f64().unwrap();
    assert!(theta < free && (free - 3.6814).abs() < 1e-3 && strain <= 0.02 && strain > 0.02 * (1.0 - 1e-8));
    check(&(spec("1e-3", "") + "theta = [0.5, 4]\n"), &[], "bound", Some(4.0));
    let (_, r) = tap(&(spec("15e-6", "") + "[model]\nsurface = true\n"), &[]);
    assert_eq!(r["limited_by"], "bias");
    let moved =
        spec("15e-6", "").replace("[tap]\n", "[tap]\ndrive = \"displacement\"\n") + "delta = [0.1, 6]\n";
    assert!(tap(&moved, &[]).1["optimum"]["delta_mm"].as_f64().unwrap() > 0.1);
}

/// Also in f32, the optimum is the bound as written.
#[test]
fn an_optimum_at_a_bound_is_that_bound() {
    for (d, precision) in [("4", "f32"), ("7", "f32"), ("9", "f32"), ("4", "f64"), ("9", "f64")] {
        for bound in [0.1, 0.3] {
            let whisker = WHISKER.replace("d = 4", &format!("d = {d}"));
            let text = format!("{whisker}[tap]\n{DISTANCES}theta = [{bound:?}, 8]\n");
            let args = ["--objective", "sd", "--backend", "cpu", "--precision", precision];
            let (_, result) = tap(&text, &args);
            let theta = result["optimum"]["theta_deg"].as_f64().unwrap();
            assert_eq!((theta, &result["at_bound"]), (bound, &true.into()), "d {d}, {precision}");
        }
    }
}

#[test]
fn the_reason_names_the_end_of_the_interval_and_what_is_so_by_construction() {
    let text = format!("{WHISKER}noise_strain = 15e-6\n[tap]\n{DISTANCES}theta = [1, 5]\n");
    // With the exact estimator, noise still falls at 5°.
    let paper = Desk::new(&text).ok("tap spec.toml").stdout;
    says(&paper, &["with --estimator exact it would be θ 5.0000°, where the interval ends:"]);
    assert!(paper.contains("(bias 0 by construction, noise"), "{paper}");
    let (_, result) = tap(&text, &[]);
    assert_eq!(result["other"]["at_bound"], true);
    let exact = format!("{text}[estimate]\ntheory = \"exact\"\n");
    let (_, result) = tap(&exact, &[]);
    assert_eq!(result["limited_by"], "bound");
    let why = |result: &Value| result["why"].as_str().unwrap().to_owned();
    assert!(why(&result).ends_with("The bias is 0 by construction: the model inverts its own strains."));
    // Without the strain limit, the end of the interval would be best; nothing is known beyond it.
    let tight = exact.replace("noise_strain", "strain_limit = 0.02\nnoise_strain");
    let (_, result) = tap(&tight, &[]);
    assert!(why(&result).contains("without it 5.0000°, where the interval ends, would be best"), "{result}");
}

/// At 1.4955° a contact begins to slide: K_sd has a kink there, and rises to both sides.
#[test]
fn a_kink_of_friction_is_no_balance_of_bias_and_noise() {
    let text = "[whisker]\nD = 9\nd = 7\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nside = \"far\"\n\
                [tap]\na = [21, 30, 39]\ntheta = [1.2, 1.8]\n\
                [model]\nextension = true\nshear = true\nmaterial = { neo-hookean = 3.2 }\ncontact = { coulomb = 0.3 }\n";
    let (_, result) = tap(text, &["--objective", "sd"]);
    assert_eq!(result["limited_by"], "friction", "{result}");
    assert!(result["why"].as_str().unwrap().contains("turns from sticking to sliding"), "{result}");
    let theta = result["optimum"]["theta_deg"].as_f64().unwrap();
    let around = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|by| theta + 0.005 * by);
    let swept = sweep(&text.replace("[1.2, 1.8]", &format!("{around:?}")), CPU_F64);
    let sd: Vec<f64> = swept.designs.numbers("K_sd").into_iter().flatten().collect();
    let rise = |a: usize, b: usize| sd[a] + sd[b] - 2.0 * sd[2];
    assert!(rise(1, 3) > 0.0 && rise(0, 4) < 3.0 * rise(1, 3), "{sd:?}");
    // Only friction causes such a change.
    let (_, smooth) = tap(&format!("{WHISKER}noise_strain = 15e-6\n[tap]\n{DISTANCES}theta = [3, 4]\n"), &[]);
    assert_eq!(smooth["limited_by"], "noise");
}

/// A soft whisker with distances by the model itself, as `new` writes it.
fn soft(base: &str, place: &str) -> String {
    format!(
        "[whisker]\nD = {base}\nd = 4.0\nL_a = 80.0\n[gauge]\nx_ss = {place}\nl = 2.0\nnoise_strain = 15e-6\n\
         [tap]\na = {{ from = 25, to = 70, steps = 10 }}\n[model]\nshear = true\nextension = true\nsurface = true\n\
         clamp = \"glued\"\nmaterial = {{ neo-hookean = 3.2 }}\n[estimate]\ntheory = \"exact\"\n"
    )
}

#[test]
fn a_distance_before_the_gauge_is_refused_at_once() {
    let begun = std::time::Instant::now();
    for place in ["25", "30"] {
        let desk = Desk::new(&soft("10.0", place));
        let error = desk.error("tap spec.toml");
        assert_eq!((&error["key"], &error["value"]), (&"tap.a".into(), &"25".into()), "{error}");
        assert!(error["message"].as_str().unwrap().contains(&format!("begins at {place} mm")), "{error}");
        assert!(error["allowed"].as_str().unwrap().contains("gauge nearer to the clamp"), "{error}");
    }
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
}

/// Contacts on the gauge, and a very thin whisker.
#[test]
fn a_whisker_whose_taps_are_hard_has_an_answer_in_seconds() {
    for (base, place, best) in [("10.0", "24", 0.629), ("0.010", "5", 10.0)] {
        let desk = Desk::new(&soft(base, place));
        let begun = std::time::Instant::now();
        let ran = desk.ok("tap spec.toml --json --out found");
        assert!(begun.elapsed().as_secs() < 120, "{:?}", begun.elapsed());
        let json = ran.json();
        let theta = json["result"]["optimum"]["theta_deg"].as_f64().expect("an angle");
        assert!((theta - best).abs() <= 1e-3 * best, "{theta} {best}");
        let run = desk.whole("found");
        let tolerance = run["backend"]["tolerance"].as_f64().expect("a tolerance");
        let in_force = run["in_force"].as_array().expect("values");
        let told = in_force.iter().find(|entry| entry["key"] == "run.tolerance").expect("a value");
        assert_eq!(told["value"].as_str().and_then(|t| t.parse().ok()), Some(tolerance));
    }
}

/// A contact that rolls on a whisker that is not a cone is left to the reference.
#[test]
fn a_whisker_whose_best_tap_would_take_minutes_is_refused() {
    let rolls = soft("10.0", "5").replace("D =", "curvature = 0.004\nD =");
    let rolls = rolls.replace("clamp = \"glued\"\n", "pole_radius = 2\ncontact = \"stick\"\n");
    let desk = Desk::new(&rolls);
    let ran = desk.run(&["tap", "spec.toml"]);
    assert!(ran.stderr.contains("hard to solve: again"), "{}", ran.stderr);
    let error = desk.error("tap spec.toml");
    assert!(error["message"].as_str().unwrap().contains("would take minutes"), "{error}");
}
