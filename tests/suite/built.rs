//! Whiskers as built (model §7): 80 cases of another code, properties that hold for all of them, the wrench on every backend, and bad input.

use std::fmt::Write;

use crate::common::cases;
use crate::common::program::Desk;
use crate::common::sweeping::{CPU, CPU_F64, REFERENCE, Row, number, sweep};
use vibrissa::measure::Rig;
use vibrissa::spec;

/// Rows of tests/data/general_cases.csv, accurate to 1e-10: by shooting and by collocation, checked by energy and virtual work.
pub fn cases() -> Vec<Row> {
    let rows = cases::rows("general_cases");
    assert_eq!(rows.len(), 80);
    rows
}

fn pairs(text: &str) -> String {
    let pair = |pair: &str| format!("[{}]", pair.replace(':', ", "));
    format!("[{}]", text.split(';').map(pair).collect::<Vec<_>>().join(", "))
}

pub fn case(row: &Row, side: &str) -> String {
    let get = |key: &str| row[key].as_str();
    let mut whisker = String::new();
    let mut say = |key: &str, value: &str| {
        if !value.is_empty() {
            let _ = writeln!(whisker, "{key} = {value}");
        }
    };
    match get("profile") {
        "" => ["D", "d", "L_a"].iter().for_each(|key| say(key, get(&format!("{key}_mm")))),
        profile => say("profile", &pairs(profile)),
    }
    say("exponent", get("exponent"));
    say("hub", get("hub_mm"));
    say("curvature", get("kappa_base_per_mm"));
    say("curvature_slope", get("kappa_slope_per_mm2"));
    let inner = |key: &str| if get(key).is_empty() { String::new() } else { pairs(get(key)) };
    say("bore", &inner("bore"));
    if !get("core").is_empty() {
        say("core", &format!("{{ diameter = {}, modulus = {} }}", inner("core"), get("E_core_MPa")));
    }
    let springs = [("k_theta", "k_theta_Nmm_per_rad"), ("k_y", "k_y_N_per_mm"), ("k_x", "k_x_N_per_mm")];
    let springs: Vec<String> = springs
        .iter()
        .filter(|(_, column)| get(column) != "inf")
        .map(|(key, column)| format!("{key} = {}", get(column)))
        .collect();
    if !springs.is_empty() {
        say("root", &format!("{{ {} }}", springs.join(", ")));
    }
    let (drive, key, amount) = match get("delta_mm") {
        "" => ("angle", "theta", get("theta_deg")),
        delta => ("displacement", "delta", delta),
    };
    let contact = match get("contact") {
        "coulomb" => format!("{{ coulomb = {} }}", get("mu")),
        other => format!("{other:?}"),
    };
    format!(
        "[whisker]\n{whisker}[gauge]\nx_ss = {}\nl = {}\nside = {side:?}\nstrain_limit = 1.0\n[tap]\ndrive = {drive:?}\na = {}\n{key} = {amount}\n\
         [model]\nshear = {}\nextension = {}\nsurface = {}\npole_radius = {}\nnu = {}\ncontact = {contact}\nmaterial = {{ {} = {} }}\n\
         [output]\nwrench = true\n",
        get("x_ss_mm"),
        get("l_mm"),
        get("a_mm"),
        get("shear"),
        get("extension"),
        get("surface"),
        get("pole_radius_mm"),
        get("nu"),
        get("material"),
        get("E_MPa"),
    )
}

#[test]
fn every_case_of_another_code_on_every_backend() {
    let known = |row: &Row, key: &str| row[key].parse::<f64>().unwrap_or(f64::NAN);
    for (place, bound) in [(REFERENCE, 1e-8), (CPU, 2e-5), (CPU_F64, 5e-8)] {
        let mut worst = 0.0_f64;
        for (i, row) in cases().iter().enumerate() {
            let name = format!("{place:?}, case {i}, {}", row["config"]);
            let found = sweep(&case(row, "contact"), place).tuples.rows.remove(0);
            let status = found["status"].split('+').find(|word| !["ambiguous", "no_root"].contains(word));
            assert_eq!(status.unwrap_or("ok"), row["status"], "{name}");
            if row["status"] != "ok" {
                assert_eq!(found["strain"], "", "{name}");
                continue;
            }
            assert_eq!(found["contact_state"], row["contact_state"], "{name}");
            let force = known(row, "base_fx_N").hypot(known(row, "base_fy_N"));
            let mut check = |what: &str, found: Option<f64>, expected: f64, scale: f64| {
                let error = (found.unwrap_or(f64::NAN) - expected).abs() / scale;
                assert!(error < bound, "{name}: {what} is {found:?}, not {expected}");
                worst = worst.max(error);
            };
            for column in ["strain", "K", "base_moment_Nmm", "contact_arc_mm"] {
                let expected = known(row, column);
                check(column, number(&found, column), expected, expected.abs());
            }
            for column in ["base_fx_N", "base_fy_N", "normal_force_N", "tangential_force_N"] {
                let expected = known(row, column);
                let own = place == REFERENCE && column.starts_with("normal");
                check(column, number(&found, column), expected, if own { expected.abs() } else { force });
            }
            if place == REFERENCE {
                let far = sweep(&case(row, "far"), REFERENCE).tuples.rows.remove(0);
                let expected = known(row, "strain_far");
                check("far strain", number(&far, "strain"), expected, expected.abs());
            }
            // Balance: the contact force is as large as the root force, for every kind of root.
            let [p, t, x, y] = ["normal_force_N", "tangential_force_N", "base_fx_N", "base_fy_N"]
                .map(|column| number(&found, column).expect("a force"));
            assert!((p.hypot(t) / x.hypot(y) - 1.0).abs() < bound, "{name}");
        }
        println!("{place:?}: largest error {worst:.1e}");
    }
}

#[test]
fn charts_of_built_whiskers_say_what_solved_taps_do() {
    let of = |rest: &str| {
        format!("D = {{ from = 8, to = 12, steps = 8 }}\nd = {{ from = 3, to = 6, steps = 4 }}\n{rest}")
    };
    let both = "surface = true\npole_radius = 2\n";
    for (whisker, model) in [
        (of("L_a = 50\nroot = { k_theta = 900, k_y = 30 }"), ""),
        (of("L_a = 50\ncore = { diameter = 0.5, modulus = 60000 }"), "shear = true\nextension = true\n"),
        (of("L_a = 50\ncurvature = 0.008"), both),
        (of("L_a = 52\nexponent = 1.6"), "surface = true\n"),
        ("profile = [[0, 12], [6, 9], [20, 8.5], [52, 4]]".to_owned(), "shear = true\n"),
    ] {
        let several: u32 = if whisker.starts_with("profile") { 128 } else { 4 };
        // f has a corner at a knot: the gauges of a profile lie between two knots.
        let (first, range) = if several == 128 { (7.0, 9.0) } else { (3.0, 7.0) };
        let place = |k: u32| first + range * f64::from(k) / f64::from(several - 1);
        let places: Vec<f64> = (0..several).map(place).collect();
        let text = |places: &[f64], theta: &str, top: &str| {
            format!(
                "[whisker]\n{whisker}\n[gauge]\nx_ss = {places:?}\nl = 2\n\
                 [tap]\na = {{ from = 21, to = 46, steps = 6 }}\ntheta = {theta}\n\
                 [model]\n{model}[output]\ntuples = false\n{top}"
            )
        };
        // Enough taps for charts; then few at a time, so that they are solved, at the chosen drives, their neighbours and some others.
        let charted = sweep(&text(&places, "{ from = 1, to = 9, steps = 200 }", "top = 60"), CPU);
        assert!(charted.report.counts.interpolated > charted.report.counts.solved, "{whisker}");
        let drive = |i: u32| 1.0 + 8.0 * f64::from(i) / 199.0;
        let chosen: Vec<f64> =
            charted.designs.rows.iter().map(|row| number(row, "theta_deg").expect("an angle")).collect();
        let near = |i: u32| chosen.iter().any(|x| (x - drive(i)).abs() < 0.05);
        let drives: Vec<f64> = (0..200).filter(|i| i % 20 == 0 || *i == 199 || near(*i)).map(drive).collect();
        println!("{whisker}: {} drives", drives.len());
        let parts = places.chunks(places.len() / 4);
        let parts = parts.map(|part| sweep(&text(part, &format!("{drives:?}"), ""), CPU_F64));
        let all: Vec<Row> = parts
            .flat_map(|part| {
                assert_eq!(part.report.counts.interpolated, 0, "{whisker}");
                part.designs.rows
            })
            .collect();
        assert_eq!(charted.designs.rows.len(), 60, "{whisker}");
        let mut by_k: Vec<&Row> = all.iter().filter(|row| row["n"] == "6").collect();
        let k = |row: &Row| number(row, "K_sd").expect("a spread");
        by_k.sort_by(|a, b| k(a).total_cmp(&k(b)));
        for (found, known) in charted.designs.rows.iter().zip(by_k) {
            for column in ["K_mean", "K_sd"] {
                let [a, b] = [found, known].map(|row| number(row, column).expect("a value"));
                assert!((a - b).abs() < 2e-5, "{whisker}: {column} {a} {b}");
            }
        }
    }
}

/// Largest relative difference of a column between two sweeps, the second multiplied by `scale`.
fn apart(one: &[Row], other: &[Row], column: &str, scale: f64) -> f64 {
    let pair = |(a, b): (&Row, &Row)| {
        let [a, b] = [a, b].map(|row| number(row, column).expect("a value"));
        (scale * b / a - 1.0).abs()
    };
    assert!(!one.is_empty() && one.len() == other.len());
    one.iter().zip(other).map(pair).fold(0.0, f64::max)
}

#[test]
fn linear_theory_of_a_curve_does_not_know_its_sign_and_moment_over_force_is_the_distance() {
    let linear = |more: &str, signal: &str| {
        let text = format!(
            "[whisker]\nD = 10\nd = 4\nL_a = 50\n{more}\n[gauge]\nx_ss = 5\nl = 2\n[sensor]\nsignal = {signal:?}\n[tap]\na = [12, 33, 48]\n\
             theta = 3\n[model]\ngeometry = \"linear\"\n[output]\nwrench = true\n"
        );
        sweep(&text, REFERENCE).tuples.rows
    };
    for signal in ["strain", "moment", "force"] {
        let column = if signal == "strain" { "strain" } else { "signal" };
        let [plus, minus] = ["curvature = 0.012", "curvature = -0.012"].map(|more| linear(more, signal));
        assert!(apart(&plus, &minus, column, 1.0) < 1e-12);
        assert!(apart(&plus, &minus, "base_fx_N", -1.0) < 1e-12);
        assert!(apart(&plus, &linear("", signal), column, 1.0) > 1e-4);
    }
    for more in ["exponent = 0.6", "bore = 3", "root = { k_theta = 200, k_y = 4 }", "hub = 12"] {
        for row in linear(more, "strain") {
            let [m, f, a] = ["base_moment_Nmm", "base_fy_N", "a_mm"].map(|c| number(&row, c).unwrap());
            assert!((m / f / a - 1.0).abs() < 1e-12, "{more}: {m} / {f} is not {a}");
        }
    }
}

#[test]
fn a_uniform_bent_rod_has_a_closed_form() {
    // Point gauge at x: f = (D/2) κ sin κ(a − x) sin κa/(a κ/2 − sin(2κa)/4); here without a hub, over a short grid.
    let text = "[whisker]\nD = 10\nd = 10\nL_a = 50\ncurvature = 0.02\n[gauge]\nx_ss = 0\nl = 1e-4\n[tap]\na = 33\ntheta = 1\n\
                [model]\ngeometry = \"linear\"\n";
    let row = sweep(text, REFERENCE).tuples.rows.remove(0);
    let f = number(&row, "strain_linear").unwrap() / 1f64.to_radians();
    assert!((f - 0.428_042_6).abs() < 2e-6, "{f}");
}

#[test]
fn distances_of_a_curved_whisker_are_arcs_or_abscissae() {
    let spec = |curvature: &str, tap: &str| {
        format!(
            "[whisker]\nD = 10\nd = 4\nL_a = 50\n{curvature}\n[gauge]\nx_ss = 5\nl = 2\n[tap]\n{tap}\ntheta = 5\n"
        )
    };
    let read = |text: &str, column: &str| -> Vec<f64> {
        sweep(text, CPU_F64).tuples.rows.iter().map(|row| number(row, column).unwrap()).collect()
    };
    // On a circle, x_a = sin(κa)/κ.
    let arcs = [21.0, 33.0, 48.0];
    let circle = "curvature = 0.01";
    let along = read(&spec(circle, "a = [21, 33, 48]"), "x_a_mm");
    for (x, a) in along.iter().zip(arcs) {
        assert!((x - 100.0 * (0.01f64 * a).sin()).abs() < 1e-9, "{x} at {a}");
    }
    for curvature in [circle, "curvature = 0.012\ncurvature_slope = -1e-4"] {
        let (a, strain) = ("a = [21, 33, 48]", "strain");
        let along = read(&spec(curvature, a), "x_a_mm");
        let asked = spec(curvature, &format!("abscissa = true\na = {along:?}"));
        let found = read(&asked, "a_mm");
        assert!(found.iter().zip(arcs).all(|(found, a)| (found - a).abs() < 1e-9), "{found:?}");
        let apart = |(one, other): (&f64, &f64)| (one - other).abs() / other.abs();
        let (one, other) = (read(&asked, strain), read(&spec(curvature, a), strain));
        assert!(one.iter().zip(&other).map(apart).all(|apart| apart < 1e-9));
    }
    // A straight whisker lacks the column: its abscissae are its arcs.
    let straight = |tap: &str| sweep(&spec("", tap), CPU_F64).tuples.rows;
    assert_eq!(straight("a = 33"), straight("abscissa = true\na = 33"));
    assert!(!straight("a = 33")[0].contains_key("x_a_mm"));
}

#[test]
fn what_changes_nothing_changes_no_byte() {
    let cone = "[whisker]\nD = 10\nd = 4\nL_a = 50\n";
    let rest = "[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [21, 33, 48]\ntheta = [1, 8]\n[model]\nsurface = true\nextension = true\n";
    let plain = sweep(&format!("{cone}{rest}"), CPU).tuples.text;
    for same in
        [format!("{cone}exponent = 1\ncurvature = 0\n"), "[whisker]\nprofile = [[0, 10], [50, 4]]\n".into()]
    {
        assert_eq!(sweep(&format!("{same}{rest}"), CPU).tuples.text, plain, "{same}");
    }
    // The same cone described otherwise: by knots, by a core of the same material, by nearly rigid springs.
    let of = |whisker: &str| sweep(&format!("{whisker}{rest}"), REFERENCE).tuples.rows;
    let expected = of(cone);
    for (same, bound) in [
        ("[whisker]\nprofile = [[0, 10], [10, 8.8], [33.5, 5.98], [50, 4]]\n".to_owned(), 1e-10),
        (format!("{cone}core = {{ diameter = 2, modulus = 3.2 }}\n"), 1e-10),
        (format!("{cone}bore = 1e-4\n"), 1e-10),
        (format!("{cone}root = {{ k_theta = 1e12, k_y = 1e11, k_x = 1e11 }}\n"), 1e-8),
        (format!("{cone}curvature = 1e-12\n"), 1e-9),
    ] {
        let found = of(&same);
        for column in ["strain", "K", "normal_force_N", "contact_arc_mm", "distance_mm"] {
            let error = apart(&expected, &found, column, 1.0);
            assert!(error < bound, "{same}: {column} by {error:.1e}");
        }
    }
    for contact in ["\"stick\"", "{ coulomb = 0.4 }", "{ coulomb = 5 }"] {
        let of = |more: &str| {
            let model =
                format!("shear = true\npole_radius = 4\ncontact = {contact}\n[output]\nwrench = true\n");
            sweep(&format!("{cone}{more}\n{rest}{model}"), CPU).tuples
        };
        let expected = of("");
        for same in ["exponent = 1.00001", "curvature = 1e-7", "root = { k_theta = 1e7 }"] {
            let found = of(same);
            assert_eq!(found.statuses(), expected.statuses(), "{same}, {contact}");
            assert_eq!(found.column("contact_state"), expected.column("contact_state"), "{same}, {contact}");
            for column in
                ["strain", "normal_force_N", "tangential_force_N", "contact_arc_mm", "base_moment_Nmm"]
            {
                let error = apart(&expected.rows, &found.rows, column, 1.0);
                assert!(error < 1e-3, "{same}, {contact}: {column} by {error:.1e}");
            }
        }
        for other in [
            "exponent = 1.5",
            "exponent = 0.7",
            "curvature = -0.01",
            "root = { k_theta = 500, k_y = 20, k_x = 20 }",
        ] {
            assert!(of(other).statuses().iter().all(|words| *words != "not_converged"), "{other}, {contact}");
        }
    }
}

#[test]
fn a_rig_comes_back_from_its_table() {
    let text = |whisker: &str, signal: &str| {
        format!(
            "[whisker]\n{whisker}\n[sensor]\nsignal = {signal:?}\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 30\ntheta = 3\n"
        )
    };
    for whisker in [
        "D = 10\nd = 4\nL_a = 50\nexponent = 2\ncurvature = 0.01\nroot = { k_theta = 300, k_y = 5 }",
        "profile = [[0, 14], [8, 9], [50, 4]]\ncurvature_slope = -1e-4",
        "D = 10\nd = 4\nL_a = 50\nbore = [[0, 3], [25, 1]]\nroot = { k_x = 2 }",
        "D = 10\nd = 4\nL_a = 50\ncore = { diameter = 0.5, modulus = 60000 }",
    ] {
        for signal in ["strain", "moment"] {
            let base = std::path::Path::new("");
            let spec = spec::parse("rig.toml", &text(whisker, signal), base).unwrap();
            let rig = Rig::of_spec(&spec, "rig.toml").unwrap();
            let written = rig.to_table().to_string();
            let (again, _) = Rig::parse_with("again.toml", &written, base, None)
                .unwrap_or_else(|e| panic!("{e}\n{written}"));
            assert_eq!(again.setup, rig.setup, "{written}");
            let place = |rig: &Rig| (rig.design.tuple.D, rig.design.tuple.d, rig.design.tuple.L_a);
            assert_eq!(place(&again), place(&rig));
        }
    }
}

fn rig(more: &str) -> String {
    format!(
        "[whisker]\nD = 10\nd = 4\nL_a = 50\n{more}\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 20e-6\n[tap]\n\
         a = {{ from = 21, to = 45, step = 4 }}\ntheta = {{ from = 2, to = 8, step = 2 }}\n\
         [model]\nshear = true\nextension = true\nsurface = true\n"
    )
}

#[test]
fn a_root_is_calibrated_by_one_who_knows_of_it_and_told_to_one_who_does_not() {
    // k_theta = 100 EI₀/L.
    let root = "root = { k_theta = 3141.593 }";
    let desk = Desk::new(&rig(""));
    desk.write("rooted.toml", rig(root));
    desk.write("guess.toml", rig("root = { k_theta = 1000 }"));
    let calibrated = |data: &str, whisker: &str, more: &str| {
        desk.ok(format!("simulate {data} --repeats 3 --out data --force"));
        let line = format!("calibrate data/measurements.csv --whisker {whisker} {more} --out cal --force");
        let ran = desk.ok(line + " --json");
        let side = ran.json()["result"]["sides"][0].clone();
        let error = side["estimators"]["exact"]["held_out_rms_mm"].as_f64().expect("a number");
        (error, ran.stdout + &ran.stderr)
    };
    let plain = calibrated("spec.toml", "spec.toml", "");
    let known = calibrated("rooted.toml", "rooted.toml", "");
    let unaware = calibrated("rooted.toml", "spec.toml", "");
    let fitted = calibrated("rooted.toml", "guess.toml", "--fit k_theta");
    println!("mm on distances left out: {} {} {} {}", plain.0, known.0, unaware.0, fitted.0);
    assert!(known.0 < 1.2 * plain.0 && fitted.0 < 1.2 * plain.0);
    assert!(unaware.0 > 3.0 * plain.0);
    assert!(unaware.1.contains("a root that gives way"), "{}", unaware.1);
    assert!(!known.1.contains("a root that gives way"), "{}", known.1);
    let record: toml::Table = desk.read("cal/calibration.toml").parse().expect("TOML");
    assert!(record.to_string().contains("k_theta"));
}

#[test]
fn a_profile_from_a_file() {
    let text = |more: &str| {
        format!(
            "[whisker]\nprofile = \"p.csv\"\n{more}\n[gauge]\nx_ss = 9\nl = 2\n[tap]\na = [20, 40]\ntheta = 4\n"
        )
    };
    let desk = Desk::new(&text("core = { modulus = 60000 }"));
    desk.write("p.csv", "# a whisker\ns_mm,D_mm,core_mm,note\n0,14,0.6,a\n8,9,0.6,b\n50,4,0.4,c\n");
    desk.ok("sweep spec.toml --out one");
    desk.write(
        "inline.toml",
        "[whisker]\nprofile = [[0, 14], [8, 9], [50, 4]]\ncore = { diameter = [[0, 0.6], [8, 0.6], [50, 0.4]], modulus = 60000 }\n\
         [gauge]\nx_ss = 9\nl = 2\n[tap]\na = [20, 40]\ntheta = 4\n",
    );
    desk.ok("sweep inline.toml --out two");
    assert_eq!(desk.read("one/tuples.csv"), desk.read("two/tuples.csv"));
}
