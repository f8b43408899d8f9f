//! Speed against error: what an answer of a given accuracy costs, on every backend, kernel and configuration.
//!
//! The yardstick is the reference solver, which shares no method with the kernels; an error is |ε − ε_ref| relative to
//! max(|ε_ref|, 1e-3 θ f_max), as the tolerance is defined. Times are those of whole taps, from a tuple to its strain,
//! forces and status; the share of the kernel is told apart. Every measurement is repeated: the best is what the machine
//! can do, the median what it did, their spread how much else it did ([`spread`]).
//!
//! A benchmark is a list of [`Step`]s, which [`measure()`] takes one after the other; [`table`] shows them, and [`crate::report`] draws its figures from it.

mod measure;
pub mod probe;
mod stopwatch;

use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use super::configuration::{self, Configuration};
use super::{Figures, Place, present};
use crate::error::Error;
use crate::figure::{self, Format, Style};
use crate::kernel::rule::{every_rule, rules_of_devices, smallest_tolerance};
use crate::report;
use crate::scene::{BackendChoice, Contact, Precision, RunOptions};
use crate::sink::folder::{Folder, Question, Written, hash};
use crate::sink::values::{Field, named};
use crate::sink::{frame::Frame, heading::heading, run_json};
pub use measure::{News, measure, taps};
pub use stopwatch::Times;

/// The configurations of model §5, all effects off to all on.
const EXACT: [&str; 8] =
    ["hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "stick", "pole-far", "yeoh"];

/// The configurations of the exact rod, from the simplest to everything on.
pub fn exact() -> Vec<Configuration> {
    let named = |name: &str| configuration::all().into_iter().find(|c| c.name == name);
    EXACT.into_iter().filter_map(named).collect()
}

/// All places that `options` leave, and the reference, which is the yardstick. A tolerance is none of a place: it is measured at several.
///
/// # Errors
/// An adapter that is not there, or no place but the reference.
pub fn places(options: &RunOptions) -> Result<Vec<Place>, Error> {
    let options = RunOptions { tolerance: None, ..options.clone() };
    let mut places = present(&options, None)?;
    // The same device may be there under two interfaces.
    let mut known: Vec<(Option<String>, Precision)> = Vec::new();
    places.retain(|p| {
        let one = (p.backend().adapter.clone(), p.precision);
        let new = !known.contains(&one);
        known.push(one);
        new
    });
    let bare = RunOptions { adapter: None, ..options };
    places.push(Place::new(&bare, (BackendChoice::Reference, Precision::F64, None), None)?);
    Ok(places)
}

/// Which kernel solves taps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solved {
    /// The closed forms of the linear theory.
    Linear,
    /// The whole ladder of rules, to a tolerance.
    Ladder,
    /// One rule alone, its sweeps converged: what so many nodes give.
    Nodes(usize),
    /// f64 shooting.
    Reference,
}

impl Solved {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Ladder => "exact",
            Self::Nodes(_) => "exact-nodes",
            Self::Reference => "reference",
        }
    }
}

/// One measurement, to be made: a point of speed against error.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Place, by number.
    pub place: usize,
    /// Whose taps are solved.
    pub configuration: Configuration,
    /// By what.
    pub solved: Solved,
    /// The tolerance asked for; of a single rule, the one to which its sweeps converge.
    pub tolerance: Option<f64>,
}

impl Step {
    /// For people.
    pub fn words(&self, places: &[Place]) -> String {
        let (on, name) = (name(places, self.place), self.configuration.name);
        if let Solved::Nodes(n) = self.solved {
            return format!("{name} on {on}, {n} nodes");
        }
        let to = self.tolerance.map_or(String::new(), |t| format!(", tolerance {t:e}"));
        format!("{name} {} on {on}{to}", self.solved.name())
    }
}

/// What a step has shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The step.
    pub step: Step,
    /// Nanoseconds per tap.
    pub times: Times,
    /// Taps whose error was measured.
    pub taps: u64,
    /// Taps that the reference solved and this did not: what is fast because it fails.
    pub failed: u64,
    /// Nanoseconds per tap in the kernel alone, transfers included; none for the reference.
    pub kernel: Option<f64>,
    /// Sweeps of the kernel per tap, all rungs together.
    pub sweeps: Option<f64>,
    /// Strain errors; none where nothing was solved.
    pub errors: Option<Figures>,
}

impl Measured {
    fn new(step: Step, times: Times) -> Self {
        Self { step, times, taps: 0, failed: 0, kernel: None, sweeps: None, errors: None }
    }
}

/// Sizes of a benchmark: how much is measured, as data, so that `--plan` tells what a run does.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Whether this is a short run.
    pub quick: bool,
    /// Configurations of the exact rod.
    pub configurations: Vec<Configuration>,
    /// Taps whose error is measured, and on which the reference is timed.
    pub compared: usize,
    /// Taps on which a fast kernel is timed.
    pub timed: usize,
    /// Runs of each measurement at most; slow ones are run twice.
    pub repeats: usize,
    /// The only tolerance, where one was asked for.
    pub tolerance: Option<f64>,
}

impl Settings {
    /// Sizes of a full or a `quick` run.
    pub fn new(quick: bool, tolerance: Option<f64>) -> Self {
        let kept = |c: &Configuration| !quick || ["hooke", "neo"].contains(&c.name);
        let configurations = exact().into_iter().filter(kept).collect();
        let (compared, timed, repeats) = if quick { (200, 1 << 12, 3) } else { (10_000, 1 << 17, 5) };
        Self { quick, configurations, compared, timed, repeats, tolerance }
    }

    /// Tolerances at which `precision` is measured.
    fn tolerances(&self, precision: Precision) -> Vec<f64> {
        if let Some(t) = self.tolerance {
            return if t >= smallest_tolerance(precision) { vec![t] } else { Vec::new() };
        }
        match (precision, self.quick) {
            (Precision::F32, false) => vec![1e-3, 1e-4, 1e-5, 1e-6],
            (Precision::F32, true) => vec![1e-3, 1e-5],
            (Precision::F64, false) => vec![1e-4, 1e-6, 1e-8, 1e-10],
            (Precision::F64, true) => vec![1e-8],
        }
    }

    /// Taps of `c` on which a fast kernel is timed: fewer with friction, whose taps take tens of sweeps.
    fn timed_of(&self, c: &Configuration) -> usize {
        let friction = c.setup.model.contact != Contact::Frictionless;
        (self.timed / if friction { 8 } else { 1 }).max(self.compared)
    }

    /// Numbers of nodes that are measured each alone. A GPU compiles any; the CPU kernels have those of the ladder.
    fn nodes(&self, place: &Place) -> Vec<usize> {
        let rules = if place.adapter.is_some() { rules_of_devices } else { every_rule };
        let mut nodes: Vec<usize> = rules(place.precision).iter().map(|r| r.nodes).collect();
        match place.adapter.is_some() {
            true if self.quick => nodes.truncate(1),
            true => nodes.extend([4, 5, 6, 7, 8, 10]),
            false => {}
        }
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// All steps of a run on `places`, of which the last is the reference.
    pub fn steps(&self, places: &[Place]) -> Vec<Step> {
        let mut steps = Vec::new();
        for (i, configuration) in self.configurations.iter().enumerate() {
            let mut add = |place: usize, solved: Solved, tolerance: Option<f64>| {
                steps.push(Step { place, configuration: configuration.clone(), solved, tolerance });
            };
            add(places.len() - 1, Solved::Reference, None);
            for (place, p) in places.iter().enumerate().filter(|(_, p)| !p.is_reference()) {
                let tolerances = self.tolerances(p.precision).into_iter();
                tolerances.for_each(|t| add(place, Solved::Ladder, Some(t)));
                let least = smallest_tolerance(p.precision);
                self.nodes(p).into_iter().for_each(|n| add(place, Solved::Nodes(n), Some(least)));
                if i == 0 {
                    // The same taps by the linear theory: what leaving the rod out costs.
                    add(place, Solved::Linear, None);
                }
            }
        }
        steps
    }

    /// Taps solved and seconds spent on `steps`, repeats included, to the order of magnitude.
    pub fn cost(&self, steps: &[Step], places: &[Place]) -> (u64, f64) {
        let cost = |step: &Step| {
            let backend = places[step.place].backend();
            let taps = match step.solved {
                Solved::Reference => self.compared,
                _ => self.timed * (self.repeats + 1),
            };
            // Of mixed work.
            let rate = match (backend.name, backend.precision) {
                ("gpu", _) if !backend.software => 2e7,
                ("reference", _) => 1e4 * backend.threads as f64,
                (_, "f32") => 2e6 * backend.threads as f64,
                _ => 1e6 * backend.threads as f64,
            };
            (taps as u64, taps as f64 / rate)
        };
        steps.iter().map(cost).fold((0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let names: Vec<_> = self.configurations.iter().map(|c| c.name).collect();
        json!({
            "quick": self.quick,
            "configurations": names,
            "taps_compared": self.compared,
            "taps_timed": self.timed,
            "repeats": self.repeats,
            "tolerance": self.tolerance,
        })
    }

    /// Identity of the result: settings and places.
    fn text(&self, places: &[Place]) -> String {
        let names: Vec<_> = (0..places.len()).map(|k| name(places, k)).collect();
        format!("{}\n", json!({ "bench": self.json(), "places": names }))
    }
}

/// Name of a place in words and legends, such as "cpu f32"; with the adapter's where there are several.
pub fn name(places: &[Place], place: usize) -> String {
    let (label, own) = (places[place].label(), &places[place].backend().adapter);
    match own {
        Some(adapter) if places.iter().any(|p| p.adapter.is_some() && p.backend().adapter != *own) => {
            format!("{label}, {adapter}")
        }
        _ => label,
    }
}

/// The table.
const TABLE: &str = "work_precision";

fn row(m: &Measured, places: &[Place]) -> Vec<Field> {
    let Step { place, configuration, solved, tolerance } = &m.step;
    let backend = places[*place].backend();
    let nodes = if let Solved::Nodes(n) = solved { (*n).into() } else { None.into() };
    let error = |f: fn(&Figures) -> f64| Field::from(m.errors.as_ref().map(f));
    vec![
        configuration.name.into(),
        backend.name.into(),
        backend.precision.into(),
        backend.adapter.clone().unwrap_or_default().into(),
        solved.name().into(),
        nodes,
        (*tolerance).into(),
        m.taps.into(),
        m.failed.into(),
        m.times.best.into(),
        m.times.median.into(),
        m.kernel.into(),
        m.sweeps.into(),
        error(|e| e.median),
        error(|e| e.p99),
        error(|e| e.worst),
        m.times.spread.into(),
    ]
}

/// The row of a measurement as JSON, by the names of the columns.
pub fn point(m: &Measured, places: &[Place]) -> Value {
    named(heading(TABLE).names_as(&[]), row(m, places))
}

/// The table.
pub fn table(measured: &[Measured], places: &[Place]) -> Result<Frame, Error> {
    let mut table = heading(TABLE).frame(&[]);
    measured.iter().try_for_each(|m| table.row(row(m, places)))?;
    Ok(table)
}

/// The folder for what is measured.
///
/// # Errors
/// A folder that holds something else, unless `force`.
pub fn open(settings: &Settings, places: &[Place], out: &Path, force: bool) -> Result<Folder, Error> {
    let question = Question::new("bench", "bench", json!({ "settings": hash(&settings.text(places)) }));
    // A figure without points is left out.
    let figures = ["work_precision.svg", "work_precision.png", "configurations.svg", "configurations.png"];
    let table = &*heading(TABLE).file;
    Folder::open(out, question, &[&[table], &figures[..]].concat(), force)
}

/// Writes table, figures and `run.json`; of a run that was `stopped` after so many of its steps no figures, which would take their time.
pub fn write(
    mut folder: Folder,
    (settings, places): (&Settings, &[Place]),
    measured: &[Measured],
    (start, stopped): (Instant, Option<[usize; 2]>),
) -> Result<Written, Error> {
    let table = table(measured, places)?;
    folder.put(&table.file, &table.csv()?)?;
    if stopped.is_none() {
        for figure in report::of_bench(&table)? {
            for (name, bytes) in figure::files(&figure, &Style::default(), &[Format::Svg, Format::Png])? {
                folder.put(&name, &bytes)?;
            }
        }
    }
    let text = settings.text(places);
    folder.run_json(&run_json::document(
        "bench",
        json!({ "name": "bench", "hash": hash(&text), "text": text }),
        json!({
            "machine": machine(),
            "backends": places.iter().map(Place::backend).collect::<Vec<_>>(),
            "settings": settings.json(),
            "yardstick": "the reference: adaptive f64 shooting; its own row is its difference from cpu f64 at the smallest tolerance",
            "error": "|strain - reference| / max(|reference|, 1e-3 theta f_max)",
            "counts": counts(measured),
            "spread": spread(measured),
            "stopped": stopped.map(|[steps, of]| json!({ "steps": steps, "of": of })),
            "seconds": { "total": start.elapsed().as_secs_f64() },
        }),
    ))?;
    folder.finish()
}

/// How much was measured.
pub fn counts(measured: &[Measured]) -> Value {
    json!({
        "points": measured.len(),
        "taps": measured.iter().map(|m| m.taps).sum::<u64>(),
        "failed": measured.iter().map(|m| m.failed).sum::<u64>(),
    })
}

/// Largest (slowest − fastest) / median of the repeats of a measurement. On a quiet machine it is some percent.
pub fn spread(measured: &[Measured]) -> f64 {
    measured.iter().filter_map(|m| m.times.spread).fold(0.0, f64::max)
}

/// The processor in its own words, and its cores.
pub fn machine() -> Value {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|l| l.starts_with("model name")).and_then(|l| l.split(':').nth(1));
    json!({
        "processor": model.map(str::trim),
        "cores": std::thread::available_parallelism().ok().map(|n| n.get()),
        "os": std::env::consts::OS,
        "architecture": std::env::consts::ARCH,
    })
}
