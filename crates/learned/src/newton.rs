//! Most likely learned numbers and their curvature: Newton's method with a Hessian from differences of exact gradients.

use nalgebra::{DMatrix, DVector};

use crate::evidence::{Problem, Solved};

const STEP: f64 = 1e-3;
const FLAT: f64 = 1e-7;
const LONGEST: f64 = 2.0;

/// Maximum of likelihood times prior.
pub struct Peak {
    /// Logarithms of the learned numbers.
    pub at: Vec<f64>,
    /// Coefficients at the peak.
    pub solved: Solved,
    /// Second derivatives of −ln(likelihood × prior).
    pub hessian: DMatrix<f64>,
}

/// Hessian at `at`; if it is not positive definite, curvature of the prior is added until it is.
fn hessian(problem: &Problem, at: &[f64], gradient: &DVector<f64>) -> DMatrix<f64> {
    let n = at.len();
    let column = |k: usize| {
        let mut there = at.to_vec();
        there[k] += STEP;
        let beside = problem.gradient(&there, &problem.solve(&there)?);
        Some((DVector::from_vec(beside) - gradient) / STEP)
    };
    let columns = (0..n).map(column).collect::<Option<Vec<_>>>();
    let h = columns.filter(|_| n > 0).map_or(DMatrix::zeros(n, n), |columns| DMatrix::from_columns(&columns));
    let h = 0.5 * (&h + h.transpose());
    let mut added = 0.0;
    loop {
        let least = |k: usize, _| added / problem.priors[k].width().powi(2);
        let tried = &h + DMatrix::from_diagonal(&DVector::from_fn(n, least));
        if tried.clone().cholesky().is_some() {
            return tried;
        }
        added = if added == 0.0 { 0.1 } else { 2.0 * added };
    }
}

fn descend(
    problem: &Problem,
    at: &mut Vec<f64>,
    solved: &mut Solved,
    gradient: &DVector<f64>,
    step: &DVector<f64>,
) -> Option<f64> {
    let longest = step.amax();
    let mut share = if longest > LONGEST { LONGEST / longest } else { 1.0 };
    while share > 1e-5 {
        let there: Vec<f64> =
            at.iter().zip(step.iter()).map(|(x, s)| (x + share * s).clamp(-30.0, 12.0)).collect();
        match problem.solve(&there) {
            Some(next) if next.value <= solved.value + 1e-4 * share * gradient.dot(step) => {
                let gain = solved.value - next.value;
                (*at, *solved) = (there, next);
                return Some(gain);
            }
            _ => share *= 0.4,
        }
    }
    None
}

/// Climbs from `start` towards a peak without second derivatives (BFGS).
pub fn approach(problem: &Problem, start: &[f64]) -> Option<(Vec<f64>, f64)> {
    let n = start.len();
    let mut at = start.to_vec();
    let mut solved = problem.solve(&at)?;
    let of_prior = DVector::from_fn(n, |k, _| problem.priors[k].width().powi(2).min(1.0) * 0.3);
    let mut inverse = DMatrix::from_diagonal(&of_prior);
    let mut gradient = DVector::from_vec(problem.gradient(&at, &solved));
    for _ in 0..80 {
        if gradient.amax() < 0.03 {
            break;
        }
        let step = -(&inverse * &gradient);
        let before = DVector::from_column_slice(&at);
        let gain = descend(problem, &mut at, &mut solved, &gradient, &step);
        let next = DVector::from_vec(problem.gradient(&at, &solved));
        let (moved, turned) = (DVector::from_column_slice(&at) - before, &next - &gradient);
        let along = moved.dot(&turned);
        if along > 1e-10 {
            let left = DMatrix::identity(n, n) - &moved * turned.transpose() / along;
            inverse = &left * &inverse * left.transpose() + &moved * moved.transpose() / along;
        } else if gain.is_none() {
            inverse = DMatrix::from_diagonal(&of_prior);
        }
        gradient = next;
        if gain.is_none_or(|g| g < 1e-5) {
            break;
        }
    }
    Some((at, solved.value))
}

/// Climbs from near a peak to the peak.
pub fn climb(problem: &Problem, start: &[f64]) -> Option<Peak> {
    let mut at = start.to_vec();
    let mut solved = problem.solve(&at)?;
    let mut curvature = None;
    for _ in 0..20 {
        let gradient = DVector::from_vec(problem.gradient(&at, &solved));
        if gradient.amax() < FLAT {
            break;
        }
        // Near the peak the Hessian changes slowly and is expensive.
        if curvature.is_none() || gradient.amax() > 0.1 {
            curvature = Some(hessian(problem, &at, &gradient));
        }
        let step = -curvature.as_ref()?.clone().cholesky()?.solve(&gradient);
        let gain = descend(problem, &mut at, &mut solved, &gradient, &step);
        if gain.is_none_or(|g| g < 1e-11 * (1.0 + solved.value.abs()) && gradient.amax() < 1e-6) {
            break;
        }
    }
    // Evaluate at the peak, so that the result does not depend on the path.
    let gradient = DVector::from_vec(problem.gradient(&at, &solved));
    let hessian = hessian(problem, &at, &gradient);
    Some(Peak { at, solved, hessian })
}
