//! Ranked sweeps from charts against the same sweep in f64, which has no chart: the same rows, the same words.

use crate::common::program::Desk;
use serde_json::Value;
use vibrissa::chart::{axis::Quantity, distance::DistanceChart, ranges::Wanted, scope::Scope};
use vibrissa::kernel::gpu::SOFTWARE_RANKS;
use vibrissa::scene::Setup;

const WHISKER: &str = "D = { from = 8, to = 12, steps = 9 }\nd = { from = 2, to = 7, steps = 6 }\nL_a = 50";
const GAUGE: &str = "x_ss = { from = 3, to = 15, steps = 7 }\nl = 2\nnoise_strain = 2e-5";
const TAP: &str = "a = { from = 21, to = 48, steps = 10 }\ntheta = { from = 0.5, to = 10, steps = 40 }";
const SAMPLED: &str = "samples = 14000";

fn spec(whisker: &str, gauge: &str, tap: &str, more: &str, output: &str) -> String {
    format!(
        "[whisker]\n{whisker}\n[gauge]\n{gauge}\n[tap]\n{tap}\n{more}\n[output]\ntuples = false\ndistances = false\n{output}\n"
    )
}

/// Header and rows of designs.csv as numbers; NaN where there is none.
fn rows(desk: &Desk, folder: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = desk.read(&format!("{folder}/designs.csv"));
    let mut lines = text.lines();
    let header = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let row = |line: &str| line.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect();
    (header, lines.map(row).collect())
}

fn counts(json: &Value) -> &Value {
    &json["counts"]
}

/// Runs `text` on cpu and gpu from the chart and on cpu f64 tap by tap, and compares. Words next to their limits may differ by a few
/// taps of a million.
#[track_caller]
fn agrees(text: &str, by: &str) {
    agrees_ranked(text, by, "device");
}

/// As [`agrees`], where `ranks` the designs of a gpu: what reads many distances from few charts is the CPU alone.
#[track_caller]
fn agrees_ranked(text: &str, by: &str, ranks: &str) {
    let desk = Desk::new(text);
    let run = |backend: &str, precision: &str| {
        let out = format!("{backend}-{precision}");
        let arguments =
            ["sweep", "spec.toml", "--backend", backend, "--precision", precision, "--out", &out, "--json"];
        // A software device would leave the ranking to the CPU.
        let ran = desk.run_with(&arguments, &[(SOFTWARE_RANKS, "1")]).exits(0);
        (ran.json(), rows(&desk, &out))
    };
    let (exact, (header, wanted)) = run("cpu", "f64");
    let taps = counts(&exact)["taps"].as_u64().unwrap();
    assert!(counts(&exact)["chart"].is_null(), "f64 has no chart");
    assert!(!wanted.is_empty(), "rows to compare");
    let rank = header.iter().position(|h| h.starts_with(by)).unwrap();
    for backend in ["cpu", "gpu"] {
        let (charted, (_, got)) = run(backend, "f32");
        let (a, b) = (counts(&charted), counts(&exact));
        assert_eq!(a["taps"], taps, "{backend}");
        let by = if backend == "gpu" { ranks } else { "lanes" };
        assert_eq!(a["chart"]["ranked_by"], by, "{backend}: {a}");
        assert!(a["interpolated"].as_u64().unwrap() > taps / 10, "{backend}: {a}");
        assert!(a["solved"].as_u64().unwrap() < taps, "{backend}: {a}");
        let near = |a: &Value, b: &Value, most: u64| {
            let (a, b) = (a.as_u64().unwrap_or(0), b.as_u64().unwrap_or(0));
            a.abs_diff(b) <= most
        };
        for word in [
            "ok",
            "slipped_off",
            "strain_limit",
            "no_root",
            "ambiguous",
            "outside_calibration",
            "invalid_geometry",
            "not_converged",
        ] {
            // Next to a fold of a sharp tip single precision gives up earlier; such taps are solved, not charted.
            let most = if word == "not_converged" { taps / 200 } else { 2 + taps / 20_000 };
            assert!(near(&a["status"][word], &b["status"][word], most), "{backend} {word}: {a} against {b}");
        }
        for (words, n) in b["combinations"].as_object().unwrap() {
            let most = if words.contains("not_converged") { taps / 200 } else { 2 + taps / 10_000 };
            assert!(near(&a["combinations"][words], n, most), "{backend} {words}: {a} against {b}");
        }
        let all: u64 = a["combinations"].as_object().unwrap().values().filter_map(Value::as_u64).sum();
        assert_eq!(all, taps, "{backend}: {a}");
        assert!(
            near(&a["complete_rows"], &b["complete_rows"], 2 + taps / 100_000),
            "{backend}: {a} against {b}"
        );
        assert_eq!(got.len(), wanted.len(), "{backend}");
        for (i, (got, want)) in got.iter().zip(&wanted).enumerate() {
            // The same design and drive, unless two rows rank the same.
            let same = got[..6].iter().zip(&want[..6]).all(|(a, b)| (a - b).abs() <= 1e-9 * b.abs());
            let (x, y) = (got[rank], want[rank]);
            assert!(
                (x - y).abs() <= 2e-4 * y.abs() + 1e-7 * f64::from(u8::from(by != "K_sd")),
                "{backend} row {i}: {x} {y}"
            );
            assert!(same || (x - y).abs() <= 2e-4 * y.abs(), "{backend} row {i}: {got:?} {want:?}");
        }
    }
}

#[test]
fn every_rank() {
    let ranks =
        [("K_sd", "row"), ("error_max_mm", "row"), ("noise_rms_mm", "row"), ("total_rms_mm", "design")];
    for (by, per) in ranks {
        agrees(&spec(WHISKER, GAUGE, TAP, "", &format!("top = 12\nby = \"{by}\"\nper = \"{per}\"")), by);
    }
}

#[test]
fn sampled_designs_with_their_own_angle() {
    const FRICTION: &str = "[model]\ncontact = { coulomb = 0.3 }\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";
    for (sampler, model, rank, by) in [
        ("sampler = \"sobol\"", "", "top = 9\nby = \"K_sd\"", "K_sd"),
        ("sampler = \"sobol\", seed = 7", "", "top = 9\nby = \"total_rms_mm\"", "total_rms_mm"),
        ("sampler = \"random\", seed = 3", "", "top = 60\nby = \"K_sd\"\nper = \"design\"", "K_sd"),
        ("sampler = \"random\", seed = 5", FRICTION, "top = 20\nby = \"K_sd\"", "K_sd"),
    ] {
        let axis = |lo: f64, hi: f64| format!("{{ min = {lo}, max = {hi}, {SAMPLED}, {sampler} }}");
        let whisker = format!("D = {}\nd = {}\nL_a = 50", axis(8.0, 12.0), axis(2.0, 7.0));
        let gauge = format!("x_ss = {}\nl = 2\nnoise_strain = 2e-5", axis(3.0, 15.0));
        let tap = format!("a = {{ from = 21, to = 48, steps = 10 }}\ntheta = {}", axis(0.5, 10.0));
        agrees(&spec(&whisker, &gauge, &tap, model, rank), by);
    }
}

/// Distances without a chart of their own are read between charts, each rank by its own statistics; distances may repeat.
#[test]
fn many_distances_are_read_from_a_few_charts() {
    const MODEL: &str =
        "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";
    let axis = |lo: f64, hi: f64, n: u32| format!("{{ min = {lo}, max = {hi}, samples = {n} }}");
    let repeated: Vec<String> = (0..60).map(|i| format!("{}", 21 + i * 7 % 28)).collect();
    let even = "{ from = 21, to = 48, steps = 60 }".to_owned();
    for (own, model, by, a) in [
        (true, MODEL, "K_sd", even.clone()),
        (true, MODEL, "total_rms_mm", format!("[{}]", repeated.join(", "))),
        (false, MODEL, "K_sd", even.clone()),
        (false, "", "total_rms_mm", even),
    ] {
        let n = if own { 2500 } else { 120 };
        let theta = if own { axis(0.5, 10.0, n) } else { "{ from = 0.5, to = 10, steps = 30 }".into() };
        let whisker = format!("D = {}\nd = {}\nL_a = 50", axis(8.0, 12.0, n), axis(2.0, 7.0, n));
        let gauge = format!("x_ss = {}\nl = 2\nnoise_strain = 2e-5", axis(3.0, 15.0, n));
        let tap = format!("a = {a}\ntheta = {theta}");
        let text = spec(&whisker, &gauge, &tap, model, &format!("top = 9\nby = \"{by}\""));
        let desk = Desk::new(&text);
        let counts = desk.run(&["sweep", "spec.toml", "--json"]).exits(0).json()["counts"].clone();
        assert!(counts["chart"]["charts"].as_u64().is_some_and(|n| n <= 20), "{counts}");
        assert!(counts["chart"]["strain_error"].as_f64().unwrap() < 5e-6, "{counts}");
        agrees_ranked(&text, by, "lanes");
    }
}

/// By the spread of K words of neighbouring distances are counted together, by the distance error tap by tap; both from the same charts.
#[test]
fn words_of_neighbouring_distances_are_those_of_each() {
    const MODEL: &str = "[model]\nsurface = true\nshear = true\nextension = true\n";
    let axis = |lo: f64, hi: f64| format!("{{ min = {lo}, max = {hi}, samples = 6000 }}");
    let backwards: Vec<String> = (0..90).map(|i| format!("{}", 48.0 - 0.3 * f64::from(i))).collect();
    let mixed: Vec<String> = (0..90).map(|i| format!("{}", 21.0 + 0.3 * f64::from(i * 37 % 90))).collect();
    let even = "{ from = 21, to = 48, steps = 150 }".to_owned();
    for (tips, theta, a, more) in [
        ([2.0, 7.0], [0.5, 10.0], even.clone(), MODEL.to_owned()),
        ([2.0, 7.0], [0.5, 10.0], even.clone(), String::new()),
        // Cylinders and whiskers that widen: some readings are far from that of their calibration.
        ([6.0, 13.0], [0.5, 10.0], even.clone(), MODEL.to_owned()),
        // Contacts slip off.
        ([2.0, 7.0], [4.0, 25.0], even.clone(), MODEL.to_owned()),
        ([2.0, 7.0], [0.01, 0.4], format!("[{}]", backwards.join(", ")), MODEL.to_owned()),
        ([2.0, 7.0], [0.5, 10.0], format!("[{}]", mixed.join(", ")), MODEL.to_owned()),
        (
            [2.0, 7.0],
            [0.5, 10.0],
            even.clone(),
            "[estimate]\ntheory = \"timoshenko\"\nrange = [24, 40]".into(),
        ),
        ([2.0, 7.0], [0.5, 10.0], even.clone(), "[estimate]\nK = 1.02\n".into()),
        // Neighbours so near to each other that some lie within rounding of where a word begins.
        ([2.0, 7.0], [0.5, 10.0], "{ from = 21, to = 21.001, steps = 1000 }".into(), String::new()),
    ] {
        let whisker = format!("D = {}\nd = {}\nL_a = 49", axis(8.0, 12.0), axis(tips[0], tips[1]));
        let gauge = format!("x_ss = {}\nl = 2\nnoise_strain = 2e-5", axis(3.0, 15.0));
        let tap = format!("a = {a}\ntheta = {}", axis(theta[0], theta[1]));
        let counts = |by: &str| {
            let text = spec(&whisker, &gauge, &tap, &more, &format!("top = 9\nby = \"{by}\""));
            let json = Desk::new(&text).run(&["sweep", "spec.toml", "--json"]).exits(0).json();
            json["counts"].clone()
        };
        let (together, each) = (counts("K_sd"), counts("total_rms_mm"));
        assert!(together["chart"]["charts"].as_u64().is_some_and(|n| n <= 20), "{together}");
        assert!(together["interpolated"].as_u64().unwrap() > 200_000, "{together}");
        assert_eq!(together["taps"], each["taps"]);
        assert_eq!(together["status"], each["status"], "{tap} {more}");
    }
}

/// Lanes do not know the linear theory of a built whisker, on which most words depend: these are told of the listed rows only.
#[test]
fn words_of_built_whiskers_are_told_of_the_rows() {
    let axis = |lo: f64, hi: f64| format!("{{ min = {lo}, max = {hi}, samples = 15000 }}");
    let core = "core = { diameter = 0.5, modulus = 60000 }";
    let whisker = format!("D = {}\nd = {}\nL_a = 48.05\n{core}", axis(8.0, 12.0), axis(2.0, 7.0));
    let gauge = format!("x_ss = {}\nl = 2", axis(3.0, 15.0));
    let tap = format!("a = {{ from = 21, to = 48, steps = 10 }}\ntheta = {}", axis(0.5, 10.0));
    let model = "[model]\nsurface = true\nshear = true\nextension = true";
    let desk = Desk::new(&spec(&whisker, &gauge, &tap, model, "top = 9\nby = \"K_sd\""));
    let ran = desk.run(&["sweep", "spec.toml", "--json"]).exits(0);
    let counts = ran.json()["counts"].clone();
    assert_eq!(counts["chart"]["words"], serde_json::json!(["slipped_off", "invalid_geometry"]));
    let words: Vec<&String> = counts["status"].as_object().unwrap().keys().collect();
    assert_eq!(words, ["slipped_off"], "{counts}");
    let ran = desk.run(&["sweep", "spec.toml", "--force"]).exits(0);
    let text = ran.stdout + &ran.stderr;
    assert!(text.contains("other words are told of the listed rows only"), "{text}");
    let row = desk.read("results/spec/designs.csv").lines().nth(1).unwrap().to_owned();
    assert!(row.ends_with("ok") || row.ends_with("strain_limit"), "{row}");
}

#[test]
fn angles_in_any_order_and_any_spacing() {
    let list: Vec<String> = (0..40)
        .map(|j| format!("{}", 0.3 + f64::from(j * 17 % 40) * f64::from(j * 17 % 40) / 170.0))
        .collect();
    for theta in
        [format!("[{}]", list.join(", ")), "{ from = 0.1, to = 10, steps = 40, scale = \"log\" }".into()]
    {
        agrees(
            &spec(
                WHISKER,
                GAUGE,
                &format!("a = {{ from = 21, to = 48, steps = 10 }}\ntheta = {theta}"),
                "",
                "top = 9",
            ),
            "K_sd",
        );
    }
}

/// Contacts up to the tip slip off; wider tips and cylinders have no apex in reach; long and short gauges.
#[test]
fn slips_and_widening_whiskers_and_all_gauges() {
    let tip = "D = { from = 8, to = 12, steps = 9 }\nd = { from = 3, to = 13, steps = 11 }\nL_a = [48, 50]";
    agrees(&spec(tip, "x_ss = [0, 4]\nl = [0.01, 6]\nnoise_strain = 1e-5", TAP, "", "top = 9"), "K_sd");
    agrees(
        &spec(
            tip,
            "x_ss = [0, 4]\nl = [0.01, 6]\nnoise_strain = 1e-5",
            TAP,
            "",
            "top = 9\nby = \"total_rms_mm\"",
        ),
        "total_rms_mm",
    );
}

/// f of widening whiskers levels off: readings of near contacts have one distance, and far ones may lie many times the whisker away.
#[test]
fn widening_whiskers_have_the_words_of_their_taps() {
    let wide = "D = { from = 7, to = 9, steps = 9 }\nd = { from = 8, to = 14, steps = 11 }\nL_a = 50";
    let gauge = "x_ss = { from = 4, to = 14, steps = 5 }\nl = 3\nnoise_strain = 1e-5";
    let tap = "a = { from = 22, to = 48, steps = 10 }\ntheta = { from = 0.5, to = 10, steps = 40 }";
    for (by, more) in [
        ("K_sd", "[estimate]\nrange = [35, 48]"),
        ("total_rms_mm", "[estimate]\nrange = [35, 48]"),
        ("error_rms_mm", "[estimate]\ntheory = \"timoshenko\""),
    ] {
        agrees(&spec(wide, gauge, tap, more, &format!("top = 9\nby = \"{by}\"")), by);
    }
}

#[test]
fn given_calibration_range_and_elongation() {
    for (more, by) in [
        ("[estimate]\nK = 1.0", "error_rms_mm"),
        ("[estimate]\nrange = [10, 49]", "total_rms_mm"),
        ("[estimate]\nrange = [30, 49]", "K_sd"),
        ("[estimate]\nconvention = \"elongation\"", "error_max_mm"),
    ] {
        agrees(&spec(WHISKER, GAUGE, TAP, more, &format!("top = 9\nby = \"{by}\"")), by);
    }
}

/// Contacts on or next to the gauge, sharp tips at large angles, gauges that do not fit: these are solved tap by tap.
#[test]
fn designs_outside_the_chart() {
    let sharp = "D = { from = 8, to = 12, steps = 9 }\nd = [1, 2, 3, 6]\nL_a = 50";
    let tap = "a = { from = 9, to = 48, steps = 10 }\ntheta = { from = 0.5, to = 10, steps = 40 }";
    agrees(&spec(sharp, "x_ss = [2, 3, 5, 12, 49]\nl = [1, 2]", tap, "", "top = 9"), "K_sd");
}

/// Ranges that sweeps ask for get a chart, of the whole range unless the tip is sharp, and it keeps its bounds.
#[test]
fn charts_keep_their_bounds() {
    for (taper, place, degrees, whole) in [
        ([0.0, 0.58], [0.08, 0.34], 10.0, true),
        ([-0.3, 0.8], [0.0, 0.8], 10.0, true),
        ([0.1, 0.95], [0.1, 0.5], 10.0, false),
        ([0.0, 0.6], [0.1, 0.5], 20.0, true),
        ([0.0, 0.6], [0.1, 0.5], 0.01, true),
        ([0.0, 0.0], [0.1, 0.1], 1.0, true),
    ] {
        let largest = f64::to_radians(degrees);
        let ranges = [[0.1 * largest, largest], [0.0; 2], [0.2, 0.4], taper, place];
        let asked = (ranges, 0.1f64.min(place[1] - place[0]));
        let chart = DistanceChart::new(&Setup::default(), 40.0, asked, 1e-5).expect("solved");
        let chart = chart.unwrap_or_else(|| panic!("no chart for {ranges:?}"));
        let kept = chart.axes()[Quantity::Taper as usize].range[1];
        assert!(chart.error <= 1e-6 && kept >= 0.75 * taper[1], "{ranges:?}: {} {kept}", chart.error);
        assert!(!whole || (kept - taper[1]).abs() < 1e-12, "{ranges:?}: {kept}");
    }
}

/// A contact that always sticks has no smooth chart next to the apex of a strong taper at large angles. That is found before more than one chart is made.
#[test]
fn charts_that_will_be_refused_ask_few_taps() {
    let text = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [21, 48]\n\
                [model]\nextension = true\ncontact = \"stick\"\n";
    let (spec, _) = crate::common::searching::parse(&format!(
        "{text}[optimise]\nobjective = \"sd\"\nvariables = {{ theta = [0.5, 10] }}\n"
    ));
    let wanted = Wanted {
        D: [8.0, 12.0],
        d: [2.0, 7.0],
        L_a: [50.0; 2],
        x_ss: [3.0, 15.0],
        l: [1.0, 4.0],
        drive: [0.5, 40.0],
    };
    let distances: Vec<f64> = (0..5).map(|i| 21.0 + 6.0 * f64::from(i)).collect();
    let tried = |wanted: &Wanted| Scope::tried(&spec.study.setup, &distances, wanted, 1e-5).unwrap();
    let (none, refused) = tried(&wanted);
    assert!(none.is_none() && refused > 0);
    // Mild tapers have all.
    let (all, made) = tried(&Wanted { d: [6.0, 7.0], drive: [0.5, 10.0], ..wanted });
    assert!(all.is_some_and(|scope| scope.charts.len() == 5));
    // And so have strong ones where the angles are moderate.
    let (all, strong) = tried(&Wanted { drive: [0.5, 10.0], ..wanted });
    assert!(all.is_some_and(|scope| scope.charts.len() == 5));
    assert!(
        refused < strong && refused < 6_000,
        "{refused} taps asked in vain, {made} and {strong} for charts that there are"
    );
}
