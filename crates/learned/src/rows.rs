//! Readings of a rig; rows with equal labels are merged, so that repeats cost nothing.

use std::collections::HashMap;

use vibrissa_core::reduce::distinct;

/// One reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Contact distance as labelled, mm.
    pub a: f64,
    /// Drive, degrees or mm; 0 without contact.
    pub u: f64,
    /// Signal; taps lie above the zero.
    pub y: f64,
    /// Number of its run, from 0.
    pub run: usize,
    /// Time in seconds, or the index in the file.
    pub t: f64,
}

impl Row {
    /// True if the whisker touches the object.
    pub fn touches(&self) -> bool {
        self.u != 0.0
    }
}

/// Rows with equal labels.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Their labels, with the mean of signal and time.
    pub row: Row,
    /// Number of rows.
    pub n: f64,
    /// Sum of squares of the signal about the mean.
    pub squares: f64,
    /// Indices of the rows.
    pub rows: Vec<usize>,
}

const MOST: usize = 2500;

/// Cells of the rows at `places`; with `timed`, rows of different times stay separate.
pub fn cells(rows: &[Row], places: &[usize], timed: bool) -> Vec<Cell> {
    let mut found: HashMap<[i64; 4], usize> = HashMap::new();
    let label = |x: f64| (x.abs().ln() * 1e9).round() as i64 * x.signum() as i64;
    let mut all: Vec<Cell> = Vec::new();
    for &place in places {
        let row = rows[place];
        let t = if timed { row.t.to_bits() as i64 } else { 0 };
        let [a, u] = if row.touches() { [row.a, row.u].map(label) } else { [i64::MIN; 2] };
        let k = *found.entry([a, u, row.run as i64, t]).or_insert(all.len());
        if k == all.len() {
            all.push(Cell { row: Row { y: 0.0, t: 0.0, ..row }, n: 0.0, squares: 0.0, rows: Vec::new() });
        }
        all[k].rows.push(place);
    }
    for cell in &mut all {
        // Relative to the first value, so that the mean of equal values is exact.
        let first = rows[cell.rows[0]];
        cell.n = cell.rows.len() as f64;
        let mean = |f: &dyn Fn(&Row) -> f64| cell.rows.iter().map(|k| f(&rows[*k])).sum::<f64>() / cell.n;
        let (dy, dt) = (mean(&|r| r.y - first.y), mean(&|r| r.t - first.t));
        cell.row.y = first.y + dy;
        cell.row.t = first.t + dt;
        cell.squares = cell.rows.iter().map(|k| (rows[*k].y - cell.row.y).powi(2)).sum();
    }
    if all.len() > MOST && timed { cells(rows, places, false) } else { all }
}

/// Step of a converter: largest number that divides all differences of readings, to a millionth of their range; 0 if none, or for two values.
pub fn quantum(values: &[f64]) -> f64 {
    let sorted = distinct(values.iter().copied().filter(|x| x.is_finite()));
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else { return 0.0 };
    let (range, size) = (last - first, first.abs().max(last.abs()));
    let least = (1e-6 * range).max(1e-12 * size);
    if sorted.len() < 3 {
        return 0.0;
    }
    let mut step = 0.0f64;
    for gap in sorted.windows(2).map(|w| w[1] - w[0]) {
        let (mut p, mut q) = (gap.max(step), gap.min(step));
        while q > least {
            (p, q) = (q, (p - q * (p / q).round()).abs());
        }
        step = p;
    }
    if step > 3.0 * least { step } else { 0.0 }
}
