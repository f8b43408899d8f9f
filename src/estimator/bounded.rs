//! Least squares within bounds: Gauss and Newton's steps in a trust region of the unknowns, which stay at bounds that they push against.
//! Levenberg and Marquardt's method without bounds stalled where friction was 0 and ν 0.5: it went on to step out of what both may be.

use nalgebra::{DMatrix, DVector};

use super::singular;

/// First and largest radius of the trust region, in unknowns, whose plausible range is about 1.
const RADIUS: f64 = 0.3;
const WIDEST: f64 = 10.0;
/// Most trials per unknown.
const PATIENCE: usize = 60;
/// Bisections of the damping.
const BISECTIONS: usize = 60;

/// What is fitted.
pub trait Problem {
    /// What the unknowns make.
    type Model;
    /// What can go wrong.
    type Error;

    /// Of the unknowns `x`, which are not far from those of `near`.
    fn model(&self, x: &DVector<f64>, near: &Self::Model) -> Result<Self::Model, Self::Error>;

    /// `None` where `model` says nothing about some of the data.
    fn residuals(&self, model: &Self::Model) -> Option<DVector<f64>>;

    /// d residual/d unknown.
    fn slopes(&self, model: &mut Self::Model) -> Result<Option<DMatrix<f64>>, Self::Error>;
}

/// The least squares from `x` and its `model` on, with every unknown in its `bounds`; ends where a step changes the unknowns, or the sum of
/// squares, by less than `settled` of it.
///
/// # Errors
/// Those of the problem.
pub fn minimise<P: Problem>(
    problem: &P,
    mut x: DVector<f64>,
    mut model: P::Model,
    bounds: &[[f64; 2]],
    settled: f64,
) -> Result<P::Model, P::Error> {
    let mut radius = RADIUS;
    let mut trials = PATIENCE * (x.len() + 1);
    while trials > 0 {
        let (r, j) = (problem.residuals(&model), problem.slopes(&mut model)?);
        let (Some(r), Some(j)) = (r, j) else { break };
        let before = r.norm_squared();
        loop {
            trials = trials.saturating_sub(1);
            let Some(step) = within(&x, (&j, &r), bounds, radius) else { return Ok(model) };
            let trial = clamped(&(&x + &step), bounds);
            let foreseen = 1.0 - (&r + &j * &step).norm_squared() / before;
            let still = step.norm() <= settled * x.norm();
            // Not-a-number where nothing is left of the squares.
            if still || trials == 0 || foreseen.is_nan() || foreseen <= settled * settled.sqrt() {
                return Ok(model);
            }
            let next = problem.model(&trial, &model)?;
            let gain =
                problem.residuals(&next).map_or(f64::NEG_INFINITY, |r| 1.0 - r.norm_squared() / before);
            if gain < 0.25 * foreseen {
                radius = 0.25 * step.norm();
            } else if gain > 0.75 * foreseen {
                radius = radius.max(2.0 * step.norm()).min(WIDEST);
            }
            if gain > 1e-4 * foreseen {
                (x, model) = (trial, next);
                if gain.max(foreseen) <= settled {
                    return Ok(model);
                }
                break;
            }
        }
    }
    Ok(model)
}

fn clamped(x: &DVector<f64>, bounds: &[[f64; 2]]) -> DVector<f64> {
    DVector::from_fn(x.len(), |i, _| x[i].clamp(bounds[i][0], bounds[i][1]))
}

/// The step of at most about `radius` from `x` that foresees the least squares; what it would carry past a bound goes to that, and the others go on
/// from there. `None` where numbers fail.
fn within(
    x: &DVector<f64>,
    (j, r): (&DMatrix<f64>, &DVector<f64>),
    bounds: &[[f64; 2]],
    radius: f64,
) -> Option<DVector<f64>> {
    let gradient = j.tr_mul(r);
    let pushes = |i: usize| {
        let [lo, hi] = bounds[i];
        (x[i] <= lo && gradient[i] > 0.0) || (x[i] >= hi && gradient[i] < 0.0)
    };
    let mut free: Vec<usize> = (0..x.len()).filter(|&i| !pushes(i)).collect();
    let mut step = DVector::zeros(x.len());
    while !free.is_empty() {
        let part = damped(&j.select_columns(&free), &(r + j * &step), radius)?;
        let past = |(k, i): (usize, &usize)| {
            let [lo, hi] = bounds[*i];
            let end = x[*i] + part[k];
            (end < lo || end > hi).then(|| (*i, end.clamp(lo, hi) - x[*i]))
        };
        let ends: Vec<(usize, f64)> = free.iter().enumerate().filter_map(past).collect();
        if ends.is_empty() {
            free.iter().zip(part.iter()).for_each(|(i, s)| step[*i] = *s);
            break;
        }
        ends.iter().for_each(|(i, s)| step[*i] = *s);
        free.retain(|i| !ends.iter().any(|(e, _)| e == i));
    }
    Some(step)
}

/// The best step no longer than `radius` where no bound is near.
fn damped(j: &DMatrix<f64>, r: &DVector<f64>, radius: f64) -> Option<DVector<f64>> {
    let svd = singular::values(j.clone(), true)?;
    let (along, right) = (svd.u?.tr_mul(r), svd.v_t?.transpose());
    let of = |lambda: f64| {
        let part = |s: f64, b: f64| if s == 0.0 { 0.0 } else { -s * b / (s * s + lambda) };
        &right * svd.singular_values.zip_map(&along, part)
    };
    let whole = of(0.0);
    if whole.norm() <= radius {
        return Some(whole);
    }
    // The step is no longer than |Jᵀ r| / λ.
    let most = svd.singular_values.max() * along.norm() / radius;
    let (mut lo, mut hi) = ((most * 1e-32).ln(), most.ln());
    for _ in 0..BISECTIONS {
        let mid = 0.5 * (lo + hi);
        *(if of(mid.exp()).norm() > radius { &mut lo } else { &mut hi }) = mid;
    }
    Some(of(hi.exp()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley: 10 (y − x²) and 1 − x.
    struct Valley;

    impl Problem for Valley {
        type Model = DVector<f64>;
        type Error = ();

        fn model(&self, x: &DVector<f64>, _: &DVector<f64>) -> Result<DVector<f64>, ()> {
            Ok(x.clone())
        }

        fn residuals(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
            Some(DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]))
        }

        fn slopes(&self, x: &mut DVector<f64>) -> Result<Option<DMatrix<f64>>, ()> {
            Ok(Some(DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0])))
        }
    }

    #[test]
    fn the_end_of_a_valley_and_the_best_of_its_bounds_are_found() {
        let all = [f64::NEG_INFINITY, f64::INFINITY];
        let start = DVector::from_vec(vec![-1.2, 1.0]);
        let free = minimise(&Valley, start.clone(), start.clone(), &[all; 2], 1e-14).unwrap();
        assert!((free - DVector::from_element(2, 1.0)).norm() < 1e-12);
        // At x = 0.5 the best y is 0.25; and 0.3 of the bounds that begin there.
        for (first, y, low) in [(-1.2, 0.25, -5.0), (0.2, 0.3, 0.3)] {
            let bounds = [[-2.0, 0.5], [low, 5.0]];
            let start = DVector::from_vec(vec![first, 1.0]);
            let found = minimise(&Valley, start.clone(), start, &bounds, 1e-14).unwrap();
            assert!((found[0] - 0.5).abs() < 1e-9 && (found[1] - y).abs() < 1e-9, "{found}");
        }
    }
}
