//! Curve that the model corrects: the whisker's own, or a power law of distance and drive.

use std::sync::Arc;

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use vibrissa_core::reduce::{range, sorted};

/// |signal| of a whisker as a function of a (mm) and the drive.
pub type Whisker = Arc<dyn Fn(f64, f64) -> f64 + Send + Sync>;

/// Signal of a tap before correction and gain.
#[derive(Clone)]
pub enum Base {
    /// Curve of a known whisker, and the offset added to its drive.
    Known(Whisker, f64),
    /// (u + u₀)^p (1/a − κ)^q.
    Power(Power),
}

impl Base {
    /// Signal at a (mm) and drive u.
    pub fn value(&self, a: f64, u: f64) -> f64 {
        match self {
            Self::Known(curve, offset) => curve(a, u + offset),
            Self::Power(power) => power.value(a, u),
        }
    }

    /// Offset added to the drive: without correction, contact begins at minus this.
    pub fn offset(&self) -> f64 {
        match self {
            Self::Known(_, offset) => *offset,
            Self::Power(power) => power.offset,
        }
    }

    /// Value and derivatives at a (mm) and u, divided by `unit`.
    pub(crate) fn about(&self, unit: f64, a: f64, u: f64) -> About {
        let (less, more, at) = (1.0 - STEP, 1.0 + STEP, |p: f64, q: f64| self.value(a * p, u * q) / unit);
        let [value, nearer, farther] = [1.0, less, more].map(|p| at(p, 1.0));
        let [less, more] = [less, more].map(|q| at(1.0, q));
        let [by_distance, by_drive] = [farther - nearer, more - less].map(|rise| rise / (2.0 * STEP));
        About { value, by_distance, turns: (farther - 2.0 * value + nearer) / (STEP * STEP), by_drive }
    }
}

/// Step of central differences, in ln.
pub const STEP: f64 = 1e-3;

#[derive(Debug, Clone, Copy)]
pub(crate) struct About {
    pub value: f64,
    /// ∂m/∂a · a.
    pub by_distance: f64,
    /// Derivative of `by_distance` by ln a.
    pub turns: f64,
    /// ∂m/∂u · u.
    pub by_drive: f64,
}

impl About {
    /// Values at a (1 + `share`), accurate enough for a slope to first order.
    pub fn beside(&self, share: f64) -> Self {
        let value = self.value + share * self.by_distance + 0.5 * share * share * self.turns;
        let by_drive = if self.value == 0.0 { self.by_drive } else { self.by_drive * value / self.value };
        Self { value, by_distance: self.by_distance + share * self.turns, by_drive, ..*self }
    }
}

/// (u + u₀)^p (1/a − κ)^q with κ = 0 or q = 1. The base moment of a cone of length 1/κ is u (1/a − κ) times a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    /// Offset u₀ of the drive: contact begins at −u₀.
    pub offset: f64,
    /// Exponent of the drive.
    pub p: f64,
    /// Exponent of 1/a − κ.
    pub q: f64,
    /// κ in 1/mm: the signal is 0 at a = 1/κ.
    pub end: f64,
}

/// ln (1/a − κ), limited from below so that beyond 1/κ the signal is small and falls.
fn ln_near(a: f64, end: f64) -> f64 {
    (1.0 / a - end).max(1e-3 / a).ln()
}

impl Power {
    /// Value at a (mm) and drive u.
    pub fn value(&self, a: f64, u: f64) -> f64 {
        (self.p * (u + self.offset).ln() + self.q * ln_near(a, self.end)).exp()
    }
}

/// A fitted power law: signal = zero + factor (u + u₀)^p (1/a − κ)^q.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// Power law without factor and zero.
    pub power: Power,
    /// Factor of the power law.
    pub factor: f64,
    /// Constant zero.
    pub zero: f64,
    /// Weighted sum of squares.
    pub squares: f64,
    free: [bool; 6],
}

/// Gain in 2 ln likelihood above which a constant, an offset or an end is accepted.
pub(crate) const WORTH: f64 = 10.0;
const POSITIONS: usize = 4;
/// Largest κ, in 1/(largest a).
const NEAREST: f64 = 0.99;

/// Fits a power law to taps (a, u, y) above `zero` or a free zero, with a free exponent or offset of the drive, and a free exponent of 1/a or
/// (`ends`) end of the cone. With both of these free, the end would lie just beyond the farthest tap of a rod.
pub fn power(taps: &[[f64; 3]], zero: Option<f64>, ends: bool) -> Option<Fitted> {
    let different = |k: usize, apart: f64| {
        let values = sorted(taps.iter().map(|t| t[k].ln()));
        let least = apart * (values.last()? - values.first()?);
        Some(1 + values.windows(2).filter(|w| w[1] - w[0] > least).count())
    };
    let [positions, drives] = [different(0, 0.02)?, different(1, 0.0)?];
    let free = zero.is_none();
    let best = |end: bool| {
        let exponent = from(taps, zero, [true, drives > 1, !end, free, false, end]);
        let offset = (drives > 2).then(|| from(taps, zero, [true, false, !end, free, true, end])).flatten();
        [exponent, offset].into_iter().flatten().min_by(|f, g| f.squares.total_cmp(&g.squares))
    };
    let endless = best(false)?;
    let worth = |f: &Fitted| taps.len() as f64 * (endless.squares / f.squares).ln() > WORTH;
    let ending = (ends && positions >= POSITIONS).then(|| best(true)).flatten().filter(worth);
    Some(ending.unwrap_or(endless))
}

pub(crate) fn again(taps: &[[f64; 3]], zero: Option<f64>, near: &Fitted) -> Option<Fitted> {
    let Power { offset, p, q, end } = near.power;
    let constant = if near.free[3] { near.zero } else { zero.unwrap_or(near.zero) };
    descend(taps, [near.factor.ln(), p, q, constant, offset, end], near.free)
}

/// ln factor, exponents of drive and of 1/a − κ, constant, offset of the drive, κ.
type Parameters = [f64; 6];

fn from(taps: &[[f64; 3]], zero: Option<f64>, free: [bool; 6]) -> Option<Fitted> {
    let [lo, hi] = range(taps.iter().map(|t| t[2]));
    let zeros =
        zero.map_or(vec![0.0, lo - 0.1 * (hi - lo), lo - 0.5 * (hi - lo), lo - 2.0 * (hi - lo)], |z| vec![z]);
    let offsets: &[f64] = if free[4] { &[0.0, 1.0] } else { &[0.0] };
    let largest = taps.iter().map(|t| t[1]).fold(0.0, f64::max);
    let longest = taps.iter().map(|t| t[0]).fold(0.0, f64::max);
    let ends: &[f64] = if free[5] { &[0.4, 0.8] } else { &[0.0] };
    let starts = zeros.iter().flat_map(|z| {
        offsets.iter().flat_map(move |o| ends.iter().map(move |e| [*z, o * largest, e / longest]))
    });
    let fits = starts.filter_map(|start| descend(taps, straight(taps, start, [free[1], free[2]])?, free));
    fits.min_by(|f, g| f.squares.total_cmp(&g.squares))
}

fn straight(taps: &[[f64; 3]], [zero, offset, end]: [f64; 3], exponents: [bool; 2]) -> Option<Parameters> {
    let (mut n, mut b) = (Matrix3::zeros(), Vector3::zeros());
    let above = || taps.iter().filter(|t| t[2] > zero);
    let sizes = sorted(above().map(|t| t[2] - zero));
    // Limit the weight, so that a tap in a wrong unit counts no more than the median one.
    let middle = *sizes.get(sizes.len() / 2)?;
    for t in above() {
        let (l, w) = ((t[2] - zero).ln(), (t[2] - zero).min(middle).powi(2));
        let logs = [(t[1] + offset).ln(), ln_near(t[0], end)];
        let [v, x] = [0, 1].map(|k| if exponents[k] { [logs[k], 0.0] } else { [0.0, logs[k]] });
        let row = Vector3::new(1.0, v[0], x[0]);
        b += w * row * (l - v[1] - x[1]);
        n += w * row * row.transpose();
    }
    (0..2).filter(|k| !exponents[*k]).for_each(|k| n[(k + 1, k + 1)] = 1.0);
    let x = n.try_inverse()? * b;
    let p = if exponents[0] { x[1].clamp(0.05, 5.0) } else { 1.0 };
    let q = if exponents[1] { x[2].clamp(0.02, 12.0) } else { 1.0 };
    x.iter().all(|x| x.is_finite()).then_some([x[0], p, q, zero, offset, end])
}

/// Levenberg-Marquardt from `start` with Huber's weights against wrong rows; `None` if the exponents are implausible for a whisker.
fn descend(taps: &[[f64; 3]], start: Parameters, free: [bool; 6]) -> Option<Fitted> {
    let least = taps.iter().map(|t| t[1]).fold(f64::INFINITY, f64::min);
    let longest = taps.iter().map(|t| t[0]).fold(0.0, f64::max);
    let value =
        |x: &Parameters, t: &[f64; 3]| (x[0] + x[1] * (t[1] + x[4]).ln() + x[2] * ln_near(t[0], x[5])).exp();
    let residuals = |x: &Parameters| taps.iter().map(|t| t[2] - x[3] - value(x, t)).collect::<Vec<f64>>();
    let huber = |r: &[f64]| {
        let sizes = sorted(r.iter().map(|r| r.abs()));
        let limit = 2.5 * 1.4826 * sizes[sizes.len() / 2];
        r.iter().map(|r| if r.abs() > limit { limit / r.abs() } else { 1.0 }).collect::<Vec<f64>>()
    };
    let sum = |r: &[f64], w: &[f64]| r.iter().zip(w).map(|(r, w)| w * r * r).sum::<f64>();
    let (mut x, mut damping) = (start, 1e-3);
    let mut r = residuals(&x);
    for _ in 0..60 {
        let weights = huber(&r);
        let before = sum(&r, &weights);
        let (mut n, mut b) = (Matrix6::zeros(), Vector6::zeros());
        for ((t, r), w) in taps.iter().zip(&r).zip(&weights) {
            let m = value(&x, t);
            let [by_drive, by_end] = [x[1] / (t[1] + x[4]), -x[2] / (1.0 / t[0] - x[5])];
            let slopes = [m, m * (t[1] + x[4]).ln(), m * ln_near(t[0], x[5]), 1.0, m * by_drive, m * by_end];
            let row = Vector6::from_fn(|i, _| if free[i] { slopes[i] } else { 0.0 });
            n += *w * row * row.transpose();
            b += *w * *r * row;
        }
        let scale = n.diagonal().map(|d| if d > 0.0 { d } else { 1.0 });
        let damped = n + Matrix6::from_diagonal(&(scale * damping));
        let Some(step) = damped.cholesky().map(|c| c.solve(&b)) else { break };
        let mut next = x;
        (0..6).filter(|i| free[*i]).for_each(|i| next[i] += step[i]);
        next[1] = next[1].clamp(0.05, 5.0);
        next[2] = next[2].clamp(0.02, 12.0);
        next[4] = next[4].clamp(-0.9 * least, 50.0 * least.max(x[4].abs()));
        next[5] = next[5].clamp(0.0, NEAREST / longest);
        let there = residuals(&next);
        let after = sum(&there, &weights);
        let done = if after.is_finite() && after <= before {
            (x, r, damping) = (next, there, 0.3 * damping);
            before - after <= 1e-12 * before
        } else {
            damping *= 10.0;
            damping > 1e8
        };
        if done {
            break;
        }
    }
    let squares = sum(&r, &huber(&r));
    let [ln_factor, p, q, zero, offset, end] = x;
    let (power, factor) = (Power { offset, p, q, end }, ln_factor.exp());
    (squares.is_finite() && ln_factor.is_finite()).then_some(Fitted { power, factor, zero, squares, free })
}
