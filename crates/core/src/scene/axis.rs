//! The values of one quantity of a sweep, computed from their index and never stored.

use super::sampler::{MAX_DIMENSIONS, MAX_SAMPLES, Sampler, middle};
use crate::error::InputError;
use crate::reduce::range;

/// Values of one quantity, in the order in which a sweep visits them.
#[derive(Debug, Clone, PartialEq)]
pub enum Axis {
    /// One value.
    Value(f64),
    /// Values as listed.
    List(Vec<f64>),
    /// Evenly spaced values; build with [`Axis::steps`] or [`Axis::step`].
    Even(Even),
    /// Values with a constant ratio; build with [`Axis::log_steps`].
    Log {
        /// First value, > 0.
        from: f64,
        /// Last value, ≥ `from`.
        to: f64,
        /// Number of values.
        len: u64,
    },
    /// Sampled values; build with [`Axis::samples`].
    Samples {
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
        /// Spread evenly in the logarithm.
        log: bool,
        /// The point set.
        points: Points,
        /// The coordinate of its points that this axis shows.
        dimension: u32,
    },
}

/// A set of sampled points that several axes share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Points {
    /// Number of points.
    pub samples: u64,
    /// Their kind.
    pub sampler: Sampler,
    /// Seed of the points.
    pub seed: u64,
}

impl From<f64> for Axis {
    fn from(value: f64) -> Self {
        Self::Value(value)
    }
}

impl From<Vec<f64>> for Axis {
    fn from(values: Vec<f64>) -> Self {
        Self::List(values)
    }
}

impl Axis {
    /// `steps` evenly spaced values from `from` to exactly `to`. The keys of errors are relative to the axis (`steps`, `to`).
    pub fn steps(from: f64, to: f64, steps: u64) -> Result<Self, InputError> {
        ends(from, to, steps)?;
        let gaps = (steps - 1).max(1) as f64;
        let exact = |unit: &f64| (from.abs().max(to.abs()).max(1.0) * unit * gaps) < EXACT;
        let (start, stride, unit) = match decimal_unit(from, to).filter(exact) {
            Some(unit) => {
                let first = (from * unit).round();
                (first * gaps, (to * unit).round() - first, unit * gaps)
            }
            None => (from, (to - from) / gaps, 1.0),
        };
        Ok(Self::Even(Even { start, stride, unit, last: to, len: steps }))
    }

    /// `from`, `from + step`, … up to `to`, included if a step falls on it within 1e-9 of a step. The keys of errors are relative to the axis.
    pub fn step(from: f64, to: f64, step: f64) -> Result<Self, InputError> {
        check(step > 0.0, "the step must be larger than zero", ("step", "> 0"))?;
        ascending(["from", "to"], [from, to])?;
        let gaps = (to - from) / step;
        if gaps >= EXACT {
            return Err(InputError::new("the step is too small: more than 2^53 values").key("step"));
        }
        let whole = (gaps + 1e-9).floor();
        let (start, stride, unit) = match decimal_unit(from, step) {
            Some(unit) => ((from * unit).round(), (step * unit).round(), unit),
            None => (from, step, 1.0),
        };
        let last = if (gaps - whole).abs() <= 1e-9 { to } else { (start + whole * stride) / unit };
        Ok(Self::Even(Even { start, stride, unit, last, len: whole as u64 + 1 }))
    }

    /// `steps` values with a constant ratio, both ends included. The keys of errors are relative to the axis.
    pub fn log_steps(from: f64, to: f64, steps: u64) -> Result<Self, InputError> {
        check(from > 0.0, LOGARITHMIC, ("from", "> 0"))?;
        ends(from, to, steps)?;
        Ok(Self::Log { from, to, len: steps })
    }

    /// Coordinate `number` of `points`, spread over [min, max]. The keys of errors are relative to the axis.
    pub fn samples(min: f64, max: f64, log: bool, points: Points, number: u32) -> Result<Self, InputError> {
        check(!log || min > 0.0, LOGARITHMIC, ("min", "> 0"))?;
        ascending(["min", "max"], [min, max])?;
        let counted = (1..=MAX_SAMPLES).contains(&points.samples);
        let allowed = ("samples", "1 … 2^32 = 4294967296");
        check(counted, "the number of samples is out of range", allowed)?;
        if number >= MAX_DIMENSIONS {
            let message = "too many axes are sampled together";
            return Err(InputError::new(message).allowed(format!("at most {MAX_DIMENSIONS}")));
        }
        Ok(Self::Samples { min, max, log, points, dimension: number })
    }

    /// Number of values.
    pub fn len(&self) -> u64 {
        match self {
            Self::Value(_) => 1,
            Self::List(values) => values.len() as u64,
            Self::Even(even) => even.len,
            Self::Log { len, .. } => *len,
            Self::Samples { points, .. } => points.samples,
        }
    }

    /// True without values; never for an axis from a spec.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Value `i`, below [`Axis::len`].
    pub fn at(&self, i: u64) -> f64 {
        match self {
            Self::Value(value) => *value,
            Self::List(values) => values[i as usize],
            Self::Even(even) if i + 1 == even.len => even.last,
            Self::Even(Even { start, stride, unit, .. }) => (start + i as f64 * stride) / unit,
            Self::Log { from, .. } if i == 0 => *from,
            Self::Log { to, len, .. } if i + 1 == *len => *to,
            Self::Log { from, to, len } => from * (to / from).powf(i as f64 / (len - 1) as f64),
            Self::Samples { points, dimension, .. } => {
                self.sampled(points.sampler.coordinate(points.seed, *dimension, i as u32))
            }
        }
    }

    fn sampled(&self, coordinate: u32) -> f64 {
        let Self::Samples { min, max, log, .. } = self else { return f64::NAN };
        let x = middle(coordinate);
        if *log { min * (max / min).powf(x) } else { min + (max - min) * x }
    }

    /// Calls `put` with each value of the indices `at` and its place among them.
    pub fn each(&self, at: &[u64], mut put: impl FnMut(usize, f64)) {
        match self {
            Self::Samples { points, dimension, .. } => {
                let indices = at.iter().map(|i| *i as u32);
                points.sampler.each((points.seed, *dimension), indices, |n, x| put(n, self.sampled(x)));
            }
            Self::Value(value) => (0..at.len()).for_each(|n| put(n, *value)),
            _ => at.iter().enumerate().for_each(|(n, i)| put(n, self.at(*i))),
        }
    }

    /// All values in order.
    pub fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.len()).map(|i| self.at(i))
    }

    /// Smallest value; of a sampled axis, its lower bound.
    pub fn min(&self) -> f64 {
        match self {
            Self::List(values) => range(values.iter().copied())[0],
            Self::Samples { min, .. } => *min,
            _ => self.at(0),
        }
    }

    /// Largest value; of a sampled axis, its upper bound.
    pub fn max(&self) -> f64 {
        match self {
            Self::List(values) => range(values.iter().copied())[1],
            Self::Samples { max, .. } => *max,
            _ => self.at(self.len() - 1),
        }
    }

    /// The point set of a sampled axis.
    pub fn points(&self) -> Option<Points> {
        match self {
            Self::Samples { points, .. } => Some(*points),
            _ => None,
        }
    }
}

const LOGARITHMIC: &str = "a logarithmic scale has no zero and no negative values";

fn check(holds: bool, message: impl Into<String>, (key, allowed): (&str, &str)) -> Result<(), InputError> {
    if holds { Ok(()) } else { Err(InputError::new(message).key(key).allowed(allowed)) }
}

fn ascending([low, high]: [&str; 2], [from, to]: [f64; 2]) -> Result<(), InputError> {
    check(from <= to, format!("{low} is larger than {high}"), (high, &format!("≥ {low} = {from}")))
}

fn ends(from: f64, to: f64, steps: u64) -> Result<(), InputError> {
    ascending(["from", "to"], [from, to])?;
    let (message, allowed) = match steps {
        0 => ("steps is the number of values and cannot be zero", "≥ 1"),
        1 if from != to => ("one step cannot include both ends", "≥ 2, or from equal to to"),
        2.. if from == to => {
            ("from and to are equal, so there is only one value", "1, or to larger than from")
        }
        s if s as f64 >= EXACT => ("too many values", "< 2^53"),
        _ => return Ok(()),
    };
    check(false, message, ("steps", allowed))
}

/// Value i is `(start + i · stride) / unit`; for short decimals these are whole numbers, so that each value is the nearest f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Even {
    start: f64,
    stride: f64,
    unit: f64,
    last: f64,
    len: u64,
}

/// Whole numbers up to here are exact in f64.
const EXACT: f64 = 9_007_199_254_740_992.0;

fn decimal_unit(a: f64, b: f64) -> Option<f64> {
    let whole = |x: f64, unit: f64| {
        let n = (x * unit).round();
        n.abs() < EXACT && n / unit == x
    };
    (0..=15).map(|digits| 10f64.powi(digits)).find(|&unit| whole(a, unit) && whole(b, unit))
}
