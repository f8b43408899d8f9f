//! Intervals of simulated objects, whose distances are known, and what one more tap brings.

use nalgebra::{DMatrix, DVector};
use vibrissa_learned::base::{Base, Power};
use vibrissa_learned::columns::{Scales, Term};
use vibrissa_learned::curve::{Curve, Spread, Tails};
use vibrissa_learned::invert::Inverse;
use vibrissa_learned::joint::{Course, Joint, Object, Outlook, Stroke, Tap};

/// What a stroke may deviate by from straight lines between the touch and the calibrated drives, as shares of the signal, and beyond the largest one.
const TOE: f64 = 0.05;
const BEND: f64 = 0.01;
const BEYOND: f64 = 0.5;
/// Standard deviation of the drive at which contact begins.
const OFFSET: f64 = 0.05;

/// A sequence of numbers between 0 and 1, and normal ones.
struct Dice(u64);

impl Dice {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let r = (-2.0 * self.uniform().ln()).sqrt();
        r * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

fn curve(spread: Spread) -> Curve {
    let scales = Scales {
        a: [31.7_f64.ln(), (45.0_f64 / 22.4).ln() / 2.0],
        u: [2.5_f64.ln(), 0.7],
        // Of the largest drive, 3 % are the offset where it is not learned.
        sizes: [32.0, OFFSET / 0.03],
        offset: 0.0,
    };
    Curve {
        unit: 1.0,
        base_unit: 1.0,
        zero: 0.0,
        scales,
        terms: vec![Term::Curve(0, 0), Term::Curve(1, 0)],
        mean: vec![1.0, 0.0],
        deviations: vec![vec![0.01, 0.0], vec![0.0, 0.005]],
        spread,
        tails: Tails::default(),
    }
}

fn made(spread: Spread, strokes: bool) -> (Curve, Inverse, Joint) {
    let (curve, base) = (curve(spread), Base::Power(POWER));
    let inverse = Inverse::new(&curve, &base, (false, [0.0, f64::INFINITY]), None);
    let joint = Joint::new(&curve, &base, false, &inverse, strokes);
    (curve, inverse, joint)
}

const POWER: Power = Power { offset: 0.0, p: 1.0, q: 1.5, end: 0.0 };

#[test]
fn intervals_of_several_taps_hold_what_they_promise() {
    // Signals are some 0.01; noise is as large as what all taps share.
    let size = 2.5 * 32.0_f64.powf(-1.5);
    let spread =
        Spread { floor: (0.02 * size).powi(2), gain: 4e-4, zero: (0.01 * size).powi(2), ..Spread::default() };
    let (curve, _, joint) = made(spread, false);
    let [near, far] = [0, 1].map(|k| {
        let [middle, half] = curve.scales.a;
        if k == 0 { (middle - half).exp() } else { (middle + half).exp() }
    });
    let mut dice = Dice(7);
    // From one place of the base, or from three.
    for (n, shifts) in [(1, [0.0; 3]), (2, [0.0; 3]), (5, [0.0; 3]), (16, [0.0; 3]), (5, [2.0, 6.0, -3.0])] {
        const OBJECTS: usize = 1500;
        let (mut inside, mut beyond, mut squares, mut sigmas) = (0, 0, 0.0, 0.0);
        for _ in 0..OBJECTS {
            // Within the calibrated distances from everywhere.
            let [least, most] = [near + f64::max(shifts[1], 0.0), far + f64::min(shifts[2], 0.0)];
            let a: f64 = least + (most - least) * dice.uniform();
            let [c0, c1, gain, zero] = std::array::from_fn(|_| dice.normal());
            let mut object = Object::new(&joint, false);
            for k in 0..n {
                let (u, shift) = (1.3 + 3.5 * dice.uniform(), shifts[k % 3]);
                let x = curve.scales.place(a - shift, 2.5)[0];
                let factor = 1.0 + 0.01 * c0 + 0.005 * c1 * x + 0.02 * gain;
                let y = POWER.value(a - shift, u) * factor + size * (0.01 * zero + 0.02 * dice.normal());
                object.add(Tap { u, y, of_zero: 0.0, zero: 0, shift });
            }
            let told = object.told().unwrap();
            let z = (told.a - a) / told.sigma;
            inside += usize::from(z.abs() < 1.0);
            beyond += usize::from(z.abs() > 3.0);
            squares += (told.a - a).powi(2);
            sigmas += told.sigma.powi(2);
        }
        // 99 % of a binomial: 1 500 objects within 1 σ ± 3.1 %.
        let share = inside as f64 / OBJECTS as f64;
        assert!((share - 0.683).abs() < 0.031, "{n} taps: {share} within one sigma");
        assert!(beyond <= 13, "{n} taps: {beyond} beyond three");
        let ratio = (squares / sigmas).sqrt();
        assert!((ratio - 1.0).abs() < 0.08, "{n} taps: errors are {ratio} of sigma");
    }
}

#[test]
fn intervals_of_strokes_hold_what_they_promise() {
    const STROKES: usize = 600;
    let size = 2.5 * 32.0_f64.powf(-1.5);
    let spread = Spread {
        floor: (0.01 * size).powi(2),
        relative: 1e-4,
        gain: 4e-4,
        zero: (0.01 * size).powi(2),
        ..Spread::default()
    };
    let (curve, inverse, joint) = made(spread, true);
    let [middle, half] = curve.scales.a;
    let [near, far] = [(middle - half).exp(), (middle + half).exp()];
    let ends = [f64::min, f64::max].map(|of| inverse.nodes.iter().copied().reduce(of).unwrap().exp());
    let mut dice = Dice(11);
    let (mut inside, mut inside95, mut touched) = (0, 0, 0);
    for _ in 0..STROKES {
        let a = near + (far - near) * dice.uniform();
        let touch = 0.3 + 1.2 * dice.uniform();
        let [c0, c1, gain, zero, by_tap, off, toe, bend, end] = std::array::from_fn(|_| dice.normal());
        // Contact begins at minus the offset, and goes straight to the smallest calibrated drive, and from the largest one on, both about.
        let offset = OFFSET * off;
        let [from, to] = ends.map(|v| v + offset);
        let factor =
            1.0 + 0.01 * c0 + 0.005 * c1 * curve.scales.place(a, 2.5)[0] + 0.02 * gain + 0.01 * by_tap;
        let signal = |since: f64| match since {
            s if s > to => factor * POWER.value(a, ends[1]) * s / to * (1.0 + BEYOND * (1.0 - to / s) * end),
            s if s >= from => factor * POWER.value(a, s - offset),
            s => {
                let t = s / from;
                factor * POWER.value(a, ends[0]) * t * (1.0 + (1.0 - t) * (TOE * toe + BEND * t * bend))
            }
        };
        let mut s = Stroke::default();
        for u in (0..60).map(|k| 0.1 * f64::from(k)) {
            s.add(u, signal((u - touch).max(0.0)) + size * (0.01 * zero + 0.01 * dice.normal()));
        }
        let course = Course { same_run: false, of_zero: 0.0, least: -0.3, nuisances: &[] };
        let told = s.told(&joint, course).unwrap();
        inside += usize::from(told.a[1] < a && a < told.a[3]);
        inside95 += usize::from(told.a[0] < a && a < told.a[4]);
        touched += usize::from((told.touch[0] - touch).abs() < 2.0 * told.touch[1]);
    }
    let share = |n: usize| n as f64 / STROKES as f64;
    // 99 % of a binomial. The posterior of the touch is no bell, as the signal has a kink there.
    assert!(
        (share(inside) - 0.683).abs() < 0.049 && (share(inside95) - 0.95).abs() < 0.023,
        "{inside} {inside95}"
    );
    assert!(share(touched) > 0.92, "{touched}");
}

#[test]
fn an_outlook_is_what_taps_would_bring() {
    let size = 2.5 * 32.0_f64.powf(-1.5);
    let spread = Spread { floor: (0.01 * size).powi(2), gain: 1e-4, zero: 1e-8, ..Spread::default() };
    let (curve, _, joint) = made(spread, false);
    // Signal, variance of its noise, and change by each shared number, last by the error of the zero.
    let of = |a: f64, tap: &Tap| {
        let mut shared = Vec::new();
        let [signal, noise] = curve.moved(&Base::Power(POWER), (a, tap.u), false, &mut shared);
        shared.push(tap.of_zero.sqrt());
        (signal, noise, DVector::from_vec(shared))
    };
    let (mut object, mut taps) = (Object::new(&joint, false), Vec::new());
    for _ in 0..3 {
        let outlook = Outlook::new(&object);
        for (u, times) in [(1.5, 1), (4.0, 1), (4.0, 64)] {
            let (mut sum, mut total) = (0.0, 0.0);
            let of_zero = if taps.is_empty() { 0.0 } else { 1e-9 };
            for (x, share) in &outlook.likely {
                // The signal that is most likely if the object is there.
                let next = Tap { u, y: 0.0, of_zero, zero: 0, shift: 0.0 };
                let (signal, _, shared) = of(x.exp(), &next);
                let n = shared.len();
                let (mut a, mut b) = (DMatrix::identity(n, n), DVector::zeros(n));
                for tap in &taps {
                    let (m, d, l) = of(x.exp(), tap);
                    a += &l * l.transpose() / d;
                    b += l * ((tap.y - m) / d);
                }
                let y = signal + shared.dot(&a.cholesky().unwrap().solve(&b));
                let mut then = object.clone();
                (0..times).for_each(|_| then.add(Tap { y, ..next }));
                sum += share * Outlook::new(&then).spread;
                total += share;
            }
            let (found, expected) = (outlook.after(u, 0.0, f64::from(times)), sum / total);
            assert!((found / expected - 1.0).abs() < 1e-6, "{} taps, {u}: {found} {expected}", taps.len());
        }
        let tap = Tap { u: 3.0, y: 1.01 * POWER.value(31.0, 3.0), of_zero: 1e-9, zero: 0, shift: 0.0 };
        object.add(tap);
        taps.push(tap);
    }
}
