//! What one more tap of an object is expected to bring.
//!
//! A tap by the drive u adds α l lᵀ to A and α r l to b, where l are its shared numbers at ln a = x, r its residual there and α = 1/d. With
//! k = lᵀ A⁻¹ l and e = lᵀ A⁻¹ b, what the taps so far expect of that residual, −2 ln p rises by
//!
//! α (r − e)²/(1 + α k) + ln(1 + α k) + ln d,
//!
//! so that A is factored once, and a drive costs one solution for each point. Of n more taps by one drive their mean is the tap, with α = n/d: what their
//! scatter would tell of the distance is not counted.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::object::{Object, likely, spread_of};
use super::{Joint, NEAR, lagrange};

/// A point is not looked at whose ln p is so much below that of the highest one, seven standard deviations, and that has no neighbour that is above.
const UNLIKELY: f64 = 25.0;

/// Of a point.
struct Known {
    /// Inverse of Cholesky's factor of A, its lower triangle row by row.
    root: Vec<f64>,
    /// A⁻¹ b.
    solved: Vec<f64>,
}

impl Known {
    /// lᵀ A⁻¹ b and lᵀ A⁻¹ l.
    fn of(&self, shared: &[f64]) -> [f64; 2] {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (mut square, mut from) = (0.0, 0);
        for n in 1..=shared.len() {
            square += dot(&self.root[from..from + n], shared).powi(2);
            from += n;
        }
        [dot(&self.solved, shared), square]
    }
}

/// What an object is known by, from where one more tap is looked at.
pub struct Outlook<'a> {
    joint: &'a Joint,
    same_run: bool,
    heights: Vec<f64>,
    likely: Vec<(f64, f64)>,
    /// Variance that the zero brings, which the taps so far and the next ones are above.
    of_zero: f64,
    /// The first and the last point that count, and of each from one to the other what is known; of those that do not count nothing.
    points: Range<usize>,
    known: Vec<Option<Known>>,
}

impl<'a> Outlook<'a> {
    /// After the taps of `object`; the next ones are of a known run where `same_run`.
    pub fn new(joint: &'a Joint, object: &Object, same_run: bool) -> Self {
        let heights = object.heights(joint);
        let likely = likely(joint, &heights);
        let of = |(factor, b): (Cholesky<f64, Dyn>, DVector<f64>)| {
            let n = b.len();
            let root = factor.l_dirty().solve_lower_triangular(&DMatrix::identity(n, n))?;
            let root = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|at| root[at]).collect();
            Some(Known { root, solved: factor.solve(&b).as_slice().to_vec() })
        };
        let counts = counting(&heights);
        let points = counts
            .iter()
            .position(|c| *c)
            .map_or(0..0, |first| first..counts.iter().rposition(|c| *c).map_or(first, |last| last + 1));
        let known =
            points.clone().map(|k| if counts[k] { object.factor(k).and_then(of) } else { None }).collect();
        Self { joint, same_run, likely, of_zero: object.of_zero(), points, known, heights }
    }

    /// Expected root mean square deviation from the mean of the posterior so far, mm.
    pub fn spread(&self) -> f64 {
        spread_of(self.joint, &self.heights)
    }

    /// Places in ln a, from the base of the first tap, that stand for the posterior, with their shares.
    pub fn likely(&self) -> &[(f64, f64)] {
        &self.likely
    }

    /// The expected [`Self::spread`] after `times` more taps by the drive `u`, over what is likely now, the base `shift` mm nearer than for the first tap.
    pub fn after(&self, u: f64, shift: f64, times: f64) -> f64 {
        let width = self.joint.width();
        let slice = self.joint.shifted(u, shift, self.same_run, self.points.clone());
        let mut shared: Vec<f64> = vec![self.of_zero.sqrt(); width - 1];
        // Of each point: signal, what is expected beside it, and α, α k.
        let of = |(point, known): (&[f64], &Option<Known>)| {
            let Some(known) = known else { return [f64::NAN; 4] };
            shared[..width - 2].copy_from_slice(&point[2..]);
            let (alpha, [expected, k]) = (times / point[1], known.of(&shared));
            [point[0], expected, alpha, alpha * k]
        };
        let points: Vec<[f64; 4]> = slice.chunks(width).zip(&self.known).map(of).collect();
        let logs: Vec<f64> =
            points.iter().zip(slice.chunks(width)).map(|(p, s)| (1.0 + p[3]).ln() + s[1].ln()).collect();
        let (mut sum, mut total) = (0.0, 0.0);
        for (x, share) in &self.likely {
            // What the taps so far say of the shared numbers, if the object is there, is in the next tap too.
            let y = self.joint.signal(u, self.joint.seen(*x, shift)) + self.beside(*x, &points);
            let rise = |([signal, expected, alpha, k], ln): (&[f64; 4], &f64)| {
                alpha * (y - signal - expected).powi(2) / (1.0 + k) + ln
            };
            let rises: Vec<f64> = points.iter().zip(&logs).map(rise).collect();
            // A point that does not count stays far below the others.
            let least = rises.iter().copied().fold(f64::INFINITY, f64::min);
            let mut heights: Vec<f64> = self.heights.iter().map(|h| h - 0.5 * least).collect();
            let own = self.points.clone().zip(rises).filter(|(_, rise)| !rise.is_nan());
            own.for_each(|(k, rise)| heights[k] = self.heights[k] - 0.5 * rise);
            sum += share * spread_of(self.joint, &heights);
            total += share;
        }
        sum / total
    }

    /// What is expected at ln a = x beside the signal, of `points` whose second number it is; of the nearest one where not all around count.
    fn beside(&self, x: f64, points: &[[f64; 4]]) -> f64 {
        let (first, t) = self.joint.place(x);
        let at = |k: usize| {
            k.checked_sub(self.points.start).and_then(|k| points.get(k)).map_or(f64::NAN, |p| p[1])
        };
        let near: [f64; NEAR] = std::array::from_fn(|i| at(first + i));
        let sum: f64 = lagrange(t).iter().zip(near).map(|(w, e)| w * e).sum();
        if sum.is_finite() {
            return sum;
        }
        let known = near.iter().enumerate().filter(|(_, e)| e.is_finite());
        let off = |i: usize| (i as f64 - t).abs();
        known.min_by(|(i, _), (k, _)| off(*i).total_cmp(&off(*k))).map_or(0.0, |(_, e)| *e)
    }
}

/// Which points count: those that are likely, and their neighbours.
fn counting(heights: &[f64]) -> Vec<bool> {
    let top = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let around = |k: usize| &heights[k.saturating_sub(NEAR)..(k + NEAR + 1).min(heights.len())];
    (0..heights.len()).map(|k| around(k).iter().any(|h| *h >= top - UNLIKELY)).collect()
}
