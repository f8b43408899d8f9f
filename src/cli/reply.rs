//! Prints results and errors: as text, or as one JSON object; and the program as host of commands: signals, progress, and lines on stderr. A closed or
//! full stderr is ignored.

use std::fmt::Display;
use std::io::Write;
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use clap::error::{ContextKind, ContextValue};
use serde_json::{Value, json};

use super::interrupt;
use super::progress::Shown;
pub use vibrissa::command::Reply;
use vibrissa::command::{Host, Show, listed};
use vibrissa::error::{Error, InputError};
use vibrissa::excerpt::printable;
use vibrissa::scene::RunOptions;

const FORMAT: u32 = 1;

static JSON: AtomicBool = AtomicBool::new(false);
static COMMAND: OnceLock<String> = OnceLock::new();

/// If `wanted`, stdout carries one JSON object and nothing else.
pub fn in_json(wanted: bool) {
    JSON.fetch_or(wanted, Ordering::Relaxed);
}

pub fn to(command: &str) {
    let _ = COMMAND.set(command.to_owned());
}

fn json() -> bool {
    JSON.load(Ordering::Relaxed)
}

/// What every JSON object begins with.
fn headed(ok: bool) -> Value {
    let command = COMMAND.get().map_or("", String::as_str);
    json!({ "format": FORMAT, "command": command, "version": env!("CARGO_PKG_VERSION"), "ok": ok })
}

/// Prints the reply of a command, then its error if there is one; returns the exit code.
pub fn print(reply: Reply, quiet: bool) -> u8 {
    let path = |p: &Path| p.display().to_string();
    let mut told = Ok(());
    if !reply.removed.is_empty() {
        let removed = listed(&reply.removed);
        line(format_args!("--force replaced or removed {removed} of an older result"));
    }
    let wrong = reply.broken.map(Error::Run).or(reply.refused.map(Error::Input));
    if json() {
        let mut object = headed(wrong.is_none());
        object["out"] = json!(reply.out.as_deref().map(path));
        object["files"] = reply.files.iter().map(|p| path(p)).collect();
        object["counts"] = reply.counts;
        object["seconds"] = reply.seconds;
        object["backend"] = reply.backend;
        object["result"] = reply.result;
        if !reply.answer.is_empty() && (object["result"].is_object() || object["result"].is_null()) {
            object["result"]["answer"] = reply.answer.into();
        }
        if let Some(error) = &wrong {
            object["error"] = error_json(error);
        }
        told = write_out(&format!("{object}\n"));
    } else if !quiet && !reply.quiet {
        let answer = if reply.answer.is_empty() { String::new() } else { reply.answer + "\n" };
        told = write_out(&(answer + &reply.text));
    }
    if let Some(error) = wrong.as_ref().filter(|_| !json()) {
        line(format_args!("error: {error}"));
    }
    if told.is_err() { 1 } else { wrong.map_or(0, |error| error.exit_code()) }
}

/// Writes to stdout. A closed pipe is ignored; other failures are reported on stderr.
fn write_out(text: &str) -> Result<(), ()> {
    let mut stdout = std::io::stdout().lock();
    taken(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()))
}

fn taken(written: std::io::Result<()>) -> Result<(), ()> {
    match written {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            line(format_args!("error: {}", Error::io("stdout", e)));
            Err(())
        }
        _ => Ok(()),
    }
}

/// Prints an error: as JSON on stdout, or on stderr with the lines of the file; returns the exit code.
pub fn failure(error: &Error) -> u8 {
    if json() {
        let mut object = headed(false);
        object["error"] = error_json(error);
        let _ = write_out(&format!("{object}\n"));
    } else {
        part(render(error) + "\n");
    }
    error.exit_code()
}

pub fn interrupted(stays: &str) -> u8 {
    failure(&Error::Run(format!("interrupted{stays}")))
}

fn error_json(error: &Error) -> Value {
    let none = InputError::default();
    let (e, message) = match error {
        Error::Input(e) => (e, e.message.clone()),
        other => (&none, other.to_string()),
    };
    json!({ "file": e.file, "line": e.line, "key": e.key, "value": e.value, "allowed": e.allowed, "message": message })
}

fn render(error: &Error) -> String {
    let said = error.to_string();
    let said = printable(&said);
    let Error::Input(InputError { snippet: Some(excerpt), .. }) = error else {
        return format!("error: {said}");
    };
    let place = AnnotationKind::Primary.span(excerpt.span.clone());
    let lines = Snippet::source(&excerpt.text).line_start(excerpt.above + 1).fold(false).annotation(place);
    let color = std::io::IsTerminal::is_terminal(&std::io::stderr());
    let renderer = if color { Renderer::styled() } else { Renderer::plain() };
    renderer.term_width(160).render(&[Level::ERROR.primary_title(&*said).element(lines)])
}

/// Removed options: command, flag (with a removed word of its list), and the replacement.
const GONE: [(&str, &str, &str); 5] = [
    ("calibrate", "--export python", "`import vibrissa` in Python, --export c for firmware"),
    ("calibrate", "--taps", "locate --same or --object; the exported program answers one tap"),
    ("optimise", "--resume", "the same command without it: a search lasts seconds, and finds the same again"),
    ("sweep", "--leave-off", "--plan --model-error E, which says what may be left off for a strain within E"),
    ("optimise", "--shard", "one search; for others change seed in [optimise] of the spec"),
];

fn said(e: &clap::Error, kind: ContextKind) -> Option<String> {
    match e.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        Some(ContextValue::Strings(all)) if !all.is_empty() => Some(all.join(", ")),
        _ => None,
    }
}

fn gone(command: &str, e: &clap::Error) -> Option<Error> {
    let flag = said(e, ContextKind::InvalidArg)?;
    let flag = flag.split(' ').next()?;
    let value = said(e, ContextKind::InvalidValue).unwrap_or_default();
    let is = |what: &str| match what.split_once(' ') {
        Some((of, word)) => of == flag && value.split(',').any(|v| v == word),
        None => what == flag,
    };
    let (_, _, instead) = GONE.iter().find(|(of, what, _)| *of == command && is(what))?;
    let error = InputError::new("this is gone").key(flag).allowed(*instead);
    Some(InputError { value: Some(value).filter(|v| !v.is_empty()), ..error }.into())
}

pub fn usage(e: &clap::Error) -> u8 {
    if !e.use_stderr() {
        let flushed = e.print().and_then(|()| std::io::Write::flush(&mut std::io::stdout()));
        return taken(flushed).map_or(1, |()| 0);
    }
    let command = std::env::args_os().nth(1).map(|a| a.to_string_lossy().into_owned());
    let command = command.filter(|a| !a.starts_with('-')).unwrap_or_default();
    to(&command);
    if let Some(error) = gone(&command, e) {
        return failure(&error);
    }
    if json() {
        let text = e.to_string();
        let mut message = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        let (key, value) = (said(e, ContextKind::InvalidArg), said(e, ContextKind::InvalidValue));
        // clap prints missing or conflicting arguments on separate lines.
        if let Some(key) = key.as_ref().filter(|_| message.ends_with(':')) {
            message = format!("{message} {key}");
        }
        let allowed = message.split_once(": allowed: ").map(|(_, allowed)| allowed.to_owned());
        let allowed = allowed.or_else(|| said(e, ContextKind::ValidValue));
        let error = InputError { key, value, allowed, message, ..InputError::default() };
        return failure(&error.into());
    }
    let _ = e.print();
    2
}

/// Prints a line; control characters, which may come from a file, are made harmless.
pub fn line(text: impl Display) {
    part(format!("{}\n", printable(&text.to_string())));
}

pub fn part(text: impl Display) {
    let _ = std::io::stderr().write_all(text.to_string().as_bytes());
}

pub struct Terminal;

impl Host for Terminal {
    fn begin(&self, options: &RunOptions) -> Result<(), Error> {
        in_json(options.json == Some(true));
        let Some(n) = options.threads else { return Ok(()) };
        rayon::ThreadPoolBuilder::new().num_threads(n).build_global().map_err(|e| Error::Run(e.to_string()))
    }

    fn line(&self, text: &str) {
        line(text);
    }

    fn progress(&self, quiet: bool) -> Box<dyn Show + '_> {
        Box::new(Shown::new(quiet))
    }

    fn stop(&self, keeps: bool) -> &AtomicBool {
        interrupt::stop(keeps)
    }
}
