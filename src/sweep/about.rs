//! What a sweep's result is a function of, and how it is written.

use std::ops::Range;

use serde_json::{Value, json};

use crate::backend::Choice;
use crate::plan::{CHUNK, Plan};
use crate::scene::{Space, Spec};
use crate::sink::folder::{Question, hash};
use crate::sink::rows::TableFormat;
use crate::sink::run_json;
use crate::sink::shard::Shard;

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
            format!("{:?} {:?} {CHUNK} {bound:?} {}", plan.way, plan.solved, !plan.row_readers().is_empty()),
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
