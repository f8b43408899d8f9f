//! `vibrissa taps` of records that do not rest, and of whole numbers: taps that are right, or a word that it is not certain where they rest.

use std::f64::consts::TAU;

use crate::common::program::Desk;
use crate::common::random::Random;
use crate::common::sweeping::number;

/// A record of 90 samples a second of `signal` (of the time, s), with noise of so much that no two samples are equal.
fn record(seconds: f64, noise: f64, signal: impl Fn(f64) -> f64) -> String {
    let mut random = Random(7);
    let mut dice = || random.uniform() - 0.5;
    let sample = |k: i32| f64::from(k) / 90.0;
    let n = (90.0 * seconds) as i32;
    (0..n).fold("t_s,reading\n".to_owned(), |text, k| {
        let t = sample(k);
        let noisy = 5.25 + signal(t) + noise * (dice() + dice() + dice());
        text + &format!("{t:.4},{noisy:.5}\n")
    })
}

/// From `low` to `high` and back, `period` s, with ramps that take the share `ramp` of it.
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
        record(seconds, 4e-4, inside)
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
        ("no rest at all", record(22.0, 4e-4, |t| square(t + 0.2))),
        ("triangles", record(22.0, 4e-4, triangle)),
        ("triangles between rests", cut(30.0, 5.0, &triangle)),
        ("sine", record(22.0, 4e-4, sine)),
        ("sine between rests", cut(30.0, 5.0, &sine)),
        ("half sines", cut(30.0, 5.0, &half_sines)),
        ("noisy sine", record(22.0, 0.02, sine)),
        ("uneven", record(22.0, 4e-4, |t| square(t) * if (t / 4.0) as i32 % 2 == 0 { 0.7 } else { 1.0 })),
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
    // To both sides in turn; all to one level; ramps that last as long as the rest; swings where the whisker comes free.
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
        desk.write("r.csv", record(6.0 + 8.0 * period, 4e-4, signal));
        desk.ok("taps r.csv --out t --force");
        let table = desk.table("t/taps.csv");
        let found: Vec<f64> = table.rows.iter().map(|row| number(row, "reading").unwrap()).collect();
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
            rows.map(|r| number(r, "signal").unwrap()).collect()
        };
        assert_eq!(of(false), levels.map(|level| f64::from(rest + level)), "{}", table.text);
        assert!(of(true).iter().all(|signal| *signal == f64::from(rest)), "{}", table.text);
    }
}
