//! Placeholders for missing values: -9999 of a logger, 9.9e37 of an instrument that could not measure.

use std::collections::BTreeSet;

use super::file::Row;
use crate::reduce::{range, sorted};

/// Usual placeholders, of either sign; also -1 and numbers from [`NEVER`] on.
const USUAL: [f64; 11] =
    [99.0, 99.99, 999.0, 999.99, 6999.0, 7999.0, 9999.0, 9999.99, 99999.0, 999_999.0, 9_999_999.0];
const NEVER: f64 = 1e30;
const OF_32_BITS: [f64; 2] = [2_147_483_647.0, -2_147_483_648.0];
/// A repeated value is a placeholder if it is this many ranges of all others away from them.
const FAR: f64 = 3.0;
/// The same for a usual placeholder.
const AWAY: f64 = 1.0;
/// The same for a negative one among signals.
const BELOW: f64 = 0.1;
/// Share of the others with decimals for which a repeated whole number, usual as a placeholder, is one.
const FRACTIONS: f64 = 0.9;
/// Repeated zeros with contact are placeholders if every other tap shows more than this share of the median.
const ISOLATED: f64 = 0.1;
const OTHERS: usize = 3;

/// A placeholder for a missing value.
#[derive(Debug, Clone, PartialEq)]
pub struct Missing {
    /// Index of the row.
    pub place: usize,
    /// Line number, from 1.
    pub line: usize,
    /// Name of its column.
    pub column: String,
    /// The value.
    pub value: f64,
}

/// A value, and the cell of its row: distance and drive, or all rows without contact.
type Placed = (f64, [u64; 2]);

/// True if `x` is a usual placeholder.
pub fn is_usual(x: f64) -> bool {
    x == -1.0 || USUAL.contains(&x.abs()) || OF_32_BITS.contains(&x) || x.abs() >= NEVER
}

/// Replaces placeholders in distances, drives and signals by NaN; returns them. `names` are the columns' names.
pub fn take(rows: &mut [Row], names: [&str; 3]) -> Vec<Missing> {
    let cell = |r: &Row| if r.drive <= 0.0 { [0; 2] } else { [r.a, r.drive].map(f64::to_bits) };
    let column = |f: fn(&Row) -> f64| rows.iter().map(|r| (f(r), cell(r))).collect::<Vec<_>>();
    // Of distances and drives only usual placeholders count.
    let distances = find(&column(|r| r.a), false);
    let mut drives = find(&column(|r| r.drive), false);
    // A drive of -1 may be before contact, or to the other side.
    drives.retain(|x| *x != -1.0);
    let signals = signals(&column(|r| r.value));
    let mut found = Vec::new();
    for (place, row) in rows.iter_mut().enumerate() {
        let line = row.line;
        let values = [&mut row.a, &mut row.drive, &mut row.value].into_iter();
        for ((value, none), name) in values.zip([&distances, &drives, &signals]).zip(names) {
            if none.contains(value) {
                found.push(Missing { place, line, column: name.to_owned(), value: *value });
                *value = f64::NAN;
            }
        }
    }
    found.retain(|m| m.column != names[0] || rows[m.place].drive != 0.0);
    found
}

/// Placeholders among signals: usual ones far from the others, or a repeated value very far; 0 if no zero reading shows it and no tap nearly so.
fn signals(column: &[Placed]) -> Vec<f64> {
    let mut found = find(column, true);
    let (rests, taps): (Vec<Placed>, Vec<Placed>) =
        column.iter().filter(|(x, _)| x.is_finite()).partition(|(_, cell)| *cell == [0; 2]);
    let (none, others): (Vec<Placed>, Vec<Placed>) = taps.into_iter().partition(|(x, _)| *x == 0.0);
    let cells: BTreeSet<[u64; 2]> = none.iter().map(|tap| tap.1).collect();
    let sizes = sorted(others.iter().map(|tap| tap.0.abs()));
    let isolated = sizes.len() >= OTHERS && sizes[0] > ISOLATED * sizes[sizes.len() / 2];
    if cells.len() > 1 && isolated && !rests.is_empty() && rests.iter().all(|rest| rest.0 != 0.0) {
        found.push(0.0);
    }
    found
}

fn find(column: &[Placed], of_signals: bool) -> Vec<f64> {
    let mut all: Vec<&Placed> = column.iter().filter(|(x, _)| x.is_finite()).collect();
    all.sort_by(|p, q| p.0.total_cmp(&q.0));
    let cells = |same: &[&Placed]| same.iter().map(|p| p.1).collect::<BTreeSet<_>>().len();
    let values = all.chunk_by(|p, q| p.0 == q.0).map(|same| (same[0].0, cells(same)));
    let mut values: Vec<(f64, usize)> = values.collect();
    let mut found = Vec::new();
    while let Some(k) = (0..values.len()).find(|k| is_none(&values, *k, of_signals)) {
        found.push(values.remove(k).0);
    }
    found
}

/// True if value `k` is a placeholder; `values` are ascending, each with its number of cells.
fn is_none(values: &[(f64, usize)], k: usize, of_signals: bool) -> bool {
    let (x, cells) = values[k];
    // A distance or a drive may be 99.
    let usual = is_usual(x) && (of_signals || !(0.0..999.0).contains(&x));
    if !usual && (cells < 2 || !of_signals || ![0, values.len() - 1].contains(&k)) {
        return false;
    }
    let others = || values.iter().map(|v| v.0).filter(|other| *other != x && !is_usual(*other));
    let n = others().count();
    if n < OTHERS {
        return false;
    }
    let [first, last] = range(others());
    let (range, away) = (last - first, (first - x).max(x - last));
    let fractions = others().filter(|other| other.fract() != 0.0).count();
    let whole = x.fract() == 0.0 && fractions as f64 >= FRACTIONS * n as f64;
    match (usual, of_signals) {
        (false, _) => away > FAR * range,
        (true, false) => away > AWAY * range,
        (true, true) => away > AWAY * range || x < 0.0 && away > BELOW * range || cells > 1 && whole,
    }
}
