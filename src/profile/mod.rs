//! The model's own curve of one whisker at one drive: |ε| over the contact distance, and how a reading is turned into a distance by it
//! (model §4.7). It stands in for `locate --estimator exact` where the model is known to be the whisker.
//!
//! What is held is the ratio of ε to the linear theory of the same model, ε/(θ f), a smooth function of u = 1/a near 1, as polynomials
//! over pieces of u. f itself is a closed form, so that neither its peak nor its kink at the gauge's far end costs anything.

pub mod both;
mod solve;

pub use solve::{Ask, Reach, solve};

use crate::estimate::{Estimated, Estimator};
use crate::physics::chebyshev::{scaled, series};
use crate::physics::linear::StrainCurve;
use crate::physics::root::bracketed;
use crate::status::Status;

/// Parts of a piece between whose ends there is at most one root.
const LOOKS: usize = 8;

/// |ε| over a, of one whisker at one drive.
#[derive(Debug, Clone)]
pub struct Profile {
    curve: StrainCurve,
    amount: f64,
    /// Ascending in u.
    pieces: Vec<Piece>,
    /// (u, |ε|) between which |ε| is monotone or unknown, ascending in u; NaN where the model has no solution.
    looks: Vec<(f64, f64)>,
    /// Place of the largest of `looks`.
    peak: usize,
}

/// The ratio over one interval of u.
#[derive(Debug, Clone)]
struct Piece {
    u: [f64; 2],
    ratio: Ratio,
}

#[derive(Debug, Clone)]
enum Ratio {
    /// Chebyshev coefficients.
    Smooth(Vec<f64>),
    /// (u, ratio) of taps, NaN of those without a solution: a boundary between sticking and sliding runs through the piece, or the
    /// end of what the model can do.
    Rough(Vec<(f64, f64)>),
}

impl Piece {
    /// The ratio and its slope over u; in a rough piece what lies between the taps around, and the slope of the chord of all.
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

    /// |ε| at the drive `amount` and its slope over u, where f is `curve`.
    fn strain(&self, curve: &StrainCurve, amount: f64, u: f64) -> (f64, f64) {
        let ((r, dr), (f, df)) = (self.at(u), curve.at_inverse(u));
        (amount * f * r, amount * (df * r + f * dr))
    }

    /// Places between which |ε| is looked at, and whether the model is solved there.
    fn looks(&self) -> Vec<(f64, bool)> {
        match &self.ratio {
            Ratio::Smooth(_) => {
                let place = |k| self.u[0] + (self.u[1] - self.u[0]) * (k as f64 / LOOKS as f64);
                (0..=LOOKS).map(|k| (place(k), true)).collect()
            }
            Ratio::Rough(taps) => taps.iter().map(|(u, r)| (*u, r.is_finite())).collect(),
        }
    }
}

impl Profile {
    fn new(curve: StrainCurve, amount: f64, mut pieces: Vec<Piece>) -> Self {
        pieces.sort_by(|p, q| p.u[0].total_cmp(&q.u[0]));
        let mut profile = Self { curve, amount, pieces, looks: Vec::new(), peak: 0 };
        let look = |piece: &Piece, (u, solved)| {
            (u, if solved { piece.strain(&profile.curve, amount, u).0 } else { f64::NAN })
        };
        let looks = profile.pieces.iter().flat_map(|p| p.looks().into_iter().map(move |at| look(p, at)));
        profile.looks = looks.collect();
        profile.looks.dedup_by_key(|(u, _)| *u);
        profile.find_peak();
        profile
    }

    /// Finds the peak and makes it a look.
    fn find_peak(&mut self) {
        let known = |e: f64| if e.is_nan() { f64::NEG_INFINITY } else { e };
        let largest = |looks: &[(f64, f64)]| {
            (0..looks.len()).max_by(|&i, &j| known(looks[i].1).total_cmp(&known(looks[j].1))).unwrap_or(0)
        };
        let top = largest(&self.looks);
        let beside = [top.checked_sub(1), Some(top + 1)];
        for i in beside.into_iter().flatten() {
            let Some(&(end, strain)) = self.looks.get(i) else { continue };
            let (lo, hi) = (self.looks[top].0.min(end), self.looks[top].0.max(end));
            if !strain.is_nan() && lo < hi && self.at(lo).1 > 0.0 && self.at(hi).1 < 0.0 {
                let u = bracketed(|u| self.at(u).1, lo, hi);
                self.looks.insert(top.max(i), (u, self.at(u).0));
                break;
            }
        }
        self.peak = largest(&self.looks);
    }

    /// |ε| and d|ε|/du.
    fn at(&self, u: f64) -> (f64, f64) {
        let piece = self.pieces.iter().find(|p| u <= p.u[1]).or(self.pieces.last());
        piece.map_or((f64::NAN, f64::NAN), |piece| piece.strain(&self.curve, self.amount, u))
    }

    /// |ε| of a tap at `a` mm.
    pub fn strain(&self, a: f64) -> f64 {
        self.at(1.0 / a).0
    }

    /// d|ε|/da at `a` mm, 1/mm.
    pub fn slope(&self, a: f64) -> f64 {
        -self.at(1.0 / a).1 / (a * a)
    }

    /// Distance (mm) and value of the largest |ε| known.
    pub fn peak(&self) -> (f64, f64) {
        self.looks.get(self.peak).map_or((f64::NAN, f64::NAN), |(u, strain)| (1.0 / u, *strain))
    }

    /// The largest distance beyond the peak with |ε| = `strain`.
    pub fn far(&self, strain: f64) -> Option<f64> {
        self.root(self.looks.get(..=self.peak)?, strain)
    }

    /// The largest distance before the peak with |ε| = `strain`.
    pub fn near(&self, strain: f64) -> Option<f64> {
        self.root(self.looks.get(self.peak..)?, strain)
    }

    fn root(&self, looks: &[(f64, f64)], strain: f64) -> Option<f64> {
        let across = |w: &&[(f64, f64)]| {
            !w[0].1.is_nan() && !w[1].1.is_nan() && (w[0].1 <= strain) != (w[1].1 <= strain)
        };
        let w = looks.windows(2).find(across)?;
        Some(1.0 / bracketed(|u| self.at(u).0 - strain, w[0].0, w[1].0))
    }

    /// What |ε| = `strain` is taken for, with the noise and the range of interest of `by`. `own`: where the tap was, if it was one of the
    /// very whisker of this curve; beyond the peak it is found exactly there.
    pub fn estimate(&self, by: &Estimator<'_>, own: Option<f64>, strain: f64) -> Estimated {
        let slope = own.map(|a| (a, self.slope(a)));
        if let Some((a, slope)) = slope.filter(|(_, slope)| *slope < 0.0) {
            return by.told(a, slope, self.near(strain));
        }
        match (self.far(strain), own.or_else(|| self.near(strain))) {
            (Some(a), second) => by.told(a, self.slope(a), second),
            (None, Some(a)) => Estimated { status: Status::AMBIGUOUS, ..by.told(a, self.slope(a), None) },
            (None, None) => Estimated { status: Status::NO_ROOT, ..Estimated::NOTHING },
        }
    }
}
