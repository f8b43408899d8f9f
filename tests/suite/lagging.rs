//! Sensors whose readings lag behind the whisker: found where rows have times, corrected in `calibrate` and `locate`, not found without a lag.

use std::fmt::Write as _;

use crate::common::measuring::{REAL, TAPS, data, prototype, table};
use crate::common::program::Desk;
use crate::common::random::Random;
use crate::common::sweeping::{number, rms};
use vibrissa::simulate::Settings;

fn clean() -> Vec<(f64, f64, f64)> {
    let measured = table(&prototype(4.0, &[TAPS, REAL]), &Settings::default());
    data(&measured).rows.iter().map(|r| (r.a, r.drive, r.value)).collect()
}

/// Taps in random order, some seconds apart, with rests; `gain` of the signal arrives with time constant `tau` s. Rows: a_mm, θ, t, strain.
fn record(taps: &[(f64, f64, f64)], [gain, tau]: [f64; 2], random: &mut Random) -> Vec<[f64; 4]> {
    let mut order = taps.to_vec();
    (1..order.len()).rev().for_each(|k| order.swap(k, random.below(k + 1)));
    let (mut x, mut t) = (0.0, 0.0);
    let mut rows = Vec::new();
    for (k, (a, u, y)) in order.into_iter().enumerate() {
        let rest = (k % 12 == 0).then_some((a, 0.0, 0.0));
        for (a, u, y) in rest.into_iter().chain([(a, u, y)]) {
            let hold = random.between(1.0, 6.0);
            t += hold;
            x = y + (-hold / tau).exp() * (x - y);
            let read = y - gain * (y - x);
            rows.push([a, u, t, 2e-4 + read * (1.0 + 1e-3 * random.normal()) + 2e-6 * random.normal()]);
        }
    }
    rows
}

fn text(rows: &[[f64; 4]], timed: bool, labelled: bool) -> String {
    let mut text = String::new();
    for (k, [a, u, t, y]) in rows.iter().enumerate() {
        let head = [("a_mm,", labelled), ("theta_deg,strain", true), (",t_s", timed)];
        if k == 0 {
            head.iter().filter(|h| h.1).for_each(|h| text.push_str(h.0));
            text.push('\n');
        }
        let (a, t) = (labelled.then(|| format!("{a},")), timed.then(|| format!(",{t:.3}")));
        writeln!(text, "{}{u},{y:e}{}", a.unwrap_or_default(), t.unwrap_or_default()).unwrap();
    }
    text
}

fn desk() -> Desk {
    Desk::new(&prototype(4.0, &[TAPS, REAL]))
}

fn calibrated(desk: &Desk, name: &str, rows: &[[f64; 4]], timed: bool) -> (toml::Table, f64) {
    desk.write("d.csv", text(rows, timed, true));
    desk.ok(format!("calibrate d.csv --whisker spec.toml --out {name} --force"));
    let file: toml::Table = desk.read(&format!("{name}/calibration.toml")).parse().unwrap();
    let error = file["sides"][0]["learned"]["held_out_rms_mm"].as_float().unwrap();
    (file, error)
}

#[test]
fn a_lag_is_found_and_taken_out_of_readings_that_have_times() {
    let mut random = Random(11);
    let taps = clean();
    let desk = desk();
    for (k, lag) in
        [[0.06, 8.0], [-0.04, 3.0], [0.12, 25.0], [-0.25, 8.0], [0.25, 8.0]].into_iter().enumerate()
    {
        let rows = record(&taps, lag, &mut random);
        let (with, error) = calibrated(&desk, "timed", &rows, true);
        let (without, blind) = calibrated(&desk, "untimed", &rows, false);
        let of = |key: &str| with["lag"][key].as_float().unwrap();
        let [gain, sigma, tau, of_tau] = ["gain", "sigma_gain", "tau_s", "sigma_tau_s"].map(of);
        println!("{lag:?}: {gain:.4} ± {sigma:.4}, {tau:.2} ± {of_tau:.2} s; {blind:.3} → {error:.3} mm");
        assert!((gain / lag[0] - 1.0).abs() < 0.15 && (tau / lag[1] - 1.0).abs() < 0.35, "{gain} {tau}");
        // Errors of some 0.1 % remain in both; σ covers them.
        assert!(sigma < 1e-3 && (gain - lag[0]).abs() < 8.0 * sigma, "{gain} ± {sigma}");
        assert!(of_tau < 0.01 * tau && (tau - lag[1]).abs() < 8.0 * of_tau, "{tau} ± {of_tau}");
        assert!(!without.contains_key("lag") && error < 0.6 * blind, "{error} {blind}");

        let fresh = record(&taps, lag, &mut random);
        let located = |timed: bool| {
            desk.write("r.csv", text(&fresh, timed, false));
            let ask = ["locate", "timed/calibration.toml", "r.csv", "--same-run", "--out", "loc", "--force"];
            let ran = desk.run(&ask).exits(0);
            assert_eq!(ran.stderr.contains("no column t_s"), !timed, "{}", ran.stderr);
            let answers = desk.table("loc/located.csv");
            let errors: Vec<[f64; 2]> = answers
                .rows
                .iter()
                .zip(&fresh)
                .filter_map(|(row, [a, ..])| {
                    Some([number(row, "distance_mm")? - a, number(row, "sigma_mm")?])
                })
                .collect();
            let [off, scaled]: [Vec<f64>; 2] =
                [errors.iter().map(|e| e[0]).collect(), errors.iter().map(|e| e[0] / e[1]).collect()];
            (rms(off), rms(scaled), errors.len())
        };
        let (rms, z, n) = located(true);
        let (blind, ..) = located(false);
        println!("{n} answers: {blind:.3} → {rms:.3} mm, rms of errors over sigma {z:.2}");
        assert!(n > 100 && rms < 0.7 * blind && (0.7..1.35).contains(&z), "case {k}");
    }
}

#[test]
fn a_stream_settles_as_a_file_does() {
    let mut random = Random(4);
    let taps = clean();
    let desk = desk();
    calibrated(&desk, "timed", &record(&taps, [0.1, 10.0], &mut random), true);
    let readings = text(&record(&taps[..40], [0.1, 10.0], &mut random), true, false);
    desk.write("r.csv", &readings);
    desk.ok("locate timed/calibration.toml r.csv --out loc");
    let filed = desk.table("loc/located.csv");
    let streamed = desk.pipe(&["locate", "timed/calibration.toml"], &readings).exits(0).stdout;
    assert_eq!(streamed.lines().count(), filed.rows.len() + 1);
    // Zeros differ: a file interpolates them over its lines, a stream uses the last one.
    let mut answered = 0;
    for (line, row) in streamed.lines().skip(1).zip(&filed.rows) {
        let field = line.split(',').nth(2).expect("drive, signal, distance");
        if let (Ok(distance), Some(filed)) = (field.parse::<f64>(), number(row, "distance_mm")) {
            assert!((distance - filed).abs() < 3.0 * number(row, "sigma_mm").unwrap(), "{line} {filed}");
            answered += 1;
        }
    }
    assert!(answered > 30, "{streamed}");
    let empty: String = readings.lines().map(|l| l.rsplit_once(',').unwrap().0.to_owned() + ",\n").collect();
    let empty = empty.replacen("strain,\n", "strain,t_s\n", 1);
    let ran = desk.pipe(&["locate", "timed/calibration.toml"], &empty).exits(0);
    assert!(ran.stderr.contains("line 2: this time is missing"), "{}", ran.stderr);
    let broken = desk.read("timed/calibration.toml").replace("tau_s = ", "tau_s = -");
    desk.write("broken.toml", broken);
    desk.refuses("locate broken.toml r.csv --out no --force", &["lag", "tau_s > 0"]);
}

#[test]
fn no_lag_is_seen_where_there_is_none() {
    let taps = clean();
    let desk = desk();
    for seed in 0..6 {
        let rows = record(&taps, [0.0, 5.0], &mut Random(100 + seed));
        let (found, _) = calibrated(&desk, "plain", &rows, true);
        assert!(!found.contains_key("lag"), "{seed}: {:?}", found["lag"]);
    }
}
