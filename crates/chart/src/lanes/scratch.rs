//! What a pack works in.

use super::Lanes;
use super::Tables;
use super::edges::Edges;
use super::read::{Basis, Values};
use super::tap::Taps;
use crate::kernel::cpu::Pack;

/// Memory of a pack, used again by the next.
pub(super) struct Scratch<const SET: u8> {
    /// Chebyshev polynomials over each axis.
    pub basis: Box<Basis<SET>>,
    /// Products of those.
    pub products: Values<SET>,
    /// A tap per distance.
    pub taps: Taps<Lanes<SET>>,
    /// A tap per chart, where distances are read between charts.
    pub charts: Taps<Lanes<SET>>,
    /// Where its words begin.
    pub edges: Vec<Edges<Lanes<SET>>>,
    /// 1 at each drive at which a tap has no distance, where distances are estimated.
    pub rootless: Vec<Lanes<SET>>,
}

impl<const SET: u8> Scratch<SET> {
    #[inline(always)]
    pub fn new(tables: &Tables) -> Self {
        let charts = if tables.between.is_some() { tables.charts.len() } else { 0 };
        Self {
            basis: Box::new([[Pack::default(); _]; _]),
            products: Values::new(tables.charts.iter().chain(&tables.rough).map(|chart| &chart.products)),
            taps: Taps::new(tables.distances.len(), tables.points),
            charts: Taps::new(charts, tables.points),
            edges: Vec::with_capacity(tables.distances.len()),
            rootless: Vec::new(),
        }
    }
}
