//! Ranked sweeps from charts against the same sweep in f64, which uses no chart: same rows, same status words.

use crate::common::program::Desk;
use serde_json::Value;
use vibrissa::chart::{axis::AXES, ranges::Wanted, scope::Scope};
use vibrissa::kernel::gpu::SOFTWARE_RANKS;

const WHISKER: &str = "D = { from = 8, to = 12, steps = 9 }\nd = { from = 2, to = 7, steps = 6 }\nL_a = 50";
const GAUGE: &str = "x_ss = { from = 3, to = 15, steps = 7 }\nl = 2\nnoise_strain = 2e-5";
const TAP: &str = "a = { from = 21, to = 48, steps = 10 }\ntheta = { from = 0.5, to = 10, steps = 40 }";

fn spec(whisker: &str, gauge: &str, tap: &str, more: &str, output: &str) -> String {
    format!(
        "[whisker]\n{whisker}\n[gauge]\n{gauge}\n[tap]\n{tap}\n{more}\n[output]\ntuples = false\ndistances = false\n{output}\n"
    )
}

fn rows(desk: &Desk, folder: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = desk.read(&format!("{folder}/designs.csv"));
    let mut lines = text.lines();
    let header = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let row = |line: &str| line.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect();
    (header, lines.map(row).collect())
}

#[derive(Clone, Copy)]
struct Ranked {
    /// Ranking column; and what ranks on a GPU backend (only the CPU reads many distances from few charts).
    by: &'static str,
    device: &'static str,
    /// Allowed relative difference of ranked values; least share of taps read from charts.
    near: f64,
    read: f64,
}

const RANKED: Ranked = Ranked { by: "K_sd", device: "device", near: 2e-4, read: 0.1 };

/// Compares cpu and gpu sweeps from charts with a tap-by-tap sweep in f64. A few taps of a million may differ in their word, next to a limit.
#[track_caller]
fn agrees(text: &str, Ranked { by, device, near, read }: Ranked) {
    let desk = Desk::new(text);
    let run = |backend: &str, precision: &str| {
        let out = format!("{backend}-{precision}");
        let line = format!("sweep spec.toml --backend {backend} --precision {precision} --out {out} --json");
        // A software device would otherwise leave the ranking to the CPU.
        let ran = desk.run_with(&line.split(' ').collect::<Vec<_>>(), &[(SOFTWARE_RANKS, "1")]).exits(0);
        (ran.json()["counts"].clone(), rows(&desk, &out))
    };
    let (exact, (header, wanted)) = run("cpu", "f64");
    let taps = exact["taps"].as_u64().unwrap();
    assert!(exact["chart"].is_null() && !wanted.is_empty(), "f64 has no chart, and rows: {exact}");
    let rank = header.iter().position(|h| h.starts_with(by)).unwrap();
    for backend in ["cpu", "gpu"] {
        let (charted, (_, got)) = run(backend, "f32");
        let said = format!("{backend}, {text}{charted} against {exact}");
        assert_eq!(charted["taps"], taps, "{said}");
        // With sharp tips only there may be no chart that ranks.
        let ranks = if backend == "gpu" { device } else { "lanes" };
        assert!(read == 0.0 || charted["chart"]["ranked_by"] == ranks, "{said}");
        let many = |key: &str| charted[key].as_u64().unwrap() as f64;
        assert!(read == 0.0 || many("interpolated") > read * taps as f64, "{said}");
        assert!(many("solved") < taps as f64 * if read > 0.5 { 0.5 } else { 1.0 } || read == 0.0, "{said}");
        let alike = |a: &Value, b: &Value, most: u64| {
            assert!(a.as_u64().unwrap_or(0).abs_diff(b.as_u64().unwrap_or(0)) <= most, "{a} {b}: {said}");
        };
        // Next to a fold of a sharp tip f32 gives up earlier; such taps are solved, not charted.
        let most = |words: &str, share: u64| {
            if words.contains("not_converged") { taps / 200 } else { 2 + taps / share }
        };
        for word in STATUSES.split(' ') {
            alike(&charted["status"][word], &exact["status"][word], most(word, 20_000));
        }
        for (words, n) in exact["combinations"].as_object().unwrap() {
            alike(&charted["combinations"][words], n, most(words, 10_000));
        }
        let all: u64 = charted["combinations"].as_object().unwrap().values().filter_map(Value::as_u64).sum();
        assert_eq!(all, taps, "{said}");
        alike(&charted["complete_rows"], &exact["complete_rows"], 2 + taps / 100_000);
        assert_eq!(got.len(), wanted.len(), "{said}");
        for (i, (got, want)) in got.iter().zip(&wanted).enumerate() {
            let same = got[..6].iter().zip(&want[..6]).all(|(a, b)| (a - b).abs() <= 1e-9 * b.abs());
            let (off, size) = ((got[rank] - want[rank]).abs(), want[rank].abs());
            let slack = match by {
                _ if !same => 0.0,
                // K is near 1: single precision leaves this absolute error.
                "K_sd" => 2e-10,
                _ => 1e-7,
            };
            assert!(off <= near * size + slack, "row {i}: {got:?} {want:?}: {said}");
        }
    }
}

const STATUSES: &str =
    "ok slipped_off strain_limit no_root ambiguous outside_calibration invalid_geometry not_converged";

const PRACTICAL: &str =
    "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";

/// Many distances are read between the charts of a few, for every statistic that ranks; distances may repeat.
#[test]
fn many_distances_are_read_from_a_few_charts() {
    let axis = |lo: f64, hi: f64, n: u32| format!("{{ min = {lo}, max = {hi}, samples = {n} }}");
    let repeated: Vec<String> = (0..60).map(|i| format!("{}", 21 + i * 7 % 28)).collect();
    let even = "{ from = 21, to = 48, steps = 60 }".to_owned();
    for (own, model, by, a) in [
        (true, PRACTICAL, "K_sd", even.clone()),
        (true, PRACTICAL, "total_rms_mm", format!("[{}]", repeated.join(", "))),
        (false, PRACTICAL, "K_sd", even.clone()),
        (false, "", "total_rms_mm", even),
    ] {
        let n = if own { 2500 } else { 120 };
        let theta = if own { axis(0.5, 10.0, n) } else { "{ from = 0.5, to = 10, steps = 30 }".into() };
        let whisker = format!("D = {}\nd = {}\nL_a = 50", axis(8.0, 12.0, n), axis(2.0, 7.0, n));
        let gauge = format!("x_ss = {}\nl = 2\nnoise_strain = 2e-5", axis(3.0, 15.0, n));
        let tap = format!("a = {a}\ntheta = {theta}");
        let text = spec(&whisker, &gauge, &tap, model, &format!("top = 9\nby = \"{by}\""));
        let desk = Desk::new(&text);
        let counts = desk.json("sweep spec.toml")["counts"].clone();
        assert!(counts["chart"]["charts"].as_u64().is_some_and(|n| n <= 20), "{counts}");
        assert!(counts["chart"]["strain_error"].as_f64().unwrap() < 5e-6, "{counts}");
        agrees(&text, Ranked { by, device: "lanes", ..RANKED });
    }
}

/// Ranked by the spread of K, words of neighbouring distances are counted together; by distance error, tap by tap. Both use the same charts.
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
        // Cylinders and widening whiskers: some readings are far from their calibration.
        ([6.0, 13.0], [0.5, 10.0], even.clone(), MODEL.to_owned()),
        // Contacts slip off; few of them are next to a fold, where the reference solves.
        ([4.0, 7.0], [4.0, 30.0], even.clone(), MODEL.to_owned()),
        ([2.0, 7.0], [0.01, 0.4], format!("[{}]", backwards.join(", ")), MODEL.to_owned()),
        ([2.0, 7.0], [0.5, 10.0], format!("[{}]", mixed.join(", ")), MODEL.to_owned()),
        (
            [2.0, 7.0],
            [0.5, 10.0],
            even.clone(),
            "[estimate]\ntheory = \"timoshenko\"\nrange = [24, 40]".into(),
        ),
        ([2.0, 7.0], [0.5, 10.0], even.clone(), "[estimate]\nK = 1.02\n".into()),
        // Distances so close that some lie within rounding of a change of status.
        ([2.0, 7.0], [0.5, 10.0], "{ from = 21, to = 21.001, steps = 1000 }".into(), String::new()),
    ] {
        let whisker = format!("D = {}\nd = {}\nL_a = 49", axis(8.0, 12.0), axis(tips[0], tips[1]));
        let gauge = format!("x_ss = {}\nl = 2\nnoise_strain = 2e-5", axis(3.0, 15.0));
        let tap = format!("a = {a}\ntheta = {}", axis(theta[0], theta[1]));
        let counts = |by: &str| {
            let text = spec(&whisker, &gauge, &tap, &more, &format!("top = 9\nby = \"{by}\""));
            let json = Desk::new(&text).json("sweep spec.toml");
            json["counts"].clone()
        };
        let (together, each) = (counts("K_sd"), counts("total_rms_mm"));
        assert!(together["chart"]["charts"].as_u64().is_some_and(|n| n <= 20), "{together}");
        assert!(together["interpolated"].as_u64().unwrap() > 200_000, "{together}");
        assert_eq!(together["taps"], each["taps"]);
        assert_eq!(together["status"], each["status"], "{tap} {more}");
    }
}

/// Status words of built whiskers follow the linear theory of built whiskers, not that of cones: roots, cores, bores, profiles, curvature, lengths and
/// widening tips.
#[test]
fn words_of_built_whiskers_are_those_of_solved_taps() {
    let axis = |lo: f64, hi: f64| format!("{{ min = {lo}, max = {hi}, samples = 15000 }}");
    let cone = |tips: [f64; 2], more: &str| {
        format!("D = {}\nd = {}\n{more}", axis(8.0, 12.0), axis(tips[0], tips[1]))
    };
    let model = "[model]\nsurface = true\nshear = true\nextension = true";
    let timoshenko = format!("{model}\n[estimate]\ntheory = \"timoshenko\"\nrange = [24, 40]");
    let core = "core = { diameter = 0.5, modulus = 60000 }";
    let ten = "{ from = 21, to = 48, steps = 10 }";
    let table = "profile = [[0, 10], [10, 8.9], [20, 7.6], [31, 6.5], [40, 5.1], [50, 4]]".to_owned();
    for (whisker, x, a, model) in [
        (cone([2.0, 7.0], "L_a = 50\nroot = { k_theta = 300, k_y = 20 }"), [3.0, 15.0], ten, model),
        (cone([2.0, 7.0], "L_a = 50\nroot = { k_theta = 100 }"), [3.0, 15.0], ten, &timoshenko),
        (cone([2.0, 7.0], &format!("L_a = {}\n{core}", axis(48.2, 52.0))), [3.0, 15.0], ten, model),
        (cone([7.0, 13.0], &format!("L_a = 50\n{core}")), [3.0, 15.0], ten, ""),
        (cone([2.0, 7.0], "L_a = 50\nbore = [[0, 4], [25, 2]]"), [3.0, 15.0], ten, ""),
        (cone([2.0, 7.0], "L_a = 50\ncurvature = 0.01"), [3.0, 15.0], ten, ""),
        (cone([2.0, 7.0], "L_a = 50\nexponent = 0.6"), [3.0, 12.0], ten, ""),
        (table, [11.0, 16.0], "{ from = 21, to = 48, steps = 20 }", model),
    ] {
        let gauge = format!("x_ss = {}\nl = 2\nstrain_limit = 0.06", axis(x[0], x[1]));
        let tap = format!("a = {a}\ntheta = {}", axis(0.5, 10.0));
        let text = spec(&whisker, &gauge, &tap, model, "top = 9\nby = \"K_sd\"");
        agrees(&text, Ranked { device: "lanes", read: 0.5, near: 1e-3, ..RANKED });
    }
}

/// Angles in any order and spacing; contacts up to the tip that slip off; widening tips and cylinders, whose f has no apex in reach and levels off;
/// long and short gauges. Contacts on or next to the gauge, sharp tips and gauges that do not fit are solved tap by tap.
#[test]
fn grids_of_every_kind() {
    let list: Vec<f64> = (0..40).map(|j| f64::from(j * 17 % 40)).map(|x| 0.3 + x * x / 170.0).collect();
    let angles = |theta: &str| format!("a = {{ from = 21, to = 48, steps = 10 }}\ntheta = {theta}");
    let tip = "D = { from = 8, to = 12, steps = 9 }\nd = { from = 3, to = 13, steps = 11 }\nL_a = [48, 50]";
    let gauges = "x_ss = [0, 4]\nl = [0.01, 6]\nnoise_strain = 1e-5";
    let wide = "D = { from = 7, to = 9, steps = 9 }\nd = { from = 8, to = 14, steps = 11 }\nL_a = 50";
    let gauge = "x_ss = { from = 4, to = 14, steps = 5 }\nl = 3\nnoise_strain = 1e-5";
    let tap = "a = { from = 22, to = 48, steps = 10 }\ntheta = { from = 0.5, to = 10, steps = 40 }";
    let sharp = "D = { from = 8, to = 12, steps = 9 }\nd = [1, 2, 3, 6]\nL_a = 50";
    let near = "a = { from = 9, to = 48, steps = 10 }\ntheta = { from = 0.5, to = 8.5, steps = 40 }";
    for (whisker, gauge, tap, more, by) in [
        (WHISKER, GAUGE, &*angles(&format!("{list:?}")), "", "K_sd"),
        (WHISKER, GAUGE, &angles("{ from = 0.1, to = 10, steps = 40, scale = \"log\" }"), "", "K_sd"),
        (tip, gauges, TAP, "", "K_sd"),
        (tip, gauges, TAP, "", "total_rms_mm"),
        (wide, gauge, tap, "[estimate]\nrange = [35, 48]", "K_sd"),
        (wide, gauge, tap, "[estimate]\nrange = [35, 48]", "total_rms_mm"),
        (wide, gauge, tap, "[estimate]\ntheory = \"timoshenko\"", "error_rms_mm"),
        (WHISKER, GAUGE, TAP, "[estimate]\nK = 1.0", "error_rms_mm"),
        (WHISKER, GAUGE, TAP, "", "noise_rms_mm"),
        (WHISKER, GAUGE, TAP, "[estimate]\nrange = [10, 49]", "total_rms_mm"),
        (WHISKER, GAUGE, TAP, "[estimate]\nrange = [30, 49]", "K_sd"),
        (WHISKER, GAUGE, TAP, "[estimate]\nconvention = \"elongation\"", "error_max_mm"),
        (sharp, "x_ss = [2, 3, 5, 12, 49]\nl = [1, 2]\nnoise_strain = 1e-5", near, "", "K_sd"),
    ] {
        let text = spec(whisker, gauge, tap, more, &format!("top = 9\nby = \"{by}\""));
        agrees(&text, Ranked { by, ..RANKED });
    }
}

/// Designs sampled over the ranges of a lab at ten distances, each design with its own drive; or grids of designs over shared drives.
fn lab(rig: &str, side: &str, drive: &str, model: &str, output: &str) -> String {
    let axis = |lo: f64, hi: f64, steps: u32| match drive.contains("from") {
        true => format!("{{ from = {lo}, to = {hi}, steps = {steps} }}"),
        false => format!("{{ min = {lo}, max = {hi}, samples = 13200 }}"),
    };
    let l = if drive.contains("from") { "2".to_owned() } else { axis(1.0, 4.0, 1) };
    spec(
        &format!("D = {}\nd = {}\nL_a = 50\n{rig}", axis(8.0, 12.0, 7), axis(2.5, 7.0, 6)),
        &format!("x_ss = {}\nl = {l}\nnoise_strain = 2e-5\n{side}", axis(3.0, 15.0, 8)),
        &format!("a = {{ from = 21, to = 48, steps = 10 }}\n{drive}"),
        model,
        output,
    )
}

/// Friction over shared drives takes too many rounds for Mesa's software device; next to the apex of sharp tips the series has too high an order.
#[test]
fn designs_of_a_lab_of_every_model() {
    let (own, shared) =
        ("theta = { min = 0.5, max = 10, samples = 13200 }", "theta = { from = 0.5, to = 10, steps = 40 }");
    let moved = "drive = \"displacement\"\ndelta = { min = 0.2, max = 4, samples = 13200 }";
    let pole =
        "[model]\nsurface = true\nshear = true\npole_radius = 2\nmaterial = { yeoh = [0.5, -0.08, 0.02] }";
    let timoshenko = "[model]\nshear = true\n[estimate]\ntheory = \"timoshenko\"";
    let far = "[model]\nextension = true\nmaterial = { neo-hookean = 3.2 }";
    let friction = format!("{PRACTICAL}\ncontact = {{ coulomb = 0.3 }}");
    let [tilted, leaning] = [format!("tilt = 35\n{own}"), format!("tilt = -20\nlean = 12\n{shared}")];
    let (seed, random) = (", seed = 7", ", sampler = \"random\", seed = 3");
    for (rig, side, drive, model, by, sampler) in [
        ("", "", own, PRACTICAL, "K_sd", ""),
        ("", "", own, "", "total_rms_mm", seed),
        ("", "", own, "", "K_sd", random),
        ("", "", shared, PRACTICAL, "total_rms_mm", ""),
        ("hub = 8", "", own, pole, "total_rms_mm", ""),
        ("", "", shared, timoshenko, "K_sd", ""),
        ("", "side = \"far\"", moved, far, "total_rms_mm", ""),
        ("", "", own, &friction, "K_sd", random),
        ("", "", shared, &friction, "total_rms_mm", ""),
        ("sharp", "", own, PRACTICAL, "K_sd", ""),
        ("hub = 4", "strain_limit = 0.06", &tilted, PRACTICAL, "K_sd", ""),
        ("", "", &tilted, "[estimate]\nK = 1.5", "total_rms_mm", random),
        ("", "", &leaning, PRACTICAL, "total_rms_mm", ""),
    ] {
        let per = if sampler == random { "\nper = \"design\"" } else { "" };
        let text = lab(rig, side, drive, model, &format!("top = 50\nby = \"{by}\"{per}"));
        let text = text.replace("samples = 13200", &format!("samples = 13200{sampler}"));
        let tips = text.replace("sharp\n", "").replace("min = 2.5, max = 7", "min = 1.25, max = 1.3");
        let text =
            if rig == "sharp" { tips.replace("min = 8, max = 12", "min = 10, max = 12") } else { text };
        let planar = !drive.contains("tilt") && (drive != shared || model != friction);
        let device = if planar { "device" } else { "lanes" };
        agrees(&text, Ranked { by, device, near: 5e-4, read: if rig == "sharp" { 0.0 } else { 0.9 } });
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
    let (all, made) = tried(&Wanted { d: [6.0, 7.0], drive: [0.5, 10.0], ..wanted });
    assert!(all.is_some_and(|scope| scope.charts.len() == 5));
    let (all, strong) = tried(&Wanted { drive: [0.5, 10.0], ..wanted });
    assert!(all.is_some_and(|scope| scope.charts.len() == 5));
    assert!(
        refused < strong && refused < 6_000,
        "{refused} taps asked in vain, {made} and {strong} for charts that there are"
    );
}

#[test]
fn charts_are_written_with_their_domain_and_error() {
    let text = lab("", "", "theta = { min = 0.5, max = 10, samples = 13200 }", PRACTICAL, "");
    let desk = Desk::new(&text);
    desk.ok("chart spec.toml --out charts");
    let chart: Value = serde_json::from_str(&desk.read("charts/chart.json")).unwrap();
    let charts = chart["charts"].as_array().unwrap();
    assert_eq!(charts.len(), 10);
    for chart in charts {
        assert!(chart["strain_error"].as_f64().unwrap() <= 1e-6);
        assert_eq!(chart["axes"].as_array().unwrap().len(), AXES);
    }
    // With tilted poles and two gauges, each chart states its direction and holds three more functions.
    let tilted = text
        .replace("[tap]\n", "[tap]\ntilt = [0, 20]\nlean = 5\n")
        .replace("[gauge]\n", "[gauge]\nsecond = true\n");
    let desk = Desk::new(&tilted.replace("steps = 10", "steps = 4"));
    desk.ok("chart spec.toml --out charts");
    let chart: Value = serde_json::from_str(&desk.read("charts/chart.json")).unwrap();
    let charts = chart["charts"].as_array().unwrap();
    let directions: Vec<[f64; 2]> =
        charts.iter().map(|c| ["tilt_deg", "lean_deg"].map(|key| c[key].as_f64().unwrap())).collect();
    assert_eq!((charts.len(), &directions[..2]), (8, &[[0.0, 5.0], [20.0, 5.0]][..]));
    assert_eq!(chart["beside"][0], "strain_2_over_theory_times_1_less_x_over_a");
    for chart in charts {
        assert!(chart["strain_error"].as_f64().unwrap() <= 1e-6);
        assert_eq!(chart["beside"]["series"].as_array().unwrap().len(), 3);
        assert_eq!(chart["beside"]["axes"].as_array().unwrap().len(), AXES);
    }
    let many = tilted.replace("tilt = [0, 20]", "tilt = { from = 0, to = 20, steps = 21 }");
    Desk::new(&many).refuses("chart spec.toml --out charts", &["tap.tilt", "64 at most"]);
    let linear = text.replace("surface = true", "geometry = \"linear\"").replace("shear = true\n", "");
    let linear = linear.replace("extension = true\nmaterial = { neo-hookean = 3.2 }", "");
    Desk::new(&linear).refuses("chart spec.toml --out charts", &["no distance has a chart"]);
}
