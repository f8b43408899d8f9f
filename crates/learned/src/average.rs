//! The mean over what the learned numbers may be: importance sampling about the peaks of their likelihood.
//!
//! Their likelihood is no bell: of a standard deviation too small to be seen it is flat to one side and steep to the other. Drawn from a
//! normal distribution of the curvature at the peak, 20 000 points of 12 numbers count as 200; drawn from one whose width differs to
//! either side of every axis (Geweke 1989, Econometrica 57, 1317), as a third to two thirds of them.

use nalgebra::{DMatrix, DVector};
use vibrissa_core::normal::quantile;
use vibrissa_core::scene::sampler::{MAX_DIMENSIONS, Sampler};

use crate::curve::Spread;
use crate::evidence::{Problem, Solved};
use crate::hyper::Hyper;
use crate::newton::Peak;
use crate::tails::{PARTS, Tails};

/// Points over which the learned numbers are averaged: of few cells, of more, of many; powers of two, of which Sobol's points are even.
const POINTS: [usize; 3] = [128, 64, 16];
/// Of so many cells the learned numbers are uncertain, and points cost little.
const FEW: usize = 60;
/// Where on an axis its width is looked for, in standard deviations of the curvature.
const REACH: f64 = 2.0;
/// Points are drawn from somewhat farther.
const WIDER: f64 = 1.1;
/// Least and largest width, in standard deviations of the curvature.
const WIDTHS: [f64; 2] = [0.3, 4.0];
/// Scramble of the points.
const SEED: u64 = 1;

/// Points for so many cells.
pub fn points(cells: usize) -> usize {
    POINTS[usize::from(cells > FEW) + usize::from(cells > crate::fit::MANY)]
}

/// Widths below and above a peak along each axis, in standard deviations of its curvature.
pub type Widths = Vec<[f64; 2]>;

/// What points are drawn from: about a peak, along the axes of the root of its curvature's inverse.
struct Proposal<'a> {
    peak: &'a Peak,
    /// Axes, and their inverse.
    axes: [DMatrix<f64>; 2],
    widths: Widths,
    /// ln of the density at the peak, but for a constant.
    top: f64,
}

impl<'a> Proposal<'a> {
    /// About `peak`, with the widths of a like one where there are any.
    fn new(problem: &Problem, peak: &'a Peak, widths: Option<&Widths>) -> Self {
        let eigen = peak.hessian.clone().symmetric_eigen();
        let power = |p: f64| {
            let scaled = DMatrix::from_diagonal(&eigen.eigenvalues.map(|x| x.powf(p)));
            &eigen.eigenvectors * scaled * eigen.eigenvectors.transpose()
        };
        let mut proposal = Self { peak, axes: [power(-0.5), power(0.5)], widths: Vec::new(), top: 0.0 };
        let d = peak.at.len();
        proposal.widths = widths.filter(|w| w.len() == d).cloned().unwrap_or_else(|| {
            let width = |k: usize, to: f64| {
                let z = DVector::from_fn(d, |i, _| if i == k { to } else { 0.0 });
                let off =
                    problem.solve(&proposal.at(&z)).map_or(f64::INFINITY, |s| s.value - peak.solved.value);
                WIDER * (to.abs() / (2.0 * off).max(1e-9).sqrt()).clamp(WIDTHS[0], WIDTHS[1])
            };
            (0..d).map(|k| [width(k, -REACH), width(k, REACH)]).collect()
        });
        proposal.top = 0.5 * eigen.eigenvalues.iter().map(|x| x.ln()).sum::<f64>()
            - proposal.widths.iter().map(|[below, above]| (0.5 * (below + above)).ln()).sum::<f64>();
        proposal
    }

    fn at(&self, z: &DVector<f64>) -> Vec<f64> {
        self.peak.at.iter().zip((&self.axes[0] * z).iter()).map(|(x, s)| x + s).collect()
    }

    fn point(&self, index: usize) -> Vec<f64> {
        let along = |(k, [below, above]): (usize, &[f64; 2])| {
            let bits = Sampler::Sobol.coordinate(SEED, k as u32 % MAX_DIMENSIONS, index as u32);
            let u = (f64::from(bits) + 0.5) / 4_294_967_296.0;
            let both = below + above;
            if u * both < *below {
                below * quantile(u * both / (2.0 * below))
            } else {
                -above * quantile((1.0 - u) * both / (2.0 * above))
            }
        };
        self.at(&DVector::from_iterator(self.widths.len(), self.widths.iter().enumerate().map(along)))
    }

    fn log_density(&self, at: &[f64]) -> f64 {
        let step = DVector::from_iterator(at.len(), at.iter().zip(&self.peak.at).map(|(x, p)| x - p));
        let z = &self.axes[1] * step;
        let off = |(z, [below, above]): (&f64, &[f64; 2])| (z / if *z < 0.0 { below } else { above }).powi(2);
        self.top - 0.5 * z.iter().zip(&self.widths).map(off).sum::<f64>()
    }
}

/// The learned numbers that [`Spread`] holds, and of what power of them the mean is taken.
const OF_SPREAD: [(Hyper, i32); 7] = [
    (Hyper::Floor, 2),
    (Hyper::Relative, 2),
    (Hyper::Position, 2),
    (Hyper::Visit, 2),
    (Hyper::Drift, 2),
    (Hyper::RunZero, 1),
    (Hyper::RunGain, 1),
];

/// Those whose variances [`Tails`] is of.
const OF_TAILS: [Hyper; PARTS] =
    [Hyper::Floor, Hyper::Relative, Hyper::Position, Hyper::Visit, Hyper::RunZero, Hyper::RunGain];

/// Means over the learned numbers.
pub struct Mixed {
    /// Of the coefficients.
    pub mean: Vec<f64>,
    /// Covariance of the coefficients, that of the learned numbers included.
    pub covariance: DMatrix<f64>,
    /// Mean variances beside the curve; of the zero and the gain of runs the squares of mean standard deviations: of six runs these hold 68 % of
    /// the readings of another one, and mean variances some more.
    pub spread: Spread,
    /// How well these are known.
    pub tails: Tails,
    /// How wide the first peak is.
    pub widths: Widths,
}

/// The mean over points about the peaks, weighted by what likelihood and prior make of them; of the peak alone where there are none.
/// `widths` are those of a fit of nearly the same rows.
pub fn mean(
    problem: &Problem,
    peaks: &[Peak],
    kept: &[usize],
    points: usize,
    widths: Option<&Widths>,
) -> Mixed {
    let first = &peaks[0];
    let heard =
        peaks.iter().filter(|p| points > 0 && p.solved.value < first.solved.value + crate::fit::HEARD);
    let proposals: Vec<Proposal<'_>> = heard.map(|p| Proposal::new(problem, p, widths)).collect();
    let mut all: Vec<(f64, Vec<f64>, Option<Solved>)> = Vec::new();
    // Peaks may overlap: what a point is drawn from is all of them.
    for proposal in &proposals {
        for k in 0..(points / proposals.len()).max(1) {
            let at = proposal.point(k);
            let densities = proposals.iter().map(|p| p.log_density(&at));
            let most = densities.clone().fold(f64::NEG_INFINITY, f64::max);
            let log_density = most + densities.map(|x| (x - most).exp()).sum::<f64>().ln();
            if let Some(solved) = problem.solve(&at) {
                all.push((first.solved.value - solved.value - log_density, at, Some(solved)));
            }
        }
    }
    if all.is_empty() {
        all.push((0.0, first.at.clone(), None));
    }
    let top = all.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = all.iter().map(|p| (p.0 - top).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let n = kept.len();
    let (mut mean, mut square, mut means) = (DVector::zeros(n), DMatrix::zeros(n, n), [0.0; 7]);
    let (mut variances, mut products) = ([0.0; PARTS], [[0.0; PARTS]; PARTS]);
    for ((_, at, solved), weight) in all.iter().zip(&weights) {
        let (w, solved) = (weight / sum, solved.as_ref().unwrap_or(&first.solved));
        // About the first peak: differences of large numbers cost digits.
        let here = DVector::from_iterator(n, kept.iter().map(|k| solved.mean[*k] - first.solved.mean[*k]));
        square += (solved.covariance(kept) + &here * here.transpose()) * w;
        mean += here * w;
        OF_SPREAD
            .iter()
            .zip(&mut means)
            .for_each(|((h, power), x)| *x += w * problem.learned(at, *h).powi(*power));
        let own = OF_TAILS.map(|h| problem.learned(at, h).powi(2));
        for (i, x) in own.into_iter().enumerate() {
            variances[i] += w * x;
            products[i].iter_mut().zip(own).for_each(|(sum, y)| *sum += w * x * y);
        }
    }
    let [floor, relative, position, visit, drift, zero, gain] = means;
    let [zero, gain] = [zero * zero, gain * gain];
    let spread = Spread { floor: floor + problem.steps, relative, position, visit, zero, gain, drift };
    let tails =
        Tails(std::array::from_fn(|i| std::array::from_fn(|k| products[i][k] - variances[i] * variances[k])));
    let covariance = square - &mean * mean.transpose();
    let mean = kept.iter().zip(mean.iter()).map(|(k, x)| x + first.solved.mean[*k]).collect();
    let widths = proposals.into_iter().next().map_or(Vec::new(), |p| p.widths);
    Mixed { mean, covariance, spread, tails, widths }
}
