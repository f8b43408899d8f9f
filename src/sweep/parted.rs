//! One part of a sweep: what `merge` must know of its rows beside the tables.

use serde_json::{Value, json};

use super::about::About;
use super::charted::Rankers;
use super::select::Kept;
use crate::plan::Plan;
use crate::scene::Study;
use crate::sink::pack::Unpacker;
use crate::sink::shard::Shard;
use crate::sink::table::Table;

/// Where a row of a part stands in the whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Its table.
    pub table: Table,
    /// The ranked value of a row that was kept; else 0.
    pub rank: f64,
    /// What a chart ranked it by; NaN where none did.
    pub charted: f32,
    /// Place of its design and drive, or its row in the tuple file: of a designs or distances row the first.
    pub index: (u64, u32),
    /// In a tuple file: of a tap, the first row of its designs row; of a designs or distances row, a number of its design.
    pub owner: u64,
}

impl Place {
    /// Bytes of one.
    pub const BYTES: usize = 33;

    /// Of a row that was kept, of the design `owner`.
    pub(super) fn of(row: &Kept, owner: u64) -> Self {
        Self { table: Table::Designs, rank: row.rank, charted: row.charted, index: row.index, owner }
    }

    /// Of a row of a table, by a row of the tuple file.
    pub(super) fn row(table: Table, row: u64, owner: u64) -> Self {
        Self { table, rank: 0.0, charted: f32::NAN, index: (row, 0), owner }
    }

    /// As bytes.
    pub fn bytes(self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        bytes[0] = self.table as u8;
        bytes[1..9].copy_from_slice(&self.rank.to_le_bytes());
        bytes[9..13].copy_from_slice(&self.charted.to_le_bytes());
        bytes[13..21].copy_from_slice(&self.index.0.to_le_bytes());
        bytes[21..25].copy_from_slice(&self.index.1.to_le_bytes());
        bytes[25..].copy_from_slice(&self.owner.to_le_bytes());
        bytes
    }

    /// From bytes; `None` where they are none.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (mut bytes, all) = (Unpacker(bytes), Table::ALL);
        let (table, rank, charted): (u8, _, _) = bytes.take()?;
        let (index, owner) = bytes.take()?;
        Some(Self { table: *all.get(usize::from(table))?, rank, charted, index, owner })
    }
}

/// What run.json says of a part.
pub(super) fn description(shard: Shard, study: &Study, plan: &Plan, about: &About) -> Value {
    let each = study.space.layout().map(|layout| [layout.n_distances, layout.n_directions]);
    let [distances, directions] = [0, 1].map(|k| each.map(|each| each[k]));
    json!({
        "index": shard.index,
        "of": shard.of,
        "designs": { "from": about.designs.start, "to": about.designs.end, "of": plan.designs },
        "format": about.format.name(),
        "top": study.output.top,
        "candidates": Rankers::of(plan).map(|rankers| rankers.keep()),
        "distances_each": distances,
        "directions_each": directions,
        "tables": super::writers::tables(study, plan),
        "chart_taps": plan.chart_taps(),
        "whole": about.whole,
    })
}
