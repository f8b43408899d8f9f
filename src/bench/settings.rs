//! How much is measured: as data, so that `--plan` tells what a run does.

use serde_json::{Value, json};

use super::place::Place;
use super::taps::exact;
use crate::kernel::rule::{every_rule, rules_of_devices, smallest_tolerance};
use crate::scene::{BackendChoice, Contact, Precision};
use crate::verify::configuration::Configuration;

/// Sizes of a benchmark.
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
        let tens = |to: u32| (3..=to).map(|k| 10u64.pow(k)).collect();
        if quick {
            let configurations = exact().into_iter().filter(|c| ["hooke", "neo"].contains(&c.name)).collect();
            let (compared, timed, repeats, sizes) = (200, 1 << 12, 3, tens(5));
            return Self { quick, configurations, compared, timed, repeats, tolerance, sizes, threads };
        }
        let (compared, timed, repeats, sizes) = (10_000, 1 << 17, 5, tens(8));
        Self { quick, configurations: exact(), compared, timed, repeats, tolerance, sizes, threads }
    }

    /// Tolerances at which `precision` is measured.
    pub fn tolerances(&self, precision: Precision) -> Vec<f64> {
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
    pub fn timed_of(&self, c: &Configuration) -> usize {
        let friction = c.model.contact != Contact::Frictionless;
        (self.timed / if friction { 8 } else { 1 }).max(self.compared)
    }

    /// Numbers of nodes that are measured each alone. A GPU compiles any; the CPU kernels have those of the ladder.
    pub fn nodes(&self, place: &Place) -> Vec<usize> {
        let rules = if place.adapter.is_some() { rules_of_devices } else { every_rule };
        let ladder: Vec<usize> = rules(place.precision).iter().map(|r| r.nodes).collect();
        let more = match (place.backend, self.quick) {
            (BackendChoice::Gpu, false) => vec![4, 5, 6, 7, 8, 10],
            (BackendChoice::Gpu, true) => return ladder[..1].to_vec(),
            _ => Vec::new(),
        };
        let mut nodes = [ladder, more].concat();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Sizes of whole sweeps at `place`; the reference and f64 are too slow for the largest.
    pub fn sizes(&self, place: &Place) -> Vec<u64> {
        let most = match (place.backend, place.precision) {
            (BackendChoice::Reference, _) if self.quick => 1000,
            (BackendChoice::Reference, _) => 10_000,
            (_, Precision::F64) => 10_000_000,
            _ => u64::MAX,
        };
        self.sizes.iter().copied().filter(|n| *n <= most).collect()
    }

    /// Steps of a run, for progress.
    pub fn steps(&self, places: &[Place]) -> usize {
        let fast = || places.iter().filter(|p| !p.is_reference());
        let points: usize =
            fast().map(|p| self.tolerances(p.precision).len() + self.nodes(p).len()).sum::<usize>() + 1;
        let linear = fast().count();
        let threaded = places.iter().filter(|p| p.adapter.is_none()).count() * self.threads.len();
        let scaled: usize = places.iter().map(|p| 2 * self.sizes(p).len()).sum();
        self.configurations.len() * points + linear + threaded + scaled
    }

    /// Taps solved in all, repeats included, to the order of magnitude.
    pub fn taps(&self, places: &[Place]) -> u64 {
        let points = |p: &Place| self.tolerances(p.precision).len() + self.nodes(p).len() + 2;
        let fast: usize = places.iter().filter(|p| !p.is_reference()).map(points).sum();
        let work = self.configurations.len() * (fast * self.timed * (self.repeats + 1) + self.compared);
        let scaled: u64 = places.iter().flat_map(|p| self.sizes(p)).map(|n| 2 * n).sum();
        work as u64 + scaled
    }

    /// Seconds to expect on `places`, to the order of magnitude.
    pub fn seconds(&self, places: &[Place]) -> f64 {
        let of = |p: &Place| {
            let rate = rate(&p.choice.backend);
            let scaled: u64 = self.sizes(p).iter().map(|n| 2 * n).sum();
            let points = self.tolerances(p.precision).len() + self.nodes(p).len() + 2;
            let work = match p.is_reference() {
                true => self.compared,
                false => points * self.timed * (self.repeats + 1),
            };
            (self.configurations.len() * work) as f64 / rate + scaled as f64 / rate
        };
        places.iter().map(of).sum()
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
    pub fn text(&self, places: &[Place]) -> String {
        let names: Vec<_> = places.iter().map(|p| &p.name).collect();
        format!("{}\n", json!({ "bench": self.json(), "places": names }))
    }
}

/// Taps a second to expect of mixed work, to the order of magnitude.
fn rate(backend: &crate::backend::Backend) -> f64 {
    let each = match (backend.name, backend.precision) {
        ("reference", _) => 1e4,
        ("gpu", _) if !backend.software => return 2e7,
        (_, "f32") => 2e6,
        _ => 1e6,
    };
    each * backend.threads as f64
}
