//! What a pack works in.

use super::Lanes;
use super::Tables;
use super::edges::Edges;
use super::read::{Products, Values};
use super::tap::Taps;
use crate::axis::AXES;
use crate::kernel::cpu::Pack;

/// Memory of a pack, used again by the next.
pub(super) struct Scratch<const FMA: bool> {
    /// Chebyshev polynomials over each axis.
    pub basis: [Vec<Lanes<FMA>>; AXES],
    /// Products of those over taper and place.
    pub products: Box<Values<FMA>>,
    /// A tap per distance.
    pub taps: Taps<Lanes<FMA>>,
    /// A tap per chart, where distances are read between charts.
    pub charts: Taps<Lanes<FMA>>,
    /// Where its words begin.
    pub edges: Vec<Edges<Lanes<FMA>>>,
    /// 1 at each drive at which a tap has no distance, where distances are estimated.
    pub rootless: Vec<Lanes<FMA>>,
}

impl<const FMA: bool> Scratch<FMA> {
    #[inline(always)]
    pub fn new(tables: &Tables) -> Self {
        let most = |k: usize| tables.charts.iter().map(|c| c.sizes[k]).max().unwrap_or(1).max(2);
        let charts = if tables.between.is_some() { tables.charts.len() } else { 0 };
        Self {
            basis: std::array::from_fn(|k| vec![Pack::default(); most(k)]),
            products: Products::values(),
            taps: Taps::new(tables.distances.len(), tables.points),
            charts: Taps::new(charts, tables.points),
            edges: Vec::with_capacity(tables.distances.len()),
            rootless: Vec::new(),
        }
    }
}
