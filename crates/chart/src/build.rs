//! Builds a chart: solves taps where they matter, and checks the result at separate points.

use super::adaptive::Interpolant;
use super::axis::{AXES, Axis, Quantity};
use super::series::Series;
use crate::error::SolveError;

/// Values of functions at a point; None where the tap has no reading.
pub type Value<const F: usize> = Option<[f64; F]>;

/// Gives the values at points, quantities in the order of [`super::axis::Quantity`].
pub type Ask<'a, const F: usize> = dyn FnMut(&[[f64; AXES]]) -> Result<Vec<Value<F>>, SolveError> + 'a;

/// Bounds on the errors of a function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Largest error.
    pub error: f64,
    /// Largest error relative to |value| + `small`.
    pub relative: f64,
    /// A small value.
    pub small: f64,
}

impl Bound {
    /// Bounds the absolute error only.
    pub fn of(error: f64) -> Self {
        Self { error, relative: f64::INFINITY, small: 1.0 }
    }

    /// `error` over its bound; at most 1 if within.
    pub fn share(&self, value: f64, error: f64) -> f64 {
        (error / self.error).max(error / (self.relative * (value.abs() + self.small)))
    }

    fn least(&self) -> f64 {
        0.2 * self.error.min(self.relative * self.small)
    }
}

/// Series over a box.
#[derive(Debug, Clone, PartialEq)]
pub struct Built<const F: usize> {
    /// The box.
    pub axes: [Axis; AXES],
    /// One per function.
    pub series: [Series; F],
    /// Largest error at the points that checked it.
    pub errors: [f64; F],
}

const TAPER: usize = Quantity::Taper as usize;

const CHECKS: usize = 160;

/// Rounds of adding terms until the check passes.
const TRIES: usize = 5;

/// Default for the most points of a chart.
pub const MOST: usize = 2600;

const CUTS: usize = 16;

/// Default axes to cut, one after the other, where the functions are too rough.
pub const ROUGH: [usize; 1] = [TAPER];

/// New end of such an axis in [−1, 1]: next to the apex, and next to the contact, the rod depends on its place most steeply.
const SMOOTHER: f64 = 0.6;

/// An axis that is cut first must keep at least this share, else another is cut.
const ENOUGH: f64 = 0.6;

/// Least share of an axis that a cut leaves.
const LEAST_SHARE: f64 = 0.15;

/// The series of `ask` over `axes` within `bounds`, from at most `most` points. Boxes with points without values are cut, and too rough functions have the
/// axes `cuts` cut, one after the other; `None` if that fails. A first axis other than the taper is also cut before others where points have no values.
pub fn build<const F: usize>(
    axes: [Axis; AXES],
    bounds: &[Bound; F],
    (most, cuts): (usize, &[usize]),
    ask: &mut Ask<'_, F>,
) -> Result<Option<Built<F>>, SolveError> {
    let mut axes = axes;
    let mut rough = 0;
    for _ in 0..CUTS {
        match over(axes, bounds, most, ask)? {
            Over::Built(built) => return Ok(Some(built)),
            Over::Rough => match cuts.get(rough).filter(|k| !axes[**k].is_point()) {
                Some(&k) => {
                    axes[k].range[1] = axes[k].at(SMOOTHER);
                    rough += 1;
                }
                None => return Ok(None),
            },
            Over::Without(points) => match cut(&axes, &points, cuts.first().filter(|k| **k != TAPER)) {
                Some(smaller) => axes = smaller,
                None => return Ok(None),
            },
        }
    }
    Ok(None)
}

type Values<const F: usize> = Result<Vec<[f64; F]>, Vec<[f64; AXES]>>;

enum Over<const F: usize> {
    Built(Built<F>),
    /// Points, in [−1, 1] of each axis, without values.
    Without(Vec<[f64; AXES]>),
    Rough,
}

fn over<const F: usize>(
    axes: [Axis; AXES],
    bounds: &[Bound; F],
    most: usize,
    ask: &mut Ask<'_, F>,
) -> Result<Over<F>, SolveError> {
    let points = axes.map(|a| a.is_point());
    let place = |x: &[f64; AXES]| -> [f64; AXES] { std::array::from_fn(|k| axes[k].at(x[k])) };
    let mut values_at = |x: &[[f64; AXES]]| -> Result<Values<F>, SolveError> {
        let found = ask(&x.iter().map(place).collect::<Vec<_>>())?;
        let without: Vec<[f64; AXES]> =
            x.iter().zip(&found).filter(|(_, v)| v.is_none()).map(|(x, _)| *x).collect();
        Ok(if without.is_empty() { Ok(found.into_iter().flatten().collect()) } else { Err(without) })
    };
    // Checks come first: a necessary cut is found before much is solved.
    let checks: Vec<[f64; AXES]> = (0..CHECKS).map(|i| check(i, &points)).collect();
    let wanted = match values_at(&checks)? {
        Ok(values) => values,
        Err(without) => return Ok(Over::Without(without)),
    };
    let mut all = Interpolant::<F>::new(points);
    let mut least = bounds.map(|b| b.least());
    for _ in 0..TRIES {
        loop {
            let orders = all.wanted(&least);
            if orders.is_empty() {
                break;
            }
            if all.surplus.len() + orders.len() > most {
                return Ok(Over::Rough);
            }
            let x: Vec<[f64; AXES]> = orders.iter().map(Interpolant::<F>::point).collect();
            match values_at(&x)? {
                Ok(values) => all.add(&orders, &values),
                Err(without) => return Ok(Over::Without(without)),
            }
        }
        let series = all.series(&least);
        let (mut errors, mut share) = ([0.0f64; F], [0.0f64; F]);
        for (x, value) in checks.iter().zip(&wanted) {
            for i in 0..F {
                let error = (series[i].at(*x) - value[i]).abs();
                errors[i] = errors[i].max(error);
                share[i] = share[i].max(bounds[i].share(value[i], error));
            }
        }
        if share.iter().all(|share| *share <= 1.0) {
            return Ok(Over::Built(Built { axes, series, errors }));
        }
        for (least, share) in least.iter_mut().zip(share) {
            if share > 1.0 {
                *least /= share.clamp(2.0, 8.0);
            }
        }
    }
    Ok(Over::Rough)
}

/// Check point `i`: the first are corners, the others fill the box evenly (Weyl).
pub fn check(i: usize, points: &[bool; AXES]) -> [f64; AXES] {
    // Powers of the inverse of the root of x⁶ = x + 1.
    const ROOT: f64 = 1.134_724_138_401_519_5;
    std::array::from_fn(|axis| match (points[axis], i < 1 << AXES) {
        (true, _) => 0.0,
        (false, true) => {
            if i >> axis & 1 == 1 {
                1.0
            } else {
                -1.0
            }
        }
        (false, false) => 2.0 * (0.5 + (i + 1) as f64 * ROOT.powi(-(axis as i32 + 1))).fract() - 1.0,
    })
}

/// `axes` without the points `without`, cut along the axis where most is left, or along `first` where enough of that is.
fn cut(axes: &[Axis; AXES], without: &[[f64; AXES]], first: Option<&usize>) -> Option<[Axis; AXES]> {
    let mut best: Option<(f64, usize, [f64; 2])> = None;
    for axis in (0..AXES).filter(|k| !axes[*k].is_point() && !axes[*k].whole) {
        let lowest = without.iter().map(|x| x[axis]).fold(1.0, f64::min);
        let highest = without.iter().map(|x| x[axis]).fold(-1.0, f64::max);
        // A margin beyond the points: the border lies between them and the others.
        for ends in [
            [-1.0, lowest - 0.25 * (lowest + 1.0).clamp(0.1, 0.5)],
            [highest + 0.25 * (1.0 - highest).clamp(0.1, 0.5), 1.0],
        ] {
            let share = 0.5 * (ends[1] - ends[0]);
            let rank = if first == Some(&axis) && share >= ENOUGH { 1.0 + share } else { share };
            if share >= LEAST_SHARE && best.is_none_or(|(most, ..)| rank > most) {
                best = Some((rank, axis, ends));
            }
        }
    }
    let (_, axis, ends) = best?;
    let mut smaller = *axes;
    smaller[axis].range = ends.map(|x| axes[axis].at(x));
    Some(smaller)
}
