//! The rod, its gauge and its estimate at one distance.

use super::{Distance, Lanes, PLACES, SQUARES, Scratch, Tables};
use crate::cpu::pack::Pack;

/// A whisker with its gauge, mm and 1/mm.
#[derive(Clone, Copy)]
pub(super) struct Whisker<T> {
    pub diameter: T,
    pub tau: T,
    pub length: T,
    /// x1, x2.
    pub gauge: [T; 2],
}

/// A tap as a series over t, or at its own square.
#[derive(Clone, Copy, Default)]
pub(super) struct Tap<T> {
    /// (K − 1)/θ².
    pub kappa: [T; SQUARES],
    /// δ/θ².
    pub deviation: [T; SQUARES],
    /// (c/a − 1)/θ².
    pub arc: [T; SQUARES],
    /// Largest |δ|.
    pub largest: T,
    /// f, per radian.
    pub strain: T,
    /// F₀, φ, β of the estimate.
    pub value: T,
    pub slope: T,
    pub beta: T,
    /// (3D/4a) b1 b2: f is this times (1 + η − p)(A − β(1 + η)).
    pub unit: T,
}

impl Tables {
    /// The chart at each lane's own square.
    #[inline(always)]
    pub(super) fn read<const FMA: bool>(&self, square: Lanes<FMA>, own: &mut [Lanes<FMA>]) {
        let m = self.squares.len();
        let x = square * Lanes::<FMA>::of(2.0 / f64::from(self.square)) - Lanes::<FMA>::of(1.0);
        let mut basis = [Lanes::<FMA>::of(1.0); SQUARES];
        basis[1] = x;
        for k in 2..m {
            basis[k] = (x + x) * basis[k - 1] - basis[k - 2];
        }
        for c in own.iter_mut() {
            *c = Lanes::<FMA>::of(0.0);
        }
        for (values, basis) in self.values.iter().zip(&basis) {
            for (f, c) in values.iter().enumerate() {
                for (sum, c) in own[f * self.terms..].iter_mut().zip(c) {
                    *sum = basis.mul_add(Pack::splat(*c), *sum);
                }
            }
        }
    }

    /// The tap of `design` at `distance`, over t or at `square`.
    #[inline(always)]
    pub(super) fn tap<const FMA: bool, const OWN: bool>(
        &self,
        design: &Whisker<Lanes<FMA>>,
        square: Lanes<FMA>,
        distance: &Distance,
        at: usize,
        scratch: &mut Scratch<FMA>,
    ) {
        let of = Lanes::<FMA>::of;
        let (one, inverse) = (of(1.0), Pack::splat(distance.inverse));
        let p = design.tau * Pack::splat(distance.a);
        let rest = one - p;
        let [s1, s2] = [design.gauge[0] * inverse, design.gauge[1] * inverse];
        let (u1, u2) = (one - p * s1, one - p * s2);
        let (near, far) = (one - s1, one - s2);

        // Means of the polynomials over s with the weight 1/(1 − ps)³.
        let mut means = [of(0.0); PLACES];
        for &(point, weight) in &self.gauge {
            let s = (s2 - s1).mul_add(Pack::splat(point), s1);
            let u = one - p * s;
            let w = Pack::splat(weight) / (u * u * u);
            let x = s.mul_add(Pack::splat(self.place[0]), Pack::splat(self.place[1]));
            let twice = x + x;
            let (mut before, mut now) = (w, w * x);
            for sum in &mut means[..self.places] {
                *sum = *sum + before;
                (before, now) = (now, twice * now - before);
            }
        }
        let whole = one / means[0];
        for mean in &mut means[..self.places] {
            *mean = *mean * whole;
        }

        let x = (one / rest).mul_add(Pack::splat(self.stiffness[0]), Pack::splat(self.stiffness[1]));
        let twice = x + x;
        let (mut before, mut now) = (one, x);
        for basis in &mut scratch.basis {
            *basis = before;
            (before, now) = (now, twice * now - before);
        }
        let lever = near * u2 + far * u1;
        let ratio = (u1 + u2) / lever;
        let m = self.carried::<OWN>();
        let tap = &mut scratch.taps[at];
        let (mut force, mut excess) = ([of(0.0); SQUARES], [of(0.0); SQUARES]);
        for k in 0..m {
            let (values, own) = (&self.values[k], &scratch.own);
            force[k] = series::<FMA, OWN>(values, own, &scratch.basis, 0);
            tap.arc[k] = series::<FMA, OWN>(values, own, &scratch.basis, 1);
            let mut shortening = of(0.0);
            for s in 0..self.places {
                shortening =
                    series::<FMA, OWN>(values, own, &scratch.basis, 2 + s).mul_add(means[s], shortening);
            }
            excess[k] = tap.arc[k] - shortening;
        }
        // δ and K − 1 are no longer linear in the series: through the points over t.
        let (mut deviation, mut kappa) = ([of(0.0); SQUARES], [of(0.0); SQUARES]);
        tap.largest = of(0.0);
        for n in 0..m {
            let (mut w, mut z, mut t) = (force[0], excess[0], square);
            if !OWN {
                t = Pack::splat(self.squares[n]);
                for k in 1..m {
                    let basis = Pack::splat(self.at_squares[n][k]);
                    w = basis.mul_add(force[k], w);
                    z = basis.mul_add(excess[k], z);
                }
            }
            deviation[n] = (t.mul_add(w, one) * ratio).mul_add(z, w);
            let delta = t * deviation[n];
            kappa[n] = of(0.0) - deviation[n] / (one + delta);
            tap.largest = tap.largest.max(delta.abs());
        }
        for k in 0..m {
            if OWN {
                (tap.deviation[k], tap.kappa[k]) = (deviation[k], kappa[k]);
                continue;
            }
            let first = Pack::splat(self.from_squares[k][0]);
            let (mut d, mut q) = (first * deviation[0], first * kappa[0]);
            for n in 1..m {
                let back = Pack::splat(self.from_squares[k][n]);
                d = back.mul_add(deviation[n], d);
                q = back.mul_add(kappa[n], q);
            }
            (tap.deviation[k], tap.kappa[k]) = (d, q);
        }

        // f of the linear theory, and the quadratic of its inverse; b = b1 b2.
        let b = one / (u1 * u2);
        tap.unit = of(0.75) * design.diameter * inverse * b;
        tap.beta = (s1 * u2 + s2 * u1) * b;
        tap.value = rest * lever * b;
        tap.slope = lever * b - tap.beta * rest;
        tap.strain = tap.unit * tap.value;
    }
}

/// Function `f` of the chart over the basis.
#[inline(always)]
fn series<const FMA: bool, const OWN: bool>(
    values: &[Vec<f32>],
    own: &[Lanes<FMA>],
    basis: &[Lanes<FMA>],
    f: usize,
) -> Lanes<FMA> {
    let n = basis.len();
    let mut sum = Lanes::<FMA>::of(0.0);
    if OWN {
        for (c, b) in own[f * n..(f + 1) * n].iter().zip(basis) {
            sum = c.mul_add(*b, sum);
        }
    } else {
        for (c, b) in values[f].iter().zip(basis) {
            sum = b.mul_add(Pack::splat(*c), sum);
        }
    }
    sum
}
