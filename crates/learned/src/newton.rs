//! The most likely learned numbers, and how sharp that is: Newton's method with a Hessian from differences of exact gradients.

use nalgebra::{DMatrix, DVector};

use crate::evidence::{Problem, Solved};

/// Steps of the differences, in ln.
const STEP: f64 = 1e-3;
/// A gradient of this size is none.
const FLAT: f64 = 1e-7;
/// Longest step, in ln.
const LONGEST: f64 = 2.0;

/// A maximum of likelihood and prior.
pub struct Peak {
    /// Logarithms of the learned numbers.
    pub at: Vec<f64>,
    /// The coefficients there.
    pub solved: Solved,
    /// Second derivatives of −ln.
    pub hessian: DMatrix<f64>,
}

/// Second derivatives at `at`, made positive.
fn hessian(problem: &Problem, at: &[f64]) -> Option<DMatrix<f64>> {
    let n = at.len();
    let mut h = DMatrix::zeros(n, n);
    for k in 0..n {
        let slopes = [-STEP, STEP].map(|step| {
            let mut there = at.to_vec();
            there[k] += step;
            Some(problem.gradient(&there, &problem.solve(&there)?))
        });
        let [lo, hi] = slopes;
        let (lo, hi) = (lo?, hi?);
        (0..n).for_each(|i| h[(i, k)] = (hi[i] - lo[i]) / (2.0 * STEP));
    }
    Some(0.5 * (&h + h.transpose()))
}

/// The Hessian with what the prior alone gives as least curvature, where it is not positive.
fn positive(h: &DMatrix<f64>, priors: &[[f64; 2]]) -> DMatrix<f64> {
    let mut added = 0.0;
    loop {
        let least = |k: usize| added / priors[k][1].powi(2);
        let tried = h + DMatrix::from_diagonal(&DVector::from_fn(h.nrows(), |k, _| least(k)));
        if tried.clone().cholesky().is_some() {
            return tried;
        }
        added = if added == 0.0 { 0.1 } else { 2.0 * added };
    }
}

/// Climbs from `start`.
pub fn climb(problem: &Problem, start: &[f64]) -> Option<Peak> {
    let mut at = start.to_vec();
    let mut solved = problem.solve(&at)?;
    let mut curvature = None;
    for round in 0..60 {
        let gradient = DVector::from_vec(problem.gradient(&at, &solved));
        // Far from the peak the curvature changes slowly against what it costs.
        if round % 2 == 0 || gradient.amax() < 0.3 || curvature.is_none() {
            curvature = Some(positive(&hessian(problem, &at)?, &problem.priors));
        }
        let h = curvature.as_ref()?;
        if gradient.amax() < FLAT {
            break;
        }
        let mut step = -h.clone().cholesky()?.solve(&gradient);
        let longest = step.amax();
        if longest > LONGEST {
            step *= LONGEST / longest;
        }
        let mut share = 1.0;
        let moved = loop {
            let there: Vec<f64> = at.iter().zip(step.iter()).map(|(x, s)| (x + share * s).clamp(-30.0, 12.0)).collect();
            match problem.solve(&there) {
                Some(next) if next.value <= solved.value + 1e-4 * share * gradient.dot(&step) => {
                    let gain = solved.value - next.value;
                    (at, solved) = (there, next);
                    break gain;
                }
                _ if share < 1e-4 => break -1.0,
                _ => share *= 0.4,
            }
        };
        if moved < 0.0 || (moved < 1e-9 && gradient.amax() < 1e-4) {
            break;
        }
    }
    let hessian = positive(&hessian(problem, &at)?, &problem.priors);
    Some(Peak { at, solved, hessian })
}
