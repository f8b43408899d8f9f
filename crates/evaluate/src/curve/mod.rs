//! The model's curve of one whisker at one drive, |ε| over the contact distance, and its inverse (model §4.7). ε/(θ f), smooth in u = 1/a, is held as
//! polynomials over pieces of u; f is a closed form with its peak and its kink at the gauge's far end.

pub mod both;
mod piece;
mod places;
mod solve;

pub use piece::{LOOKS, NODES, Piece, Ratio, look};
pub use places::Reach;
pub use solve::{Ask, solve};

use crate::estimate::{Estimated, Estimator};
use crate::physics::inverse::bracketed;
use crate::physics::linear::StrainCurve;
use crate::status::Status;

/// |ε| over a, of one whisker at one drive.
#[derive(Debug, Clone)]
pub struct Curve {
    of: StrainCurve,
    amount: f64,
    /// Ascending in u.
    pieces: Vec<Piece>,
    /// Smallest u with a solution; 0 where nothing was cut off.
    end: f64,
    /// (u, |ε|) between which there is at most one extremum, ascending in u; NaN where the model has no solution.
    looks: Vec<(f64, f64)>,
}

impl Curve {
    /// `parts`: pieces ascending in u, each with f at its looks, f being `of`; `amount`: the drive, rad or mm; `end`: the smallest u with a solution,
    /// 0 where nothing was cut off.
    pub fn new<'f>(
        of: StrainCurve,
        amount: f64,
        parts: impl ExactSizeIterator<Item = (Piece, &'f [f64; LOOKS + 1])>,
        end: f64,
    ) -> Self {
        let mut pieces = Vec::with_capacity(parts.len());
        let mut looks: Vec<(f64, f64)> = Vec::with_capacity((LOOKS + 1) * parts.len());
        for (piece, f) in parts {
            piece.look_into(&mut looks, &of, amount, f);
            pieces.push(piece);
        }
        Self { of, amount, pieces, end, looks }
    }

    fn at(&self, u: f64) -> (f64, f64) {
        let piece = self.pieces.iter().find(|p| u <= p.u[1]).or(self.pieces.last());
        piece.map_or((f64::NAN, f64::NAN), |piece| piece.strain(&self.of, self.amount, u))
    }

    /// |ε| of a tap at `a` mm; NaN where the model has none.
    pub fn value(&self, a: f64) -> f64 {
        let u = 1.0 / a;
        if u >= self.end { self.at(u).0 } else { f64::NAN }
    }

    /// d|ε|/da at `a` mm, 1/mm.
    pub fn slope(&self, a: f64) -> f64 {
        -self.at(1.0 / a).1 / (a * a)
    }

    /// The smallest |ε| beyond the peak, up to the distance `to`, mm: a smaller one comes from farther out.
    pub fn weakest(&self, to: f64) -> f64 {
        self.at((1.0 / to).max(self.end)).0
    }

    /// Distance (mm) and value of the largest |ε| known.
    pub fn peak(&self) -> (f64, f64) {
        let known = |i: usize| if self.looks[i].1.is_nan() { f64::NEG_INFINITY } else { self.looks[i].1 };
        let Some(top) = (0..self.looks.len()).max_by(|&i, &j| known(i).total_cmp(&known(j))) else {
            return (f64::NAN, f64::NAN);
        };
        let (u, strain) = [top.checked_sub(1), Some(top)]
            .into_iter()
            .flatten()
            .find_map(|i| self.top(i))
            .filter(|(_, strain)| *strain >= known(top))
            .unwrap_or(self.looks[top]);
        (1.0 / u, strain)
    }

    /// The extremum between the looks `i` and i + 1 that is a maximum.
    fn top(&self, i: usize) -> Option<(f64, f64)> {
        let (&(lo, e), &(hi, f)) = (self.looks.get(i)?, self.looks.get(i + 1)?);
        let between = lo < hi && !e.is_nan() && !f.is_nan() && self.at(lo).1 > 0.0 && self.at(hi).1 < 0.0;
        between.then(|| {
            let u = bracketed(|u| self.at(u).1, lo, hi);
            (u, self.at(u).0)
        })
    }

    /// The largest distance with this |ε|, and the next one; `None` if none is within reach.
    pub fn roots(&self, strain: f64) -> Option<(f64, Option<f64>)> {
        let mut found = [None; 2];
        let mut next = 0;
        // Known end values are not computed again: rounded differently they could lie on the other side of `strain`.
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
            let ((_, e), (_, f)) = (w[0], w[1]);
            if e.is_nan() || f.is_nan() {
                continue;
            }
            if (e <= strain) != (f <= strain) {
                take(w[0], w[1]);
            } else if e < strain && self.may_peak(i) {
                // Both ends lie below; the peak between them may lie above.
                if let Some(top) = self.top(i).filter(|(_, top)| *top >= strain) {
                    take(w[0], top);
                    take(top, w[1]);
                }
            }
        }
        found[0].map(|far| (far, found[1]))
    }

    /// |ε| at infinite distance: from the farthest one known it changes as f does.
    fn farthest(&self) -> f64 {
        let Some((u, strain)) = self.looks.iter().find(|look| look.1.is_finite()) else { return 0.0 };
        strain * self.of.farthest() / self.of.at_inverse(*u).0
    }

    /// True if |ε| may have a maximum after look `i`.
    fn may_peak(&self, i: usize) -> bool {
        let at = |k: usize| self.looks.get(k).map_or(f64::NEG_INFINITY, |l| l.1);
        let before = if i == 0 { f64::NEG_INFINITY } else { at(i - 1) };
        at(i).max(at(i + 1)) >= before.max(at(i + 2))
    }

    /// The distance for |ε| = `strain`, with the noise and range of interest of `by`. `own`: distance of the tap, if it is of this very whisker.
    pub fn estimate(&self, by: &Estimator<'_>, own: Option<f64>, strain: f64) -> Estimated {
        let (mut far, mut near) = (None, None);
        if let Some((first, second)) = self.roots(strain) {
            match self.slope(first) < 0.0 {
                true => (far, near) = (Some(first), second),
                false => near = Some(first),
            }
        }
        if let Some(a) = own.filter(|a| self.slope(*a) < 0.0) {
            return by.estimated(a, self.slope(a), near);
        }
        match (far, own.or(near)) {
            (Some(a), second) => by.estimated(a, self.slope(a), second),
            (None, Some(a)) => {
                let status = if strain < self.farthest() { Status::OK } else { Status::AMBIGUOUS };
                Estimated { status, ..by.estimated(a, self.slope(a), None) }
            }
            (None, None) => Estimated { status: Status::NO_ROOT, ..Estimated::NOTHING },
        }
    }
}
