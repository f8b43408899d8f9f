//! Commands of the library, with requests and inputs from Python.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::command::{self, Content, Context, HeldFile, Host, Show};
use vibrissa::error::Error;
use vibrissa::optimise::{Step, Watch};
use vibrissa::progress::Progress;

use super::error::{self, keywords};
use super::job;
use super::spec::unread;
use super::table::{FileGiven, Table, TableGiven, frame};

/// A step of a search: evaluations, remaining budget, start, stage, best design (D, d, L_a, x_ss, l, drive), objective, and true if it keeps the
/// limits.
type SearchStep = (u64, Option<u64>, u32, &'static str, [f64; 6], f64, bool);

enum Heard {
    Far(u64, u64),
    Step(SearchStep),
}

struct Session<'a> {
    stop: &'a AtomicBool,
    tell: RefCell<&'a mut dyn FnMut(Heard)>,
}

impl Host for Session<'_> {
    fn progress(&self, _: bool) -> Box<dyn Show + '_> {
        Box::new(self)
    }

    fn stop(&self, _: bool) -> &AtomicBool {
        self.stop
    }
}

impl Progress for &Session<'_> {
    fn at(&mut self, done: u64, total: u64) {
        (self.tell.borrow_mut())(Heard::Far(done, total));
    }
}

impl Watch for &Session<'_> {
    fn step(&mut self, step: &Step, value: f64, feasible: bool, left: Option<u64>) {
        let p = &step.best.point;
        let point = [p.D, p.d, p.L_a, p.x_ss, p.l, p.drive];
        let step = (step.evaluations, left, step.start, step.stage.word(), point, value, feasible);
        (self.tell.borrow_mut())(Heard::Step(step));
    }
}

/// A spec: optional path of its file, sections that override it, and the name of the caller.
type SpecGiven = (Option<PathBuf>, String, String);

/// Output of a command: tables, and texts, by file name without `.csv`; run.json or the result; warnings; the interrupt that ended it, if any.
type Given_ = (Vec<(String, Table)>, Vec<(String, String)>, String, Vec<String>, Option<Py<PyAny>>);

/// Runs a command. `said` is its request as TOML; `files` are those that it names and that are in memory; `taps` are in place of those of the spec.
/// `hear` is called with taps done and how many there are, or with the steps of a search, which ends where it says true.
#[pyfunction]
#[pyo3(signature = (command, said, spec = None, files = Vec::new(), taps = None, hear = None))]
pub fn run<'py>(
    py: Python<'py>,
    command: String,
    said: String,
    spec: Option<SpecGiven>,
    files: Vec<(String, FileGiven<'py>)>,
    taps: Option<TableGiven<'py>>,
    hear: Option<&Bound<'py, PyAny>>,
) -> PyResult<Given_> {
    let file = |(name, given): (String, FileGiven<'py>)| {
        let content = match given {
            FileGiven::Text(text) => Content::Bytes(text.into_bytes()),
            FileGiven::Table(table) => Content::Table(frame(py, &name, table)?),
        };
        let name = PathBuf::from(name);
        let base = name.parent().map_or_else(PathBuf::new, Path::to_owned);
        Ok::<_, PyErr>(HeldFile { name, content, base })
    };
    let mut files: Vec<HeldFile> = files.into_iter().map(file).collect::<PyResult<_>>()?;
    let (mut request, mut threads) = (said, None);
    if let Some((path, text, name)) = spec {
        let spec = unread(path, &text, &name).map_err(|e| error::raise(py, e))?;
        let key = if command == "calibrate" { "whisker" } else { "spec" };
        request = format!("{key} = {}\n{request}", toml::Value::String(spec.name.display().to_string()));
        threads =
            spec.content.text().parse().ok().and_then(|t: toml::Table| number(t.get("run")?.get("threads")?));
        files.push(spec);
    }
    threads = threads.or_else(|| number(request.parse::<toml::Table>().ok()?.get("threads")?));
    let taps = taps.map(|taps| frame(py, "tuples", taps)).transpose()?;
    let work = move |stop: &AtomicBool, tell: &mut dyn FnMut(Heard)| {
        let session = Session { stop, tell: RefCell::new(tell) };
        let context = Context::in_memory(&session, files, taps);
        let reply = command::run(&command, &request, &context)?;
        let (mut tables, mut texts) = (Vec::new(), Vec::new());
        for (name, kept) in reply.kept {
            match kept {
                Content::Table(frame) => tables.push((name, Table::new(frame)?)),
                Content::Bytes(bytes) => {
                    texts.push((name, String::from_utf8(bytes).map_err(|e| Error::Run(e.to_string()))?));
                }
            }
        }
        let run = match reply.document.is_null() {
            true => json!({ "result": reply.result, "out": reply.out, "files": reply.files }),
            false => reply.document,
        };
        let told = context.told().iter().map(|text| keywords(text)).collect();
        Ok((tables, texts, run.to_string(), told))
    };
    let hear = |heard: Heard| match (hear, heard) {
        (None, _) => Ok(true),
        (Some(hear), Heard::Far(done, of)) => hear.call1((done, of)).map(|_| true),
        (Some(hear), Heard::Step(step)) => Ok(!hear.call1(step)?.is_truthy()?),
    };
    let ((tables, texts, run, told), interrupt) = job::run(py, threads, work, hear)?;
    Ok((tables, texts, run, told, interrupt.map(|e| e.into_value(py).into_any())))
}

fn number(value: &toml::Value) -> Option<usize> {
    value.as_integer().and_then(|n| usize::try_from(n).ok()).filter(|n| (1..=4096).contains(n))
}
