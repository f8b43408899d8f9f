//! Columns that nobody named, in a file without a drive: whether one of them is the drive by its values.

use std::borrow::Cow;

use super::columns::Columns;
use super::file::Row;
use super::group::Groups;
use super::text;

/// From one value to the next the signal goes the same way in this share of all cases.
const SAME_WAY: f64 = 0.95;
/// Fewer cases say nothing.
const CASES: usize = 6;
/// And leads, at one distance, over this share of the range of all signals.
const FAR: f64 = 0.2;

/// Numbers in columns that are not used; none where the drive is known.
pub struct Others<'a> {
    columns: Vec<(usize, &'a str, Vec<f64>)>,
}

impl<'a> Others<'a> {
    /// Of a file with these `names`.
    pub fn new(columns: &Columns, names: &'a [String]) -> Self {
        let unused = |(_, n): &(usize, &String)| columns.drive.is_none() && columns.ignored.contains(n);
        let all = names.iter().enumerate().filter(unused);
        Self { columns: all.map(|(place, name)| (place, name.as_str(), Vec::new())).collect() }
    }

    /// Takes a line; a column that holds a word is no drive.
    pub fn push(&mut self, record: &[Cow<'_, str>]) {
        self.columns.retain_mut(|(place, _, values)| {
            let x = text::number(&record[*place]).filter(|x| x.is_finite());
            values.extend(x);
            x.is_some()
        });
    }

    /// The column that is a drive by its values.
    pub fn drive(&self, rows: &[Row]) -> Option<&'a str> {
        self.columns.iter().find(|(.., values)| leads(values, rows)).map(|(_, name, _)| *name)
    }
}

/// Whether the signal follows `levels`, which are few: at each distance one way, and far.
fn leads(levels: &[f64], rows: &[Row]) -> bool {
    let distances = Groups::of(rows.iter().map(|r| r.a), None, false);
    let mut cells = std::collections::BTreeMap::<[i64; 2], (f64, f64)>::new();
    let ordered = |x: f64| x.to_bits() as i64 ^ ((x.to_bits() as i64 >> 63) as u64 >> 1) as i64;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (level, row) in levels.iter().zip(rows).filter(|(_, r)| r.a.is_finite() && r.value.is_finite()) {
        let cell = cells.entry([distances.centre(row.a), *level].map(ordered)).or_default();
        *cell = (cell.0 + row.value, cell.1 + 1.0);
        (low, high) = (low.min(row.value), high.max(row.value));
    }
    let mut distinct = levels.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    let means: Vec<(i64, f64)> = cells.iter().map(|([a, _], (sum, n))| (*a, sum / n)).collect();
    let steps = means.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1 - w[0].1);
    let (up, all) = steps.fold((0, 0), |(up, n), step| (up + usize::from(step > 0.0), n + 1));
    let ranges: Vec<f64> = means
        .chunk_by(|p, q| p.0 == q.0)
        .filter(|c| c.len() > 1)
        .map(|c| (c[c.len() - 1].1 - c[0].1).abs())
        .collect();
    2 * distinct.len() <= rows.len()
        && all >= CASES
        && up.max(all - up) as f64 >= SAME_WAY * all as f64
        && ranges.iter().sum::<f64>() >= FAR * (high - low) * ranges.len() as f64
}
