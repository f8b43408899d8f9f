use super::*;
use crate::base::Power;
use crate::columns::{Scales, Term};
use crate::curve::{Spread, Tails};

#[test]
fn an_outlook_is_what_taps_would_bring() {
    let size = 2.5 * 32.0_f64.powf(-1.5);
    let spread = Spread { floor: (0.01 * size).powi(2), gain: 1e-4, zero: 1e-8, ..Spread::default() };
    let scales = Scales {
        a: [31.7_f64.ln(), (45.0_f64 / 22.4).ln() / 2.0],
        u: [2.5_f64.ln(), 0.7],
        sizes: [32.0, 5.0],
        offset: 0.0,
    };
    let curve = Curve {
        unit: 1.0,
        base_unit: 1.0,
        zero: 0.0,
        scales,
        terms: vec![Term::Curve(0, 0), Term::Curve(1, 0)],
        mean: vec![1.0, 0.0],
        deviations: vec![vec![0.01, 0.0], vec![0.0, 0.005]],
        spread,
        tails: Tails::default(),
    };
    let power = Power { offset: 0.0, p: 1.0, q: 1.5, end: 0.0 };
    let base = Base::Power(power);
    let inverse = Inverse::new(&curve, &base, (false, [0.0, f64::INFINITY]), None);
    let joint = Joint::new(&curve, &base, false, &inverse, false);
    let mut object = Object::new(&joint, false);
    for taps in 0..3 {
        let outlook = Outlook::new(&object);
        for (u, times) in [(1.5, 1.0), (4.0, 1.0), (4.0, 64.0)] {
            let (mut sum, mut total) = (0.0, 0.0);
            for (x, share) in &outlook.likely {
                let then = |y: f64| {
                    let mut then = object.clone();
                    let of_zero = if taps > 0 { 1e-9 } else { 0.0 };
                    then.weigh(Tap { u, y, of_zero, zero: 0, shift: 0.0 }, times);
                    then
                };
                // The signal that is most likely if the object is there: the top of a parabola.
                let (m, h) = (joint.signal(u, *x), 0.01 * size);
                let [p, q, r] = [m - h, m, m + h].map(|y| object::at(&joint, &then(y).heights(), *x));
                let most = m + 0.5 * h * (r - p) / (2.0 * q - p - r);
                sum += share * Outlook::new(&then(most)).spread;
                total += share;
            }
            let (found, expected) = (outlook.after(u, 0.0, times), sum / total);
            assert!((found / expected - 1.0).abs() < 1e-6, "{taps} taps, {u}: {found} {expected}");
        }
        let y = 1.01 * power.value(31.0, 3.0);
        object.add(Tap { u: 3.0, y, of_zero: 1e-9, zero: 0, shift: 0.0 });
    }
}
