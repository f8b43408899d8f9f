//! Which taps are solved side by side. Strides, steps and pieces are those of a whole pack, and effects those of a shader: only taps that agree in them go
//! together. So the bits of a tap are a function of that tap alone, whatever is solved beside it.

use std::collections::HashMap;

use super::{GRAIN, Rod, Tap, newton};

/// What of a whisker the kernels have code for; what is off costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Shape {
    /// The resting whisker is curved.
    pub curved: bool,
    /// Something is inside.
    pub inner: bool,
    /// The diameter is a power of the distance from the tip.
    pub power: bool,
}

impl Shape {
    /// Of `rod`.
    pub fn of(rod: &Rod) -> Self {
        Self {
            curved: rod.curvature != [0.0; 2],
            inner: rod.pieces.iter().any(|piece| piece.inner != [0.0; 2]),
            power: rod.power.is_some(),
        }
    }
}

/// Places of the taps of each work item, of those at the places `open`, with `steps` over each whisker at least; `onward`: a tap goes on from a rung
/// below.
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
