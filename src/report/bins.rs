//! Maps of many rows in few cells.

use super::quantity::{self, distinct, ends, numbers_apart};
use crate::figure::{Axis, Cells, Mark, Panel};

pub const MOST: usize = 40;
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
            if few.len() <= MOST && !few.contains(x) {
                few.push(*x);
            }
        }
        if few.len() <= MOST {
            return Self::at(distinct(few));
        }
        let [a, b] = ends(numbers.iter().copied());
        Self { edges: (0..=MOST).map(|i| a + (b - a) * i as f64 / MOST as f64).collect(), values: None }
    }

    fn at(values: Vec<f64>) -> Self {
        let edges = match values.len() {
            1..=FEW => (0..=values.len()).map(|i| i as f64 - 0.5).collect(),
            _ => edges(&values),
        };
        Self { edges, values: Some(values) }
    }

    fn axis(&self, column: &str) -> Axis {
        let axis = quantity::axis(column);
        match &self.values {
            Some(few) if (1..=FEW).contains(&few.len()) => {
                Axis { words: numbers_apart(few), log: false, ..axis }
            }
            _ => axis,
        }
    }

    fn place(&self, x: f64) -> Option<usize> {
        match &self.values {
            Some(values) => values.iter().position(|v| *v == x),
            None if x.is_finite() => {
                let (a, b) = (self.edges[0], self.edges[MOST]);
                Some((((x - a) / (b - a) * MOST as f64) as usize).min(MOST - 1))
            }
            None => None,
        }
    }
}

fn edges(values: &[f64]) -> Vec<f64> {
    match values {
        [] => vec![0.0, 1.0],
        [x] => vec![x - 0.5, x + 0.5],
        _ => {
            let n = values.len();
            let between = values.windows(2).map(|w| 0.5 * (w[0] + w[1]));
            let (first, last) =
                (1.5 * values[0] - 0.5 * values[1], 1.5 * values[n - 1] - 0.5 * values[n - 2]);
            std::iter::once(first).chain(between).chain([last]).collect()
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
        let [x, y] = columns.map(|(name, _)| quantity::axis(name));
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
