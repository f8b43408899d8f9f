//! What a sweep's result is a function of, how it is written, and what `merge` must know of the rows of a part beside the tables.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::best::Kept;
use super::charted::Rankers;
use crate::backend::Choice;
use crate::plan::Plan;
use crate::scene::{Space, Spec, Study};
use crate::sink::folder::{Question, hash};
use crate::sink::format::TableFormat;
use crate::sink::run_json;
use crate::sink::shard::Shard;
use crate::sink::table::Table;

/// Of a sweep, or of one part of it.
#[derive(Debug)]
pub(super) struct About {
    /// Designs of the part.
    pub designs: Range<u64>,
    /// How tables are written.
    pub format: TableFormat,
    /// Whether the places of its rows in the whole are written: where it is a part whose rows do not simply follow those of the part before.
    pub places: bool,
    /// Where the tables come from: the same for every part.
    pub provenance: String,
    /// Everything of which the bytes of the tables are a function, hashed.
    pub identity: String,
    /// The same for all parts, whatever driver and instructions they were computed with.
    pub whole: String,
}

impl About {
    /// Of a `shard`, or of the whole with effects left off within `bound`.
    pub fn new(
        spec: &Spec,
        plan: &Plan,
        choice: &Choice,
        (shard, bound): (Option<Shard>, Option<f64>),
    ) -> Self {
        let (format, b) = (TableFormat::of(spec), &choice.backend);
        let listed = !matches!(spec.study.space, Space::Grid(_));
        let places = shard.is_some() && (listed || spec.study.output.top.is_some());
        let backend = json!({
            "name": b.name, "adapter": b.adapter, "driver": b.driver, "precision": b.precision, "tolerance": b.tolerance,
        });
        let question = Question::of_scene("sweep", spec, Value::Null);
        let body = json!({ "in_force": question.lasting(), "backend": backend });
        let provenance = run_json::document("sweep", run_json::spec(spec), body).to_string();
        // Listed tuples are known by their hash.
        let study = &spec.study;
        let space = if listed { String::new() } else { format!("{:?}", study.space) };
        let whole = json!([
            env!("CARGO_PKG_VERSION"),
            format!("{:?} {:?} {space}", study.setup, study.output),
            question.lasting(),
            question.asked,
            (b.name, &b.adapter, b.precision, b.tolerance),
            format!("{:?} {:?} {} {bound:?}", plan.way, plan.solved, plan.chunk),
            format.name(),
        ]);
        let whole = hash(&whole.to_string());
        let part = shard.map(|s| s.to_string());
        let identity = json!([whole, crate::sink::COMMIT, b.driver, b.instructions, part]);
        let shard = shard.unwrap_or(Shard::WHOLE);
        let designs = shard.designs(plan.designs);
        Self { designs, format, places, provenance, identity: hash(&identity.to_string()), whole }
    }
}

/// Where a row of a part stands in the whole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
    /// Of a row that was kept, of the design `owner`.
    pub(super) fn of(row: &Kept, owner: u64) -> Self {
        Self { table: Table::Designs, rank: row.rank, charted: row.charted, index: row.index, owner }
    }

    /// Of a row of a table, by a row of the tuple file.
    pub(super) fn row(table: Table, row: u64, owner: u64) -> Self {
        Self { table, rank: 0.0, charted: f32::NAN, index: (row, 0), owner }
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
