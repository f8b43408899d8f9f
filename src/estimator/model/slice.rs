//! The curve of a surface at one drive, and its roots.

use super::surface::NODES;
use crate::physics::chebyshev::{scaled, series};
use crate::physics::linear::StrainCurve;
use crate::physics::root::bracketed;

/// Points of a piece between which roots are looked for.
const LOOKS: usize = 12;

/// |ε| over a at one drive.
#[derive(Debug, Clone)]
pub struct Slice {
    curve: StrainCurve,
    amount: f64,
    pieces: Vec<([f64; 2], [f64; NODES[0]])>,
    /// Smallest u with a solution; 0 where nothing was cut off.
    end: f64,
    /// (u, ε) at points between which there is at most one extremum.
    looks: Vec<(f64, f64)>,
}

impl Slice {
    pub(super) fn new(
        curve: StrainCurve,
        amount: f64,
        pieces: Vec<([f64; 2], [f64; NODES[0]])>,
        end: f64,
    ) -> Self {
        let mut slice = Self { curve, amount, pieces, end, looks: Vec::new() };
        let mut looks = Vec::with_capacity(LOOKS * slice.pieces.len() + 1);
        for (i, (u, _)) in slice.pieces.iter().enumerate() {
            let from = usize::from(i > 0);
            looks.extend((from..=LOOKS).map(|k| {
                let u = u[0] + (u[1] - u[0]) * (k as f64 / LOOKS as f64);
                (u, slice.at(u).0)
            }));
        }
        slice.looks = looks;
        slice
    }

    /// ε and dε/du.
    fn at(&self, u: f64) -> (f64, f64) {
        let piece = self.pieces.iter().find(|(range, _)| u <= range[1]).or(self.pieces.last());
        let Some((range, c)) = piece else { return (f64::NAN, f64::NAN) };
        let (r, dr) = series(c, scaled(*range, u));
        let dr = dr * 2.0 / (range[1] - range[0]);
        let (f, df) = self.curve.at_inverse(u);
        (self.amount * f * r, self.amount * (df * r + f * dr))
    }

    /// Strain at a, mm; NaN where the model has none.
    pub fn value(&self, a: f64) -> f64 {
        let u = 1.0 / a;
        if u >= self.end { self.at(u).0 } else { f64::NAN }
    }

    /// The smallest strain beyond the peak: a smaller one comes from farther out than the distances `to` which it is known.
    pub fn weakest(&self, to: f64) -> f64 {
        self.at((1.0 / to).max(self.end)).0
    }

    /// dε/da, 1/mm.
    pub fn slope(&self, a: f64) -> f64 {
        -self.at(1.0 / a).1 / (a * a)
    }

    /// The largest distance with this strain, and the next one; `None` where there is none within reach.
    pub fn roots(&self, strain: f64) -> Option<(f64, Option<f64>)> {
        let mut found = [None; 2];
        let mut next = 0;
        let mut take = |lo: f64, hi: f64| {
            if next < 2 {
                found[next] = Some(1.0 / bracketed(|u| self.at(u).0 - strain, lo, hi));
                next += 1;
            }
        };
        for (i, w) in self.looks.windows(2).enumerate() {
            let ((lo, e), (hi, f)) = (w[0], w[1]);
            if e.is_nan() || f.is_nan() {
                continue;
            }
            if (e <= strain) != (f <= strain) {
                take(lo, hi);
            } else if e < strain && self.may_peak(i) {
                // Both ends lie below; the peak between them may lie above.
                let (slope_lo, slope_hi) = (self.at(lo).1, self.at(hi).1);
                if slope_lo > 0.0 && slope_hi < 0.0 {
                    let peak = bracketed(|u| self.at(u).1, lo, hi);
                    if self.at(peak).0 >= strain {
                        take(lo, peak);
                        take(peak, hi);
                    }
                }
            }
        }
        found[0].map(|far| (far, found[1]))
    }

    /// Whether the strain may have a maximum after look `i`.
    fn may_peak(&self, i: usize) -> bool {
        let at = |k: usize| self.looks.get(k).map_or(f64::NEG_INFINITY, |l| l.1);
        let before = if i == 0 { f64::NEG_INFINITY } else { at(i - 1) };
        at(i).max(at(i + 1)) >= before.max(at(i + 2))
    }
}
