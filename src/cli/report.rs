//! `vibrissa report DIR`.

use std::fmt::Write;

use serde_json::json;
use vibrissa::error::Error;
use vibrissa::figure::{Format, Style};
use vibrissa::report::{self, source::Source};

use super::args::Report;
use super::reply::{self, Reply};
use super::say;

/// Draws a result.
pub fn run(args: &Report) -> Result<Reply, Error> {
    reply::in_json(args.json);
    let keys = ["--width", "--font-size"];
    let style = Style::asked(args.width, args.font_size, args.font.as_deref(), keys)?;
    let mut formats: Vec<Format> = args.figures.clone();
    formats.sort();
    formats.dedup();
    let out = args.out.clone().unwrap_or_else(|| args.dir.join("report"));
    if args.plan {
        let source = Source::open(&args.dir, args.force)?;
        let content = report::content(&source)?;
        let names: Vec<&str> = content.figures.iter().map(|f| f.name.as_str()).collect();
        let text = format!(
            "{} of {}: {} and {} figures to {} ({}); nothing was written\n",
            source.command,
            source.name,
            report::PAGE,
            names.len(),
            out.display(),
            names.join(", ")
        );
        return Ok(Reply { text, out: Some(out), result: json!({ "figures": names }), ..Reply::default() });
    }
    let made = report::run(&args.dir, &out, &style, &formats, args.force)?;
    if !args.quiet {
        made.notes.iter().for_each(|n| say::line(format_args!("note: {n}")));
    }
    let mut text = String::new();
    let endings: Vec<&str> = formats.iter().map(|f| f.ending()).collect();
    let _ = writeln!(text, "{}", made.answer);
    let _ = writeln!(text, "{} figures: {}", made.figures.len(), made.figures.join(", "));
    let _ = writeln!(
        text,
        "wrote {} ({} kB){} in {:.2} s",
        out.join(report::PAGE).display(),
        made.bytes.div_ceil(1000),
        if endings.is_empty() {
            String::new()
        } else {
            format!(" and the figures as {}", endings.join(", "))
        },
        made.seconds
    );
    let reply = Reply {
        text,
        out: Some(out),
        files: made.written.files.clone(),
        counts: json!({ "figures": made.figures.len(), "page_bytes": made.bytes }),
        seconds: json!({ "total": made.seconds }),
        result: json!({ "answer": made.answer, "figures": made.figures, "notes": made.notes }),
        quiet: args.quiet,
        ..Reply::default()
    };
    Ok(reply.removing(&made.written.removed))
}
