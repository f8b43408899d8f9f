//! Ranges of numbers that a key may hold.

use crate::design::MOST;

/// The numbers between two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Smallest and largest number.
    pub ends: [f64; 2],
    /// True for each end, lower and upper, that is excluded.
    pub open: [bool; 2],
}

impl Interval {
    /// The interval with these ends, excluded where `open`; an infinite end becomes the largest number that a quantity may be.
    pub const fn new([low, high]: [f64; 2], [lower, upper]: [bool; 2]) -> Self {
        Self { ends: [low.max(-MOST), high.min(MOST)], open: [lower && low > -MOST, upper && high < MOST] }
    }

    /// True if `v` lies in the interval. A number whose square underflows is refused, unless it is 0.
    pub fn holds(&self, v: f64) -> bool {
        let ([low, high], [lower, upper]) = (self.ends, self.open);
        let above = if lower { v > low } else { v >= low };
        let below = if upper { v < high } else { v <= high };
        above && below && (v == 0.0 || v * v >= f64::MIN_POSITIVE)
    }

    /// The numbers in words, of a quantity of this `name` and `unit`.
    pub fn words(&self, name: &str, unit: &str) -> String {
        let [low, high] = self.ends;
        let [lower, upper] = self.open.map(|open| if open { "<" } else { "≤" });
        let words = match self.open {
            _ if self.ends == [-MOST, MOST] => return format!("a number in {unit}"),
            [true, _] if high == MOST => format!("> {low}"),
            [false, _] if high == MOST => format!("≥ {low}"),
            [false, false] => format!("{low} … {high}"),
            _ => format!("{low} {lower} {name} {upper} {high}"),
        };
        if unit.is_empty() { words } else { format!("{words} {unit}") }
    }
}
