//! Names of columns for readers: symbol, unit, and whether the axis is logarithmic; cells of a map of many rows; axis ends that
//! a few outliers do not stretch.

use std::hash::Hash;

use indexmap::IndexMap;

use crate::digits::{DIGITS, short_to};
use crate::figure::{Axis, Cells, Mark, Panel};
use crate::reduce::range;
use crate::sink::heading::{Fact, fact};

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

/// `rows` with equal keys, in the order in which keys appear.
pub fn grouped<K: Hash + Eq>(
    rows: impl IntoIterator<Item = usize>,
    key: impl Fn(usize) -> K,
) -> IndexMap<K, Vec<usize>> {
    let mut all: IndexMap<K, Vec<usize>> = IndexMap::new();
    rows.into_iter().for_each(|r| all.entry(key(r)).or_default().push(r));
    all
}

/// A value in words: d = 4 mm.
pub fn said(column: &str, value: f64) -> String {
    said_to(column, value, DIGITS)
}

/// The same for `values`, with enough digits to distinguish them.
pub fn told_apart(column: &str, values: &[f64]) -> Vec<String> {
    apart(values, |x, digits| said_to(column, x, digits))
}

fn signed(x: f64, digits: i32) -> String {
    format!("{}{}", if x < 0.0 { "−" } else { "" }, short_to(x.abs(), digits))
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
    format!("{symbol} = {}{unit}", signed(value, digits))
}

pub const BINS: usize = 40;
/// Up to this number of values, an axis has bands: named places without anything between.
const FEW: usize = 6;
/// Most cells of a map with one cell for each value.
const CELLS: usize = 40_000;

struct Bins {
    edges: Vec<f64>,
    values: Option<Vec<f64>>,
}

impl Bins {
    fn of(numbers: &[f64]) -> Self {
        let mut few = Vec::new();
        // Most axes have few distinct values, found in the first rows: no set of all values is needed.
        for x in numbers.iter().filter(|x| x.is_finite()) {
            if few.len() <= BINS && !few.contains(x) {
                few.push(*x);
            }
        }
        if few.len() <= BINS {
            return Self::at(distinct(few));
        }
        let [a, b] = ends(numbers.iter().copied());
        Self { edges: (0..=BINS).map(|i| a + (b - a) * i as f64 / BINS as f64).collect(), values: None }
    }

    fn at(values: Vec<f64>) -> Self {
        let n = values.len();
        let edges = match n {
            0 => vec![0.0, 1.0],
            1..=FEW => (0..=n).map(|i| i as f64 - 0.5).collect(),
            _ => {
                let beyond = |end: usize, next: usize| 1.5 * values[end] - 0.5 * values[next];
                let between = values.windows(2).map(|w| 0.5 * (w[0] + w[1]));
                std::iter::once(beyond(0, 1)).chain(between).chain([beyond(n - 1, n - 2)]).collect()
            }
        };
        Self { edges, values: Some(values) }
    }

    fn axis(&self, column: &str) -> Axis {
        let axis = axis(column);
        match &self.values {
            Some(few) if (1..=FEW).contains(&few.len()) => {
                Axis { words: apart(few, signed), log: false, ..axis }
            }
            _ => axis,
        }
    }

    fn place(&self, x: f64) -> Option<usize> {
        match &self.values {
            Some(values) => values.iter().position(|v| *v == x),
            None => {
                let (a, b) = (self.edges[0], self.edges[BINS]);
                x.is_finite().then_some((((x - a) / (b - a) * BINS as f64) as usize).min(BINS - 1))
            }
        }
    }
}

/// A map of two columns: the least `value` of the rows in each cell; true if values share cells.
pub fn map(
    title: &str,
    columns: [(&str, &[f64]); 2],
    value: impl Fn(usize) -> f64,
    of: Axis,
) -> (Panel, bool) {
    let bins = columns.map(|(_, numbers)| Bins::of(numbers));
    let binned = bins.iter().any(|b| b.values.is_none());
    (filled(title, columns, bins, value, of), binned)
}

/// The same with a cell for each value; an empty panel if there are more than `CELLS`.
pub fn every(title: &str, columns: [(&str, &[f64]); 2], value: impl Fn(usize) -> f64, of: Axis) -> Panel {
    let bins = columns.map(|(_, numbers)| Bins::at(distinct(numbers.iter().copied())));
    let [wide, high] = bins.each_ref().map(|b| b.edges.len().saturating_sub(1));
    if wide < 2 || high < 2 || wide * high > CELLS {
        let [x, y] = columns.map(|(name, _)| axis(name));
        return Panel::new(title, x, y);
    }
    filled(title, columns, bins, value, of)
}

fn filled(
    title: &str,
    [x, y]: [(&str, &[f64]); 2],
    [bx, by]: [Bins; 2],
    value: impl Fn(usize) -> f64,
    of: Axis,
) -> Panel {
    let panel = Panel::new(title, bx.axis(x.0), by.axis(y.0));
    let wide = bx.edges.len() - 1;
    let mut z = vec![f64::NAN; wide * (by.edges.len() - 1)];
    for (r, (x, y)) in x.1.iter().zip(y.1).enumerate() {
        if let (Some(i), Some(j)) = (bx.place(*x), by.place(*y)) {
            z[j * wide + i] = z[j * wide + i].min(value(r));
        }
    }
    panel.with(Mark::Cells(Cells { x: bx.edges, y: by.edges, z, of }))
}

/// Points within this many median deviations of the median always fit: 4.7 σ of a normal distribution.
const WIDE: f64 = 7.0;
/// At most this share of the samples at either end is cut.
const SHARE: f64 = 0.1;
/// An axis is cut only if it becomes shorter by this factor.
const WORTH: f64 = 2.0;
/// Free space at either end for arrows, as a share of the bulk.
const ROOM: f64 = 0.08;

/// Range of `samples` without outliers; `None` if it is a single value.
fn bulk(samples: &[f64]) -> Option<[f64; 2]> {
    let mut all: Vec<f64> = samples.iter().copied().filter(|x| x.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    let last = all.len().checked_sub(1)?;
    let at = |share: f64| all[(share * last as f64).round() as usize];
    let middle = at(0.5);
    let mut off: Vec<f64> = all.iter().map(|x| (x - middle).abs()).collect();
    off.sort_by(f64::total_cmp);
    let wide = WIDE * off[off.len() / 2];
    let (low, high) = ((middle - wide).min(at(SHARE)), (middle + wide).max(at(1.0 - SHARE)));
    let [least, most] = ends(all.into_iter().filter(|x| (low..=high).contains(x)));
    (least < most).then_some([least, most])
}

/// Fits the y axis to the points called `name` and their bars. Other points are drawn at the edge, and the key counts them.
pub fn cut(mut panel: Panel, name: &str) -> Panel {
    let points = || {
        panel.marks.iter().filter_map(|m| match m {
            Mark::Points { path, error, .. } => Some((path, error)),
            _ => None,
        })
    };
    let mut errors: Vec<f64> =
        points().flat_map(|(_, error)| error).copied().filter(|e| e.is_finite()).collect();
    errors.sort_by(f64::total_cmp);
    // Bars longer than the median may be cut at the edge.
    let usual = errors.get(errors.len() / 2).copied().unwrap_or(0.0);
    let samples: Vec<f64> =
        points().filter(|(path, _)| path.name == name).flat_map(|(path, _)| &path.y).copied().collect();
    let Some([low, high]) = bulk(&samples).map(|[low, high]| [low - usual, high + usual]) else {
        return panel;
    };
    let [least, most] = ends(panel.marks.iter().flat_map(Mark::reach).map(|p| p.1));
    if most - least <= WORTH * (high - low) {
        return panel;
    }
    let room = ROOM * (high - low);
    let axis = [low - room, high + room];
    let out = |y: &f64| *y < axis[0] || *y > axis[1];
    let taps: Vec<f64> =
        points().flat_map(|(path, _)| &path.y).copied().filter(|y| y.is_finite() && out(y)).collect();
    let ends_of = |(y, e): (&f64, &f64)| [y - e, y + e].iter().any(|end| end.is_finite() && out(end));
    let bars =
        points().flat_map(|(path, error)| path.y.iter().zip(error)).filter(|bar| ends_of(*bar)).count();
    let farthest = taps.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let unit = if panel.y.unit.is_empty() { String::new() } else { format!(" {}", panel.y.unit) };
    let mut words = Vec::new();
    if let Some(far) = farthest.map(|far| signed(far, DIGITS)) {
        words.push(match taps.len() {
            1 => format!("1 tap, at {far}{unit}"),
            n => format!("{n} taps, the farthest at {far}{unit}"),
        });
    }
    if bars > 0 {
        words.push(format!("the bars of {bars}"));
    }
    panel.beyond = format!("beyond the axis: {}", words.join(", "));
    panel.y.ends = Some(axis);
    panel
}
