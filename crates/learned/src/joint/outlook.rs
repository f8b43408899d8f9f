//! Expected benefit of one more tap of an object.
//!
//! A tap at drive u adds α l lᵀ to A and α r l to b (shared numbers l, residual r, α = 1/d). With k = lᵀ A⁻¹ l and the expected residual
//! e = lᵀ A⁻¹ b, −2 ln p rises by α (r − e)²/(1 + α k) + ln(1 + α k) + ln d, so A is factored once. n more taps at one drive count as their mean,
//! α = n/d; the information in their scatter is neglected.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::object::{Object, likely, spread_of};
use super::{Joint, NEAR};
use crate::invert::lagrange;

/// Points whose ln p is this far below the maximum (7 σ) are skipped, unless near a higher point.
const UNLIKELY: f64 = 25.0;

/// The inverse of the factor of A, and A⁻¹ b, at a point.
struct Known {
    root: DMatrix<f64>,
    solved: DVector<f64>,
}

/// State of an object before one more tap.
pub struct Outlook<'a> {
    joint: &'a Joint,
    same_run: bool,
    heights: Vec<f64>,
    likely: Vec<(f64, f64)>,
    of_zero: f64,
    /// Range of the points that count; `known` is `None` for points in it that do not count.
    points: Range<usize>,
    known: Vec<Option<Known>>,
}

impl<'a> Outlook<'a> {
    /// State after the taps of `object`; `same_run` if the next taps are of a run of the calibration.
    pub fn new(joint: &'a Joint, object: &Object, same_run: bool) -> Self {
        let heights = object.heights(joint);
        let likely = likely(joint, &heights);
        let of = |(factor, b): (Cholesky<f64, Dyn>, DVector<f64>)| {
            let n = b.len();
            let root = factor.l_dirty().solve_lower_triangular(&DMatrix::identity(n, n))?;
            Some(Known { root, solved: factor.solve(&b) })
        };
        let counts = counting(&heights);
        let ends = counts.iter().position(|c| *c).zip(counts.iter().rposition(|c| *c));
        let points = ends.map_or(0..0, |(first, last)| first..last + 1);
        let known =
            points.clone().map(|k| if counts[k] { object.factor(k).and_then(of) } else { None }).collect();
        Self { joint, same_run, likely, of_zero: object.of_zero, points, known, heights }
    }

    /// RMS deviation from the mean of the present posterior, mm.
    pub fn spread(&self) -> f64 {
        spread_of(self.joint, &self.heights)
    }

    /// Nodes in ln a that represent the posterior, from the base of the first tap, with their shares.
    pub fn likely(&self) -> &[(f64, f64)] {
        &self.likely
    }

    /// Expected [`Self::spread`] after `times` more taps at drive `u`, with the base shifted by `shift` mm from the first tap.
    pub fn after(&self, u: f64, shift: f64, times: f64) -> f64 {
        let width = self.joint.width();
        let slice = self.joint.shifted(u, shift, self.same_run, self.points.clone());
        let mut shared = DVector::from_element(width - 1, self.of_zero.sqrt());
        let of = |(point, known): (&[f64], &Option<Known>)| {
            let Some(Known { root, solved }) = known else { return [f64::NAN; 4] };
            shared.rows_mut(0, width - 2).copy_from_slice(&point[2..]);
            let alpha = times / point[1];
            [point[0], solved.dot(&shared), alpha, alpha * (root * &shared).norm_squared()]
        };
        let points: Vec<[f64; 4]> = slice.chunks(width).zip(&self.known).map(of).collect();
        let logs: Vec<f64> =
            points.iter().zip(slice.chunks(width)).map(|(p, s)| (1.0 + p[3]).ln() + s[1].ln()).collect();
        let (mut sum, mut total) = (0.0, 0.0);
        for (x, share) in &self.likely {
            // The shared numbers estimated from the taps so far also move the next tap.
            let y = self.joint.signal(u, self.joint.seen(*x, shift)) + self.beside(*x, &points);
            let rise = |([signal, expected, alpha, k], ln): (&[f64; 4], &f64)| {
                alpha * (y - signal - expected).powi(2) / (1.0 + k) + ln
            };
            let rises: Vec<f64> = points.iter().zip(&logs).map(rise).collect();
            // Keep points that do not count far below the others.
            let least = rises.iter().copied().fold(f64::INFINITY, f64::min);
            let mut heights: Vec<f64> = self.heights.iter().map(|h| h - 0.5 * least).collect();
            let own = self.points.clone().zip(rises).filter(|(_, rise)| !rise.is_nan());
            own.for_each(|(k, rise)| heights[k] = self.heights[k] - 0.5 * rise);
            sum += share * spread_of(self.joint, &heights);
            total += share;
        }
        sum / total
    }

    /// Expected residual at ln a = x, interpolated from `points`; from the nearest point if not all around count.
    fn beside(&self, x: f64, points: &[[f64; 4]]) -> f64 {
        let (first, t) = self.joint.place(x);
        let at = |k: usize| {
            k.checked_sub(self.points.start).and_then(|k| points.get(k)).map_or(f64::NAN, |p| p[1])
        };
        let near: [f64; NEAR] = std::array::from_fn(|i| at(first + i));
        let sum: f64 = lagrange::<NEAR>(t).iter().zip(near).map(|(w, e)| w * e).sum();
        if sum.is_finite() {
            return sum;
        }
        let known = near.iter().enumerate().filter(|(_, e)| e.is_finite());
        let off = |i: usize| (i as f64 - t).abs();
        known.min_by(|(i, _), (k, _)| off(*i).total_cmp(&off(*k))).map_or(0.0, |(_, e)| *e)
    }
}

fn counting(heights: &[f64]) -> Vec<bool> {
    let top = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let around = |k: usize| &heights[k.saturating_sub(NEAR)..(k + NEAR + 1).min(heights.len())];
    (0..heights.len()).map(|k| around(k).iter().any(|h| *h >= top - UNLIKELY)).collect()
}
