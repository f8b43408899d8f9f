//! Sensors of several channels: distance and force maximise the likelihood of all readings together.

use crate::common::program::Desk;
use crate::common::sweeping::{CPU, REFERENCE, Row, number, rms, sweep, value};

pub fn spec(sensor: &str, more: &str) -> String {
    format!(
        "[whisker]\nD = 10\nd = 4\nL_a = 50\nroot = {{ k_theta = 1000, k_y = 40 }}\n[gauge]\nx_ss = 5\nl = 2\n[sensor]\n{sensor}\n\
         [tap]\na = {{ from = 21, to = 45, step = 4 }}\ntheta = [2, 8]\n{more}\n"
    )
}

fn values<const N: usize>(row: &Row, columns: [&str; N]) -> [f64; N] {
    columns.map(|column| value(row, column))
}

#[test]
fn without_calibration_the_distance_is_the_moment_over_the_force() {
    let sensor = "signal = [\"moment\", \"force\"]\nnoise = [0.02, 0.001]";
    for model in ["[model]\ngeometry = \"linear\"\n", "[model]\nshear = true\npole_radius = 2\n"] {
        let text = spec(sensor, &format!("{model}[estimate]\nK = 1\n[output]\nwrench = true\n"));
        for row in &sweep(&text, CPU).tuples.rows {
            let [m, f, m0, fy] =
                values(row, ["signal_moment", "signal_force", "base_moment_Nmm", "base_fy_N"]);
            let [a, told, error, sigma, force] =
                values(row, ["a_mm", "distance_mm", "error_mm", "sigma_mm", "estimated_force_N"]);
            assert_eq!([m, f], [m0, fy]);
            assert!((told - m / f).abs() < 1e-8, "{told} {}", m / f);
            assert!((error - (told - a)).abs() < 1e-12);
            // dâ = (dM − â dF)/F.
            let known = 0.02f64.hypot(told * 0.001) / f.abs();
            assert!((sigma / known - 1.0).abs() < 1e-6, "{sigma} {known}");
            assert!((force / f.abs() - 1.0).abs() < 1e-8);
            let [k_moment, k_force] = values(row, ["K_moment", "K_force"]);
            if model.contains("linear") {
                assert!((told - a).abs() < 1e-8);
                assert!((k_moment - 1.0).abs() < 1e-12 && (k_force - 1.0).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn a_matrix_with_a_covariance_tells_what_its_signals_tell() {
    let fixed = |sensor: &str| sweep(&spec(sensor, "[estimate]\nK = 1\n"), CPU).tuples.rows;
    let plain = fixed("signal = [\"moment\", \"force\"]\nnoise = [0.02, 0.001]");
    let mixed = fixed("matrix = [[1, 0, 10], [0.5, 0, -10]]\ncovariance = [[5e-4, 1e-4], [1e-4, 2e-4]]");
    let backwards = fixed("signal = [\"force\", \"moment\"]\nnoise = [0.001, 0.02]");
    for (a, b) in plain.iter().zip(&mixed).chain(plain.iter().zip(&backwards)) {
        let told = |row| values(row, ["distance_mm", "sigma_mm", "estimated_force_N"]);
        for (one, other) in told(a).iter().zip(told(b)) {
            assert!((one / other - 1.0).abs() < 1e-8, "{one} {other}");
        }
    }
}

#[test]
fn more_channels_tell_more_and_backends_agree() {
    let sensor = |signals: &str, noise: &str| format!("signal = [{signals}]\nnoise = [{noise}]");
    let two = sensor("\"moment\", \"force\"", "0.02, 0.001");
    let three = sensor("\"strain\", \"moment\", \"force\"", "20e-6, 0.02, 0.001");
    let of = |sensor: &str, place| sweep(&spec(sensor, "[model]\nshear = true\n"), place).tuples.rows;
    let [less, more] = [of(&two, CPU), of(&three, CPU)];
    for ((a, b), c) in less.iter().zip(&more).zip(&of(&three, REFERENCE)) {
        let [[one], [other]] = [a, b].map(|row| values(row, ["sigma_mm"]));
        assert!(other < one, "{other} {one}");
        let columns = ["signal_strain", "K_strain", "distance_mm", "sigma_mm", "estimated_force_N"];
        for (x, y) in values(b, columns).iter().zip(values(c, columns)) {
            assert!((x / y - 1.0).abs() < 2e-5, "{x} {y}");
        }
    }
}

fn calibrated(sensor: &str) -> Desk {
    let desk = simulated(sensor, "theta = [1, 2, 3, 4, 5, 6]");
    desk.ok("calibrate s/measurements.csv --whisker spec.toml --out c");
    desk
}

fn simulated(sensor: &str, drives: &str) -> Desk {
    let desk = Desk::new(&spec(sensor, "").replace("theta = [2, 8]", drives));
    let text = desk.read("spec.toml");
    let a: Vec<String> =
        (0..60).map(|k| format!("{:.3}", 22.0 + 22.0 * f64::from((k * 37) % 60) / 59.0)).collect();
    let fresh = text.replace("a = { from = 21, to = 45, step = 4 }", &format!("a = [{}]", a.join(", ")));
    desk.write("fresh.toml", fresh.replace(drives, "theta = 3.5"));
    desk.ok("simulate spec.toml --out s --repeats 2 --zero-every 5");
    desk.ok("simulate fresh.toml --out f --zero-every 5 --seed 9");
    desk
}

/// rms of error over σ, and rms of the error, over the readings in the folder `out`.
fn scored(desk: &Desk, out: &str) -> [f64; 2] {
    let mut rows = desk.table(format!("{out}/located.csv")).rows;
    rows.retain(|row| number(row, "distance_mm").is_some());
    assert!(rows.len() >= 55, "{rows:?}");
    let off = |row: &Row| value(row, "distance_mm") - value(row, "a_mm");
    [rms(rows.iter().map(|row| off(row) / value(row, "sigma_mm"))), rms(rows.iter().map(off))]
}

#[test]
fn a_sensor_is_simulated_calibrated_and_read_by_all_its_channels() {
    let noise = "noise = [0.02, 0.001]";
    let [all, one] = [
        format!("signal = [\"moment\", \"force\"]\n{noise}"),
        "signal = \"moment\"\nnoise = 0.02".to_owned(),
    ];
    let desk = calibrated(&all);
    let answers = desk.ok("locate c/calibration.toml f/measurements.csv --out l");
    assert!(answers.stdout.contains("the channels moment_Nmm, force_N together"), "{}", answers.stdout);
    let [off, rms] = scored(&desk, "l");
    assert!((0.5..1.5).contains(&off), "errors of {off} σ");
    let single = calibrated(&one);
    single.ok("locate c/calibration.toml f/measurements.csv --out l");
    let [_, alone] = scored(&single, "l");
    assert!(rms < 0.9 * alone, "{rms} mm together, {alone} mm by the moment");
    // Moment and force of opposite signs fit no contact.
    let mut rows = desk.read("f/measurements.csv").lines().take(3).collect::<Vec<_>>().join("\n");
    rows += "\n25,3.5,-5,0.2,1,synthetic,,ok\n";
    desk.write("wrong.csv", rows);
    desk.ok("locate c/calibration.toml wrong.csv --out w");
    assert!(desk.read("w/located.csv").ends_with(",,,no_root\n"), "{}", desk.read("w/located.csv"));
    let plan = ["calibrate", "s/measurements.csv", "--whisker", "spec.toml", "--plan", "--out", "nothing"];
    assert!(desk.run(&plan).exits(0).stdout.contains("nothing was run") && !desk.path("nothing").exists());
    let table = desk.read("f/measurements.csv");
    let lines = table.lines().filter(|l| l.split(',').nth(1) != Some("0"));
    desk.write("free.csv", lines.collect::<Vec<_>>().join("\n").replacen("theta_deg", "ignored", 1));
    desk.ok("locate c/calibration.toml free.csv --columns ignore=ignored --out u");
    let [off, free] = scored(&desk, "u");
    assert!((0.5..1.5).contains(&off) && free > rms, "errors of {off} σ, {free} mm");
}

#[test]
fn mixed_channels_are_calibrated_from_the_data_alone() {
    let desk = calibrated(
        "matrix = [[1, 0, 10], [0.5, 0, -10], [0, 0, 0, 1e3]]\ncovariance = [[5e-4, 1e-4, 0], [1e-4, 2e-4, 0], [0, 0, 1e-4]]",
    );
    desk.ok("locate c/calibration.toml f/measurements.csv --out l");
    let [off, _] = scored(&desk, "l");
    assert!((0.5..1.5).contains(&off), "errors of {off} σ");
    desk.write("hall.csv", desk.read("f/measurements.csv").replacen("channel_2", "hall", 1));
    desk.ok("locate c/calibration.toml hall.csv --columns channel_2=hall --out h");
    let [h, l] = ["h", "l"].map(|out| desk.table(format!("{out}/located.csv")));
    assert_eq!(h.column("distance_mm"), l.column("distance_mm"));
    let table = desk.read("f/measurements.csv").replacen("channel_2", "channel_9", 1);
    desk.write("less.csv", table);
    let changed = desk.read("c/calibration.toml").replacen("noise = ", "noise = 1", 1);
    desk.write("changed.toml", changed);
    let text = desk.read("c/calibration.toml");
    let first = text.find("covariance = [[").unwrap() + "covariance = [[".len();
    desk.write("loud.toml", format!("{}9{}", &text[..first], &text[first..]));
    let fresh = "f/measurements.csv";
    for (line, words) in [
        (format!("locate loud.toml {fresh}"), "edited by hand"),
        ("locate c/calibration.toml less.csv".to_owned(), "less.csv:1: channel_2"),
        (format!("locate c/calibration.toml {fresh} --zero 1"), "one signal"),
        (format!("locate changed.toml {fresh}"), "edited by hand"),
        ("simulate spec.toml --noise 1e-5".to_owned(), "several channels"),
        (format!("locate c/calibration.toml {fresh} --same"), "several channels"),
        (format!("contour --calibration c/calibration.toml {fresh}"), "several channels"),
    ] {
        desk.refuses(line + " --out x", &[words]);
    }
}

/// Readings of the folder `f` above their zero, as rows of a stream, with or without the drive.
fn taps(desk: &Desk, names: &[&str], drive: bool) -> String {
    let table = desk.table("f/measurements.csv");
    let columns: Vec<Vec<f64>> = names.iter().map(|name| table.values(name)).collect();
    let at = |k: usize| {
        let known = if drive { "3.5".to_owned() } else { "nan".to_owned() };
        let signals = columns.iter().map(|c| (c[k] * 1.01).to_string());
        std::iter::once(known).chain(signals).collect::<Vec<_>>().join(",")
    };
    let drives = table.values("theta_deg");
    (0..drives.len()).filter(|k| drives[*k] != 0.0).map(at).collect::<Vec<_>>().join("\n") + "\n"
}

#[test]
fn streams_answer_as_tables() {
    let list = "signal = [\"moment\", \"force\", \"strain\"]\nnoise = [0.02, 0.001, 2e-5]";
    let matrix = "matrix = [[1, 0, 10], [0.05, 0, 2]]\ncovariance = [[5e-4, 1e-6], [1e-6, 1e-6]]";
    let names: [&[&str]; 2] = [&["moment_Nmm", "force_N", "strain"], &["channel_1", "channel_2"]];
    for (sensor, names) in [list, matrix].into_iter().zip(names) {
        let desk = simulated(sensor, "theta = [2, 3.5, 5]");
        let said = ["--whisker", "spec.toml", "--out", "e"];
        desk.run(&[&["calibrate", "s/measurements.csv"][..], &said].concat()).exits(0);
        for drive in [true, false] {
            let rows = taps(&desk, names, drive);
            let rows = if drive { rows } else { rows.replace("nan,", "") };
            let header = if drive { "theta_deg," } else { "" };
            desk.write("taps.csv", format!("{header}{}\n{rows}", names.join(",")));
            desk.ok("locate e/calibration.toml taps.csv --out l --force");
            let table = desk.table("l/located.csv");
            let [a, sigma] = ["distance_mm", "sigma_mm"].map(|name| table.values(name));
            assert!(sigma.iter().filter(|s| **s < 24.0).count() >= 40, "{}", table.text);
            let told = desk.stream("locate e/calibration.toml", &rows).values("distance_mm");
            assert_eq!(told.len(), a.len());
            assert!(told.iter().zip(&a).all(|(x, y)| (x - y).abs() < 1e-9 || !y.is_finite()));
            if drive {
                // A drive or a signal may be missing, but not infinite or text.
                let first: Vec<&str> = rows.lines().next().unwrap().split(',').collect();
                for place in [0, first.len() - 1] {
                    let odd = ["", "nan", "inf", "two", "1e999"].map(|odd| {
                        let mut row = first.clone();
                        row[place] = odd;
                        row.join(",") + "\n"
                    });
                    let stream = desk.pipe(&["locate", "e/calibration.toml"], &odd.concat()).exits(0).stdout;
                    let bad: Vec<bool> = stream.lines().skip(1).map(|l| l.ends_with("bad_input")).collect();
                    assert_eq!(bad, [false, false, true, true, true], "{stream}");
                }
                let refused = desk.pipe(&["locate", "e/calibration.toml", "--same"], &rows).exits(2);
                assert_eq!(refused.stdout, "");
                // σ grows with the contradiction between channels, at most by √(44/2) with two degrees of freedom.
                if let [moment, force, strain] = names {
                    let fresh = desk.table("f/measurements.csv");
                    let [moment, force, strain] = [moment, force, strain].map(|name| fresh.values(name)[1]);
                    let moved = (-90..91)
                        .map(|k| format!("3.5,{},{force},{strain}\n", moment + 0.002 * f64::from(k)));
                    let told = desk.stream("locate e/calibration.toml", &moved.collect::<String>());
                    let sigma = told.values("sigma_mm").into_iter().filter(|s| s.is_finite());
                    let [least, most] = [f64::min, f64::max].map(|of| sigma.clone().reduce(of).unwrap());
                    assert!((4.0..6.0).contains(&(most / least)), "{most} of {least}");
                }
            }
        }
        let refused =
            desk.run(&[&["calibrate", "s/measurements.csv"][..], &said, &["--export", "c"]].concat());
        assert!(refused.exits(2).stderr.contains("vibrissa locate"), "{sensor}");
    }
}

#[test]
fn only_strains_have_a_limit_of_strain() {
    let search = "[optimise]\nobjective = \"distance\"\nvariables = { theta = [1, 8], E = [1, 5] }\nbudget = { evaluations = 60 }\n";
    for sensor in
        ["signal = \"moment\"\nnoise = 0.02", "signal = [\"moment\", \"force\"]\nnoise = [0.02, 0.001]"]
    {
        let text = spec(sensor, search)
            .replace("theta = [2, 8]", "")
            .replace("root = { k_theta = 1000, k_y = 40 }\n", "");
        let desk = Desk::new(&text);
        let ran = desk.ok("optimise spec.toml --out o");
        assert!(!ran.stdout.contains("times the limit"), "{}", ran.stdout);
        assert_eq!(
            ran.stdout.contains("--estimator exact"),
            sensor.contains("= \"moment\""),
            "{}",
            ran.stdout
        );
        desk.write("limit.toml", format!("{text}limits = {{ strain = 0.05 }}\n"));
        desk.refuses("optimise limit.toml --out x", &["reads no strain"]);
    }
    let desk = Desk::new(&spec("signal = \"moment\"\nnoise = 0.02", ""));
    desk.refuses("simulate spec.toml --signal force_N --out x", &["--signal = force_N"]);
}

#[test]
fn a_sensor_that_the_springs_do_not_carry_reads_about_where_the_base_rests() {
    let text = |sensor: &str| {
        spec(sensor, "[output]\nwrench = true\n").replace("k_theta = 1000, k_y = 40", "k_y = 5, k_x = 2")
    };
    let list = "signal = [\"moment\", \"force\"]\nnoise = [0.02, 0.001]";
    for (sensor, column) in [("signal = \"moment\"", "signal"), (list, "signal_moment")] {
        for place in [CPU, REFERENCE] {
            let [rows, fixed] =
                ["", "\nfixed = true"].map(|key| sweep(&text(&format!("{sensor}{key}")), place).tuples.rows);
            for (row, fixed) in rows.iter().zip(&fixed) {
                let columns = [column, "base_moment_Nmm", "base_fx_N", "base_fy_N"];
                let ([signal, m0, fx, fy], [read, ..]) = (values(row, columns), values(fixed, columns));
                let about = m0 + fx / 2.0 * fy - fy / 5.0 * fx;
                assert!((signal / m0).abs() - 1.0 < 1e-12 && (about / m0 - 1.0).abs() > 1e-6);
                assert!((read / (signal / m0 * about) - 1.0).abs() < 1e-9, "{read} {about} {signal}");
            }
        }
    }
}
