//! Speed against error: what an answer of a given accuracy costs, on every backend, kernel and configuration.
//!
//! The yardstick is the reference solver, which shares no method with the kernels; an error is |ε − ε_ref| relative to
//! max(|ε_ref|, 1e-3 θ f_max), as the tolerance is defined. Times are those of whole taps, from a tuple to its strain,
//! forces and status; the share of the kernel is told apart. Every measurement is repeated: the best is what the machine
//! can do, the median what it did, their spread how much else it did ([`Noise`]).
//!
//! A benchmark is a list of [`Step`]s, which [`measure()`] takes one after the other; [`tables`] show them, and [`crate::report`] draws its figures from these.

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
use crate::sink::{csv::Text, run_json, table::Field};
pub use measure::{News, measure, taps};
pub use stopwatch::{Noise, Times};

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

/// What the taps of a sweep share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Every whisker has its own tap angle.
    Independent,
    /// A grid of whiskers, distances and 100 tap angles.
    Gridded,
}

impl Shape {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        if self == Self::Independent { "independent" } else { "gridded" }
    }
}

/// One measurement, to be made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Place, by number.
    pub place: usize,
    /// What is measured there.
    pub what: What,
}

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum What {
    /// A work–precision point: taps of a configuration, solved somehow to a tolerance; of a single rule, the one to which its sweeps converge.
    Point(Configuration, Solved, Option<f64>),
    /// So many taps of the simplest configuration on so many threads.
    Threads(usize),
    /// A whole sweep of so many taps, from its spec to the last byte of its tables.
    Sweep(Shape, u64),
}

impl Step {
    /// For people.
    pub fn words(&self, places: &[Place]) -> String {
        let on = name(places, self.place);
        match self.what {
            What::Point(c, Solved::Nodes(n), _) => format!("{} on {on}, {n} nodes", c.name),
            What::Point(c, solved, tolerance) => {
                let to = tolerance.map_or(String::new(), |t| format!(", tolerance {t:e}"));
                format!("{} {} on {on}{to}", c.name, solved.name())
            }
            What::Threads(n) => format!("{n} threads of {on}"),
            What::Sweep(shape, taps) => format!("a sweep of {taps} {} taps on {on}", shape.name()),
        }
    }
}

/// What a step has shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The step.
    pub step: Step,
    /// Nanoseconds per tap; of a sweep its seconds, opening the device and making charts included.
    pub times: Times,
    /// Taps whose error was measured; of a sweep its taps.
    pub taps: u64,
    /// Taps that the reference solved and this did not; of a sweep those without a solution: what is fast because it fails.
    pub failed: u64,
    /// Nanoseconds per tap in the kernel alone, transfers included; none for the reference.
    pub kernel: Option<f64>,
    /// Sweeps of the kernel per tap, all rungs together.
    pub sweeps: Option<f64>,
    /// Strain errors; none where nothing was solved.
    pub errors: Option<Figures>,
    /// Taps of a sweep solved by a kernel, and interpolated.
    pub solved: [u64; 2],
    /// Best time on one thread over best time on these.
    pub speedup: f64,
}

impl Measured {
    fn new(step: Step, times: Times) -> Self {
        let (kernel, sweeps, errors, speedup) = (None, None, None, f64::NAN);
        Self { step, times, taps: 0, failed: 0, kernel, sweeps, errors, solved: [0; 2], speedup }
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
    /// Sizes of whole sweeps, taps.
    pub sizes: Vec<u64>,
    /// Numbers of CPU threads.
    pub threads: Vec<usize>,
}

impl Settings {
    /// Sizes of a full or a `quick` run on `threads` threads at most.
    pub fn new(quick: bool, tolerance: Option<f64>, threads: usize) -> Self {
        let powers = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|n| *n < threads);
        let threads = powers.chain([threads]).collect();
        let kept = |c: &Configuration| !quick || ["hooke", "neo"].contains(&c.name);
        let configurations = exact().into_iter().filter(kept).collect();
        let (compared, timed, repeats, tens) =
            if quick { (200, 1 << 12, 3, 5) } else { (10_000, 1 << 17, 5, 8) };
        let sizes = (3..=tens).map(|k| 10u64.pow(k)).collect();
        Self { quick, configurations, compared, timed, repeats, tolerance, sizes, threads }
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
        let friction = c.model.contact != Contact::Frictionless;
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

    /// Sizes of whole sweeps at `place`; the reference and f64 are too slow for the largest.
    fn sizes(&self, place: &Place) -> impl Iterator<Item = u64> {
        let most = match place.precision {
            _ if place.is_reference() => self.compared.max(1000) as u64,
            Precision::F64 => 10_000_000,
            Precision::F32 => u64::MAX,
        };
        self.sizes.iter().copied().filter(move |n| *n <= most)
    }

    /// All steps of a run on `places`, of which the last is the reference.
    pub fn steps(&self, places: &[Place]) -> Vec<Step> {
        let mut steps = Vec::new();
        let mut add = |place: usize, what: What| steps.push(Step { place, what });
        for (i, &c) in self.configurations.iter().enumerate() {
            add(places.len() - 1, What::Point(c, Solved::Reference, None));
            for (place, p) in places.iter().enumerate().filter(|(_, p)| !p.is_reference()) {
                let tolerances = self.tolerances(p.precision).into_iter();
                tolerances.for_each(|t| add(place, What::Point(c, Solved::Ladder, Some(t))));
                let least = smallest_tolerance(p.precision);
                let nodes = self.nodes(p).into_iter();
                nodes.for_each(|n| add(place, What::Point(c, Solved::Nodes(n), Some(least))));
                if i == 0 {
                    // The same taps by the linear theory: what leaving the rod out costs.
                    add(place, What::Point(c, Solved::Linear, None));
                }
            }
        }
        for (place, _) in places.iter().enumerate().filter(|(_, p)| p.adapter.is_none()) {
            self.threads.iter().for_each(|n| add(place, What::Threads(*n)));
        }
        for (place, p) in places.iter().enumerate() {
            for shape in [Shape::Independent, Shape::Gridded] {
                self.sizes(p).for_each(|taps| add(place, What::Sweep(shape, taps)));
            }
        }
        steps
    }

    /// Taps solved and seconds spent on `steps`, repeats included, to the order of magnitude.
    pub fn cost(&self, steps: &[Step], places: &[Place]) -> (u64, f64) {
        let cost = |step: &Step| {
            let place = &places[step.place];
            let taps = match step.what {
                What::Point(_, Solved::Reference, _) => self.compared,
                What::Point(..) => self.timed * (self.repeats + 1),
                What::Threads(_) if place.is_reference() => self.compared.min(1000) * (self.repeats + 1),
                What::Threads(_) => self.timed * (self.repeats + 1),
                What::Sweep(_, taps) => taps as usize,
            };
            // Of mixed work.
            let backend = place.backend();
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
            "sizes": self.sizes,
            "threads": self.threads,
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

/// Every table and its columns.
pub const COLUMNS: [(&str, &str); 3] = [
    (
        "work_precision.csv",
        "configuration backend precision adapter kernel nodes tolerance taps failed ns_per_tap \
         ns_per_tap_median kernel_ns_per_tap sweeps_mean strain_error_median strain_error_p99 \
         strain_error_max spread",
    ),
    (
        "scaling.csv",
        "shape backend precision adapter taps solved interpolated failed seconds seconds_median \
         taps_per_second ns_per_tap spread",
    ),
    ("threads.csv", "backend precision adapter threads ns_per_tap ns_per_tap_median speedup spread"),
];

/// The number of its table, and the row.
fn row(m: &Measured, places: &[Place]) -> (usize, Vec<Field>) {
    let backend = places[m.step.place].backend();
    let (times, count) = (m.times, Field::Count);
    let mut row = vec![
        Field::Word(backend.name),
        Field::Word(backend.precision),
        Field::Text(backend.adapter.clone().unwrap_or_default()),
    ];
    let (table, first, rest) = match m.step.what {
        What::Point(c, solved, tolerance) => {
            let nodes = if let Solved::Nodes(n) = solved { count(n as u64) } else { None.into() };
            let error = |f: fn(&Figures) -> f64| Field::from(m.errors.as_ref().map(f));
            let rest = vec![
                Field::Word(solved.name()),
                nodes,
                tolerance.into(),
                count(m.taps),
                count(m.failed),
                Field::Number(times.best),
                Field::Number(times.median),
                m.kernel.into(),
                m.sweeps.into(),
                error(|e| e.median),
                error(|e| e.p99),
                error(|e| e.worst),
            ];
            (0, Some(c.name), rest)
        }
        What::Sweep(shape, _) => {
            let [solved, interpolated] = m.solved;
            let rate = m.taps as f64 / times.best;
            let numbers = [times.best, times.median, rate, 1e9 / rate].map(Field::Number);
            let counts = [m.taps, solved, interpolated, m.failed].map(count);
            (1, Some(shape.name()), counts.into_iter().chain(numbers).collect())
        }
        What::Threads(n) => {
            let numbers = [times.best, times.median, m.speedup].map(Field::Number);
            (2, None, [count(n as u64)].into_iter().chain(numbers).collect())
        }
    };
    row.splice(0..0, first.map(Field::Word));
    row.extend(rest);
    row.push(times.spread.into());
    (table, row)
}

/// Text of every table, by file name.
///
/// # Errors
/// None in practice: tables are made in memory.
pub fn tables(measured: &[Measured], places: &[Place]) -> Result<Vec<(&'static str, String)>, Error> {
    let mut rows: Vec<_> = measured.iter().map(|m| row(m, places)).collect();
    let table = |(k, (file, columns)): (usize, (&'static str, &str))| {
        let mut text = Text::default();
        text.header(&columns.split(' ').collect::<Vec<_>>())?;
        rows.iter_mut().filter(|(table, _)| *table == k).try_for_each(|(_, row)| text.row(row))?;
        Ok((file, String::from_utf8(text.into_bytes()).map_err(|e| Error::Run(e.to_string()))?))
    };
    COLUMNS.into_iter().enumerate().map(table).collect()
}

/// The folder for what is measured.
///
/// # Errors
/// A folder that holds something else, unless `force`.
pub fn open(settings: &Settings, places: &[Place], out: &Path, force: bool) -> Result<Folder, Error> {
    let question = Question::new("bench", "bench", json!({ "settings": hash(&settings.text(places)) }));
    // A figure without points is left out.
    let figures = ["work_precision", "configurations", "scaling", "threads"].into_iter();
    let figures = figures.flat_map(|name| [format!("{name}.svg"), format!("{name}.png")]);
    let files: Vec<String> = COLUMNS.iter().map(|(file, _)| (*file).to_owned()).chain(figures).collect();
    Folder::open(out, question, &files.iter().map(String::as_str).collect::<Vec<_>>(), force)
}

/// Writes tables, figures and `run.json`; of a run that was `stopped` after so many of its steps no figures, which would take their time.
///
/// # Errors
/// A file that fails.
pub fn write(
    mut folder: Folder,
    (settings, places): (&Settings, &[Place]),
    measured: &[Measured],
    (start, stopped): (Instant, Option<[usize; 2]>),
) -> Result<Written, Error> {
    let texts = tables(measured, places)?;
    for (name, text) in &texts {
        folder.put(name, text.as_bytes())?;
    }
    if stopped.is_none() {
        for figure in report::of_bench(&texts)? {
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
            "noise": Noise::of(measured, places).json(),
            "stopped": stopped.map(|[steps, of]| json!({ "steps": steps, "of": of })),
            "seconds": { "total": start.elapsed().as_secs_f64() },
        }),
    ))?;
    folder.finish()
}

/// How much was measured.
pub fn counts(measured: &[Measured]) -> Value {
    let points = || measured.iter().filter(|m| matches!(m.step.what, What::Point(..)));
    let number = |of: fn(&What) -> bool| measured.iter().filter(|m| of(&m.step.what)).count();
    json!({
        "points": points().count(),
        "taps": points().map(|m| m.taps).sum::<u64>(),
        "failed": points().map(|m| m.failed).sum::<u64>(),
        "scaling": number(|what| matches!(what, What::Sweep(..))),
        "threads": number(|what| matches!(what, What::Threads(_))),
    })
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
