//! `vibrissa.tap` and `vibrissa.optimise`.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use pyo3::prelude::*;
use vibrissa::backend::{Choice, Work};
use vibrissa::error::{Error, InputError};
use vibrissa::optimise::{self as search, Step, Watch, best, write};
use vibrissa::progress::Silent;
use vibrissa::scene::search::Objective;
use vibrissa::{spec, tap as best_tap};

use super::error::raise;
use super::job;
use super::spec::asked;
use super::sweep::settle;
use super::table::Table;

/// Tables under the names of their files, without their ends.
pub type Tables = Vec<(&'static str, Table)>;

/// See [`Tables`].
pub fn named(tables: &[(&'static str, Vec<u8>)]) -> Result<Tables, Error> {
    tables.iter().map(|(name, bytes)| Ok((name.trim_end_matches(".csv"), Table::of_csv(bytes)?))).collect()
}

/// The best drive of the one whisker of a spec: the curve, and run.json.
#[pyfunction]
pub fn tap(
    py: Python<'_>,
    path: Option<PathBuf>,
    text: String,
    objective: &str,
) -> PyResult<(Table, String)> {
    let asked = asked(py, path, text, "tap")?;
    let known = Objective::WORDS[..2].iter().find(|(word, _)| *word == objective);
    let wrong =
        || InputError::new("unknown word").key("objective").value(objective).allowed("\"distance\", \"sd\"");
    let objective = known.ok_or_else(|| raise(py, wrong().into()))?.1;
    let read = asked.read(|label, text, base| spec::parse_tap(label, text, base, objective.needs_distance()));
    let (mut spec, ends) = read.map_err(|e| raise(py, e))?;
    let threads = spec.run.threads;
    job::whole(py, threads, None, move |stop, _| {
        let choice = best_tap::choice(&spec.run, &spec.study)?;
        let report = match settle(&mut spec, &asked.label, &choice)? {
            Some(bound) => {
                best_tap::find_needed(&spec.study, ends, objective, &choice, (bound, stop, &mut Silent))?
            }
            None => best_tap::find(&spec.study, ends, objective, &choice, (stop, &mut Silent))?,
        };
        let curve = Table::of_csv(&best_tap::table(&spec.study, &report)?)?;
        Ok((curve, best_tap::document(&spec, &report).to_string()))
    })
}

/// A step of a search: evaluations, what the budget still allows, start, stage, the best design (D, d, L_a, x_ss, l, drive), the value of the
/// objective, and whether it keeps the limits.
type Told = (u64, Option<u64>, u32, &'static str, [f64; 6], f64, bool);

/// Hands on the steps of a search.
struct Steps<'a>(&'a mut dyn FnMut(Told));

impl Watch for Steps<'_> {
    fn step(&mut self, step: &Step, value: f64, feasible: bool, left: Option<u64>) {
        let p = &step.best.point;
        let point = [p.D, p.d, p.L_a, p.x_ss, p.l, p.drive];
        (self.0)((step.evaluations, left, step.start, step.stage.name(), point, value, feasible));
    }
}

/// A search: its tables, best.toml, run.json, and the interrupt that ended it, if one did. `callback` is told each step, and returns true to
/// end the search.
#[pyfunction]
#[pyo3(signature = (path, text, name, callback = None))]
#[allow(clippy::type_complexity)]
pub fn optimise<'py>(
    py: Python<'py>,
    path: Option<PathBuf>,
    text: String,
    name: &str,
    callback: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Tables, String, String, Option<Bound<'py, PyAny>>)> {
    let asked = asked(py, path, text, name)?;
    let (mut spec, wanted) = asked.read(spec::parse_search).map_err(|e| raise(py, e))?;
    let threads = spec.run.threads;
    let work = move |stop: &AtomicBool, tell: &mut dyn FnMut(Told)| {
        let work = Work::of_search(&wanted, &spec.study.space, &spec.study.setup, &spec.run);
        let choice = Choice::for_work(&spec.run, work)?;
        let bound = settle(&mut spec, &asked.label, &choice)?;
        let needed = bound.map(|e| search::run::needed(&spec, &wanted, e)).transpose()?;
        let (options, watch) = (spec.run.clone(), &mut Steps(tell));
        let report = search::find(&spec, &wanted, (&choice, &options, needed), stop, watch)?;
        let best = best::text(&spec, &wanted, &report)?;
        let tables = named(&write::tables(&spec, &report)?)?;
        // Here the points of a front stand in the run, too: there is no file beside it.
        let run = write::document(&spec, &wanted, &report);
        Ok((tables, best, run.to_string()))
    };
    let hear = |told: Told| {
        let Some(callback) = callback else { return Ok(true) };
        Ok(!callback.call1(told)?.is_truthy()?)
    };
    let ((tables, best, run), interrupt) = job::run(py, threads, work, hear)?;
    Ok((tables, best, run, interrupt.map(|e| e.into_value(py).into_bound(py).into_any())))
}
