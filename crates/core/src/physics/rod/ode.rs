//! Gragg–Bulirsch–Stoer extrapolation (Numer. Math. 8 (1966) 1; Hairer, Nørsett and Wanner, *Solving ODEs I*, II.9).

use std::array::from_fn;

use crate::status::Status;

/// Columns of the extrapolation table; column j takes 2 (j + 1) substeps of the midpoint rule.
const COLUMNS: usize = 9;

/// Local error of a step, relative to the scale of each component.
const TOLERANCE: f64 = 1e-13;

const SMALLEST: f64 = 1e-4;

/// Rounding error of an increment per step and [`Slope::size`], which smaller steps do not reduce; 7e-15 of ∫ size dx in all.
const ROUNDINGS: f64 = 32.0 * f64::EPSILON;

pub(super) struct Slope<const N: usize> {
    pub rate: [f64; N],
    /// Size of the terms of each rate; it sets the rounding error, however small the rate is.
    pub size: [f64; N],
}

/// Carries `y` from `start` over `length` ≥ 0. Errors are relative to `scale` of y or its increment, whichever is larger. `material_limit` where
/// `rhs` has no value, `not_converged` where that is not accurate enough.
pub(super) fn integrate<const N: usize>(
    rhs: impl Fn(f64, &[f64; N]) -> Option<Slope<N>>,
    scale: impl Fn(&[f64; N]) -> [f64; N],
    mut y: [f64; N],
    start: f64,
    length: f64,
) -> Result<[f64; N], Status> {
    let (mut done, mut step) = (0.0, length);
    while done < length {
        let last = step >= length - done;
        let h = if last { length - done } else { step };
        let slope = rhs(start + done, &y).ok_or(Status::MATERIAL_LIMIT)?;
        let (increment, factor) = extrapolate(&rhs, &scale, (start + done, &y), &slope, h);
        match increment {
            Ok(increment) => {
                y = from_fn(|i| y[i] + increment[i]);
                done = if last { length } else { done + h };
            }
            Err(why) if h < SMALLEST * length => return Err(why),
            Err(_) => {}
        }
        step = h * factor;
    }
    Ok(y)
}

fn extrapolate<const N: usize>(
    rhs: &impl Fn(f64, &[f64; N]) -> Option<Slope<N>>,
    scale: &impl Fn(&[f64; N]) -> [f64; N],
    (x, y): (f64, &[f64; N]),
    slope: &Slope<N>,
    h: f64,
) -> (Result<[f64; N], Status>, f64) {
    let mut row = [[0.0; N]; COLUMNS];
    // The largest within the step: at the loaded end of a rod all are 0.
    let mut size = slope.size;
    let mut factor = 0.25;
    for k in 0..COLUMNS {
        let Some(mut entry) = midpoint(rhs, (x, y), (&slope.rate, &mut size), h, 2 * (k + 1)) else {
            return (Err(Status::MATERIAL_LIMIT), 0.25);
        };
        let mut change = [f64::INFINITY; N];
        for (j, above) in row.iter_mut().enumerate().take(k) {
            let ratio = ((k + 1) as f64 / (k - j) as f64).powi(2) - 1.0;
            let step: [f64; N] = from_fn(|i| (entry[i] - above[i]) / ratio);
            change = step;
            (*above, entry) = (entry, from_fn(|i| entry[i] + step[i]));
        }
        row[k] = entry;
        let (here, there) = (scale(y), scale(&entry));
        let error = (0..N)
            .filter(|&i| change[i].abs() > ROUNDINGS * h * size[i])
            .map(|i| change[i].abs() / here[i].max(there[i]))
            .fold(0.0, f64::max);
        factor = 0.9 * (0.5 * TOLERANCE / error.max(1e-18)).powf(1.0 / (2 * k + 1) as f64);
        if error <= TOLERANCE {
            let growth = if k + 2 >= COLUMNS { 1.5 } else { 4.0 };
            return (Ok(entry), factor.clamp(0.3, growth));
        }
    }
    (Err(Status::NOT_CONVERGED), factor.clamp(0.1, 0.6))
}

/// Increment over `h` by `n` (even) substeps of the explicit midpoint rule, whose error has even powers of h only. Raises `size`.
fn midpoint<const N: usize>(
    rhs: &impl Fn(f64, &[f64; N]) -> Option<Slope<N>>,
    (x, y): (f64, &[f64; N]),
    (rate, size): (&[f64; N], &mut [f64; N]),
    h: f64,
    n: usize,
) -> Option<[f64; N]> {
    let sub = h / n as f64;
    let mut before = [0.0; N];
    let mut now: [f64; N] = from_fn(|i| sub * rate[i]);
    for m in 1..n {
        let f = rhs(x + sub * m as f64, &from_fn(|i| y[i] + now[i]))?;
        let next = from_fn(|i| before[i] + sub * 2.0 * f.rate[i]);
        before = std::mem::replace(&mut now, next);
        *size = from_fn(|i| size[i].max(f.size[i]));
    }
    Some(now)
}
