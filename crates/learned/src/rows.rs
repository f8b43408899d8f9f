//! Readings of a rig; rows with equal labels are merged, so that repeats cost nothing. Checks of labels: how far apart positions are, and positions in
//! the wrong order (beyond its peak, the signal falls with the distance).

use std::collections::HashMap;

use vibrissa_core::reduce::{distinct, range, sorted};

use crate::evidence::{Hyper, Prior};

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

/// Positions within this share of the range of ln a count as one.
pub(crate) const TOGETHER: f64 = 0.01;
/// A rise counts beyond this many standard deviations of the difference, and beyond the share [`LEAST`] of the signal.
const CERTAIN: f64 = 4.0;
const LEAST: f64 = 0.01;
const REPEATS: f64 = 4.0;

/// Spread in ln of the prior if labels contradict each other; the median is the size of the contradiction.
const WRONG: f64 = 0.5;
/// Error of a position as a share of the gaps, two standard deviations of the prior.
const SET: f64 = 0.2;
/// The same in ln a for close positions: by hand, 30 mm is set to 0.3 mm.
const BY_HAND: f64 = 0.01;
const NARROW: f64 = 0.8;

/// Prior of the position; `wrong` is the size of a contradiction of labels (see `contradicted`). It is limited, because a free curve is as
/// likely as wrong labels: of four positions 9 mm apart, errors of 6 mm were as likely as none, and every σ was 8 mm.
pub fn position(cells: &[Cell], known: bool, wrong: Option<f64>) -> Prior {
    let usual = Prior::new(Hyper::Position.prior(known));
    if let Some(apart) = wrong {
        return Prior::new([apart.ln(), WRONG]);
    }
    let all = sorted(cells.iter().filter(|c| c.row.touches()).map(|c| c.row.a.ln()));
    let range = all.last().zip(all.first()).map_or(0.0, |(last, first)| last - first);
    let apart = all.windows(2).filter(|w| w[1] - w[0] > TOGETHER * range).count();
    let set = (SET * range / apart.max(1) as f64).max(BY_HAND);
    Prior { above: (0.5 * (set.ln() - usual.median)).clamp(NARROW, usual.above), ..usual }
}

/// Positions of one drive, in order and beyond the strongest signal, after which the signal rises, and by how many standard deviations.
pub fn rises<P>(all: &[P], signal: impl Fn(&P) -> f64, sd: impl Fn(&P, &P) -> f64) -> Vec<(usize, f64)> {
    let strongest = (0..all.len()).max_by(|i, k| signal(&all[*i]).total_cmp(&signal(&all[*k])));
    let rise = |k: usize| {
        let (p, q) = (&all[k], &all[k + 1]);
        let (rise, sd) = (signal(q) - signal(p), sd(p, q));
        (rise > LEAST * signal(p).abs() && rise > CERTAIN * sd).then_some((k, rise / sd))
    };
    (strongest.unwrap_or(0)..all.len().saturating_sub(1)).filter_map(rise).collect()
}

/// Largest difference in ln a of two positions in the wrong order.
pub fn contradicted(cells: &[Cell]) -> Option<f64> {
    let mut taps: Vec<&Cell> = cells.iter().filter(|c| c.row.touches()).collect();
    taps.sort_by(|c, d| c.row.u.total_cmp(&d.row.u).then(c.row.a.total_cmp(&d.row.a)));
    let [nearest, farthest] = range(taps.iter().map(|c| c.row.a.ln()));
    let (mut squares, mut freedom) = (0.0, 0.0);
    let mut positions: Vec<Vec<[f64; 3]>> = Vec::new();
    for drive in taps.chunk_by(|c, d| c.row.u == d.row.u) {
        let near = |c: &&Cell, d: &&Cell| (d.row.a / c.row.a).ln() <= TOGETHER * (farthest - nearest);
        let of_position = |cells: &[&Cell]| {
            let n: f64 = cells.iter().map(|c| c.n).sum();
            let mean = |of: &dyn Fn(&Cell) -> f64| cells.iter().map(|c| c.n * of(c)).sum::<f64>() / n;
            let (x, y) = (mean(&|c| c.row.a.ln()), mean(&|c| c.row.y));
            squares += cells.iter().map(|c| c.squares + c.n * (c.row.y - y).powi(2)).sum::<f64>();
            freedom += n - 1.0;
            [x, y, n]
        };
        positions.push(drive.chunk_by(near).map(of_position).collect());
    }
    if freedom < REPEATS {
        return None;
    }
    let variance = squares / freedom;
    let of_drive = |all: &Vec<[f64; 3]>| {
        let found = rises(all, |p| p[1], |p, q| (variance * (1.0 / p[2] + 1.0 / q[2])).sqrt());
        found.into_iter().map(|(k, _)| all[k + 1][0] - all[k][0]).reduce(f64::max)
    };
    positions.iter().filter_map(of_drive).reduce(f64::max)
}
