//! Zeros and drives of real rigs: unbalanced bridges, counters that wrap, drives with an own zero, unrecorded quantities.

use std::fmt::Write as _;

use crate::common::measuring::{REAL, TAPS, calibrated, data, prototype, rewritten, table, undescribed};
use crate::common::program::{Desk, says};
use crate::common::sweeping::{Row, value};
use vibrissa::calibrate::Reason;
use vibrissa::calibrate::report::result;
use vibrissa::calibrate::{Calibrated, coverage::coverage};
use vibrissa::estimator::taps::Tap;
use vibrissa::measure::unit::quarter_bridge_output;
use vibrissa::scene::Drive;
use vibrissa::simulate::Settings;

fn spec() -> String {
    prototype(10.0, &["noise_strain = 1e-5\n", TAPS, REAL])
}

fn rig_table(zero_every: Option<u64>, repeats: u64) -> String {
    table(&spec(), &Settings { repeats, noise: 1e-5, zero_every, seed: 1, ..Settings::default() })
}

/// Rows with `f` of (position in the file from 0 to 1, strain) as signal.
fn signals(table: &str, column: &str, f: impl Fn(f64, f64) -> f64) -> String {
    let n = data(table).rows.len() as f64;
    let head = format!("a_mm,theta_deg,{column}");
    rewritten(table, &head, |k, row| [row.a, row.drive, f(k as f64 / n, row.value)])
}

fn apart(p: &[f64], q: &[f64]) -> f64 {
    assert_eq!(p.len(), q.len());
    p.iter().zip(q).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max)
}

#[test]
fn the_zero_of_a_bridge_is_subtracted_as_it_is_shown() {
    let desk = Desk::new(&spec());
    let measured = rig_table(Some(20), 3);
    for (name, off) in [("balanced", 0.0), ("off", 0.35)] {
        let bridge = |_, e| quarter_bridge_output(e, 2.21) + off;
        desk.write(&format!("{name}.csv"), signals(&measured, "bridge_mV_per_V", bridge));
        desk.ok(format!("calibrate {name}.csv --whisker spec.toml --out c_{name}"));
        desk.ok(format!("locate c_{name}/calibration.toml {name}.csv --out l_{name}"));
    }
    let [balanced, off] =
        ["balanced", "off"].map(|name| desk.table(format!("l_{name}/located.csv")).values("distance_mm"));
    assert!(apart(&balanced, &off) < 1e-3, "{}", apart(&balanced, &off));
    let stream = |value: f64, zero: &str| {
        let line = format!("locate c_off/calibration.toml --zero {zero}");
        desk.stream(&line, &format!("4,{value}\n")).numbers("distance_mm")[0].unwrap()
    };
    assert!((stream(12.0, "0") - stream(12.35, "0.35")).abs() < 1e-6);
}

#[test]
fn a_wild_zero_of_a_stream_is_told_and_not_used() {
    let desk = crate::common::world::calibrated();
    let ask = |input: &str, more: &[&str]| {
        let ran = desk.pipe(&[&["locate", "cal/calibration.toml"], more].concat(), input).exits(0);
        let lines: Vec<String> = ran.stdout.lines().skip(1).map(str::to_owned).collect();
        (lines, ran.stderr)
    };
    let answer = |line: &String| line.split(',').nth(2).unwrap().to_owned();
    let (plain, said) = ask("0,0\n4,0.02\n", &[]);
    assert!(!said.contains("far off"), "{said}");
    let (wild, said) = ask("0,0\n0,0.02\n4,0.02\n0,0\n4,0.02\n", &[]);
    assert_eq!([answer(&wild[2]), answer(&wild[4])], [answer(&plain[1]), answer(&plain[1])]);
    assert!(said.contains("line 2") && said.contains("far off"), "{said}");
    // A changed zero is accepted the second time.
    let (moved, _) = ask("0,0\n0,0.01\n0,0.01\n4,0.03\n", &[]);
    let number = |l: &String| answer(l).parse::<f64>().unwrap();
    assert!((number(&moved[3]) - number(&plain[1])).abs() < 1e-6);
    let (_, said) = ask("4,0.02\n0,0\n4,0.02\n", &["--zero", "1e-300"]);
    assert!(said.contains("line 2 on") && said.contains("--zero 1e-300"), "{said}");
    let (commented, _) = ask("# a note\n0,0\n# another\n4,0.02\n", &[]);
    assert_eq!(commented, plain);
}

#[test]
fn names_and_comments_of_a_file_of_readings_are_kept_apart() {
    let desk = crate::common::world::calibrated();
    desk.write("r.csv", "# rig 3\nline,given_line,theta_deg,strain\n# begun\n7,8,0,0\n9,10,4,0.02\n");
    desk.ok("locate cal/calibration.toml r.csv --out l");
    let located = desk.table("l/located.csv");
    assert_eq!(located.columns[..3], ["line", "given_given_line", "given_line"], "{:?}", located.columns);
    let row = &located.rows[1];
    assert_eq!([&row["line"], &row["given_given_line"], &row["given_line"]], ["5", "9", "10"]);
    assert_eq!(row["status"], "ok");
}

/// A rig whose drive has its own zero; contact begins at `begin`, mm.
fn own_zero(begin: f64, drives: &[f64], rest: f64) -> String {
    let mut out = String::from("a_mm,delta_mm,reading\n");
    for run in 0..3 {
        let _ = writeln!(out, "144,{rest},{}", 50_000 + run);
        for k in 0..7 {
            let a = 117.0 + 4.5 * f64::from(k);
            for d in drives {
                let signal = 2_700.0 * (d - begin) * (117.0 / a).powi(3) * (1.0 + 0.01 * (d - begin));
                let noise = f64::from((7 * k + 3 * run) % 5 - 2) * 60.0;
                let _ = writeln!(out, "{a},{d},{}", (50_000.0 - signal + noise).round());
            }
        }
    }
    out
}

#[test]
fn taps_at_drives_below_the_zero_of_the_rig_are_taps() {
    let text = own_zero(-6.0, &[-4.0, -2.0, 0.0, 2.0, 4.0], -7.85);
    let desk = Desk::new("");
    desk.write("d.csv", &text);
    let ran = desk.ok("calibrate d.csv --out cal --export c");
    says(&ran.stdout, &["105 of 105 taps used, 3 zero"]);
    says(&ran.stderr, &["counted from there"]);
    let ran = desk.ok("locate cal/calibration.toml d.csv --out loc");
    let located = desk.table("loc/located.csv");
    let words = |w: &str| located.rows.iter().filter(|r| r["status"] == w).count();
    assert_eq!([words("no_strain"), words("ok")], [3, 105], "{}", ran.stderr);
    says(&ran.stdout, &["105 readings located by", ", beside 3 zero readings: 105 ok\n"]);
    assert!(ran.stdout.starts_with("105 of 105 readings have a distance"), "{}", ran.stdout);
    let off = |r: &&Row| (value(r, "distance_mm") - value(r, "a_mm")).abs() / value(r, "sigma_mm");
    assert!(located.rows.iter().filter(|r| r["status"] == "ok").map(|r| off(&r)).all(|e| e < 4.0));
    let rows = desk.table("cal/rows.csv");
    assert!(rows.rows[0]["delta_mm"] == "-7.85" && rows.rows[1]["delta_mm"] == "-4");
    assert!(desk.read("cal/locate.c").contains("drive -= -7.85e0;"));
}

#[test]
fn a_rest_row_whose_drive_is_also_there_as_a_positive_one_is_no_slip() {
    let judged = |text: &str| {
        let found = undescribed(text, Drive::Displacement, 144.0);
        let outside = |t: &&Tap| t.reason == Some(Reason::OutsideDomain);
        (found.zeros.len(), found.taps.iter().filter(outside).count())
    };
    let plan = [2.0, 4.0, 6.0, 8.0, 10.0];
    assert_eq!(judged(&own_zero(-6.0, &plan, -8.0)), (3, 0));
    // A wrong sign makes neither a rest nor a second side; a real second side counts.
    assert_eq!(judged(&own_zero(0.0, &plan, 0.0).replacen("117,4,", "117,-4,", 1)), (3, 1));
    assert_eq!(judged(&own_zero(0.0, &[-8.0, -4.0, 4.0, 8.0, 10.0], 0.0)), (3, 0));
}

#[test]
fn a_column_that_the_signal_follows_is_not_ignored() {
    let desk = Desk::new(&spec());
    let measured = rig_table(None, 1);
    let renamed = |name: &str| measured.replacen("theta_deg", name, 1);
    for name in ["ch_7", "step", "Winkel (deg)"] {
        desk.write("d.csv", renamed(name));
        let quote = if name.contains(' ') { "'" } else { "" };
        let named = format!("{quote}theta={name}{quote}");
        desk.refuses("calibrate d.csv --whisker spec.toml --out o", &["d.csv:1", &named]);
        let columns = format!("theta={name}");
        let line =
            ["calibrate", "d.csv", "--whisker", "spec.toml", "--out", "o", "--force", "--columns", &columns];
        desk.run(&line).exits(0);
    }
    // Columns that only count or drift are ignored; one named like a drive is ignored with a warning.
    let mut text = String::from("a_mm,step,t_s,reading\n");
    for (k, a) in (0..60).map(|k| (k, 20 + k % 10)) {
        let _ = writeln!(text, "{a},{},{},{}", k / 10, k, 1e6 / f64::from(a) + 30.0 * f64::from(k / 10));
    }
    desk.write("d.csv", text);
    let ran = desk.ok("calibrate d.csv --out p");
    assert!(ran.stderr.contains("theta=step"), "{}", ran.stderr);
}

/// Reported value and standard error: of the zero, and of the drive's offset.
fn said(found: &Calibrated) -> [[f64; 2]; 2] {
    let said = result(found, &found.calibration.rig, &coverage(found));
    let fitted = said["sides"][0]["parameters"]["fitted"].as_array().unwrap().clone();
    let offset = fitted.iter().find(|p| p["name"] == "theta_offset").expect("it is fitted");
    let pair = |v: &serde_json::Value, error: &str| ["value", error].map(|k| v[k].as_f64().unwrap());
    [pair(&said["zero"], "error"), pair(offset, "standard_error")]
}

fn shuffled(plain: &str) -> String {
    let rows: Vec<&str> = plain.lines().skip(1).collect();
    let order: Vec<&str> = (0..rows.len()).map(|k| rows[37 * k % rows.len()]).collect();
    format!("{}\n{}\n", plain.lines().next().unwrap(), order.join("\n"))
}

#[test]
fn an_offset_or_a_drift_that_nobody_read_makes_no_certain_numbers() {
    let plain = rig_table(None, 1);
    let has = |found: &Calibrated, word: &str| found.warnings.iter().any(|w| w.contains(word));
    let small = [(0.0, 0.0), (2e-5, 0.0), (4e-5, 0.0), (8e-5, 0.0), (0.0, 4e-5), (0.0, 8e-5), (0.0, -8e-5)];
    for (offset, drift) in small.into_iter().chain([(0.0, 4e-4)]) {
        let found = calibrated(&signals(&plain, "strain", |t, e| e + offset + drift * t), &spec(), &[]);
        let [[zero, of_zero], [theta, of_theta]] = said(&found);
        assert!((zero - offset - 0.5 * drift).abs() < 3.0 * of_zero, "{offset} {drift}: {zero} ± {of_zero}");
        assert!(theta.abs() < 3.0 * of_theta, "{offset} {drift}: {theta} ± {of_theta}");
        assert!(drift > 1e-4 || of_zero < 1.5e-4 && of_theta < 0.02, "{of_zero} {of_theta}");
        assert_eq!(has(&found, "A drift of the zero"), zero != 0.0, "{:?}", found.warnings);
    }
    // If rows are not in order of distance, residuals show a drift, also for a sharp tip without solutions at some taps.
    let taps = "[tap]\na = { from = 21, to = 48, step = 1 }\ntheta = [0.5, 2, 4, 6, 8, 10]\n";
    let sharp = prototype(0.5, &["noise_strain = 1e-5\n", taps]);
    let once = Settings { noise: 1e-5, zero_every: None, seed: 1, ..Settings::default() };
    for (spec, rows, drifts) in
        [(spec(), plain, &[0.0, 8e-5, -8e-5][..]), (sharp.clone(), table(&sharp, &once), &[0.0, 8e-5])]
    {
        let rows = shuffled(&rows);
        for &drift in drifts {
            let found = calibrated(&signals(&rows, "strain", |t, e| e + drift * t), &spec, &[]);
            assert_eq!(has(&found, "order of the lines"), drift != 0.0, "{drift}: {:?}", found.warnings);
            if spec == sharp {
                let side = &found.sides[0];
                assert!(side.fit.as_ref().unwrap().cells.len() < side.table.cells.len());
            } else {
                let [[zero, of_zero], _] = said(&found);
                assert!((zero - 0.5 * drift).abs() < 4.0 * of_zero, "{drift}: {zero} ± {of_zero}");
            }
        }
    }
}

/// Taps at 8 distances by ±2, ±4 and ±6°; `other` gives the signal at the negative drives.
fn two_signs(zero: bool, other: impl Fn(f64) -> f64) -> String {
    let mut text = "a_mm,theta_deg,reading\n".to_owned();
    for k in 0..8 {
        let a = 20.0 + 3.0 * k as f64;
        let signal = |theta: f64| 66_000.0 * theta / (a * a);
        let noise = |n: i32| 0.2 * f64::from((k * 7 + n * 5) % 11 - 5);
        if zero {
            text += &format!("{a},0,{}\n", 300.0 + noise(0));
        }
        for n in 1..4 {
            let theta = 2.0 * f64::from(n);
            let [one, two] = [signal(theta) + noise(n), other(signal(theta)) + noise(n + 4)];
            text += &format!("{a},{theta},{}\n{a},{},{}\n", 300.0 + one, -theta, 300.0 + two);
        }
    }
    text
}

#[test]
fn drives_of_both_signs_are_taps_to_both_sides() {
    for zero in [true, false] {
        let desk = Desk::new("");
        desk.write("taps.csv", two_signs(zero, |s| -s));
        let ran = desk.ok("calibrate taps.csv --out c --export c");
        assert!(ran.stderr.contains("drives below 0 are taps to the other side"), "{}", ran.stderr);
        let rows = desk.table("c/rows.csv");
        assert!(rows.rows.iter().all(|row| row["use"] == "used"), "{}", rows.text);
        desk.write("new.csv", "theta_deg,reading\n0,300\n-4,0\n4,600\n");
        desk.ok("locate c/calibration.toml new.csv --out l");
        let found = desk.table("l/located.csv");
        for row in &found.rows[1..] {
            let a = value(row, "distance_mm");
            assert!((a - 880_f64.sqrt()).abs() < 0.3, "{zero} {}", found.text);
        }
        assert!(desk.read("c/locate.c").contains("fabs(drive)"));
        let side = |sign: f64| {
            let reading = |u: f64| 300.0 + sign * 66_000.0 * (u - 0.5).max(0.0) / 880.0;
            let rows = (1..14).map(|k| 0.45 * f64::from(k));
            rows.map(|u| format!("{},{},{sign}\n", sign * u, reading(u) + 0.1 * (7.0 * u).sin()))
                .collect::<String>()
        };
        desk.write("strokes.csv", format!("theta_deg,reading,stroke\n0,300,\n{}{}", side(1.0), side(-1.0)));
        desk.ok("locate c/calibration.toml strokes.csv --strokes --out s");
        let found = desk.table("s/located.csv");
        for k in [13, 26] {
            let a = value(&found.rows[k], "stroke_distance_mm");
            assert!((a - 880_f64.sqrt()).abs() < 0.5, "{zero} {}", found.text);
        }
    }
    // Before contact the signal does not change; a wrong sign keeps the sign of the signal.
    for (name, other) in [("rest", (|_| 0.0) as fn(f64) -> f64), ("slip", |s| s)] {
        let desk = Desk::new("");
        desk.write("taps.csv", two_signs(true, other));
        let ran = desk.line("calibrate taps.csv --out c");
        assert!(!ran.stderr.contains("taps to the other side: "), "{name}: {}", ran.stderr);
    }
}

#[test]
fn a_slip_of_the_sign_of_the_smallest_drive_is_no_zero() {
    for zeros in [true, false] {
        let mut text = "a_mm,theta_deg,reading\n".to_owned();
        for k in 0..5 {
            let a = 20.0 + 6.0 * f64::from(k);
            for n in if zeros { 0..4 } else { 1..4 } {
                let theta = if (k, n) == (3, 1) { -2.0 } else { 2.0 * f64::from(n) };
                let noise = 1e-3 * f64::from((k * 7 + n * 5) % 11 - 5);
                text += &format!("{a},{theta},{}\n", 3.0 + 400.0 * f64::from(n) / (a * a) + noise);
            }
        }
        let desk = Desk::new("");
        desk.write("taps.csv", text);
        let ran = desk.ok("calibrate taps.csv --out c");
        let said = format!("14 of 15 taps used, {} zero readings", if zeros { 5 } else { 0 });
        assert!(ran.stdout.contains(&said), "{} {}", ran.stdout, ran.stderr);
        let rows = desk.table("c/rows.csv");
        let suspects: Vec<&Row> = rows.rows.iter().filter(|row| row["use"] == "suspect").collect();
        assert!(suspects.len() == 1 && suspects[0]["theta_deg"] == "-2", "{}", rows.text);
    }
}
