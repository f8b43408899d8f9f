//! Nonlinear least squares within bounds: Gauss-Newton steps in a trust region; unknowns that push against a bound stay there.
//! Without bounds a fit stalled at friction 0 and ν 0.5, where its steps left the valid range.

use nalgebra::{DMatrix, DVector, Dyn, SVD};

/// First and largest radius of the trust region; a plausible range of an unknown is about 1.
const RADIUS: f64 = 0.3;
const WIDEST: f64 = 10.0;
const PATIENCE: usize = 60;
const BISECTIONS: usize = 60;

/// A least-squares problem of a model M, whose evaluation may fail with E.
#[allow(clippy::type_complexity)]
pub struct Problem<'a, M, E> {
    /// The model at these unknowns; the other argument is that at a nearby point.
    pub model: &'a dyn Fn(&DVector<f64>, &M) -> Result<M, E>,
    /// Residuals; `None` if the model has no value for some of the data.
    pub residuals: &'a dyn Fn(&M) -> Option<DVector<f64>>,
    /// Derivatives of the residuals, a column for each unknown.
    pub slopes: &'a dyn Fn(&mut M) -> Result<Option<DMatrix<f64>>, E>,
}

/// Minimises from `x` and its `model` within `bounds`. Stops when a step changes unknowns, or squares, by less than the share `settled`.
pub fn minimise<M, E>(
    problem: &Problem<'_, M, E>,
    mut x: DVector<f64>,
    mut model: M,
    bounds: &[[f64; 2]],
    settled: f64,
) -> Result<M, E> {
    let mut radius = RADIUS;
    let mut trials = PATIENCE * (x.len() + 1);
    while trials > 0 {
        let (r, j) = ((problem.residuals)(&model), (problem.slopes)(&mut model)?);
        let (Some(r), Some(j)) = (r, j) else { break };
        let before = r.norm_squared();
        loop {
            trials = trials.saturating_sub(1);
            let Some(step) = within(&x, (&j, &r), bounds, radius) else { return Ok(model) };
            let trial = DVector::from_fn(x.len(), |i, _| (x[i] + step[i]).clamp(bounds[i][0], bounds[i][1]));
            let foreseen = 1.0 - (&r + &j * &step).norm_squared() / before;
            let still = step.norm() <= settled * x.norm();
            // NaN if the residuals are zero.
            if still || trials == 0 || foreseen.is_nan() || foreseen <= settled * settled.sqrt() {
                return Ok(model);
            }
            let next = (problem.model)(&trial, &model)?;
            let gain =
                (problem.residuals)(&next).map_or(f64::NEG_INFINITY, |r| 1.0 - r.norm_squared() / before);
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

/// Best step of length `radius` at most within the bounds: unknowns that reach a bound stay there. `None` if the linear algebra fails.
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

fn damped(j: &DMatrix<f64>, r: &DVector<f64>, radius: f64) -> Option<DVector<f64>> {
    let svd = values(j.clone(), true)?;
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

/// Step of differences as a share of a plausible change of an unknown.
const SMALL: f64 = 1e-5;

/// Minimum found from values alone, without given derivatives.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// Unknowns at the minimum.
    pub at: Vec<f64>,
    /// Inverse of the normal matrix.
    pub covariance: DMatrix<f64>,
    /// Residuals over their standard deviations.
    pub residuals: Vec<f64>,
}

impl Minimum {
    /// Sum of squares.
    pub fn chi2(&self) -> f64 {
        self.residuals.iter().map(|r| r * r).sum()
    }
}

/// Residuals as a function of the unknowns; `None` where some have no value.
pub type Residuals<'a> = &'a dyn Fn(&[f64]) -> Option<Vec<f64>>;

/// Central differences of half widths `h`, one-sided at the `bounds`; a row for each residual. `None` where a value is missing.
pub fn slopes(of: Residuals<'_>, x: &[f64], h: &[f64], bounds: &[[f64; 2]]) -> Option<DMatrix<f64>> {
    let mut columns = Vec::with_capacity(x.len());
    let mut moved = x.to_vec();
    for (i, h) in h.iter().enumerate() {
        let ends = [x[i] - h, x[i] + h].map(|end| end.clamp(bounds[i][0], bounds[i][1]));
        let mut at = |end: f64| {
            moved[i] = end;
            Some(DVector::from_vec(of(&moved)?))
        };
        let (low, high) = (at(ends[0])?, at(ends[1])?);
        moved[i] = x[i];
        columns.push((high - low) / (ends[1] - ends[0]));
    }
    Some(DMatrix::from_columns(&columns))
}

/// Bounds of an unknown without bounds.
pub const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Minimises `residuals` from `start`; `h` is a small change of each unknown. `None` without residuals at the start, or if unknowns are undetermined.
pub fn by_values(
    residuals: Residuals<'_>,
    start: &[f64],
    h: &[f64],
    bounds: &[[f64; 2]],
    settled: f64,
) -> Option<Minimum> {
    residuals(start)?;
    let scale: Vec<f64> = h.iter().map(|h| h / SMALL).collect();
    let scaled = DVector::from_fn(start.len(), |i, _| start[i] / scale[i]);
    let scaled_bounds: Vec<[f64; 2]> = bounds.iter().zip(&scale).map(|(b, s)| b.map(|end| end / s)).collect();
    let place = |((x, s), [lo, hi]): ((&f64, &f64), &[f64; 2])| (x * s).clamp(*lo, *hi);
    let problem = Problem::<Vec<f64>, std::convert::Infallible> {
        model: &|x, _| Ok(x.iter().zip(&scale).zip(bounds).map(place).collect()),
        residuals: &|x| residuals(x).filter(|r| r.iter().all(|r| r.is_finite())).map(DVector::from_vec),
        slopes: &|x| {
            let slopes = slopes(residuals, x, h, bounds);
            Ok(slopes.map(|j| DMatrix::from_fn(j.nrows(), j.ncols(), |i, k| j[(i, k)] * scale[k])))
        },
    };
    let Ok(at) = minimise(&problem, scaled, start.to_vec(), &scaled_bounds, settled);
    let j = slopes(residuals, &at, h, bounds)?;
    let (_, covariance) = solve(&j.tr_mul(&j), &DVector::zeros(at.len()))?;
    Some(Minimum { residuals: residuals(&at)?, covariance, at })
}

/// Solution of `n` x = `b`, and the inverse of `n`; `None` if `n` is singular or not finite.
pub fn solve(n: &DMatrix<f64>, b: &DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let m = n.nrows();
    let scale: Vec<f64> = (0..m).map(|i| n[(i, i)].sqrt()).collect();
    if !scale.iter().all(|s| *s > 0.0 && s.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(m, m, |i, k| n[(i, k)] / (scale[i] * scale[k])).cholesky()?.inverse();
    let inverse = DMatrix::from_fn(m, m, |i, k| scaled[(i, k)] / (scale[i] * scale[k]));
    let x = &inverse * b;
    (x.iter().chain(inverse.iter()).all(|c| c.is_finite())).then_some((x, inverse))
}

const STEPS: usize = 10_000;

/// Singular values in no particular order, with right vectors, and left ones if `left`. `None` if the matrix is empty or numbers are not finite.
pub fn values(matrix: DMatrix<f64>, left: bool) -> Option<SVD<f64, Dyn, Dyn>> {
    let finite = |x: &f64| x.is_finite();
    if matrix.is_empty() || !matrix.iter().all(finite) {
        return None;
    }
    let svd = SVD::try_new_unordered(matrix, left, true, 5.0 * f64::EPSILON, STEPS)?;
    let sound = |m: &DMatrix<f64>| m.iter().all(finite);
    let all = svd.singular_values.iter().all(finite)
        && svd.v_t.as_ref().is_none_or(sound)
        && svd.u.as_ref().is_none_or(sound);
    all.then_some(svd)
}
