//! The model's curve of one whisker at one drive, |ε| over the contact distance, and its inverse (model §4.7). ε/(θ f), smooth in u = 1/a, is held as
//! polynomials over pieces of u; f is a closed form with its peak and its kink at the gauge's far end.

pub mod both;
mod solve;

pub use solve::{Ask, Reach, solve};

use std::sync::LazyLock;

use crate::estimate::{Estimated, Estimator};
use crate::physics::chebyshev::{basis, placed, scaled, series, transpose};
use crate::physics::{driven::Driven, inverse::bracketed, linear::StrainCurve};

/// |ε| over a, of one whisker at one drive.
#[derive(Debug, Clone)]
pub struct Curve {
    of: StrainCurve,
    driven: Driven,
    /// Ascending in u.
    pieces: Vec<Piece>,
    /// Smallest u with a solution; 0 where nothing was cut off.
    end: f64,
    /// (u, |ε|) between which there is at most one extremum, ascending in u; NaN where the model has no solution.
    looks: Vec<(f64, f64)>,
}

impl Curve {
    /// The curve of taps `driven`. `parts`: pieces ascending in u, each with f at its looks, f being `of`; `end`: the smallest u with a solution, 0
    /// where nothing was cut off.
    pub fn new<'f>(
        of: StrainCurve,
        driven: Driven,
        parts: impl ExactSizeIterator<Item = (Piece, &'f [f64; LOOKS + 1])>,
        end: f64,
    ) -> Self {
        let mut pieces = Vec::with_capacity(parts.len());
        let mut looks: Vec<(f64, f64)> = Vec::with_capacity((LOOKS + 1) * parts.len());
        for (piece, f) in parts {
            piece.look_into(&mut looks, &of, driven.size(), f);
            pieces.push(piece);
        }
        Self { of, driven, pieces, end, looks }
    }

    fn at(&self, u: f64) -> (f64, f64) {
        let piece = self.pieces.iter().find(|p| u <= p.u[1]).or(self.pieces.last());
        piece.map_or((f64::NAN, f64::NAN), |piece| piece.strain(&self.of, self.driven.size(), u))
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
        let root = |[(lo, e), (hi, f)]: [(f64, f64); 2]| {
            // Known end values are not computed again: rounded differently they could lie on the other side of `strain`.
            let at = |u| if u == lo { Some(e) } else { Some(f).filter(|_| u == hi) };
            1.0 / bracketed(|u| at(u).unwrap_or_else(|| self.at(u).0) - strain, lo, hi)
        };
        let parts = |(i, w): (usize, &[(f64, f64)])| {
            let (e, f) = (w[0].1, w[1].1);
            match () {
                () if e.is_nan() || f.is_nan() => [None; 2],
                () if (e <= strain) != (f <= strain) => [Some([w[0], w[1]]), None],
                // Both ends may lie below, and the peak between them above.
                () => {
                    let below = Some(i).filter(|_| e < strain && self.may_peak(i));
                    let top = below.and_then(|i| self.top(i)).filter(|(_, top)| *top >= strain);
                    top.map_or([None; 2], |top| [Some([w[0], top]), Some([top, w[1]])])
                }
            }
        };
        let mut found = self.looks.windows(2).enumerate().flat_map(parts).flatten().map(root);
        found.next().map(|far| (far, found.next()))
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
            return by.estimated(a, self.slope(a), near, false);
        }
        match (far, own.or(near)) {
            (Some(a), second) => by.estimated(a, self.slope(a), second, false),
            (None, Some(a)) => {
                let known = strain < self.farthest();
                by.estimated(a, self.slope(a), None, !known)
            }
            (None, None) => Estimated::NO_ROOT,
        }
    }
}

/// Most coefficients of a smooth piece.
pub const NODES: usize = 16;
/// Steps of a smooth piece between whose ends there is at most one extremum.
pub const LOOKS: usize = 12;
const SAME: f64 = 1e-14;
/// T_i at the looks of a piece: row i, column of the look.
static AT_LOOKS: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| {
    let at = |k| basis(NODES, look([-1.0, 1.0], k));
    transpose(&(0..=LOOKS).map(at).collect::<Vec<_>>())
});

/// Look `k` of a piece over `range`.
pub fn look(range: [f64; 2], k: usize) -> f64 {
    placed(range, 2.0 * k as f64 / LOOKS as f64 - 1.0)
}

/// The ratio over one interval of u.
#[derive(Debug, Clone)]
pub struct Piece {
    /// The interval.
    pub u: [f64; 2],
    /// The ratio.
    pub ratio: Ratio,
}

/// Representation of the ratio.
#[derive(Debug, Clone)]
pub enum Ratio {
    /// Chebyshev coefficients.
    Smooth([f64; NODES]),
    /// (u, ratio) of taps, NaN without a solution: the piece holds a boundary between sticking and sliding, or the end of the model's solutions.
    Rough(Vec<(f64, f64)>),
}

impl Ratio {
    /// From at most `NODES` coefficients.
    pub fn smooth(coefficients: &[f64]) -> Self {
        Self::Smooth(std::array::from_fn(|k| coefficients.get(k).copied().unwrap_or(0.0)))
    }
}

impl Piece {
    /// The ratio and its slope over u; in a rough piece interpolated between taps, with the slope of the chord of all.
    fn at(&self, u: f64) -> (f64, f64) {
        match &self.ratio {
            Ratio::Smooth(c) => {
                let (r, slope) = series(c, scaled(self.u, u));
                (r, slope * 2.0 / (self.u[1] - self.u[0]))
            }
            Ratio::Rough(taps) => {
                let solved: Vec<(f64, f64)> = taps.iter().copied().filter(|(_, r)| r.is_finite()).collect();
                let chord = |(v, r): (f64, f64), (w, s): (f64, f64)| (s - r) / (w - v);
                let [first, .., last] = solved[..] else { return (f64::NAN, f64::NAN) };
                let next = solved.partition_point(|(v, _)| *v <= u).clamp(1, solved.len() - 1);
                let (v, r) = solved[next - 1];
                (r + chord(solved[next - 1], solved[next]) * (u - v), chord(first, last))
            }
        }
    }

    /// |ε| at u for a drive of `size`, rad or mm, and its derivative by u.
    fn strain(&self, of: &StrainCurve, size: f64, u: f64) -> (f64, f64) {
        let ((r, dr), (f, df)) = (self.at(u), of.at_inverse(u));
        (size * f * r, size * (df * r + f * dr))
    }

    /// Appends (u, |ε|) at the looks of this piece, with `f` at those of a smooth one; NaN where nothing is solved.
    fn look_into(&self, looks: &mut Vec<(f64, f64)>, of: &StrainCurve, size: f64, f: &[f64; LOOKS + 1]) {
        match &self.ratio {
            Ratio::Smooth(coefficients) => {
                let mut ratios = [0.0; LOOKS + 1];
                for (c, row) in coefficients.iter().zip(AT_LOOKS.iter()) {
                    ratios.iter_mut().zip(row).for_each(|(sum, t)| *sum += c * t);
                }
                let known = |(u, _): &(f64, f64)| (u - self.u[0]).abs() <= SAME * u;
                let from = usize::from(looks.last().is_some_and(known));
                looks.extend((from..=LOOKS).map(|k| (look(self.u, k), size * f[k] * ratios[k])));
            }
            Ratio::Rough(taps) => {
                let strain = |u| self.strain(of, size, u).0;
                looks.extend(
                    taps.iter().map(|(u, r)| (*u, if r.is_finite() { strain(*u) } else { f64::NAN })),
                );
            }
        }
    }
}
