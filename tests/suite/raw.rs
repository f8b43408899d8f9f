//! `vibrissa taps`: rests, plateaus and peaks of a raw record.

use crate::common::program::Desk;
use crate::common::sweeping::{Row, Table, number};

/// A sequence of normal numbers.
struct Dice(u64);

impl Dice {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

/// A tap: its drive, its signal at the end of the plateau, and how long it stands, s (0: a peak).
type Tap = (f64, f64, f64);

/// A record of 100 samples a second of `taps` above a level that drifts; each rises in 0.2 s, creeps by 3 %, and rests 1 s.
fn record(taps: &[Tap], [level, drift, noise]: [f64; 3], with_drive: bool) -> String {
    let mut dice = Dice(11);
    let mut text = if with_drive { "t_s,theta_deg,reading\n" } else { "t_s,reading\n" }.to_owned();
    let mut k = 0;
    let mut say = |drive: f64, signal: f64, text: &mut String| {
        let t = f64::from(k) * 0.01;
        k += 1;
        let y = level + drift * t + signal + noise * dice.normal();
        *text += &if with_drive { format!("{t},{drive},{y}\n") } else { format!("{t},{y}\n") };
    };
    for &(drive, signal, stands) in taps {
        (0..100).for_each(|_| say(0.0, 0.0, &mut text));
        let steps = (100.0 * stands) as usize;
        for i in 1..=20 {
            let part = f64::from(i) / 20.0;
            say(part * drive, part * signal * if steps > 0 { 1.03 } else { 1.0 }, &mut text);
        }
        for i in 0..steps {
            let creep = 0.03 * (-(i as f64) / 20.0).exp();
            say(drive, signal * (1.0 + creep), &mut text);
        }
        (1..=20)
            .rev()
            .for_each(|i| say(f64::from(i) / 21.0 * drive, f64::from(i) / 21.0 * signal, &mut text));
    }
    (0..100).for_each(|_| say(0.0, 0.0, &mut text));
    text
}

const TAPS: [Tap; 6] = [
    (2.0, 60.0, 1.0),
    (4.0, 125.0, 0.6),
    (1.0, 28.0, 1.5),
    (8.0, 260.0, 2.5),
    (0.5, 14.0, 0.8),
    (4.0, -90.0, 1.0),
];

/// Signals of the rows of readings.csv that are no rests, above their rests.
fn above_rest(table: &Table) -> Vec<f64> {
    let of = |row: &Row, column: &str| number(row, column).unwrap();
    let taps = table.rows.iter().filter(|row| row["kind"] != "rest");
    taps.map(|row| of(row, "signal") - of(row, "rest")).collect()
}

#[test]
fn plateaus_and_rests_of_a_record_are_rows_of_calibrate() {
    let desk = Desk::new(&record(&TAPS, [412.0, 0.6, 0.5], true));
    desk.ok("taps spec.toml --a 25,25,30,30,35,35 --out t");
    let table = desk.table("t/taps.csv");
    assert_eq!(table.columns, ["a_mm", "theta_deg", "reading", "t_s"]);
    assert_eq!(table.rows.len(), 13);
    for (k, row) in table.rows.iter().enumerate() {
        let of = |column: &str| number(row, column).unwrap();
        let drift = 412.0 + 0.6 * of("t_s");
        if k % 2 == 0 {
            assert_eq!((of("theta_deg"), row["a_mm"].as_str()), (0.0, ""));
            assert!((of("reading") - drift).abs() < 0.5, "{row:?}");
        } else {
            let (drive, signal, _) = TAPS[k / 2];
            assert!((of("theta_deg") - drive).abs() < 1e-6, "{row:?}");
            assert!((of("reading") - drift - signal).abs() < 0.012 * signal.abs() + 0.5, "{row:?} {signal}");
        }
    }
    // What it wrote is calibrated: rests are zero readings.
    let ran = desk.run(&["calibrate", "t/taps.csv", "--out", "cal"]);
    assert!(!ran.stderr.contains("a_mm"), "{}", ran.stderr);
    let readings = desk.table("t/readings.csv");
    assert!(readings.rows.iter().all(|row| ["rest", "plateau"].contains(&row["kind"].as_str())));
    assert!(desk.read("t/taps.svg").contains("<svg"));
}

#[test]
fn without_a_drive_taps_stand_above_their_rest() {
    let desk = Desk::new(&record(&TAPS, [-3.0, -0.4, 0.3], false));
    desk.ok("taps spec.toml --theta 2,4,1,8,0.5,4 --out t");
    let table = desk.table("t/taps.csv");
    let taps: Vec<_> = table.rows.iter().filter(|row| number(row, "theta_deg") != Some(0.0)).collect();
    assert_eq!(taps.len(), 6);
    desk.ok("taps spec.toml --out u");
    let tared = desk.table("u/taps.csv");
    assert_eq!(tared.columns, ["reading", "t_s"]);
    for (row, (_, signal, _)) in tared.rows.iter().zip(TAPS) {
        let found = number(row, "reading").unwrap();
        assert!((found - signal).abs() < 0.012 * signal.abs() + 0.5, "{found} {signal}");
    }
}

#[test]
fn peaks_and_steps_are_read_too() {
    let peaks: Vec<Tap> = TAPS.iter().map(|(drive, signal, _)| (*drive, *signal, 0.0)).collect();
    let desk = Desk::new(&record(&peaks, [100.0, 0.0, 0.2], true));
    desk.ok("taps spec.toml --out t");
    let readings = desk.table("t/readings.csv");
    let found: Vec<f64> = readings
        .rows
        .iter()
        .filter(|row| row["kind"] == "peak")
        .map(|row| number(row, "signal").unwrap() - number(row, "rest").unwrap())
        .collect();
    assert_eq!(found.len(), 6);
    for (found, (_, signal, _)) in found.iter().zip(TAPS) {
        assert!((found - signal).abs() < 0.05 * signal.abs() + 0.5, "{found} {signal}");
    }
    // A staircase: several drives in one contact.
    let mut dice = Dice(5);
    let mut text = "t_s,theta_deg,strain\n".to_owned();
    for k in 0..900 {
        let step = [0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 2.0, 0.0][k / 100];
        text += &format!("{},{step},{}\n", 0.01 * k as f64, 0.004 * step + 1e-5 * dice.normal());
    }
    desk.write("steps.csv", text);
    desk.ok("taps steps.csv --out s");
    let table = desk.table("s/taps.csv");
    let drives: Vec<f64> = table.rows.iter().map(|row| number(row, "theta_deg").unwrap()).collect();
    assert_eq!(drives, [0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 2.0, 0.0]);
}

#[test]
fn records_that_show_no_tap_are_refused() {
    let desk = Desk::new(&record(&TAPS, [0.0, 0.0, 0.5], true));
    let text = desk.read("spec.toml");
    let refused = |name: &str, text: &str, more: &[&str], words: &str| {
        desk.write(name, text);
        let ran = desk.run(&[&["taps", name, "--out", "bad"], more].concat()).exits(2);
        assert!(ran.stderr.contains(words), "{name}: {}", ran.stderr);
        assert!(!desk.path("bad").exists());
    };
    refused("time.csv", &text.replace("t_s,", "clock,"), &[], "t_s is missing");
    refused("back.csv", &text.replace("\n3.5,", "\n0.5,"), &[], "not after the one before");
    refused("word.csv", &text.replace("\n3.5,", "\n3.5x,"), &[], "not a number");
    refused(
        "short.csv",
        &text.lines().take(9).map(|l| format!("{l}\n")).collect::<String>(),
        &[],
        "too short",
    );
    refused("labels.csv", &text, &["--a", "20,30"], "6");
    refused("own.csv", &text, &["--theta", "4"], "drive of its own");
    let mut dice = Dice(1);
    let flat: String = (0..500).map(|k| format!("{},{}\n", k, dice.normal())).collect();
    refused("flat.csv", &format!("t_s,reading\n{flat}"), &[], "no tap is found");
}

/// A record of `rate` samples a second: holds of 1 s of 1, 2 and 3 units between rests of 1 s, by ramps of `ramp` s; the level drifts.
fn ramps(rate: f64, ramp: f64, drift: f64, with_drive: bool) -> String {
    let mut dice = Dice(3);
    let mut text = if with_drive { "t_s,theta_deg,strain\n" } else { "t_s,strain\n" }.to_owned();
    let mut k = 0;
    let mut say = |drive: f64| {
        let t = f64::from(k) / rate;
        k += 1;
        let y = 0.006 * drive + drift * t + 1e-5 * dice.normal();
        text += &if with_drive { format!("{t},{drive},{y}\n") } else { format!("{t},{y}\n") };
    };
    let samples = |seconds: f64| (seconds * rate) as usize;
    for drive in [1.0, 2.0, 3.0] {
        (0..samples(1.0)).for_each(|_| say(0.0));
        (0..samples(ramp)).for_each(|i| say(drive * i as f64 / samples(ramp) as f64));
        (0..samples(1.0)).for_each(|_| say(drive));
        (0..samples(ramp)).rev().for_each(|i| say(drive * i as f64 / samples(ramp) as f64));
    }
    (0..samples(1.0)).for_each(|_| say(0.0));
    text
}

#[test]
fn the_rate_of_a_record_and_its_drift_change_no_reading() {
    let desk = Desk::new("");
    for (rate, ramp, drift) in [
        (100.0, 0.2, 0.0),
        (1000.0, 0.2, 1e-4),
        (10_000.0, 0.2, 0.0),
        (1000.0, 1.0, 0.0),
        (100.0, 0.2, -3e-4),
    ] {
        for with_drive in [false, true] {
            desk.write("r.csv", ramps(rate, ramp, drift, with_drive));
            desk.ok("taps r.csv --out t --force");
            let table = desk.table("t/readings.csv");
            let taps = above_rest(&table);
            let case = format!("{rate} Hz, ramps of {ramp} s, drift {drift}, drive {with_drive}");
            assert_eq!(taps.len(), 3, "{case}: {}", table.text);
            for (k, found) in taps.iter().enumerate() {
                let known = 0.006 * (k + 1) as f64;
                assert!((found / known - 1.0).abs() < 0.01, "{case}: {found} for {known}");
            }
            assert_eq!(table.rows.len() - taps.len(), 4, "{case}: {}", table.text);
        }
    }
}

#[test]
fn spikes_long_holds_and_negative_drives_are_read() {
    // Single samples that spring out of the record, and holds that are longer than all rests.
    let long: Vec<Tap> = TAPS.iter().map(|(drive, signal, _)| (-drive, *signal, 4.0)).collect();
    let text = record(&long, [10.0, 0.0, 0.3], true);
    let spiked = text.lines().enumerate().map(|(k, line)| match (k % 97 == 50, line.rsplit_once(',')) {
        (true, Some((before, value))) => format!("{before},{}\n", value.parse::<f64>().unwrap() + 500.0),
        _ => format!("{line}\n"),
    });
    let desk = Desk::new(&spiked.collect::<String>());
    let without: String = text
        .lines()
        .map(|l| {
            let f: Vec<&str> = l.split(',').collect();
            format!("{},{}\n", f[0], f[2])
        })
        .collect();
    desk.write("without.csv", without);
    for file in ["spec.toml", "without.csv"] {
        desk.ok(format!("taps {file} --out t --force"));
        let table = desk.table("t/readings.csv");
        assert!(table.rows.iter().all(|row| ["rest", "plateau"].contains(&row["kind"].as_str())));
        let taps = above_rest(&table);
        assert_eq!(taps.len(), 6, "{file}: {}", table.text);
        for (found, (_, signal, _)) in taps.iter().zip(TAPS) {
            assert!((found - signal).abs() < 0.012 * signal.abs() + 0.5, "{file}: {found} for {signal}");
        }
    }
    for bad in ["--a nan", "--a 0", "--theta 0", "--theta inf"] {
        desk.refuses(format!("taps without.csv --out u {bad}"), &[&bad[..3]]);
    }
}

/// A record of taps that hold for 1 s, at 1 kHz or 100 Hz, above what `more` (of the share of the record that is over) adds.
fn trials(rate: f64, seed: u64, noise: f64, more: &dyn Fn(f64, f64) -> f64) -> (Vec<f64>, String) {
    let mut dice = Dice(seed);
    let levels: Vec<f64> = (0..7).map(|_| 0.2 + 0.8 * dice.uniform()).collect();
    let mut signal = vec![0.0; (1.5 * rate) as usize];
    for level in &levels {
        let (ramp, hold) = (0.1 + 0.4 * dice.uniform(), 0.5 + dice.uniform());
        let steps = |s: f64| (s * rate) as usize;
        let part =
            |n: usize, f: &dyn Fn(f64) -> f64| (0..n).map(|k| f(k as f64 / n as f64)).collect::<Vec<_>>();
        signal.extend(part(steps(ramp), &|s| level * s));
        signal.extend(part(steps(hold), &|_| *level));
        signal.extend(part(steps(ramp), &|s| level * (1.0 - s)));
        signal.extend(part(steps(0.6 + dice.uniform()), &|_| 0.0));
    }
    let n = signal.len() as f64;
    let mut text = "t_s,reading\n".to_owned();
    for (k, y) in signal.iter().enumerate() {
        let t = k as f64 / rate;
        text += &format!("{t},{}\n", 5.0 + y + more(k as f64 / n, t) + noise * dice.normal());
    }
    (levels, text)
}

#[test]
fn noise_drift_and_hum_hide_no_tap() {
    let desk = Desk::new("");
    let hum = |_: f64, t: f64| 0.01 * (std::f64::consts::TAU * 50.0 * t + 1.0).sin();
    let drift = |share: f64, _: f64| 0.3 * share;
    let wave = |share: f64, _: f64| 0.05 * (9.4 * share).sin();
    let none = |_: f64, _: f64| 0.0;
    type Case<'a> = (&'a str, &'a dyn Fn(f64, f64) -> f64, f64);
    let cases: [Case<'_>; 4] =
        [("noise", &none, 0.008), ("hum", &hum, 5e-4), ("drift", &drift, 2e-3), ("wave", &wave, 2e-3)];
    for (name, more, noise) in cases {
        for seed in 0..6 {
            let (levels, text) = trials([100.0, 1000.0][seed as usize % 2], seed, noise, more);
            desk.write("r.csv", text);
            desk.ok("taps r.csv --out t --force");
            let table = desk.table("t/taps.csv");
            assert_eq!(table.rows.len(), levels.len(), "{name} {seed}: {}", table.text);
            for (row, level) in table.rows.iter().zip(&levels) {
                let found = number(row, "reading").unwrap();
                assert!((found - level).abs() < 0.015, "{name} {seed}: {found} for {level}");
            }
        }
    }
    // Samples that were lost are no fault.
    let (levels, text) = trials(100.0, 9, 1e-3, &none);
    let lost = |(k, line): (usize, &str)| match line.rsplit_once(',') {
        Some((t, _)) if k % 11 == 5 => format!("{t},\n"),
        _ => format!("{line}\n"),
    };
    desk.write("r.csv", text.lines().enumerate().map(lost).collect::<String>());
    let ran = desk.ok("taps r.csv --out t --force");
    assert!(ran.stderr.contains("lines without a signal are left out"), "{}", ran.stderr);
    assert_eq!(desk.table("t/taps.csv").rows.len(), levels.len());
}
