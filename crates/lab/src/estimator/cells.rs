//! Cells: taps of one distance and one drive.

use super::taps::Tap;
use crate::design::amount;
use crate::measure::Rig;
use crate::measure::group::Groups;

/// Taps of one distance and one drive on one side.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    pub i: usize,
    pub j: usize,
    pub taps: Vec<usize>,
    pub a: f64,
    pub drive: f64,
    pub signal: f64,
    /// Mean θ f in the theory of the spec.
    pub linear: f64,
    /// Sum of squares about the mean, corrected for distance and drive within the level.
    pub squares: f64,
    /// Expected sum of squares for a reading's variance of 1.
    pub freedom: f64,
    /// Variance of the mean in units of a reading's: 1/n plus the zeros' part.
    pub share: f64,
    /// Runs of zero readings below its mean: index, weight, variance in units of a reading's.
    pub zeros: Vec<(usize, f64, f64)>,
}

impl Cell {
    pub fn n(&self) -> f64 {
        self.taps.len() as f64
    }
}

/// Levels of distance and drive, and cells by distance, then drive, of the `wanted` taps.
pub fn grouped(taps: &[Tap], rig: &Rig, wanted: impl Fn(&Tap) -> bool) -> ([Groups; 2], Vec<Cell>) {
    let levels = |axis: usize| Groups::levels(taps.iter().filter(|t| wanted(t)).map(|t| t.group[axis]));
    let [distances, drives] = [0, 1].map(levels);
    let mut grid: Vec<Vec<usize>> = vec![Vec::new(); distances.len() * drives.len()];
    for (k, tap) in taps.iter().enumerate().filter(|(_, t)| wanted(t)) {
        grid[distances.place(tap.group[0]) * drives.len() + drives.place(tap.group[1])].push(k);
    }
    let curve = rig.shared().theory.curve();
    let linear = |t: &Tap| amount(rig.setup.drive, t.drive) * curve.value(t.a);
    let cell = |(place, taps_here): (usize, Vec<usize>)| {
        if taps_here.is_empty() {
            return None;
        }
        let n = taps_here.len() as f64;
        let mean = |f: &dyn Fn(&Tap) -> f64| taps_here.iter().map(|&k| f(&taps[k])).sum::<f64>() / n;
        // Relative to the first value, so that the mean of equal values is exact.
        let about = |f: &dyn Fn(&Tap) -> f64| {
            let first = f(&taps[taps_here[0]]);
            first + mean(&|t| f(t) - first)
        };
        let (signal, theory) = (about(&|t| t.signal.abs()), about(&linear));
        let ratio = signal / theory;
        let squares = n * mean(&|t| (t.signal.abs() - ratio * linear(t)).powi(2));
        let (zeros, [of_mean, about_mean]) = zero_noise(taps_here.iter().map(|&k| &taps[k]));
        Some(Cell {
            i: place / drives.len(),
            j: place % drives.len(),
            a: about(&|t| t.a),
            drive: about(&|t| t.drive),
            signal,
            linear: theory,
            squares: if n > 1.0 { squares } else { 0.0 },
            freedom: n - 1.0 + about_mean,
            share: 1.0 / n + of_mean,
            zeros,
            taps: taps_here,
        })
    };
    let cells = grid.into_iter().enumerate().filter_map(cell).collect();
    ([distances, drives], cells)
}

/// Noise of the zero readings in a cell: runs with weights; variance of the mean and sum of squares about it, in units of a reading's variance.
fn zero_noise<'a>(taps: impl Iterator<Item = &'a Tap>) -> (Vec<(usize, f64, f64)>, [f64; 2]) {
    let mut runs = std::collections::BTreeMap::<usize, (f64, f64, f64)>::new();
    let mut n = 0.0;
    for tap in taps {
        n += 1.0;
        for (run, weight, share) in tap.zeros {
            if weight != 0.0 {
                let sum = runs.entry(run).or_insert((0.0, 0.0, share));
                *sum = (sum.0 + weight, sum.1 + weight * weight, share);
            }
        }
    }
    let add = |[mean, about]: [f64; 2], (sum, squares, share): &(f64, f64, f64)| {
        [mean + share * (sum / n).powi(2), about + share * (squares - sum * sum / n).max(0.0)]
    };
    let noise = runs.values().fold([0.0; 2], add);
    (runs.into_iter().map(|(run, (sum, _, share))| (run, sum / n, share)).collect(), noise)
}
