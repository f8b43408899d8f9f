//! Effects of positions, and of one visit of a position: by how much what a label says is off, as columns over the taps.

use crate::columns::Scales;
use crate::labels::TOGETHER;
use crate::rows::Cell;

/// Most columns for effects of positions, of visits each; more are approximated.
const EFFECTS: usize = 64;
/// Labels that differ by no more than this share are one.
const SAME: f64 = 1e-6;
/// Labels nearer than so many [`TOGETHER`] have effects that are more than half the same.
const CLOSE: f64 = 2.355;

/// Columns of positions and of visits, over `taps` of `cells` in so many `runs`; none where each tap has a position of its own.
pub(crate) fn of_positions(
    cells: &[Cell],
    taps: &[usize],
    scales: &Scales,
    runs: usize,
) -> [Vec<Vec<f64>>; 2] {
    let n = taps.len();
    let row = |i: usize| cells[taps[i]].row;
    let positions: Vec<f64> = (0..n).map(|i| scales.place(row(i).a, row(i).u)[0]).collect();
    let mut sorted = positions.clone();
    sorted.sort_by(f64::total_cmp);
    // An effect of the position is one of the reading where each position has one.
    let repeated =
        taps.iter().any(|k| cells[*k].n > 1.0) || sorted.windows(2).any(|w| w[1] - w[0] < 2.0 * TOGETHER);
    if !repeated {
        return [Vec::new(), Vec::new()];
    }
    let near = |i: usize, k: usize| (-0.5 * ((positions[i] - positions[k]) / (2.0 * TOGETHER)).powi(2)).exp();
    // Labels that hardly differ are jitter of one setting, or several settings, each with its own error.
    let same = |i: usize, k: usize| (row(i).a - row(k).a).abs() <= SAME * row(i).a;
    let visited = |i: usize, k: usize| match row(i).run == row(k).run {
        true => 0.5 * near(i, k) + if same(i, k) { 0.5 } else { 0.0 },
        false => 0.0,
    };
    let mut labels: Vec<f64> = (0..n).map(|i| row(i).a).collect();
    labels.sort_by(f64::total_cmp);
    labels.dedup_by(|a, b| *a - *b <= SAME * *b);
    let place = |a: f64| scales.place(a, row(0).u)[0];
    let close = labels.windows(2).any(|w| place(w[1]) - place(w[0]) < CLOSE * TOGETHER);
    // Where each tap has a label of its own, its error is noise.
    let settings = runs > 1 || close && 2 * labels.len() <= n;
    [factor(n, &near), if settings { factor(n, &visited) } else { Vec::new() }]
}

/// Columns F with F Fᵀ = the matrix of `kernel`, by Cholesky's method with pivots; what is below 1e-6 is left.
fn factor(n: usize, kernel: &dyn Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let mut left: Vec<f64> = (0..n).map(|i| kernel(i, i)).collect();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    while columns.len() < EFFECTS {
        let Some(pivot) = (0..n).max_by(|i, k| left[*i].total_cmp(&left[*k]).then(k.cmp(i))) else { break };
        if left[pivot] < 1e-6 {
            break;
        }
        let root = left[pivot].sqrt();
        let entry =
            |i: usize| (kernel(i, pivot) - columns.iter().map(|c| c[i] * c[pivot]).sum::<f64>()) / root;
        let column: Vec<f64> = (0..n).map(entry).collect();
        left.iter_mut().zip(&column).for_each(|(l, x)| *l = (*l - x * x).max(0.0));
        columns.push(column);
    }
    columns
}
