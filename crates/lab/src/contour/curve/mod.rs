//! The curve through points: one point, a line, a circle or a smooth curve, whichever tells best where points lie that it has not seen.
//!
//! Points weigh by their covariance across the curve; those of a stroke, which have errors in common, count as few as they are worth. A start
//! that outliers do not move (the least median over lines and circles through a few points) is refined on the points that are near it. Judged
//! is by what is left out, a stroke or a tap at a time, with a loss that outliers bound; the simplest is taken that the others do not
//! beat by more than one standard error, and a tenth of the density.

mod arc;
mod choice;

pub use arc::{Arc, Smooth, ends};
pub use choice::{Chosen, Judged, Nothing, choose};
use vibrissa_core::reduce::median;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// mm.
    pub at: [f64; 2],
    /// mm².
    pub covariance: Covariance,
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

    /// The same kind through weighted samples.
    fn fit(&self, samples: &[Sample], weights: &[f64]) -> Option<Self> {
        Some(match self {
            Self::Point(_) => Self::Point(Spot::fit(samples, weights)?),
            Self::Arc(arc) => Self::Arc(arc.fit(samples, weights)?),
            Self::Smooth(smooth) => Self::Smooth(smooth.fit(samples, weights)?),
        })
    }

    /// The curves without each of `groups`.
    fn without(&self, samples: &[Sample], weights: &[f64], groups: &[Vec<usize>]) -> Option<Vec<Self>> {
        if let Self::Smooth(smooth) = self {
            let all = smooth.without(samples, weights, groups)?;
            return Some(all.into_iter().map(Self::Smooth).collect());
        }
        let one = |group: &Vec<usize>| {
            let mut left = weights.to_vec();
            group.iter().for_each(|&i| left[i] = 0.0);
            self.fit(samples, &left)
        };
        groups.iter().map(one).collect()
    }

    fn scale(&mut self, factor: f64) {
        match self {
            Self::Point(spot) => spot.covariance = Covariance(spot.covariance.0.map(|x| x * factor)),
            Self::Arc(arc) => arc.covariance *= factor,
            Self::Smooth(smooth) => {
                smooth.covariance *= factor;
                smooth.base.covariance *= factor;
            }
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
            Self::Smooth(smooth) => (smooth.ends, &|s| smooth.at(s)),
        };
        let place = |k: usize| {
            let (p, direction) = at(from + (to - from) * k as f64 / (n - 1) as f64);
            (p, direction, self.deviation(p))
        };
        (0..n).map(place).collect()
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// mm.
    pub at: [f64; 2],
    /// mm².
    pub covariance: Covariance,
}

/// M⁻¹, whose determinant is positive.
fn inverse(Covariance([xx, xy, yy]): Covariance) -> Option<Covariance> {
    let determinant = xx * yy - xy * xy;
    (determinant > 0.0).then(|| Covariance([yy / determinant, -xy / determinant, xx / determinant]))
}

impl Spot {
    /// The medians of both coordinates: outliers do not move it.
    pub fn middle(samples: &[Sample]) -> Self {
        let of = |k: usize| median(&mut samples.iter().map(|s| s.at[k]).collect::<Vec<_>>());
        Self { at: [of(0), of(1)], covariance: Covariance::default() }
    }

    /// Least squares of the `samples` of `weights` > 0.
    pub fn fit(samples: &[Sample], weights: &[f64]) -> Option<Self> {
        let (mut n, mut b) = (Covariance::default(), [0.0; 2]);
        for (s, w) in samples.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
            let Covariance([xx, xy, yy]) = Covariance(inverse(s.covariance)?.0.map(|x| w * x));
            let [x, y] = s.at;
            n = Covariance([n.0[0] + xx, n.0[1] + xy, n.0[2] + yy]);
            b = [b[0] + xx * x + xy * y, b[1] + xy * x + yy * y];
        }
        let covariance = inverse(n)?;
        let Covariance([xx, xy, yy]) = covariance;
        Some(Self { at: [xx * b[0] + xy * b[1], xy * b[0] + yy * b[1]], covariance })
    }

    /// How far a place is from it, mm, and in which direction.
    pub fn off(&self, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
        let d = [x - self.at[0], y - self.at[1]];
        let size = d[0].hypot(d[1]);
        (size, if size > 0.0 { d.map(|d| d / size) } else { [1.0, 0.0] })
    }

    /// Distance of a sample over its standard deviations, in all directions at once.
    pub fn deviations(&self, s: &Sample) -> f64 {
        let (size, direction) = self.off(s.at);
        inverse(s.covariance).map_or(f64::INFINITY, |n| size * n.of(direction).sqrt())
    }

    /// Standard deviation of it in the direction of a place, mm.
    pub fn deviation(&self, p: [f64; 2]) -> f64 {
        self.covariance.of(self.off(p).1).sqrt()
    }

    /// Density of a sample that has not been seen, 1/mm², whose deviations are `scale` times as large as said.
    pub fn density(&self, s: &Sample, scale: f64) -> f64 {
        let variance = |k: usize| scale * scale * (s.covariance.0[k] + self.covariance.0[k]);
        let whole = Covariance([0, 1, 2].map(variance));
        let Some(inverse) = inverse(whole) else { return 0.0 };
        let Covariance([xx, xy, yy]) = inverse;
        let (size, direction) = self.off(s.at);
        (-0.5 * size * size * inverse.of(direction)).exp() * (xx * yy - xy * xy).sqrt()
            / std::f64::consts::TAU
    }
}

/// A symmetric 2 × 2 matrix: xx, xy, yy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Covariance(pub [f64; 3]);

impl Covariance {
    /// Plus `variance` along `by`.
    pub fn along(self, by: [f64; 2], variance: f64) -> Self {
        let [xx, xy, yy] = self.0;
        let [x, y] = by;
        Self([xx + variance * x * x, xy + variance * x * y, yy + variance * y * y])
    }

    /// Plus `variance` in all directions.
    pub fn plus(self, variance: f64) -> Self {
        self.along([1.0, 0.0], variance).along([0.0, 1.0], variance)
    }

    pub fn of(self, [x, y]: [f64; 2]) -> f64 {
        let [xx, xy, yy] = self.0;
        xx * x * x + 2.0 * xy * x * y + yy * y * y
    }

    /// Half axes of the ellipse of one standard deviation, the longer first, and the direction of that, degrees in (−90, 90].
    pub fn ellipse(self) -> ([f64; 2], f64) {
        let [xx, xy, yy] = self.0;
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let axis = 0.5 * (2.0 * xy).atan2(xx - yy);
        ([(mean + half).sqrt(), (mean - half).max(0.0).sqrt()], axis.to_degrees())
    }
}
