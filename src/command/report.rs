//! `vibrissa report DIR`: figures and a page of a result.

use std::path::PathBuf;

use clap::Args as Flags;
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::json;

use super::{Asked, Common, Context, Destination, Reply, meant, named, number};
use crate::error::{Error, InputError};
use crate::figure::{self, Figure, Format, Style};
use crate::report::{self, Source};
use crate::sink::folder::{Folder, Question};

/// Figures and a page of a result.
#[derive(Debug, Flags, Deserialize)]
#[command(
    after_help = "Here --out is DIR/report by default, and --force draws also a result that was changed since it was written. Example: vibrissa sweep sweeps/prototypes.toml && vibrissa report results/prototypes"
)]
pub struct ReportRequest {
    /// Folder of a result of sweep, optimise, tap, calibrate, locate, bench, verify or shape
    pub dir: PathBuf,
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
}

pub fn run(asked: &Asked<ReportRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let Common { out, force, plan, .. } = &asked.common;
    context.prepared(&asked.common, None)?;
    let style = Style::asked(asked.width, asked.font_size, asked.font.as_deref())?;
    let format = |word: &String| meant(("word", "--figures"), Some(word), &Format::WORDS);
    let formats = asked.figures.iter().map(format).collect::<Result<Vec<_>, InputError>>()?;
    let mut formats: Vec<Format> = formats.into_iter().flatten().collect();
    formats.sort();
    formats.dedup();
    let out = out.clone().unwrap_or_else(|| asked.dir.join("report"));
    let source = Source::open(&asked.dir, *force)?;
    let content = report::content(&source)?;
    let names: Vec<&str> = content.figures.iter().map(|f| f.name.as_str()).collect();
    let (command, name, n, listed) = (&source.command, &source.name, names.len(), names.join(", "));
    if *plan {
        let (page, to) = (report::PAGE, out.display());
        let text =
            format!("{command} of {name}: {page} and {n} figures to {to} ({listed}); nothing was written\n");
        return Ok(Reply { text, out: Some(out), result: json!({ "figures": names }), ..Reply::default() });
    }
    let notes: Vec<&String> = source.notes.iter().chain(&content.notes).collect();
    let files = |f| figure::files(f, &style, &formats);
    let drawn = content.figures.par_iter().map(files).collect::<Result<Vec<_>, _>>()?;
    let page = report::content::page(&source, &content, &notes);
    let mut files: Vec<(String, Vec<u8>)> = drawn.into_iter().flatten().collect();
    files.push((report::PAGE.to_owned(), page.into_bytes()));
    let bytes = files.last().map_or(0, |(_, page)| page.len());
    let endings: Vec<&str> = formats.iter().map(|f| f.word()).collect();
    let of = json!({
        "drawn": source.hash, "figures": endings, "width_mm": style.width, "font_size_pt": style.size, "font": style.font.family,
    });
    let inputs = source.inputs()?.into_iter().chain(style.font.file.clone()).collect();
    let question = Question { inputs, ..Question::new("report", name.clone(), of) };
    let written: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    let folder = Folder::open(&out, question, &written, *force)?;
    let (command, force, folder, kept) = ("report", *force, Some(folder), Vec::new());
    let mut destination = Destination { context, command, out, force, folder, kept };
    files.into_iter().try_for_each(|(name, bytes)| destination.put(&name, bytes))?;
    let figure = |f: &Figure| json!({ "name": f.name, "title": f.title, "caption": f.caption });
    let (run, answer) = (&source.run, &content.answer);
    let body = json!({
        "of": { "command": source.command, "run_json_blake3": source.hash, "version": run["version"], "commit": run["commit"] },
        "figures": content.figures.iter().map(figure).collect::<Vec<_>>(),
        "answer": answer,
        "notes": notes,
    });
    notes.iter().for_each(|note| context.line(format!("note: {note}")));
    let also = match endings.is_empty() {
        true => String::new(),
        false => format!(" and the figures as {}", endings.join(", ")),
    };
    let at = destination.out.join(report::PAGE);
    let counts = json!({ "figures": n, "page_bytes": bytes });
    let result = json!({ "answer": answer, "figures": names, "notes": notes });
    let reply = Reply { counts, result, ..Reply::default() };
    let reply = reply.filed(destination, run["spec"].clone(), body)?;
    let (kilobytes, time) = (bytes.div_ceil(1000), context.elapsed());
    let at = at.display();
    let text = format!("{answer}\n{n} figures: {listed}\nwrote {at} ({kilobytes} kB){also} in {time:.2} s\n");
    Ok(Reply { text, ..reply })
}
