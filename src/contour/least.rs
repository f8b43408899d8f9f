//! Small nonlinear least squares: Levenberg and Marquardt's steps on a handful of parameters, derivatives by central differences.

use nalgebra::{DMatrix, DVector};

use crate::estimator::normal;

/// Most steps.
const STEPS: usize = 60;
/// Relative gain of χ² below which a step is the last.
const GAIN: f64 = 1e-10;

/// A minimum.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// Where it is.
    pub at: Vec<f64>,
    /// Inverse of the normal matrix there.
    pub covariance: DMatrix<f64>,
    /// Residuals, each over its standard deviation.
    pub residuals: Vec<f64>,
}

impl Minimum {
    /// Sum of squares.
    pub fn chi2(&self) -> f64 {
        self.residuals.iter().map(|r| r * r).sum()
    }
}

/// Derivatives of `of` at `x` by central differences of half widths `h`: a row each; `None` where a value is missing.
pub fn slopes(of: &dyn Fn(&[f64]) -> Option<Vec<f64>>, x: &[f64], h: &[f64]) -> Option<DMatrix<f64>> {
    let mut columns = Vec::with_capacity(x.len());
    let mut moved = x.to_vec();
    for (i, h) in h.iter().enumerate() {
        moved[i] = x[i] + h;
        let high = DVector::from_vec(of(&moved)?);
        moved[i] = x[i] - h;
        let low = DVector::from_vec(of(&moved)?);
        moved[i] = x[i];
        columns.push((high - low) / (2.0 * h));
    }
    Some(DMatrix::from_columns(&columns))
}

/// The minimum of the sum of squares of `residuals` that is reached from `start`; `h` is a small change of each parameter. `None` where
/// residuals are missing at the start, or what the data do not determine is asked for.
pub fn minimise(
    residuals: &dyn Fn(&[f64]) -> Option<Vec<f64>>,
    start: Vec<f64>,
    h: &[f64],
) -> Option<Minimum> {
    let size = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>();
    let mut x = start;
    let mut r = residuals(&x)?;
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let j = slopes(residuals, &x, h)?;
        let gradient = j.tr_mul(&DVector::from_column_slice(&r));
        let curvature = j.tr_mul(&j);
        let before = size(&r);
        let mut gained = None;
        while damping < 1e12 {
            let mut n = curvature.clone();
            (0..x.len()).for_each(|i| n[(i, i)] *= 1.0 + damping);
            let (step, _) = normal::solve(&n, &gradient)?;
            let next: Vec<f64> = x.iter().zip(step.iter()).map(|(x, s)| x - s).collect();
            match residuals(&next).filter(|r| size(r) <= before) {
                Some(found) => {
                    gained = Some(before - size(&found));
                    (x, r) = (next, found);
                    damping *= 0.2;
                    break;
                }
                None => damping *= 5.0,
            }
        }
        if gained.is_none_or(|g| g <= GAIN * before) {
            break;
        }
    }
    let j = slopes(residuals, &x, h)?;
    let n = j.tr_mul(&j);
    let (_, covariance) = normal::solve(&n, &DVector::zeros(x.len()))?;
    Some(Minimum { at: x, covariance, residuals: r })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let valley = |x: &[f64]| Some(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]);
        let m = minimise(&valley, vec![-1.2, 1.0], &[1e-5, 1e-5]).unwrap();
        assert!((m.at[0] - 1.0).abs() < 1e-6 && (m.at[1] - 1.0).abs() < 1e-6, "{:?}", m.at);
        assert!(minimise(&|x| Some(vec![x[0] - 1.0]), vec![0.0, 0.0], &[1e-5, 1e-5]).is_none());
        assert!(minimise(&|_| None, vec![0.0], &[1e-5]).is_none());
    }
}
