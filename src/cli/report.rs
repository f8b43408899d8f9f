//! `vibrissa report DIR`.

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
        let (command, name, page) = (&source.command, &source.name, report::PAGE);
        let (n, listed, to) = (names.len(), names.join(", "), out.display());
        let text =
            format!("{command} of {name}: {page} and {n} figures to {to} ({listed}); nothing was written\n");
        return Ok(Reply { text, out: Some(out), result: json!({ "figures": names }), ..Reply::default() });
    }
    let made = report::run(&args.dir, &out, &style, &formats, args.force)?;
    if !args.quiet {
        made.notes.iter().for_each(|n| say::line(format_args!("note: {n}")));
    }
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
        quiet: args.quiet,
        ..Reply::default()
    };
    Ok(reply.removing(&made.written.removed))
}
