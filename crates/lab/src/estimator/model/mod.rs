//! Curves of readings over distance, and how they are read backwards: closed forms, data, the exact model with its fitted parameters.

pub mod exact;
pub mod form;
pub mod pair;
pub mod paper;
pub mod parameter;
pub mod polynomial;
pub mod surface;

/// What an estimator makes of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The largest distance with this reading, mm.
    pub a: f64,
    /// The next one, mm.
    pub near: Option<f64>,
    /// d reading/da there, 1/mm.
    pub slope: f64,
    /// Variance of the expected reading that the noise of the calibration leaves, reading².
    pub variance: f64,
    /// One standard deviation of the distance, mm, where it is that of a posterior; NaN where noise, slope and variance make it.
    pub sigma: f64,
    /// The interval that holds it with 95 %, mm, where it is that of a posterior.
    pub ends: [f64; 2],
    /// Whether it is the median of a wide posterior, and no root.
    pub wide: bool,
}

/// Relative slack with which a recorded drive equals a calibrated one.
pub(crate) use crate::measure::group::ROUNDING as SAME;

/// Place of `x` among ascending `values`: index of the one before and weight of the one after; `None` outside.
pub(crate) fn bracket(values: &[f64], x: f64) -> Option<(usize, f64)> {
    let (first, last) = (*values.first()?, *values.last()?);
    if x < first * (1.0 - SAME) || x > last * (1.0 + SAME) || x.is_nan() {
        return None;
    }
    let j = values.partition_point(|v| *v <= x).saturating_sub(1).min(values.len().saturating_sub(2));
    match values.get(j + 1) {
        Some(next) => Some((j, ((x - values[j]) / (next - values[j])).clamp(0.0, 1.0))),
        None => Some((j, 0.0)),
    }
}

/// Linear interpolation of `ys` over ascending `xs`, held at both ends.
pub(crate) fn between(xs: &[f64], ys: &[f64], x: f64) -> f64 {
    let x = x.clamp(xs[0], xs[xs.len() - 1]);
    match bracket(xs, x) {
        Some((j, w)) if w > 0.0 => ys[j] + w * (ys[j + 1] - ys[j]),
        Some((j, _)) => ys[j],
        None => f64::NAN,
    }
}
