//! `vibrissa merge DIR…`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args as Flags;
use serde_json::json;

use super::{Asked, Context, Reply, grouped};
use crate::error::Error;
use crate::merge;

/// Parts of a sweep.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa merge results/million")]
pub struct MergeRequest {
    /// Folders shard-i-of-n, or the folder that holds them; the result goes there too unless --out says otherwise
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,
}

pub fn run(asked: &Asked<MergeRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&asked.common, None)?;
    if options.plan == Some(true) {
        let (parts, out) = merge::plan(&asked.folders, options.out.as_deref())?;
        return Ok(Reply::planned(out, |to| format!("{parts} parts would be joined in {to}")));
    }
    let report = merge::run(&asked.folders, options.out.as_deref(), options.force == Some(true))?;
    context.warn_all(&report.warnings);
    let (run, parts) = (&report.run, report.run["parts"].as_array().map_or(0, Vec::len));
    let n = |key: &str| grouped(run["counts"][key].as_u64().unwrap_or(0));
    let mut text = format!("{parts} parts of {} taps", n("taps"));
    if run["counts"]["kept_rows"].is_u64() {
        let _ = write!(text, ", kept {} of {} complete rows", n("kept_rows"), n("complete_rows"));
    }
    text.push('\n');
    let rows = ["tuples", "designs"].iter().filter_map(|key| run["counts"][key].as_u64()).sum::<u64>();
    let seconds = json!({ "total": report.seconds, "parts": run["seconds"]["total"] });
    let result = json!({ "parts": run["parts"], "warnings": report.warnings });
    let (counts, backend) = (run["counts"].clone(), run["backend"].clone());
    let reply = Reply { text, counts, seconds, backend, result, ..Reply::default() };
    let timed = (report.seconds, context.is_quiet());
    Ok(reply.with_files(report.out, report.written, timed).answered_of(rows))
}
