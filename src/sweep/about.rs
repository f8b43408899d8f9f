//! Identity and format of a sweep's result, and the data that `merge` needs about the rows of a part besides the tables.

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
    pub designs: Range<u64>,
    pub format: TableFormat,
    /// True if the places of the rows in the whole are written: in a part whose rows do not simply follow those of the part before.
    pub places: bool,
    pub provenance: String,
    pub question: Question,
    /// Hash of the whole sweep: equal for all parts, with any driver and CPU instructions.
    pub whole: String,
}

impl About {
    /// For a `shard`, or for the whole with effects left off within `bound`.
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

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Place {
    pub table: Table,
    /// Number of its design and stroke; for a distances row only of its design.
    pub of: (u64, u32),
    /// Sort key of the rows of a table: ranked value of a kept row, then design or row of the tuple file, then place in the design.
    pub order: (u64, u64, u32),
    /// Rank value from a chart; NaN without one.
    pub charted: f32,
}

impl Place {
    pub(super) fn of(row: &Kept, number: u64) -> Self {
        let (first, stroke) = row.index;
        let order = (ordered(row.rank), first, stroke);
        Self { table: Table::Designs, of: (number, stroke), order, charted: row.charted }
    }
}

/// A number with the same order as `x` by `total_cmp`.
pub fn ordered(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

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
