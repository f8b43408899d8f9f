//! Packs taps that agree in strides, steps, pieces and effects, so that the bits of a tap depend on that tap alone.

use std::collections::HashMap;

use super::{GRAIN, Rod, Tap, newton};

/// Properties of a whisker for which the kernels have separate code; a property that is off costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Shape {
    /// The resting whisker is curved.
    pub curved: bool,
    /// The whisker has a core or a bore.
    pub inner: bool,
    /// The diameter is a power of the distance from the tip.
    pub power: bool,
}

impl Shape {
    /// The properties of `rod`.
    pub fn of(rod: &Rod) -> Self {
        Self {
            curved: rod.curvature != [0.0; 2],
            inner: rod.pieces.iter().any(|piece| piece.inner != [0.0; 2]),
            power: rod.power.is_some(),
        }
    }
}

/// Indices of the taps of each work item. `open`: taps to solve; `steps`: least over a whisker; `onward`: a coarser rung's result is the start.
pub fn items(
    taps: &[Tap<'_>],
    open: &[usize],
    steps: usize,
    onward: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let mut of_rod: HashMap<*const Rod, usize> = HashMap::new();
    let mut classes: HashMap<(Shape, Vec<usize>), usize> = HashMap::new();
    let mut class = |rod: &Rod| {
        *of_rod.entry(std::ptr::from_ref(rod)).or_insert_with(|| {
            let next = classes.len();
            let steps = rod.pieces.iter().map(|piece| piece.steps(steps)).collect();
            *classes.entry((Shape::of(rod), steps)).or_insert(next)
        })
    };
    let key = |&i: &usize| {
        let strides = if onward(i) { 0 } else { newton::strides(&taps[i]) };
        ((strides, class(taps[i].rod)), i)
    };
    let mut all: Vec<((usize, usize), usize)> = open.iter().map(key).collect();
    all.sort_unstable();
    let alike = all.chunk_by(|p, q| p.0 == q.0).flat_map(|alike| alike.chunks(GRAIN));
    alike.map(|item| item.iter().map(|(_, i)| *i).collect()).collect()
}
