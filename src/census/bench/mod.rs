//! Speed against error: what an answer of a given accuracy costs, on every backend, kernel and configuration.
//!
//! The yardstick is the reference solver, which shares no method with the kernels; an error is |ε − ε_ref| relative to
//! max(|ε_ref|, 1e-3 θ f_max), as the tolerance is defined. Times are those of whole taps, from a tuple to its strain,
//! forces and status; the share of the kernel is told apart. Every measurement is repeated: the best is what the machine
//! can do, the median what it did, their spread how much else it did.
//!
//! A benchmark is a list of [`Step`]s, which [`measure()`] takes one after the other.

mod measure;
pub mod probe;
mod stopwatch;

use serde_json::{Value, json};

use super::configuration::{self, Configuration};
use super::{Figures, Place, present};
use crate::backend::Backend;
use crate::error::Error;
use crate::kernel::rule::{every_rule, rules_of_devices, smallest_tolerance};
use crate::scene::{BackendChoice, Contact, Precision, RunOptions};
use crate::sink::values::Field;
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
    /// Its row of work_precision.csv, on this backend.
    pub fn fields(&self, backend: &Backend) -> Vec<Field> {
        let Step { configuration, solved, tolerance, .. } = &self.step;
        let nodes = if let Solved::Nodes(n) = solved { (*n).into() } else { None.into() };
        let error = |f: fn(&Figures) -> f64| Field::from(self.errors.as_ref().map(f));
        vec![
            configuration.name.into(),
            backend.name.into(),
            backend.precision.into(),
            backend.adapter.clone().unwrap_or_default().into(),
            solved.name().into(),
            nodes,
            (*tolerance).into(),
            self.taps.into(),
            self.failed.into(),
            self.times.best.into(),
            self.times.median.into(),
            self.kernel.into(),
            self.sweeps.into(),
            error(|e| e.median),
            error(|e| e.p99),
            error(|e| e.worst),
            self.times.spread.into(),
        ]
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
