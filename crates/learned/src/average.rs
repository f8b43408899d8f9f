//! The mean over what the learned numbers may be: importance sampling about the peaks of their likelihood.

use nalgebra::{DMatrix, DVector};

use crate::curve::Spread;
use crate::evidence::{Problem, Solved};
use crate::hyper::Hyper;
use crate::newton::Peak;

/// Points over which the learned numbers are averaged: of few cells, of more, of many.
const POINTS: [usize; 3] = [120, 60, 20];

/// Of so many cells the learned numbers are uncertain, and points cost little.
const FEW: usize = 60;

/// Points of a low-discrepancy sequence as normal deviates (Halton; Acklam's inverse).
fn deviates(point: usize, dim: usize) -> Vec<f64> {
    const PRIMES: [usize; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];
    let radical = |base: usize| {
        let (mut k, mut share, mut x) = (point + 20, 1.0, 0.0);
        while k > 0 {
            share /= base as f64;
            x += share * (k % base) as f64;
            k /= base;
        }
        x
    };
    (0..dim).map(|d| normal_quantile(radical(PRIMES[d % PRIMES.len()]).clamp(1e-9, 1.0 - 1e-9))).collect()
}

/// Quantile of the normal distribution, to 1e-9 (Acklam 2003).
fn normal_quantile(p: f64) -> f64 {
    const A: [f64; 6] = [
        -39.69683028665376,
        220.9460984245205,
        -275.9285104469687,
        138.357751867269,
        -30.66479806614716,
        2.506628277459239,
    ];
    const B: [f64; 5] =
        [-54.47609879822406, 161.5858368580409, -155.6989798598866, 66.80131188771972, -13.28068155288572];
    const C: [f64; 6] = [
        -0.007784894002430293,
        -0.3223964580411365,
        -2.400758277161838,
        -2.549732539343734,
        4.374664141464968,
        2.938163982698783,
    ];
    const D: [f64; 4] = [0.007784695709041462, 0.3224671290700398, 2.445134137142996, 3.754408661907416];
    let series = |c: &[f64], x: f64| c.iter().fold(0.0, |s, c| s * x + c);
    if p > 0.5 {
        return -normal_quantile(1.0 - p);
    }
    if p < 0.02425 {
        let q = (-2.0 * p.ln()).sqrt();
        return series(&C, q) / (series(&D, q) * q + 1.0);
    }
    let q = p - 0.5;
    let r = q * q;
    series(&A, r) * q / (series(&B, r) * r + 1.0)
}

/// Points for so many cells.
pub fn points(cells: usize) -> usize {
    POINTS[usize::from(cells > FEW) + usize::from(cells > crate::fit::MANY)]
}

/// Means over the learned numbers.
pub struct Mixed {
    /// Of the coefficients.
    pub mean: Vec<f64>,
    /// Covariance of the coefficients, that of the learned numbers included.
    pub covariance: DMatrix<f64>,
    /// Of the variances beside the curve.
    pub spread: Spread,
}

/// The mean over points about the peaks, weighted by what likelihood and prior make of them.
pub fn mean(problem: &Problem, peaks: &[Peak], kept: &[usize], points: usize) -> Mixed {
    // Half of the points as far as the curvature says, half farther: few data leave long tails.
    const WIDER: [f64; 2] = [1.0, 1.5];
    let (d, first) = (problem.dim(), &peaks[0]);
    let mut all: Vec<(f64, Vec<f64>, Option<Solved>)> = Vec::new();
    let heard: Vec<&Peak> =
        peaks.iter().filter(|p| p.solved.value < first.solved.value + crate::fit::HEARD).collect();
    for peak in &heard {
        let factor = peak.hessian.clone().cholesky().expect("it was made positive").l();
        let width: f64 = factor.diagonal().iter().map(|x| x.ln()).sum();
        for k in 0..points / heard.len() {
            let z = DVector::from_vec(deviates(k, d)) * WIDER[k % 2];
            let density = |s: &f64| (-0.5 * z.norm_squared() / (s * s)).exp() * s.powi(-(d as i32));
            let proposal = (WIDER.iter().map(density).sum::<f64>()).max(1e-300).ln() + width;
            let Some(step) = factor.transpose().solve_upper_triangular(&z) else { continue };
            let at: Vec<f64> =
                peak.at.iter().zip(step.iter()).map(|(x, s)| (x + s).clamp(-30.0, 12.0)).collect();
            if let Some(solved) = problem.solve(&at) {
                all.push((first.solved.value - solved.value - proposal, at, Some(solved)));
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
    let (mut mean, mut square, mut spread) = (DVector::zeros(n), DMatrix::zeros(n, n), Spread::default());
    for ((_, at, solved), weight) in all.iter().zip(&weights) {
        let (w, solved) = (weight / sum, solved.as_ref().unwrap_or(&first.solved));
        // About the first peak: differences of large numbers cost digits.
        let here = DVector::from_iterator(n, kept.iter().map(|k| solved.mean[*k] - first.solved.mean[*k]));
        square += (solved.covariance(kept) + &here * here.transpose()) * w;
        mean += here * w;
        let of = |h: Hyper| w * problem.learned(at, h).powi(2);
        spread.floor += of(Hyper::Floor) + w * problem.steps;
        spread.relative += of(Hyper::Relative);
        spread.position += of(Hyper::Position);
        spread.visit += of(Hyper::Visit);
        spread.zero += of(Hyper::RunZero);
        spread.gain += of(Hyper::RunGain);
        spread.drift += of(Hyper::Drift);
    }
    let covariance = square - &mean * mean.transpose();
    let mean = kept.iter().zip(mean.iter()).map(|(k, x)| x + first.solved.mean[*k]).collect();
    Mixed { mean, covariance, spread }
}
