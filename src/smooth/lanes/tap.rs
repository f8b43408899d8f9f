//! The rod, its gauge and its estimate at one distance.

use super::{Distance, Lanes, PLACES, SQUARES, Scratch, Tables};
use crate::kernel::cpu::pack::Pack;

/// A whisker with its gauge, mm and 1/mm.
#[derive(Clone, Copy)]
pub(super) struct Whisker<T> {
    pub diameter: T,
    pub tau: T,
    pub length: T,
    /// x1, x2.
    pub gauge: [T; 2],
}

/// A tap at every square of the chart, or at its own.
#[derive(Clone, Copy, Default)]
pub(super) struct Tap<T> {
    /// (K − 1)/θ².
    pub kappa: [T; SQUARES],
    /// δ/θ².
    pub deviation: [T; SQUARES],
    /// (c/a − 1)/θ².
    pub arc: [T; SQUARES],
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
        let mut basis = [Lanes::<FMA>::of(0.0); SQUARES];
        for k in 0..m {
            let (mut l, mut scale) = (Lanes::<FMA>::of(1.0), 1.0);
            for j in 0..m {
                if j != k {
                    l = l * (square - Pack::splat(self.squares[j]));
                    scale *= f64::from(self.squares[k]) - f64::from(self.squares[j]);
                }
            }
            basis[k] = l * Lanes::<FMA>::of(1.0 / scale);
        }
        for i in 0..own.len() {
            let mut sum = basis[0] * Pack::splat(self.values[0][i]);
            for k in 1..m {
                sum = basis[k].mul_add(Pack::splat(self.values[k][i]), sum);
            }
            own[i] = sum;
        }
    }

    /// The tap of `design` at `distance`, at the squares of the chart or at `square`.
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
        let tap = &mut scratch.taps[at];
        for k in 0..self.carried::<OWN>() {
            let (values, own) = (&self.values[k], &scratch.own);
            let force = series::<FMA, OWN>(values, own, &scratch.basis, 0);
            let arc = series::<FMA, OWN>(values, own, &scratch.basis, 1);
            let mut shortening = of(0.0);
            for s in 0..self.places {
                shortening =
                    series::<FMA, OWN>(values, own, &scratch.basis, 2 + s).mul_add(means[s], shortening);
            }
            let t = if OWN { square } else { Pack::splat(self.squares[k]) };
            let growth = t.mul_add(force, one);
            let deviation = (growth * ratio).mul_add(arc - shortening, force);
            tap.deviation[k] = deviation;
            tap.arc[k] = arc;
            tap.kappa[k] = of(0.0) - deviation / t.mul_add(deviation, one);
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
    values: &[f32],
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
        for (c, b) in values[f * n..(f + 1) * n].iter().zip(basis) {
            sum = b.mul_add(Pack::splat(*c), sum);
        }
    }
    sum
}
