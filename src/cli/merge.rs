//! `vibrissa merge DIR…`.

use std::fmt::Write;

use serde_json::json;
use vibrissa::error::Error;

use super::args::Merge;
use super::reply::Reply;
use super::say::grouped;
use super::{listed, say};

/// Rows up to which what is recommended is told.
const ANSWERED: u64 = 100_000;

/// Joins the parts.
pub fn run(args: &Merge) -> Result<Reply, Error> {
    let common = &args.common;
    let report = vibrissa::merge::run(&args.folders, common.out.as_deref(), common.force)?;
    if !common.quiet {
        report.warnings.iter().for_each(say::warning);
    }
    let (run, parts) = (&report.run, report.run["parts"].as_array().map_or(0, Vec::len));
    let n = |key: &str| grouped(run["counts"][key].as_u64().unwrap_or(0));
    let searched = run["command"] == "optimise";
    let mut text = match searched {
        true => format!("{parts} searches of {} evaluations", n("evaluations")),
        false => format!("{parts} parts of {} taps", n("taps")),
    };
    if searched {
        let _ = write!(text, "; best {:.6e}", run["result"]["value"].as_f64().unwrap_or(f64::NAN));
    }
    if run["counts"]["kept_rows"].is_u64() {
        let _ = write!(text, ", kept {} of {} complete rows", n("kept_rows"), n("complete_rows"));
    }
    let _ = writeln!(text, "\nwrote {} in {:.2} s", listed(&report.files), report.seconds);
    let rows = ["tuples", "designs"].iter().filter_map(|key| run["counts"][key].as_u64()).sum::<u64>();
    let reply = Reply {
        text,
        out: Some(report.out),
        counts: run["counts"].clone(),
        seconds: json!({ "total": report.seconds, "parts": run["seconds"]["total"] }),
        backend: run["backend"].clone(),
        result: json!({ "parts": run["parts"], "warnings": report.warnings }),
        files: report.files,
        quiet: common.quiet,
        ..Reply::default()
    }
    .removing(&report.removed);
    // Long tables are not read again for a sentence.
    Ok(if rows <= ANSWERED { reply.answered() } else { reply })
}
