//! The statistical model of a calibration, against data of which the truth is known, and the plan of its taps.

use crate::common::random::Random;
use vibrissa_learned::base::{Base, power};
use vibrissa_learned::curve::Weights;
use vibrissa_learned::fit::{Fault, Fit, From, Task, fit};
use vibrissa_learned::hyper::{Hyper, Prior};
use vibrissa_learned::invert::Inverse;
use vibrissa_learned::labels::{contradicted, prior};
use vibrissa_learned::plan::{Ask, Planner, Rig as PlannedRig, Tap};
use vibrissa_learned::rows::{Row, cells, quantum};
use vibrissa_learned::suspects::sound;
use vibrissa_learned::tails::{OF_95, Tails, student};

/// A whisker that no power law is.
fn truth(a: f64, u: f64) -> f64 {
    1e-3 * u * (1.0 + 0.01 * u) * (30.0 / a).powf(1.2) * (1.0 - 0.15 * (a / 45.0).powi(3))
}

struct Rig {
    noise: f64,
    repeats: usize,
    drives: Vec<f64>,
    runs: usize,
    zero: f64,
    gain: f64,
}

impl Rig {
    fn rows(&self, seed: u64) -> Vec<Row> {
        let mut noise = Random(seed);
        let mut rows = Vec::new();
        for run in 0..self.runs {
            let (z, g) = (self.zero * noise.normal(), 1.0 + self.gain * noise.normal());
            for _ in 0..self.repeats {
                for k in 0..11 {
                    for u in &self.drives {
                        let a = 20.0 + 2.5 * f64::from(k);
                        let y = z + g * truth(a, *u) * (1.0 + self.noise * noise.normal());
                        rows.push(Row { a, u: *u, y, run, t: rows.len() as f64 });
                    }
                }
            }
        }
        rows
    }
}

fn task(rows: &[Row]) -> Task<'_> {
    Task { rows, known: None, step: 0.0, zero: f64::INFINITY, drift: false }
}

fn all(rows: &[Row]) -> Vec<usize> {
    (0..rows.len()).collect()
}

fn inverse(found: &Fit) -> Inverse {
    let base = Base::Power(found.power.expect("no whisker is known").power);
    Inverse::new(&found.curve, &base, false, [1.0, 1e3])
}

/// Shares of errors within 1 σ and beyond 3 σ, and their root mean square, of readings at distances between those of the calibration.
fn judged(rig: &Rig, seeds: u64) -> [f64; 3] {
    let (mut within, mut beyond, mut squares, mut n) = (0.0, 0.0, 0.0, 0.0);
    for seed in 1..=seeds {
        let rows = rig.rows(seed);
        let found = fit(&task(&rows), &all(&rows), From::Nowhere, true).unwrap();
        let inverse = inverse(&found);
        let mut noise = Random(1000 + seed);
        for k in 0..40 {
            let (z, g) = (rig.zero * noise.normal(), 1.0 + rig.gain * noise.normal());
            let (a, u) = (21.0 + 0.58 * f64::from(k), rig.drives[k as usize % rig.drives.len()]);
            let y = z + g * truth(a, u) * (1.0 + rig.noise * noise.normal());
            let answer = inverse.at(u, false).find(y - found.curve.zero, 0.0).unwrap();
            let error = (answer.a - a).abs();
            within += f64::from(u8::from(error <= answer.sigma));
            beyond += f64::from(u8::from(error > 3.0 * answer.sigma));
            squares += error * error;
            n += 1.0;
        }
    }
    [within / n, beyond / n, (squares / n).sqrt()]
}

#[test]
fn sigma_holds_with_repeats_and_without() {
    let rig = |repeats, drives: &[f64]| Rig {
        noise: 3e-3,
        repeats,
        drives: drives.to_vec(),
        runs: 1,
        zero: 0.0,
        gain: 0.0,
    };
    for (what, rig) in [
        ("repeats", rig(3, &[1.0, 2.0, 4.0])),
        ("none", rig(1, &[1.0, 2.0, 4.0])),
        ("one drive", rig(1, &[4.0])),
    ] {
        let [within, beyond, rms] = judged(&rig, 40);
        println!("{what}: {within} {beyond} {rms}");
        assert!(
            (0.58..0.85).contains(&within) && beyond <= 0.03 && rms < 0.2,
            "{what}: {within} {beyond} {rms}"
        );
    }
}

#[test]
fn sigma_holds_in_a_run_that_was_not_seen() {
    let rig = Rig { noise: 1e-3, repeats: 1, drives: vec![1.0, 2.0, 4.0], runs: 5, zero: 3e-5, gain: 0.01 };
    let [within, beyond, _] = judged(&rig, 10);
    assert!(within > 0.55 && beyond <= 0.04, "{within} {beyond}");
    let rows = rig.rows(3);
    let found = fit(&task(&rows), &all(&rows), From::Nowhere, true).unwrap();
    let sigma = |same_run| inverse(&found).at(2.0, same_run).find(truth(30.0, 2.0), 0.0).unwrap().sigma;
    assert!(sigma(false) > 2.0 * sigma(true));
}

#[test]
fn a_wrong_row_that_is_the_nearest_is_named() {
    let rig =
        Rig { noise: 2e-3, repeats: 2, drives: vec![1.0, 2.0, 4.0, 6.0], runs: 1, zero: 0.0, gain: 0.0 };
    for seed in 1..=10 {
        let mut rows = rig.rows(seed);
        let nearest = |y: f64| Row { a: 17.0, u: 4.0, y, run: 0, t: 1e3 };
        rows.push(nearest(truth(30.0, 4.0)));
        let found = |rows: &[Row]| sound(&task(rows), &all(rows), false).unwrap().1;
        let places: Vec<usize> = found(&rows).iter().map(|s| s.place).collect();
        assert_eq!(places, [rows.len() - 1], "seed {seed}");
        let last = rows.len() - 1;
        rows[last] = nearest(truth(17.0, 4.0));
        assert!(found(&rows).is_empty(), "seed {seed}");
    }
}

#[test]
fn one_position_is_none() {
    let rows: Vec<Row> =
        (1..9).map(|u| Row { a: 30.0, u: f64::from(u), y: f64::from(u), run: 0, t: 0.0 }).collect();
    assert_eq!(fit(&task(&rows), &all(&rows), From::Nowhere, true).err(), Some(Fault::OnePosition));
}

#[test]
fn rows_of_which_more_is_learned_than_of_the_whole_are_fitted_anew() {
    let rig = Rig { noise: 2e-3, repeats: 2, drives: vec![1.0, 2.0], runs: 1, zero: 0.0, gain: 0.0 };
    let mut rows = rig.rows(3);
    let taps = all(&rows);
    rows.push(Row { a: 30.0, u: 0.0, y: 0.0, run: 0, t: 1e3 });
    let whole = fit(&task(&rows), &all(&rows), From::Nowhere, true).unwrap();
    let part = fit(&task(&rows), &taps, From::Held(&whole), true).unwrap();
    assert!(part.hypers.len() > whole.hypers.len());
    // Of a zero that is known from elsewhere nothing is learned.
    let known = fit(&Task { zero: 1e-9, ..task(&rows) }, &taps, From::Nowhere, true).unwrap();
    let [zero, error] = known.curve.zero();
    assert!(
        known.hypers.len() == whole.hypers.len() && zero.abs() < 3e-9 && error < 2e-9,
        "{zero} ± {error}"
    );
}

/// Shares of readings of new runs within σ, within 1.96 σ, and in the interval of 95 %.
fn held(rig: &Rig, seeds: u64) -> [f64; 3] {
    let (mut inside, mut n) = ([0.0; 3], 0.0);
    for seed in 1..=seeds {
        let rows = rig.rows(seed);
        let found = fit(&task(&rows), &all(&rows), From::Nowhere, true).unwrap();
        let inverse = inverse(&found);
        let mut noise = Random(5000 + seed);
        for k in 0..100 {
            let (z, g) = (rig.zero * noise.normal(), 1.0 + rig.gain * noise.normal());
            let (a, u) = (21.0 + 23.0 * noise.uniform(), rig.drives[k % rig.drives.len()]);
            let y = z + g * truth(a, u) * (1.0 + rig.noise * noise.normal()) - found.curve.zero;
            let answer = inverse.at(u, false).find(y, 0.0).unwrap();
            let mut weights = Weights::default();
            weights.add(1.0, [y, answer.slope * answer.a], 0.0);
            let longer = found.curve.longer(weights, (answer.sigma * answer.slope).powi(2), false, false);
            let [lo, hi] = answer.ends.map(|end| answer.a + longer * (end - answer.a));
            let off = (answer.a - a).abs() / answer.sigma;
            [off < 1.0, off < OF_95, lo < a && a < hi]
                .iter()
                .zip(&mut inside)
                .for_each(|(is, sum)| *sum += f64::from(u8::from(*is)));
            n += 1.0;
        }
    }
    inside.map(|x| x / n)
}

#[test]
fn intervals_of_few_runs_are_longer_than_those_of_a_normal_error() {
    // With 100 in place of 16: 69 % within one sigma, 93.3 % within 1.96, 94.6 % within the interval; of three runs also 68, 91.1 and 93.4 %.
    let rig = Rig { noise: 1e-3, repeats: 1, drives: vec![1.0, 2.0, 4.0], runs: 5, zero: 3e-5, gain: 0.01 };
    let [one, normal, interval] = held(&rig, 16);
    println!("{one} {normal} {interval}");
    assert!((0.6..0.78).contains(&one) && (0.92..0.98).contains(&interval), "{one} {interval}");
    assert!(interval > normal, "{normal} {interval}");
    // Of one run of many readings the tails are those of a normal error.
    let rig = Rig { noise: 3e-3, repeats: 8, drives: vec![1.0, 2.0, 4.0], runs: 1, zero: 0.0, gain: 0.0 };
    let rows = rig.rows(1);
    let found = fit(&task(&rows), &all(&rows), From::Nowhere, true).unwrap();
    let answer = inverse(&found).at(2.0, true).find(truth(30.0, 2.0) - found.curve.zero, 0.0).unwrap();
    let mut weights = Weights::default();
    weights.add(1.0, [truth(30.0, 2.0), answer.slope * answer.a], 0.0);
    let longer = found.curve.longer(weights, (answer.sigma * answer.slope).powi(2), false, true);
    assert!((1.0..1.05).contains(&longer), "{longer}");
}

#[test]
fn a_power_law_is_found_with_and_without_its_constant() {
    let tap = |a: f64, u: f64| [a, u, 3.0 + 40.0 * u.powf(1.1) * a.powf(-1.3)];
    let mut taps: Vec<_> =
        (10..20).flat_map(|a| (1..5).map(move |u| tap(f64::from(a), f64::from(u)))).collect();
    taps[7][2] *= 1.5;
    let found = power(&taps, None, true).unwrap();
    assert!((found.power.p - 1.1).abs() < 0.01 && (found.power.q - 1.3).abs() < 0.02, "{found:?}");
    assert!((found.zero - 3.0).abs() < 0.2, "{found:?}");
    let tared: Vec<_> = taps.iter().map(|t| [t[0], t[1], t[2] - 3.0]).collect();
    let found = power(&tared, Some(0.0), true).unwrap();
    assert!((found.power.p - 1.1).abs() < 0.01 && (found.power.q - 1.3).abs() < 0.02, "{found:?}");
}
#[test]
fn the_end_of_a_cone_is_found_where_there_is_one() {
    let taps = |end: f64| -> Vec<[f64; 3]> {
        let tap = |a: f64, u: f64| [a, u, 40.0 * u * (1.0 / a - end) * (1.0 + 1e-3 * (9.0 * a + u).sin())];
        (20..40).step_by(2).flat_map(|a| (1..5).map(move |u| tap(f64::from(a), f64::from(u)))).collect()
    };
    let found = power(&taps(1.0 / 60.0), Some(0.0), true).unwrap().power;
    assert!((found.end * 60.0 - 1.0).abs() < 0.02 && found.q == 1.0, "{found:?}");
    assert_eq!(power(&taps(0.0), Some(0.0), true).unwrap().power.end, 0.0);
}

#[test]
fn swapped_labels_are_seen_and_noise_is_not() {
    let of = |labels: [f64; 4], noise: f64| {
        let row = |k: usize| {
            let a = [20.0, 30.0, 40.0, 50.0][k / 5];
            let y = 1.0 / a * (1.0 + noise * (7.0 * k as f64).sin());
            Row { a: labels[k / 5], u: 2.0, y, run: 0, t: 0.0 }
        };
        let rows: Vec<Row> = (0..20).map(row).collect();
        contradicted(&cells(&rows, &(0..20).collect::<Vec<_>>(), false))
    };
    assert_eq!(of([20.0, 30.0, 40.0, 50.0], 0.01), None);
    assert!((of([20.0, 30.0, 50.0, 40.0], 0.01).unwrap() - 1.25f64.ln()).abs() < 1e-12);
    assert_eq!(of([20.0, 30.0, 50.0, 40.0], 0.5), None);
}

#[test]
fn labels_are_set_better_than_positions_are_apart() {
    let of = |labels: &[f64]| {
        let row = |(k, a): (usize, &f64)| Row { a: *a, u: 1.0 + (k % 2) as f64, y: 1.0 / a, run: 0, t: 0.0 };
        let rows: Vec<Row> = labels.iter().enumerate().map(row).collect();
        prior(&cells(&rows, &(0..rows.len()).collect::<Vec<_>>(), false), false, None)
    };
    let usual = Prior::new(Hyper::Position.prior(false));
    // Two standard deviations are a fifth of the 7 % between these, 1 % of close ones, and no more than the prior of old.
    for (labels, two) in
        [(&[117.0, 126.0, 135.0, 144.0][..], 0.2 * 0.0692), (&[30.0, 30.1, 30.3, 30.4], 0.01)]
    {
        let found = of(labels);
        assert_eq!(Prior { above: usual.above, ..found }, usual);
        assert!(((found.median + 2.0 * found.above).exp() / two - 1.0).abs() < 1e-2, "{found:?}");
    }
    assert_eq!(of(&[10.0, 40.0]), usual);
    assert_eq!(of(&[30.0]), of(&[30.0, 30.0]));
}

#[test]
fn the_step_of_few_readings_is_that_of_the_converter() {
    let step = 0.00488;
    let readings: Vec<f64> = [12.0, 17.0, 30.0, 31.0, 77.0].map(|k| k * step + 0.3).to_vec();
    assert!((quantum(&readings) / step - 1.0).abs() < 1e-6);
    assert!((quantum(&[12.0, 18.0, 30.0, 96.0]) - 6.0).abs() < 1e-9);
    let smooth: Vec<f64> = (0..50).map(|k| (f64::from(k) * 1.7).sin()).collect();
    assert!(quantum(&smooth) < 1e-4);
}

#[test]
fn equal_rows_merge() {
    let row = |a: f64, y: f64, t: f64| Row { a, u: 2.0, y, run: 0, t };
    let rows = [row(20.0, 1.0, 0.0), row(30.0, 5.0, 1.0), row(20.0, 3.0, 2.0)];
    let merged = cells(&rows, &[0, 1, 2], false);
    assert_eq!(merged.len(), 2);
    assert_eq!((merged[0].row.y, merged[0].n, merged[0].squares, merged[0].row.t), (2.0, 2.0, 2.0, 1.0));
    assert_eq!(cells(&rows, &[0, 1, 2], true).len(), 3);
}

#[test]
fn quantiles_are_those_of_student() {
    // scipy.stats.t.ppf.
    for (x, freedom, t) in
        [(OF_95, 4.0, 2.776_445), (OF_95, 10.0, 2.228_139), (1.0, 4.0, 1.141_600), (1.0, 30.0, 1.017_0)]
    {
        let got = student(x, 1.0 / freedom);
        assert!((got / t - 1.0).abs() < 3e-3, "{x} {freedom}: {got} {t}");
    }
}

#[test]
fn tails_are_longer_the_less_the_variances_are_known() {
    let tails = |doubt: f64| {
        let mut all = Tails::default();
        all.0[0][0] = doubt;
        all
    };
    let parts = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(tails(0.0).longer(parts, 2.0), 1.0);
    let [little, much, most] = [0.1, 1.0, 1e9].map(|doubt| tails(doubt).longer(parts, 2.0));
    assert!(1.0 < little && little < much && much < most && most < 1.25, "{little} {much} {most}");
    // What does not move the reading is of no matter.
    assert_eq!(tails(1.0).longer([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], 2.0), 1.0);
}

fn curve(a: f64, u: f64) -> f64 {
    1e-2 * u.powf(1.02) * (30.0 / a).powf(2.2)
}

fn planner(positions: usize) -> Planner {
    let distances: Vec<f64> = (0..13).map(|k| 20.0 + 2.0 * f64::from(k)).collect();
    let rig = PlannedRig { noise: 1e-4, relative: 1e-3, position: 1e-3, visit: 1e-5, gain: 2e-3, zero: 1e-4 };
    let ask = Ask {
        curve: &curve,
        distances: &distances,
        drives: &[1.0, 2.0, 4.0],
        allowed: &|_, _| true,
        runs: 2,
        positions,
        rig,
    };
    Planner::new(&ask).unwrap()
}

#[test]
fn taps_are_taken_and_given_back() {
    let mut p = planner(99);
    let before = p.clone();
    (0..6).for_each(|_| p.grow());
    let sigma = p.sigma();
    assert!(sigma < before.sigma() && sigma > p.floor());
    assert!((p.with(p.chosen()).sigma() / sigma - 1.0).abs() < 1e-9);
    (0..6).for_each(|_| p.shrink());
    assert!((p.sigma() / before.sigma() - 1.0).abs() < 1e-6, "{} {}", p.sigma(), before.sigma());
}

#[test]
fn no_other_pair_is_better_by_two_per_cent() {
    let mut p = planner(99);
    (0..4).for_each(|_| p.grow());
    p.exchange();
    let (chosen, best) = (p.chosen(), p.sigma());
    let all = p.taps.clone();
    let mut least = f64::INFINITY;
    for k in 0..4 {
        for l in k + 1..4 {
            let rest: Vec<Tap> = (0..4).filter(|i| *i != k && *i != l).map(|i| chosen[i]).collect();
            let base = p.with(rest);
            for t in &all {
                let with = base.with(base.chosen().into_iter().chain([*t]));
                for u in &all {
                    let place = with.taps.iter().position(|x| x == u).unwrap();
                    least = least.min(with.floor + with.variance() - with.gain(place));
                }
            }
        }
    }
    assert!(best < 1.02 * least.sqrt(), "{best} {}", least.sqrt());
}

#[test]
fn fewer_positions_are_kept_to() {
    let mut p = planner(4);
    (0..24).for_each(|_| p.grow());
    p.exchange();
    let mut used: Vec<usize> = p.chosen().iter().map(|t| t[0]).collect();
    used.sort_unstable();
    used.dedup();
    assert!(used.len() == 4 && p.len() == 24, "{used:?}");
}
