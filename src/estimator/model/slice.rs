//! The curve of a surface at one drive, and its roots.

use std::sync::LazyLock;

use super::surface::NODES;
use crate::physics::chebyshev::{basis, placed, scaled, series, transpose};
use crate::physics::linear::StrainCurve;
use crate::physics::root::bracketed;

/// Steps of a piece between whose ends roots are looked for.
pub(super) const LOOKS: usize = 12;
/// T_i at the looks of a piece: row i, column of the look.
static AT_LOOKS: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| {
    let at = |k| basis(NODES[0], look([-1.0, 1.0], k));
    transpose(&(0..=LOOKS).map(at).collect::<Vec<_>>())
});

/// Look `k` of a piece over `range`.
pub(super) fn look(range: [f64; 2], k: usize) -> f64 {
    placed(range, 2.0 * k as f64 / LOOKS as f64 - 1.0)
}

/// A piece of a surface at one drive: the ratio to linear theory over an interval of u.
#[derive(Debug, Clone)]
pub(super) struct Cut {
    pub(super) u: [f64; 2],
    pub(super) coefficients: [f64; NODES[0]],
}

/// |ε| over a at one drive.
#[derive(Debug, Clone)]
pub struct Slice {
    curve: StrainCurve,
    amount: f64,
    pieces: Vec<Cut>,
    /// Smallest u with a solution; 0 where nothing was cut off.
    end: f64,
    /// (u, ε) at points between which there is at most one extremum.
    looks: Vec<(f64, f64)>,
}

impl Slice {
    /// Of `cuts`, ascending in u, each with f at its looks.
    pub(super) fn new<'a>(
        curve: StrainCurve,
        amount: f64,
        cuts: impl ExactSizeIterator<Item = (Cut, &'a [f64; LOOKS + 1])>,
        end: f64,
    ) -> Self {
        let mut pieces = Vec::with_capacity(cuts.len());
        let mut looks = Vec::with_capacity(LOOKS * cuts.len() + 1);
        for (cut, f) in cuts {
            let mut ratios = [0.0; LOOKS + 1];
            for (c, row) in cut.coefficients.iter().zip(AT_LOOKS.iter()) {
                ratios.iter_mut().zip(row).for_each(|(sum, t)| *sum += c * t);
            }
            let from = usize::from(!pieces.is_empty());
            looks.extend((from..=LOOKS).map(|k| (look(cut.u, k), amount * f[k] * ratios[k])));
            pieces.push(cut);
        }
        Self { curve, amount, pieces, end, looks }
    }

    /// ε and dε/du.
    fn at(&self, u: f64) -> (f64, f64) {
        let piece = self.pieces.iter().find(|p| u <= p.u[1]).or(self.pieces.last());
        let Some(Cut { u: [lo, hi], coefficients }) = piece else { return (f64::NAN, f64::NAN) };
        let (r, dr) = series(coefficients, scaled([*lo, *hi], u));
        let dr = dr * 2.0 / (hi - lo);
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
        // What is known of the ends is not asked again: summed another way it could lie on the other side of `strain`.
        let mut take = |(lo, e): (f64, f64), (hi, f): (f64, f64)| {
            if next < 2 {
                let at = |u| {
                    if u == lo {
                        e
                    } else if u == hi {
                        f
                    } else {
                        self.at(u).0
                    }
                };
                found[next] = Some(1.0 / bracketed(|u| at(u) - strain, lo, hi));
                next += 1;
            }
        };
        for (i, w) in self.looks.windows(2).enumerate() {
            let ((lo, e), (hi, f)) = (w[0], w[1]);
            if e.is_nan() || f.is_nan() {
                continue;
            }
            if (e <= strain) != (f <= strain) {
                take(w[0], w[1]);
            } else if e < strain && self.may_peak(i) {
                // Both ends lie below; the peak between them may lie above.
                let (slope_lo, slope_hi) = (self.at(lo).1, self.at(hi).1);
                if slope_lo > 0.0 && slope_hi < 0.0 {
                    let peak = bracketed(|u| self.at(u).1, lo, hi);
                    let top = (peak, self.at(peak).0);
                    if top.1 >= strain {
                        take(w[0], top);
                        take(top, w[1]);
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
