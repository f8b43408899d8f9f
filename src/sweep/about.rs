//! What a sweep's result is a function of, how it is written, and what `merge` must know of the rows of a part beside the tables.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::best::Kept;
use crate::backend::Choice;
use crate::plan::{Plan, Rankers};
use crate::scene::{Space, Spec, Study};
use crate::sink::folder::{Question, hash};
use crate::sink::format::TableFormat;
use crate::sink::run_json;
use crate::sink::shard::Shard;
use crate::sink::table::Table;

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
    /// What its folder answers.
    pub question: Question,
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
        let mut question = Question::of_scene("sweep", spec, Value::Null);
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
        let identity = json!([whole, crate::sink::COMMIT, b.driver, b.instructions, part]).to_string();
        question.identity = Some(hash(&identity));
        if let Some(part) = part {
            question.asked["shard"] = part.into();
        }
        let designs = shard.unwrap_or(Shard::WHOLE).designs(plan.designs);
        Self { designs, format, places, provenance, question, whole }
    }
}

/// Where a row of a part stands in the whole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Its table.
    pub table: Table,
    /// Number of its design and stroke; of a distances row only of its design.
    pub of: (u64, u32),
    /// By what the rows of a table follow each other: the ranked value of a row that was kept, the design or the row in the tuple file, and the
    /// place in the design.
    pub order: (u64, u64, u32),
    /// What a chart ranked it by; NaN where none did.
    pub charted: f32,
}

impl Place {
    /// Of a row that was kept, of the design `number`.
    pub(super) fn of(row: &Kept, number: u64) -> Self {
        let (first, stroke) = row.index;
        let order = (ordered(row.rank), first, stroke);
        Self { table: Table::Designs, of: (number, stroke), order, charted: row.charted }
    }
}

/// A number that is ordered as `x` is by `total_cmp`.
pub fn ordered(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// What run.json says of a part.
pub(super) fn description(shard: Shard, study: &Study, plan: &Plan, about: &About) -> Value {
    json!({
        "index": shard.index,
        "of": shard.of,
        "designs": { "from": about.designs.start, "to": about.designs.end, "of": plan.designs },
        "format": about.format.name(),
        "top": study.output.top,
        "candidates": plan.rankers.as_ref().map(Rankers::keep),
        "tables": super::writers::tables(study, plan),
        "whole": about.whole,
    })
}
