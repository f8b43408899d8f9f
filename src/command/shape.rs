//! `vibrissa shape SPEC.toml`: bent whiskers, section by section.

use std::path::PathBuf;

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Asked, Context, Reply, folder, whole};
use crate::error::Error;
use crate::progress::Progress;
use crate::shape;
use crate::sink::{Question, run_json};

/// Bytes per section while its table is in memory: text in a buffer of up to twice its size, fields, columns.
const BYTES_OF_SECTION: u64 = 1024;

/// Shapes of bent whiskers.
#[derive(Debug, Flags, Deserialize)]
#[command(
    after_help = "Example: vibrissa shape sweeps/tapping.toml && vibrissa report results/tapping-shape"
)]
pub struct ShapeRequest {
    /// The spec: whiskers, distances and drives (10 000 taps at most), an exact model
    pub spec: PathBuf,
    /// Sections from the clamp to the contact
    #[arg(long, value_name = "N", default_value_t = 101, value_parser = whole::<u32>(3..=10_001))]
    pub nodes: u32,
}

pub fn run(asked: &Asked<ShapeRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let mut spec = context.spec(&asked.spec)?;
    spec.one_rig()?;
    let options = context.begun(&asked.common, &mut spec)?;
    let (setup, nodes) = (&spec.study.setup, asked.nodes as usize);
    shape::check(setup)?;
    let out = folder(options.out.as_ref(), &spec.name, "shape");
    if options.plan == Some(true) {
        let planned =
            Reply::planned(out, |to| format!("{}: shapes with {nodes} sections to {to}", spec.name));
        return Ok(Reply { result: json!({ "in_force": run_json::in_force(&spec) }), ..planned });
    }
    shape::rows(&spec.study.space, nodes, context.room(BYTES_OF_SECTION))?;
    let (method, by) = shape::method(&options, &setup.model)?;
    let question = Question::of_scene("shape", &spec, json!({ "nodes": nodes, "solved_by": by }));
    let mut destination = context.open(&out, question, &shape::FILES, options.force)?;
    let mut progress = context.progress();
    let steered = (context.host.stop(false), &mut *progress as &mut dyn Progress);
    let ([taps, shapes], tables) = shape::tables(&spec, method, nodes, steered)?;
    tables.into_iter().try_for_each(|table| destination.table(table))?;
    let without = match taps - shapes {
        0 => String::new(),
        n => format!("; {n} taps have none, contacts.csv says why"),
    };
    let text = format!("{shapes} shapes of {nodes} sections from clamp to contact{without}\n");
    let counts = json!({ "taps": taps, "shapes": shapes });
    let body = json!({ "material_fit": run_json::material_fit(&spec, None), "solved_by": by });
    let reply = Reply { text, counts, ..Reply::default() };
    Ok(reply.filed_of(&spec, destination, body)?.answered())
}
