//! `vibrissa report DIR`: figures and a page of a result.

use std::path::PathBuf;

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Common, Context, Reply, meant, named, number};
use crate::error::{Error, InputError};
use crate::figure::{Format, Style};
use crate::report::{self, source::Source};

/// Figures and a page of a result.
#[derive(Debug, Flags, Deserialize)]
#[command(
    after_help = "Example: vibrissa sweep sweeps/prototypes.toml && vibrissa report results/prototypes"
)]
pub struct ReportRequest {
    /// Folder of a result of sweep, optimise, tap, calibrate, locate, bench, verify or shape
    pub dir: PathBuf,
    /// Folder for the report [default: DIR/report]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Formats of the figures, separated by commas; the page has its own
    #[arg(long, value_name = "FORMATS", value_delimiter = ',', default_value = "svg,png,pdf", value_parser = named(Format::WORDS))]
    pub figures: Vec<String>,
    /// Width of a column of the paper, mm; figures with several panels are two columns wide
    #[arg(long, value_name = "MM", default_value_t = 88.0, value_parser = number)]
    pub width: f64,
    /// Size of all text in the figures, pt
    #[arg(long, value_name = "PT", default_value_t = 8.0, value_parser = number)]
    pub font_size: f64,
    /// TrueType font file of the figures [default: DejaVu Sans, built in]
    #[arg(long, value_name = "FILE")]
    pub font: Option<PathBuf>,
    /// Draw also a result that was changed since it was written; write also over another report or beside other files
    #[arg(long)]
    pub force: bool,
    /// List the figures that would be drawn; write nothing
    #[arg(long)]
    #[serde(skip)]
    pub plan: bool,
    /// No notes, no summary
    #[arg(long)]
    #[serde(skip)]
    pub quiet: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    #[serde(skip)]
    pub json: bool,
}

/// Draws a result.
///
/// # Errors
/// A folder without a result, a size or a font that is not allowed, files that cannot be written.
pub fn run(asked: &ReportRequest, context: &Context<'_>) -> Result<Reply, Error> {
    let (quiet, json) = (asked.quiet, asked.json);
    context.prepared(&Common { quiet, json, ..Common::default() }, None)?;
    let keys = ["--width", "--font-size"];
    let style = Style::asked(asked.width, asked.font_size, asked.font.as_deref(), keys)?;
    let format = |word: &String| meant(("word", "--figures"), Some(word), &Format::WORDS);
    let formats = asked.figures.iter().map(format).collect::<Result<Vec<_>, InputError>>()?;
    let mut formats: Vec<Format> = formats.into_iter().flatten().collect();
    formats.sort();
    formats.dedup();
    let out = asked.out.clone().unwrap_or_else(|| asked.dir.join("report"));
    if asked.plan {
        let source = Source::open(&asked.dir, asked.force)?;
        let content = report::content(&source)?;
        let names: Vec<&str> = content.figures.iter().map(|f| f.name.as_str()).collect();
        let (command, name, page) = (&source.command, &source.name, report::PAGE);
        let (n, listed, to) = (names.len(), names.join(", "), out.display());
        let text =
            format!("{command} of {name}: {page} and {n} figures to {to} ({listed}); nothing was written\n");
        return Ok(Reply { text, out: Some(out), result: json!({ "figures": names }), ..Reply::default() });
    }
    let made = report::run(&asked.dir, &out, &style, &formats, asked.force)?;
    made.notes.iter().for_each(|note| context.line(format!("note: {note}")));
    let endings: Vec<&str> = formats.iter().map(|f| f.ending()).collect();
    let also = match endings.is_empty() {
        true => String::new(),
        false => format!(" and the figures as {}", endings.join(", ")),
    };
    let (answer, n, names) = (&made.answer, made.figures.len(), made.figures.join(", "));
    let (page, kilobytes, time) = (out.join(report::PAGE), made.bytes.div_ceil(1000), made.seconds);
    let page = page.display();
    let text =
        format!("{answer}\n{n} figures: {names}\nwrote {page} ({kilobytes} kB){also} in {time:.2} s\n");
    let reply = Reply {
        text,
        out: Some(out),
        files: made.written.files.clone(),
        counts: json!({ "figures": made.figures.len(), "page_bytes": made.bytes }),
        seconds: json!({ "total": made.seconds }),
        result: json!({ "answer": made.answer, "figures": made.figures, "notes": made.notes }),
        quiet,
        ..Reply::default()
    };
    Ok(reply.removing(&made.written.removed))
}
