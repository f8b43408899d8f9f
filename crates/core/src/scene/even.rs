//! Evenly spaced values that come out as the decimal numbers one expects: 0.7, not 0.7000000000000001.

/// Value i is `(start + i · stride) / unit`.
///
/// Where the numbers it is built from are decimal numbers of moderate length, `unit` is chosen so that `start`
/// and `stride` are whole numbers; then the division is the only rounding, and each value is the f64 nearest to
/// the exact one. Otherwise `unit` is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Even {
    start: f64,
    stride: f64,
    unit: f64,
    last: f64,
    len: u64,
}

/// Whole numbers up to here are exact in f64.
pub(super) const EXACT: f64 = 9_007_199_254_740_992.0;

impl Even {
    /// `steps` ≥ 1 values from `from` to exactly `to`.
    pub(super) fn steps(from: f64, to: f64, steps: u64) -> Self {
        let gaps = (steps - 1).max(1) as f64;
        let exact = |unit: &f64| (from.abs().max(to.abs()).max(1.0) * unit * gaps) < EXACT;
        match decimal_unit(from, to).filter(exact) {
            Some(unit) => {
                let (first, last) = ((from * unit).round(), (to * unit).round());
                Self { start: first * gaps, stride: last - first, unit: unit * gaps, last: to, len: steps }
            }
            None => Self { start: from, stride: (to - from) / gaps, unit: 1.0, last: to, len: steps },
        }
    }

    /// `from`, `from + step`, … and `to` itself if a step falls on it within 1e-9 of a step. `step` > 0,
    /// `from` ≤ `to`, fewer than [`EXACT`] values.
    pub(super) fn step(from: f64, to: f64, step: f64) -> Self {
        let gaps = (to - from) / step;
        let whole = (gaps + 1e-9).floor();
        let (start, stride, unit) = match decimal_unit(from, step) {
            Some(unit) => ((from * unit).round(), (step * unit).round(), unit),
            None => (from, step, 1.0),
        };
        let last = if (gaps - whole).abs() <= 1e-9 { to } else { (start + whole * stride) / unit };
        Self { start, stride, unit, last, len: whole as u64 + 1 }
    }

    /// Number of values.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Value `i`.
    pub fn at(&self, i: u64) -> f64 {
        if i + 1 == self.len { self.last } else { (self.start + i as f64 * self.stride) / self.unit }
    }
}

/// The smallest power of ten that makes whole numbers of both; `None` if they have more than 15 digits.
fn decimal_unit(a: f64, b: f64) -> Option<f64> {
    let whole = |x: f64, unit: f64| {
        let n = (x * unit).round();
        n.abs() < EXACT && n / unit == x
    };
    (0..=15).map(|digits| 10f64.powi(digits)).find(|&unit| whole(a, unit) && whole(b, unit))
}
