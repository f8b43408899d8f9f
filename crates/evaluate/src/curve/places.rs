//! The pieces over which a curve is solved, their halves, and the distances of the taps in each.

use std::sync::LazyLock;

use crate::design::Design;
use crate::physics::chebyshev::{matrix, placed};
use crate::scene::{Direction, Setup};

/// Tolerance from which a piece has fewer points, and both numbers of points.
const NODES: (f64, [usize; 2]) = (1e-6, [12, super::NODES]);
static TRANSFORMS: LazyLock<[Vec<Vec<f64>>; 2]> = LazyLock::new(|| NODES.1.map(matrix));

pub(super) fn transform(tolerance: f64) -> &'static [Vec<f64>] {
    &TRANSFORMS[usize::from(tolerance < NODES.0)]
}

const NARROW: f64 = 1e-3;

/// The extent of a wanted curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// Around these distances (smallest and largest, mm) and the range of interest; to the tip where |ε| rises at the smallest.
    Asked([f64; 2]),
    /// The same, starting before the peak.
    Peak([f64; 2]),
    /// From the gauge to the tip.
    Whole([f64; 2]),
}

impl Reach {
    /// For taps between these distances (mm) at a pole of this direction: readings of a tilted one may lie anywhere on the curve.
    pub fn of(direction: Direction, ends: [f64; 2]) -> Self {
        if direction.is_upright() { Self::Asked(ends) } else { Self::Whole(ends) }
    }
}

/// The interval of u between two distances, mm, the farther first.
pub(super) fn between(ends: &[f64]) -> [f64; 2] {
    [1.0 / ends[0], 1.0 / ends[1]]
}

pub(super) fn halves(u: [f64; 2]) -> [[f64; 2]; 2] {
    let mid = 0.5 * (u[0] + u[1]);
    [[u[0], mid], [mid, u[1]]]
}

/// The distance at the place x, −1 … 1, of an interval of u, mm.
pub(super) fn distance(u: [f64; 2], x: f64) -> f64 {
    1.0 / placed(u, x)
}

/// Ends of the first pieces of the curve of `design`, mm, falling; a little beyond the request, as a polynomial's slopes are poor at its ends.
pub(super) fn ends(setup: &Setup, design: &Design, reach: Reach) -> Vec<f64> {
    let Some(shared) = &design.shared else { return Vec::new() };
    let ([x1, x2], tip) = (shared.gauge, design.tuple.L_a);
    let start = x1 + 0.02 * (x2 - x1);
    let (Reach::Asked([least, most]) | Reach::Peak([least, most]) | Reach::Whole([least, most])) = reach;
    let [from, to] = setup.estimate.range.unwrap_or([least, most]);
    let (least, most) = (least.min(from).max(start), most.max(to).min(tip));
    let whole = matches!(reach, Reach::Whole(_));
    let hi = if whole { tip } else { most.max(1.2 * least).min(tip) };
    // A contact on the gauge is another branch of f.
    let clear = |a: f64| if least > x2 { a.max(0.5 * (x2 + least)).min(least) } else { least };
    let mut ends = vec![hi, clear(0.7 * hi)];
    if !matches!(reach, Reach::Asked(_)) {
        ends.push(x2 + 0.5 * (shared.theory.peak().0 - x2));
    }
    if whole {
        ends.push(start);
    }
    ends.retain(|a| (start..=tip).contains(a));
    ends.sort_by(|p, q| q.total_cmp(p));
    if let Some(place) = ends.windows(2).position(|w| w[1] < x2 && x2 < w[0]) {
        ends.insert(place + 1, x2);
    }
    ends.dedup_by(|next, last| *next > *last * (1.0 - NARROW));
    ends
}
