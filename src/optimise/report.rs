//! What a finished search tells.

use std::path::PathBuf;

use serde_json::Value;

use super::front::Front;
use super::other::Other;
use super::score::{Limit, Score};
use super::sensitivity::Sensitivity;
use super::session::{Ended, Step};
use crate::backend::Backend;
use crate::scene::search::Quantity;
use crate::scene::{Setup, Tuple};
use crate::sink::table::AtDrive;
use crate::statistics::DriveRow;

/// A design with its figures in f64.
#[derive(Debug, Clone, Copy)]
pub struct Design {
    /// Design and drive.
    pub point: Tuple,
    /// Its row of designs.csv, of the nominal whisker.
    pub row: DriveRow,
    /// Its score, with tolerances if there are any.
    pub score: Score,
    /// Unit of K in the tables.
    pub unit: f64,
}

impl Design {
    /// Its row of designs.csv.
    pub fn at_drive(&self) -> AtDrive<'_> {
        AtDrive {
            design: &self.point,
            direction: self.point.direction(),
            drive: self.point.drive,
            row: self.row.figures(),
            unit: self.unit,
        }
    }
}

/// What a finished search tells.
#[derive(Debug)]
pub struct Report {
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Files of an older result that only `force` removed.
    pub removed: Vec<PathBuf>,
    /// The best design; of a front, the one that tells distance best.
    pub best: Design,
    /// Value of the objective.
    pub value: f64,
    /// Why it ended.
    pub ended: Ended,
    /// Starts made, each a swarm.
    pub starts: u32,
    /// Evaluations made.
    pub evaluations: u64,
    /// Taps of one evaluation.
    pub taps_each: usize,
    /// Seconds: all, and of the search alone.
    pub seconds: [f64; 2],
    /// Seconds of making charts; `None` where none was tried.
    pub chart: Option<f64>,
    /// `model_error` of `run.json`, where effects could be left off, and the same in a few lines.
    pub model_error: Option<(Value, String)>,
    /// Variables that lie at a bound, and at which.
    pub at_bounds: Vec<(Quantity, &'static str)>,
    /// Limits that bind.
    pub binding: Vec<Limit>,
    /// What the other estimator would make of the best design; `None` where no distance is told, or by two gauges, or the search was asked to stop.
    pub other: Option<Other>,
    /// Sensitivities.
    pub sensitivity: Sensitivity,
    /// The front, of a pareto search.
    pub front: Option<Front>,
    /// Backend of the swarm, and of the polish and the figures.
    pub backends: [Backend; 2],
    /// Best after each step.
    pub history: Vec<Step>,
}

/// Unit of K of a design in the tables.
pub(super) fn unit(setup: &Setup, point: &Tuple) -> f64 {
    crate::design::Design::new(setup, *point).elongation(setup).unwrap_or(1.0)
}
