//! The curve through points: one point, a line, a circle or a smooth curve, whichever tells best where points lie that it has not seen.
//!
//! Points weigh by their covariance across the curve; those of a stroke, which have errors in common, count as few as they are worth. A start
//! that outliers do not move (the least median over lines and circles through a few points) is refined on the points that are near it. Judged
//! is by what is left out, a stroke or a tap at a time, with a loss that outliers bound; the simplest is taken that the others do not
//! beat by more than one standard error, and a tenth of the density.

mod arc;
mod choice;
mod smooth;
mod spot;

pub use arc::Arc;
pub use choice::{Chosen, Judged, Nothing, choose};
pub use smooth::{Smooth, ends};
pub use spot::Covariance;
pub use spot::Spot;

/// A point that takes part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// mm.
    pub at: [f64; 2],
    /// mm².
    pub covariance: Covariance,
    /// Weight.
    pub share: f64,
    /// Left out together: number of its stroke, or of itself.
    pub group: usize,
}

vibrissa_core::choices! {
    /// Kinds of curves, the simplest first.
    #[derive(serde::Serialize)]
    Kind {
        Point = "point", "one point, as of a corner";
        Line = "line", "a straight line";
        Circle = "circle", "a circle";
        Smooth = "smooth", "a smooth curve";
    }
}

impl Kind {
    pub fn word(self) -> &'static str {
        Self::WORDS[self as usize].0
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Curve {
    Point(Spot),
    Arc(Arc),
    Smooth(Smooth),
}

impl Curve {
    /// How far a place lies to the left, mm, and the unit vector across the curve there; of a point how far away, and in which direction.
    pub fn off(&self, p: [f64; 2]) -> (f64, [f64; 2]) {
        match self {
            Self::Point(spot) => spot.off(p),
            Self::Arc(arc) => (arc.off(p), arc.normal(p)),
            Self::Smooth(smooth) => smooth.off(p),
        }
    }

    /// Standard deviation of the curve itself across it beside a place, mm.
    pub fn deviation(&self, p: [f64; 2]) -> f64 {
        match self {
            Self::Point(spot) => spot.deviation(p),
            Self::Arc(arc) => arc.deviation(p),
            Self::Smooth(smooth) => smooth.deviation(p),
        }
    }

    /// The same kind through weighted samples; a smooth curve of this stiffness.
    fn fit(&self, samples: &[Sample], weights: &[f64], stiffness: f64) -> Option<Self> {
        Some(match self {
            Self::Point(_) => Self::Point(Spot::fit(samples, weights)?),
            Self::Arc(arc) => Self::Arc(arc.fit(samples, weights)?),
            Self::Smooth(smooth) => Self::Smooth(smooth.fit(samples, weights, stiffness)?),
        })
    }

    /// The curves without each of `groups`.
    fn without(
        &self,
        samples: &[Sample],
        weights: &[f64],
        stiffness: f64,
        groups: &[Vec<usize>],
    ) -> Option<Vec<Self>> {
        if let Self::Smooth(smooth) = self {
            let all = smooth.without(samples, weights, stiffness, groups)?;
            return Some(all.into_iter().map(Self::Smooth).collect());
        }
        let one = |group: &Vec<usize>| {
            let mut left = weights.to_vec();
            group.iter().for_each(|&i| left[i] = 0.0);
            self.fit(samples, &left, stiffness)
        };
        groups.iter().map(one).collect()
    }

    fn scaled(self, factor: f64) -> Self {
        match self {
            Self::Point(spot) => Self::Point(spot.scaled(factor)),
            Self::Arc(arc) => Self::Arc(arc.scaled(factor)),
            Self::Smooth(smooth) => Self::Smooth(smooth.scaled(factor)),
        }
    }

    /// `n` places along `samples`: where, direction (rad), standard deviation across (mm). A point gives the longer axis of its ellipse.
    pub fn traced(&self, samples: &[Sample], n: usize) -> Vec<([f64; 2], f64, f64)> {
        let ([from, to], at): (_, &dyn Fn(f64) -> ([f64; 2], f64)) = match self {
            Self::Point(spot) => {
                let ([major, _], axis) = spot.covariance.ellipse();
                return vec![(spot.at, axis.to_radians(), major)];
            }
            Self::Arc(arc) => (ends(arc, samples.iter().map(|s| s.at)).0, &|s| arc.at(s)),
            Self::Smooth(smooth) => (smooth.basis.ends, &|s| smooth.at(s)),
        };
        let place = |k: usize| {
            let (p, direction) = at(from + (to - from) * k as f64 / (n - 1) as f64);
            (p, direction, self.deviation(p))
        };
        (0..n).map(place).collect()
    }
}
