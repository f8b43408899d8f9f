use super::*;
use crate::base::Power;
use crate::columns::{Scales, Term};
use crate::curve::Spread;
use crate::tails::Tails;

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
        sizes: [32.0, 5.0],
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

const POWER: Power = Power { offset: 0.0, p: 1.0, q: 1.5, end: 0.0 };

#[test]
fn an_outlook_is_what_taps_would_bring() {
    let size = 2.5 * 32.0_f64.powf(-1.5);
    let spread = Spread { floor: (0.01 * size).powi(2), gain: 1e-4, zero: 1e-8, ..Spread::default() };
    let curve = curve(spread);
    let base = Base::Power(POWER);
    let inverse = Inverse::new(&curve, &base, false, [0.0, f64::INFINITY]);
    let joint = Joint::new(&curve, &base, false, &inverse);
    let mut object = Object::new(&joint);
    for taps in 0..3 {
        let outlook = Outlook::new(&joint, &object, false);
        for (u, times) in [(1.5, 1.0), (4.0, 1.0), (4.0, 64.0)] {
            let (mut sum, mut total) = (0.0, 0.0);
            for (x, share) in outlook.likely() {
                let then = |y: f64| {
                    let mut then = object.clone();
                    let of_zero = if taps > 0 { 1e-9 } else { 0.0 };
                    then.weigh(&joint, Tap { u, y, of_zero, zero: 0, shift: 0.0 }, false, times);
                    then
                };
                // The signal that is most likely if the object is there: the top of a parabola.
                let (m, h) = (joint.signal(u, *x), 0.01 * size);
                let [p, q, r] = [m - h, m, m + h].map(|y| modes::at(&joint, &then(y).heights(&joint), *x));
                let most = m + 0.5 * h * (r - p) / (2.0 * q - p - r);
                sum += share * Outlook::new(&joint, &then(most), false).spread();
                total += share;
            }
            let (found, expected) = (outlook.after(u, 0.0, times), sum / total);
            assert!((found / expected - 1.0).abs() < 1e-6, "{taps} taps, {u}: {found} {expected}");
        }
        object.add(
            &joint,
            Tap { u: 3.0, y: 1.01 * POWER.value(31.0, 3.0), of_zero: 1e-9, zero: 0, shift: 0.0 },
            false,
        );
    }
}

#[test]
fn what_all_taps_share_no_next_tap_takes_away() {
    // A gain of one per cent, and hardly any noise.
    let size = 2.5 * 32.0_f64.powf(-1.5);
    for noise in [1e-3, 1e-5, 1e-6] {
        let curve = curve(Spread { floor: (noise * size).powi(2), gain: 1e-4, ..Spread::default() });
        let base = Base::Power(POWER);
        let inverse = Inverse::new(&curve, &base, true, [0.0, f64::INFINITY]);
        let joint = Joint::new(&curve, &base, true, &inverse);
        let mut object = Object::new(&joint);
        let mut dice = Dice(3);
        for k in 0..60 {
            let u = 1.5 + 0.5 * f64::from(k % 6);
            let y = 1.012 * POWER.value(31.0, u) + noise * size * dice.normal();
            object.add(&joint, Tap { u, y, of_zero: 0.0, zero: 0, shift: 0.0 }, false);
            if [1, 3, 10, 30, 60].contains(&(k + 1)) {
                let outlook = Outlook::new(&joint, &object, false);
                let now = outlook.spread();
                for (u, times) in [(1.5, 1.0), (4.0, 1.0), (4.0, 8.0), (4.0, 1e4)] {
                    let then = outlook.after(u, 0.0, times);
                    assert!((0.95..1.02).contains(&(then / now)), "{noise} {k} {u} {times}: {then} of {now}");
                }
            }
        }
    }
}
