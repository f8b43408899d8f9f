//! Names of columns for readers: symbol, unit, and whether the axis is logarithmic.

use crate::digits::{DIGITS, short_to};
use crate::figure::Axis;
use crate::reduce::range;
use crate::sink::fact::{Fact, fact};

/// Digits that distinguish any two f64.
const MOST: i32 = 17;

/// The axis of `column`.
pub fn axis(column: &str) -> Axis {
    let known = fact(column).filter(|fact| !fact.axis.is_empty());
    let Some(Fact { axis, unit, log, .. }) = known else { return Axis::new(column, "") };
    let unit = if unit == "degrees" { "°" } else { unit };
    if *log { Axis::log(axis, unit) } else { Axis::new(axis, unit) }
}

/// Least and greatest finite number; (∞, −∞) without any.
pub fn ends(numbers: impl IntoIterator<Item = f64>) -> [f64; 2] {
    range(numbers.into_iter().filter(|x| x.is_finite()))
}

/// Distinct finite `numbers`, ascending.
pub fn distinct(numbers: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut seen = std::collections::HashSet::new();
    let mut values: Vec<f64> =
        numbers.into_iter().filter(|x| x.is_finite() && seen.insert((x + 0.0).to_bits())).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// A value in words: d = 4 mm.
pub fn said(column: &str, value: f64) -> String {
    said_to(column, value, DIGITS)
}

/// The same for `values`, with enough digits to distinguish them.
pub fn told_apart(column: &str, values: &[f64]) -> Vec<String> {
    apart(values, |x, digits| said_to(column, x, digits))
}

/// Numbers with enough digits to distinguish them.
pub fn numbers_apart(values: &[f64]) -> Vec<String> {
    apart(values, |x, digits| format!("{}{}", if x < 0.0 { "−" } else { "" }, short_to(x.abs(), digits)))
}

fn apart(values: &[f64], say: impl Fn(f64, i32) -> String) -> Vec<String> {
    let different = distinct(values.iter().copied()).len();
    let words = |digits| values.iter().map(|x| say(*x, digits)).collect::<Vec<_>>();
    let parted = |all: &Vec<String>| all.iter().collect::<std::collections::HashSet<_>>().len() >= different;
    (DIGITS..=MOST).map(words).find(parted).unwrap_or_else(|| words(MOST))
}

fn said_to(column: &str, value: f64, digits: i32) -> String {
    let axis = axis(column);
    let symbol = axis.label.rsplit(' ').next().unwrap_or_default();
    let unit = match axis.unit.as_str() {
        "" | "°" => axis.unit.clone(),
        unit => format!(" {unit}"),
    };
    let sign = if value < 0.0 { "−" } else { "" };
    format!("{symbol} = {sign}{}{unit}", short_to(value.abs(), digits))
}
