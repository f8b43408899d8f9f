//! Looking for a mode in two numbers, and reading a density around it.

use super::course::{POSTERIOR, Place};
use super::{NEAR, lagrange};
use crate::invert::FINE;

/// ln p below that of the highest point that is none.
const NONE: f64 = 60.0;
/// Steps of a simplex.
const STEPS: usize = 80;

/// A density at [`FINE`] points, its logarithm by polynomials.
pub(super) fn finer(of: &[f64; POSTERIOR[0]]) -> [f64; FINE] {
    let top = of.iter().copied().fold(0.0, f64::max);
    let logs = of.map(|p| (p / top).ln().max(-NONE));
    std::array::from_fn(|i| {
        let s = (i * (POSTERIOR[0] - 1)) as f64 / (FINE - 1) as f64;
        let k = (s as usize + 1).saturating_sub(NEAR / 2).min(POSTERIOR[0] - NEAR);
        let ln: f64 = lagrange(s - k as f64).iter().zip(&logs[k..]).map(|(w, l)| w * l).sum();
        if ln <= -0.9 * NONE { 0.0 } else { ln.exp() }
    })
}

/// How a posterior lies in its window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fits {
    Well,
    TooNarrow,
    TooWide,
}

/// Whether the points of a density show all of it, and enough of it.
pub(super) fn fits(density: &[f64]) -> Fits {
    let top = density.iter().copied().fold(0.0, f64::max);
    let last = density.len() - 1;
    if density[0].max(density[last]) > 1e-3 * top {
        return Fits::TooNarrow;
    }
    let seen = density.iter().filter(|p| **p > 1e-3 * top).count();
    if 3 * seen < density.len() { Fits::TooWide } else { Fits::Well }
}

/// The least value that Nelder and Mead's simplex of this size finds from `start`.
pub(super) fn simplex(
    value: &dyn Fn(Place) -> f64,
    start: Place,
    size: [f64; 2],
    free: usize,
) -> (Place, f64) {
    let mut all: Vec<(Place, f64)> = (0..=free)
        .map(|k| {
            let mut p = start;
            if k > 0 {
                p[k - 1] += size[k - 1];
            }
            if !value(p).is_finite() && k > 0 {
                p[k - 1] -= 2.0 * size[k - 1];
            }
            (p, value(p))
        })
        .collect();
    let between = |p: Place, q: Place, t: f64| [0, 1].map(|k| p[k] + t * (q[k] - p[k]));
    for _ in 0..STEPS {
        all.sort_by(|p, q| p.1.total_cmp(&q.1));
        let (best, worst) = (all[0], all[free]);
        if worst.1 - best.1 < 1e-3 {
            break;
        }
        let middle = [0, 1].map(|k| all[..free].iter().map(|p| p.0[k]).sum::<f64>() / free as f64);
        let tried = |t: f64| {
            let p = between(worst.0, middle, t);
            (p, value(p))
        };
        let mirrored = tried(2.0);
        let next = if mirrored.1 < best.1 {
            let further = tried(3.0);
            if further.1 < mirrored.1 { further } else { mirrored }
        } else if mirrored.1 < all[free - 1].1 || (free == 1 && mirrored.1 < worst.1) {
            mirrored
        } else {
            let inner = if mirrored.1 < worst.1 { tried(1.5) } else { tried(0.5) };
            if inner.1 < worst.1.min(mirrored.1) {
                inner
            } else {
                for other in &mut all[1..] {
                    let p = between(best.0, other.0, 0.5);
                    *other = (p, value(p));
                }
                continue;
            }
        };
        all[free] = next;
    }
    all.sort_by(|p, q| p.1.total_cmp(&q.1));
    all[0]
}
