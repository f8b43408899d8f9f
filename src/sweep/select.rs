//! `top`: the best complete rows, in bounded memory.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::scene::{Direction, Setup, Tuple};
use crate::sink::pack::{Packed, Packer, Unpacker, packed};
use crate::sink::table::{AtDrive, Field, fields};
use crate::statistics::Figures;

/// A designs row that was kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Ranked value.
    pub rank: f64,
    /// Place of the design, then of the stroke.
    pub index: (u64, u32),
    /// The design.
    pub design: Tuple,
    /// Direction of the pole.
    pub direction: Direction,
    /// Its drive, degrees or mm.
    pub drive: f64,
    /// The row.
    pub row: Figures,
    /// Unit of K in the tables.
    pub unit: f64,
    /// What it was ranked by in a chart, which decides whether it is a candidate; NaN of a row solved tap by tap.
    pub(super) charted: f32,
}

packed!(Kept { rank, index, design, direction, drive, row, unit, charted });

impl Packed for Best {
    fn pack(&self, to: &mut Packer<'_>) {
        (self.n as u64, self.offered, self.heap.len() as u64).pack(to);
        self.heap.iter().for_each(|worst| worst.0.pack(to));
    }

    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        let (n, offered, len): (u64, u64, u64) = from.take()?;
        let heap = (0..len).map(|_| from.take().map(Worst)).collect::<Option<_>>()?;
        Some(Self { n: usize::try_from(n).ok()?, heap, offered })
    }
}

impl Kept {
    /// A row whose taps were solved.
    pub(super) fn of(row: &AtDrive<'_>, rank: f64, index: (u64, u32)) -> Self {
        let AtDrive { design, direction, drive, row, unit } = *row;
        Self { rank, index, design: *design, direction, drive, row, unit, charted: f32::NAN }
    }

    /// Its row of designs.csv for `setup`, after what `out` holds.
    pub fn fields(&self, setup: &Setup, out: &mut Vec<Field>) {
        let Self { direction, drive, row, unit, .. } = *self;
        let row = AtDrive { design: &self.design, direction, drive, row, unit };
        fields(&AtDrive::COLUMNS, setup, &row, out);
    }

    /// Better first: smaller value, then smaller index.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.rank.total_cmp(&other.rank).then(self.index.cmp(&other.index))
    }
}

/// The `n` best rows of all that were offered.
#[derive(Debug)]
pub(super) struct Best {
    n: usize,
    heap: BinaryHeap<Worst>,
    /// Complete rows offered.
    pub offered: u64,
}

#[derive(Debug)]
struct Worst(Kept);

impl PartialEq for Worst {
    fn eq(&self, o: &Self) -> bool {
        self.cmp(o) == Ordering::Equal
    }
}
impl Eq for Worst {}
impl PartialOrd for Worst {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        Some(self.cmp(o))
    }
}
impl Ord for Worst {
    fn cmp(&self, o: &Self) -> Ordering {
        self.0.order(&o.0)
    }
}

impl Best {
    pub fn new(n: usize) -> Self {
        Self { n, heap: BinaryHeap::new(), offered: 0 }
    }

    /// Takes a complete row if it is among the best so far.
    pub fn offer(&mut self, row: Kept) {
        self.offered += 1;
        if self.heap.len() < self.n {
            self.heap.push(Worst(row));
        } else if self.heap.peek().is_some_and(|worst| row.order(&worst.0) == Ordering::Less) {
            self.heap.pop();
            self.heap.push(Worst(row));
        }
    }

    /// The rows kept, best first.
    pub fn into_rows(self) -> Vec<Kept> {
        self.heap.into_sorted_vec().into_iter().map(|w| w.0).collect()
    }
}
