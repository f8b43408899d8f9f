//! `vibrissa.sweep`.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use rayon::prelude::*;
use vibrissa::backend::{Choice, Work};
use vibrissa::census::needed::Needed;
use vibrissa::census::sample::ComparedRows;
use vibrissa::error::Error;
use vibrissa::plan::Plan;
use vibrissa::progress::Progress;
use vibrissa::scene::{Column, Space, Spec, Tuple};
use vibrissa::sink::run_json;
use vibrissa::sink::table::Table as Of;
use vibrissa::sweep::collect;
use vibrissa::{files, spec};

use super::held::{self, Given};
use super::job::{self, Ahead};
use super::spec::{UnreadSpec, asked};
use super::table::Table;
use super::taps;

/// Keys of `[run]` that say where files go, of which there are none.
const OF_FILES: [&str; 5] = ["run.out", "run.force", "run.plan", "run.quiet", "run.json"];

/// The values of `[run]` that are in force in `spec`, which was asked as `label`; those of files are none. The bound by which effects are left
/// off, if there is one.
///
/// # Errors
/// A bound by which nothing can be judged.
pub fn settle(spec: &mut Spec, label: &str, choice: &Choice) -> Result<Option<f64>, Error> {
    let bound = files::model_error(None, spec, choice).map_err(|e| match e {
        Error::Input(e) => {
            let line = e.line;
            e.at(label, line).into()
        }
        other => other,
    })?;
    let options = spec.run.clone();
    files::settle(spec, &options, &choice.backend, Path::new(""));
    files::settle_model_error(spec, bound);
    leave_files(spec);
    Ok(bound)
}

/// Leaves the values that say where files go out of those in force.
pub fn leave_files(spec: &mut Spec) {
    spec.in_force.retain(|(key, ..)| !OF_FILES.contains(&key.as_str()));
}

/// Taps one by one: how many, and their columns.
pub type Listed<'py> = (usize, Vec<held::Column<'py>>);

/// The spec that was `asked`, or that of the taps `listed`.
///
/// # Errors
/// What is wrong with it.
pub fn read(py: Python<'_>, asked: &UnreadSpec, listed: Option<Listed<'_>>) -> PyResult<Spec> {
    let listed = listed.map(|(n, columns)| {
        let given = Given::new(py, n, columns)?;
        let tuples: Vec<Tuple> = (0..n).into_par_iter().map(|i| given.tap(i)).collect();
        Ok::<_, PyErr>((tuples, given.leaning(n), given.directions()))
    });
    let read = |listed: Option<(Vec<Tuple>, _, _)>| match listed {
        None => asked.read(spec::parse),
        Some((tuples, leaning, directions)) => {
            let mut spec = asked.read(spec::parse_listed)?;
            taps::refuse(&spec.study.setup, leaning)?;
            spec.study.setup.directions = directions;
            let kind = spec.study.setup.drive;
            let name = |column: Column| column.name(kind).to_owned();
            spec.warnings.extend(spec::doubts_of_taps(kind, tuples.len(), None, |i| tuples[i], name));
            spec.study.space = Space::List(tuples.into_iter().collect());
            let of_tuples =
                |key: &str| Column::ALL.iter().any(|c| key.ends_with(&format!(".{}", key_of(*c, kind))));
            spec.in_force.retain(|(key, ..)| !of_tuples(key));
            Ok(spec)
        }
    };
    read(listed.transpose()?).map_err(|e| super::error::raise(py, e))
}

/// Sweeps the spec in `path` with the sections of `text` over it, or, with `listed`, these taps. The tables by name, None for one that was
/// not asked for, and run.json.
#[pyfunction]
#[pyo3(signature = (path, text, name, listed = None, progress = None))]
#[allow(clippy::type_complexity)]
pub fn sweep<'py>(
    py: Python<'py>,
    path: Option<PathBuf>,
    text: String,
    name: &str,
    listed: Option<Listed<'py>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Vec<(&'static str, Option<Table>)>, String)> {
    let asked = asked(py, path, text, name)?;
    let mut spec = read(py, &asked, listed)?;
    let threads = spec.run.threads;
    job::whole(py, threads, progress, move |stop, tell| {
        let choice = Choice::for_work(&spec.run, Work::of_study(&spec.study, &spec.run))?;
        let bound = settle(&mut spec, &asked.label, &choice)?;
        let fewer = |e| Needed::new(&spec.study.setup, ComparedRows::of_study(&spec.study)?, e);
        let mut needed = bound.map(fewer).transpose()?;
        if let Some(needed) = &needed {
            spec.study.setup = needed.setup().clone();
        }
        let (plan, steered) =
            (Plan::new(&spec.study, &choice)?, (stop, &mut Ahead(tell) as &mut dyn Progress));
        let (report, tables) = collect(&mut spec, plan, &choice, steered, needed.as_mut())?;
        let told = [report.model_error.as_ref(), report.handed_over.as_ref()];
        let run = run_json::of_sweep(
            &spec,
            (&report.backend, &report.backend.warnings(&spec.warnings)),
            &report.counts,
            report.seconds,
            told,
        );
        let setup = &spec.study.setup;
        let named = Of::ALL.into_iter().zip(tables).map(|(of, columns)| {
            let table = columns.map(|columns| Table::new(&of.columns(setup), columns)).transpose()?;
            Ok((of.name(), table))
        });
        Ok((named.collect::<Result<Vec<_>, Error>>()?, run.to_string()))
    })
}

/// Key of a column in a spec.
fn key_of(column: Column, kind: vibrissa::scene::Drive) -> &'static str {
    vibrissa::optimise::write::key(&vibrissa::scene::Setup { drive: kind, ..Default::default() }, column)
}
