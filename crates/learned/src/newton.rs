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

/// Second derivatives at `at`, where the gradient is `gradient`; with what the prior alone gives as least curvature, where they are not positive.
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

/// One step down along `step`, shortened until it is one; what it gained, `None` where there is none.
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

/// Climbs from `start` without second derivatives (Broyden, Fletcher, Goldfarb, Shanno) to the neighbourhood of a peak.
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

/// Climbs from the neighbourhood of a peak to it.
pub fn climb(problem: &Problem, start: &[f64]) -> Option<Peak> {
    let mut at = start.to_vec();
    let mut solved = problem.solve(&at)?;
    let mut curvature = None;
    for _ in 0..20 {
        let gradient = DVector::from_vec(problem.gradient(&at, &solved));
        if gradient.amax() < FLAT {
            break;
        }
        // Near the peak the curvature changes slowly against what it costs.
        if curvature.is_none() || gradient.amax() > 0.1 {
            curvature = Some(hessian(problem, &at, &gradient));
        }
        let step = -curvature.as_ref()?.clone().cholesky()?.solve(&gradient);
        let gain = descend(problem, &mut at, &mut solved, &gradient, &step);
        if gain.is_none_or(|g| g < 1e-11 * (1.0 + solved.value.abs()) && gradient.amax() < 1e-6) {
            break;
        }
    }
    // At the peak itself: what it is must not depend on the way there.
    let gradient = DVector::from_vec(problem.gradient(&at, &solved));
    let hessian = hessian(problem, &at, &gradient);
    Some(Peak { at, solved, hessian })
}
