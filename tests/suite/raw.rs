//! `vibrissa taps`: rests, plateaus and peaks of a raw record. Without rests: correct taps, or a refusal.

use std::f64::consts::TAU;

use crate::common::program::Desk;
use crate::common::random::Random;
use crate::common::sweeping::{Table, value};

/// Drive, signal at the end of the plateau, and duration in s (0: a peak).
type Tap = (f64, f64, f64);

/// A record of `taps` with level, drift and noise; `shape`: sample rate (Hz), ramp (s), share of creep. A rest of 1 s precedes each tap.
fn record(taps: &[Tap], [level, drift, noise]: [f64; 3], shape: [f64; 3], with_drive: bool) -> String {
    above(taps, &|t| level + drift * t, noise, shape, with_drive)
}

/// The same on the baseline `base` of the time, s.
fn above(
    taps: &[Tap],
    base: &dyn Fn(f64) -> f64,
    noise: f64,
    [rate, ramp, creep]: [f64; 3],
    with_drive: bool,
) -> String {
    let mut random = Random(11);
    let mut text = if with_drive { "t_s,theta_deg,reading\n" } else { "t_s,reading\n" }.to_owned();
    let mut k = 0;
    let mut say = |drive: f64, signal: f64| {
        let t = f64::from(k) / rate;
        k += 1;
        let y = base(t) + signal + noise * random.normal();
        text += &if with_drive { format!("{t},{drive},{y}\n") } else { format!("{t},{y}\n") };
    };
    let samples = |seconds: f64| (seconds * rate) as usize;
    for &(drive, signal, stands) in taps {
        (0..samples(1.0)).for_each(|_| say(0.0, 0.0));
        let (rise, steps) = (samples(ramp), samples(stands));
        for part in (1..=rise).map(|i| i as f64 / rise as f64) {
            say(part * drive, part * signal * if steps > 0 { 1.0 + creep } else { 1.0 });
        }
        (0..steps).for_each(|i| say(drive, signal * (1.0 + creep * (-(i as f64) / 20.0).exp())));
        let falls = (1..=rise).rev().map(|i| i as f64 / (rise + 1) as f64);
        falls.for_each(|part| say(part * drive, part * signal));
    }
    (0..samples(1.0)).for_each(|_| say(0.0, 0.0));
    text
}

/// Sample rate (Hz), ramp (s) and share of creep of most records.
const PLAIN: [f64; 3] = [100.0, 0.2, 0.03];

const TAPS: [Tap; 6] = [
    (2.0, 60.0, 1.0),
    (4.0, 125.0, 0.6),
    (1.0, 28.0, 1.5),
    (8.0, 260.0, 2.5),
    (0.5, 14.0, 0.8),
    (4.0, -90.0, 1.0),
];

fn above_rest(table: &Table) -> Vec<f64> {
    let taps = table.rows.iter().filter(|row| row["kind"] != "rest");
    taps.map(|row| value(row, "signal") - value(row, "rest")).collect()
}

#[test]
fn plateaus_and_rests_of_a_record_are_rows_of_calibrate() {
    let desk = Desk::new(&record(&TAPS, [412.0, 0.6, 0.5], PLAIN, true));
    desk.ok("taps spec.toml --a 25,25,30,30,35,35 --out t");
    let table = desk.table("t/taps.csv");
    assert_eq!(table.columns, ["a_mm", "theta_deg", "reading", "t_s"]);
    assert_eq!(table.rows.len(), 13);
    for (k, row) in table.rows.iter().enumerate() {
        let of = |column: &str| value(row, column);
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
    let ran = desk.line("calibrate t/taps.csv --out cal");
    assert!(!ran.stderr.contains("a_mm"), "{}", ran.stderr);
    let readings = desk.table("t/readings.csv");
    assert!(readings.rows.iter().all(|row| ["rest", "plateau"].contains(&row["kind"].as_str())));
    assert!(desk.read("t/taps.svg").contains("<svg"));
}

#[test]
fn peaks_and_steps_are_read_too() {
    let peaks: Vec<Tap> = TAPS.iter().map(|(drive, signal, _)| (*drive, *signal, 0.0)).collect();
    let desk = Desk::new(&record(&peaks, [100.0, 0.0, 0.2], PLAIN, true));
    desk.ok("taps spec.toml --out t");
    let readings = desk.table("t/readings.csv");
    assert!(readings.rows.iter().all(|row| ["rest", "peak"].contains(&row["kind"].as_str())));
    let found = above_rest(&readings);
    assert_eq!(found.len(), 6);
    for (found, (_, signal, _)) in found.iter().zip(TAPS) {
        assert!((found - signal).abs() < 0.05 * signal.abs() + 0.5, "{found} {signal}");
    }
    let mut dice = Random(5);
    let mut text = "t_s,theta_deg,strain\n".to_owned();
    for k in 0..900 {
        let step = [0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 2.0, 0.0][k / 100];
        text += &format!("{},{step},{}\n", 0.01 * k as f64, 0.004 * step + 1e-5 * dice.normal());
    }
    desk.write("steps.csv", text);
    desk.ok("taps steps.csv --out s");
    let table = desk.table("s/taps.csv");
    assert_eq!(table.values("theta_deg"), [0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 2.0, 0.0]);
}

#[test]
fn records_that_show_no_tap_are_refused() {
    let desk = Desk::new(&record(&TAPS, [0.0, 0.0, 0.5], PLAIN, true));
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
    let short: String = text.lines().take(9).map(|l| format!("{l}\n")).collect();
    refused("short.csv", &short, &[], "too short");
    refused("labels.csv", &text, &["--a", "20,30"], "6");
    refused("own.csv", &text, &["--theta", "4"], "drive of its own");
    let mut dice = Random(1);
    let flat: String = (0..500).map(|k| format!("{},{}\n", k, dice.normal())).collect();
    refused("flat.csv", &format!("t_s,reading\n{flat}"), &[], "no tap is found");
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
            let taps = [1.0, 2.0, 3.0].map(|drive| (drive, 0.006 * drive, 1.0));
            desk.write("r.csv", record(&taps, [0.0, drift, 1e-5], [rate, ramp, 0.0], with_drive));
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
    // Single-sample spikes, and holds longer than all rests.
    let long: Vec<Tap> = TAPS.iter().map(|(drive, signal, _)| (-drive, *signal, 4.0)).collect();
    let text = record(&long, [10.0, 0.0, 0.3], PLAIN, true);
    let spiked = text.lines().enumerate().map(|(k, line)| match (k % 97 == 50, line.rsplit_once(',')) {
        (true, Some((before, value))) => format!("{before},{}\n", value.parse::<f64>().unwrap() + 500.0),
        _ => format!("{line}\n"),
    });
    let desk = Desk::new(&spiked.collect::<String>());
    let without = text.lines().map(|l| l.split(',').step_by(2).collect::<Vec<_>>().join(",") + "\n");
    desk.write("without.csv", without.collect::<String>());
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

#[test]
fn noise_drift_and_hum_hide_no_tap() {
    let desk = Desk::new("");
    let hum = |t: f64| 0.01 * (TAU * 50.0 * t + 1.0).sin();
    type Case<'a> = (&'a str, &'a dyn Fn(f64) -> f64, f64);
    let cases: [Case<'_>; 4] = [
        ("noise", &|_| 5.0, 0.008),
        ("hum", &hum, 5e-4),
        ("drift", &|t| 0.015 * t, 2e-3),
        ("wave", &|t| 0.05 * (0.47 * t).sin(), 2e-3),
    ];
    let mut random = Random(3);
    let mut taps = || [0; 7].map(|_| (1.0, random.between(0.2, 1.0), random.between(0.5, 1.5)));
    for (name, base, noise) in cases {
        for rate in [100.0, 1000.0, 100.0, 1000.0] {
            let taps = taps();
            desk.write("r.csv", above(&taps, base, noise, [rate, 0.3, 0.0], false));
            desk.ok("taps r.csv --out t --force");
            let table = desk.table("t/taps.csv");
            assert_eq!(table.rows.len(), taps.len(), "{name} {rate}: {}", table.text);
            for (row, (_, level, _)) in table.rows.iter().zip(&taps) {
                let found = value(row, "reading");
                assert!((found - level).abs() < 0.015, "{name} {rate}: {found} for {level}");
            }
        }
    }
    let taps = taps();
    let text = record(&taps, [5.0, 0.0, 1e-3], PLAIN, false);
    let lost = |(k, line): (usize, &str)| match line.rsplit_once(',') {
        Some((t, _)) if k % 11 == 5 => format!("{t},\n"),
        _ => format!("{line}\n"),
    };
    desk.write("r.csv", text.lines().enumerate().map(lost).collect::<String>());
    let ran = desk.ok("taps r.csv --out t --force");
    assert!(ran.stderr.contains("lines without a signal are left out"), "{}", ran.stderr);
    assert_eq!(desk.table("t/taps.csv").rows.len(), taps.len());
}

/// 90 samples a second of `signal` (of the time, s); the noise makes all samples different.
fn unrested(seconds: f64, noise: f64, signal: impl Fn(f64) -> f64) -> String {
    let mut random = Random(7);
    let mut sample = |k: i32| {
        let t = f64::from(k) / 90.0;
        format!("{t:.4},{:.5}\n", 5.25 + signal(t) + 0.5 * noise * random.normal())
    };
    format!("t_s,reading\n{}", (0..(90.0 * seconds) as i32).map(&mut sample).collect::<String>())
}

/// A trapezoidal wave between `low` and `high`; each ramp takes the share `ramp` of the period.
fn wave(t: f64, period: f64, ramp: f64, [low, high]: [f64; 2]) -> f64 {
    let phase = (t / period).fract();
    let half = 0.5 - ramp;
    let share = (phase / ramp).min((2.0 * ramp + half - phase) / ramp).clamp(0.0, 1.0);
    low + share * (high - low)
}

#[test]
fn records_without_rests_between_their_taps_are_refused() {
    let desk = Desk::new("");
    let cut = |seconds: f64, from: f64, f: &dyn Fn(f64) -> f64| {
        let inside = |t: f64| if (from..seconds - from).contains(&t) { f(t - from) } else { 0.0 };
        unrested(seconds, 4e-4, inside)
    };
    let square = |t: f64| wave(t, 4.0, 0.04, [-0.6, 0.6]);
    let slow = |t: f64| wave(t, 4.0, 0.3, [-0.6, 0.6]);
    let triangle = |t: f64| wave(t, 4.0, 0.5, [-0.6, 0.6]);
    let sine = |t: f64| 0.6 * (TAU * t / 4.0).sin();
    let half_sines = |t: f64| 0.6 * (TAU * t / 4.0).sin().abs();
    for (name, text) in [
        ("square", cut(30.0, 5.0, &square)),
        ("ramps", cut(30.0, 5.0, &slow)),
        ("few", cut(18.0, 5.0, &square)),
        ("no rest at all", unrested(22.0, 4e-4, |t| square(t + 0.2))),
        ("triangles", unrested(22.0, 4e-4, triangle)),
        ("triangles between rests", cut(30.0, 5.0, &triangle)),
        ("sine", unrested(22.0, 4e-4, sine)),
        ("sine between rests", cut(30.0, 5.0, &sine)),
        ("half sines", cut(30.0, 5.0, &half_sines)),
        ("noisy sine", unrested(22.0, 0.02, sine)),
        ("uneven", unrested(22.0, 4e-4, |t| square(t) * if (t / 4.0) as i32 % 2 == 0 { 0.7 } else { 1.0 })),
        ("levels", cut(30.0, 5.0, &|t| [0.3, 0.6, -0.2, 0.5, 0.1][(t / 4.0) as usize % 5])),
    ] {
        desk.write("r.csv", text);
        let ran = desk.line("taps r.csv --out t").exits(2);
        let said = ["rest", "no tap is found"].iter().any(|word| ran.stderr.contains(word));
        assert!(said, "{name}: {}", ran.stderr);
        assert!(!desk.path("t").exists(), "{name}");
    }
}

#[test]
fn taps_with_rests_are_read_whatever_their_pattern() {
    let desk = Desk::new("");
    // Alternating sides; one level; ramps as long as the rest; oscillation after release.
    let to = |k: usize, levels: &[f64]| levels[k % levels.len()];
    type Tap<'a> = (&'a str, [f64; 3], &'a [f64], f64);
    let cases: [Tap<'_>; 4] = [
        ("both sides", [0.1, 2.0, 0.6], &[0.6, -0.6], 0.0),
        ("one level", [0.2, 0.8, 1.2], &[0.4], 0.0),
        ("slow", [1.0, 1.0, 1.0], &[0.2, 0.5, 0.3], 0.0),
        ("swings", [0.1, 1.0, 1.0], &[0.6, 0.3, 0.5], 0.3),
    ];
    for (name, [ramp, hold, rest], levels, swing) in cases {
        let period = 2.0 * ramp + hold + rest;
        let signal = |t: f64| {
            let t = t - 3.0;
            let (k, t) = ((t / period).floor(), t.rem_euclid(period));
            if !(0.0..8.0).contains(&k) {
                return 0.0;
            }
            let share = (t / ramp).min((2.0 * ramp + hold - t) / ramp).clamp(0.0, 1.0);
            let free = t - 2.0 * ramp - hold;
            let swings =
                if free > 0.0 { -swing * (-free / 0.05).exp() * (TAU * free / 0.08).sin() } else { 0.0 };
            to(k as usize, levels) * (share + swings)
        };
        desk.write("r.csv", unrested(6.0 + 8.0 * period, 4e-4, signal));
        desk.ok("taps r.csv --out t --force");
        let table = desk.table("t/taps.csv");
        let found = table.values("reading");
        assert_eq!(found.len(), 8, "{name}: {found:?}");
        for (k, found) in found.iter().enumerate() {
            assert!((found - to(k, levels)).abs() < 0.02, "{name} {k}: {found}");
        }
    }
}

#[test]
fn plateaus_of_whole_numbers_without_noise_are_all_read() {
    let desk = Desk::new("");
    for (levels, rest, rate) in
        [([48, 96, 42, 84, 33, 67], 0, 10.0), ([318, 637, 279, 558, 222, 445], 2048, 50.0)]
    {
        let mut text = "t_s,reading\n".to_owned();
        let mut k = 0;
        let mut say = |value: i32, seconds: f64| {
            (0..(seconds * rate) as i32).for_each(|_| {
                text += &format!("{},{}\n", f64::from(k) / rate, rest + value);
                k += 1;
            });
        };
        for level in levels {
            say(0, 1.0);
            say(level, 1.2);
        }
        say(0, 1.0);
        desk.write("r.csv", text);
        desk.ok("taps r.csv --a 25,25,30,30,40,40 --theta 2,4,2,4,2,4 --out t --force");
        let table = desk.table("t/readings.csv");
        let of = |rests: bool| -> Vec<f64> {
            let rows = table.rows.iter().filter(|r| (r["kind"] == "rest") == rests);
            rows.map(|r| value(r, "signal")).collect()
        };
        assert_eq!(of(false), levels.map(|level| f64::from(rest + level)), "{}", table.text);
        assert!(of(true).iter().all(|signal| *signal == f64::from(rest)), "{}", table.text);
    }
}
