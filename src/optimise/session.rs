//! A running search: its variables in the unit box, its budget, its findings, and its only access to evaluations.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Goal, Score, Scorer};
use crate::error::{Error, SolveError};
use crate::plan::Layout;
use crate::scene::{Budget, Column, Property, Quantity, Search, Setup, Tuple, Variable};

/// Time for the last evaluations after a stop; all must be written within two seconds.
const LAST: Duration = Duration::from_millis(500);

vibrissa_core::words! {
    Stage {
        /// The swarm, on the backend that was asked for.
        Swarm = "swarm",
        /// The polish, in f64.
        Polish = "polish",
    }
}

vibrissa_core::words! {
    Ended {
        /// Several starts found the same, or all starts were made.
        Converged = "converged",
        Evaluations = "evaluations",
        Seconds = "seconds",
        Interrupted = "interrupted",
    }
}

#[derive(Debug)]
pub enum Halt {
    Ended(Ended),
    Failed(Error),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    pub point: Tuple,
    pub score: Score,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    pub evaluations: u64,
    pub start: u32,
    pub stage: Stage,
    pub best: Found,
}

pub trait Watch {
    /// Called after a step; `left` is the remaining budget.
    fn step(&mut self, step: &Step, value: f64, feasible: bool, left: Option<u64>);
}

pub struct Session<'a> {
    pub scorers: [Scorer<'a>; 2],
    pub variables: &'a Variables,
    pub goal: Goal,
    pub budget: Budget,
    pub kept_back: u64,
    pub begun: Instant,
    pub stop: &'a AtomicBool,
    pub watch: &'a mut dyn Watch,
    pub start: u32,
    pub swarms: u32,
    pub evaluations: u64,
    pub history: Vec<Step>,
    /// Best of all, and best of those in f64.
    pub best: [Option<Found>; 2],
    pub archive: Vec<(Stage, Found)>,
}

impl<'a> Session<'a> {
    pub fn stop_by(&mut self, stop: &'a AtomicBool) {
        self.scorers.iter_mut().for_each(|scorer| scorer.evaluator.stop = stop);
    }

    pub fn scores(&mut self, stage: Stage, points: &[Tuple]) -> Result<Vec<Score>, Halt> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Halt::Ended(Ended::Interrupted));
        }
        let left = self.left();
        let take =
            left.map_or(points.len(), |left| points.len().min(usize::try_from(left).unwrap_or(usize::MAX)));
        if take == 0 && !points.is_empty() {
            return Err(Halt::Ended(Ended::Evaluations));
        }
        let late = || self.budget.seconds.is_some_and(|s| self.begun.elapsed().as_secs_f64() >= s);
        // At least one evaluation is made, so that a slow machine gives an answer too.
        let first = Cell::new(self.evaluations == 0);
        let on = || !self.stop.load(Ordering::Relaxed) && (first.replace(false) || !late());
        let scores = match self.scorers[stage as usize].scores_while(&points[..take], &on) {
            Err(Error::Solve(SolveError::Stopped)) => return Err(Halt::Ended(Ended::Interrupted)),
            scores => scores.map_err(Halt::Failed)?,
        };
        self.evaluations += scores.len() as u64;
        self.note(stage, &points[..scores.len()], &scores);
        if scores.len() < take {
            let stopped = self.stop.load(Ordering::Relaxed);
            return Err(Halt::Ended(if stopped { Ended::Interrupted } else { Ended::Seconds }));
        }
        if take < points.len() { Err(Halt::Ended(Ended::Evaluations)) } else { Ok(scores) }
    }

    pub fn left(&self) -> Option<u64> {
        let kept = self.kept_back;
        self.budget.evaluations.map(|n| n.saturating_sub(self.evaluations).saturating_sub(kept))
    }

    fn note(&mut self, stage: Stage, points: &[Tuple], scores: &[Score]) {
        if points.is_empty() {
            return;
        }
        let goal = self.goal;
        for (&point, &score) in points.iter().zip(scores) {
            let found = Found { point, score };
            self.archive.push((stage, found));
            for (i, best) in self.best.iter_mut().enumerate() {
                let asked = i == 0 || stage == Stage::Polish;
                if asked && best.is_none_or(|b| goal.order(&score) < goal.order(&b.score)) {
                    *best = Some(found);
                }
            }
        }
        if let Some(best) = self.best[1].or(self.best[0]) {
            let step = Step { evaluations: self.evaluations, start: self.start, stage, best };
            self.history.push(step);
            self.watch.step(&step, goal.value(&best.score), goal.feasible(&best.score), self.left());
        }
    }

    pub fn take(&mut self) -> Vec<Found> {
        std::mem::take(&mut self.archive).into_iter().map(|(_, found)| found).collect()
    }

    /// Scores `points` in f64, outside the budget, for the report; after a stop only the first ones for which there is time.
    pub fn again(&mut self, points: &[Tuple]) -> Result<Vec<Found>, Error> {
        let (begun, stop) = (Instant::now(), self.stop);
        let on = || !stop.load(Ordering::Relaxed) || begun.elapsed() < LAST;
        let scores = self.scorers[1].scores_while(points, &on)?;
        Ok(points.iter().zip(scores).map(|(&point, score)| Found { point, score }).collect())
    }
}

/// A place in the unit box, and the number of its drive.
pub type Place = (Vec<f64>, usize);

#[derive(Debug, Clone, PartialEq)]
pub struct Variables {
    pub list: Vec<Variable>,
    base: Tuple,
    /// Drives from which each design takes the best; a single placeholder if the drive is a variable.
    drives: Vec<f64>,
    setup: Setup,
    pub start: Option<Vec<f64>>,
}

impl Variables {
    /// Cuts off parts of the bounds that contain no valid candidate for the distances of `layout`.
    pub fn new(setup: &Setup, layout: &Layout, search: &Search) -> Self {
        let base = Tuple { a: 0.0, ..layout.stroke(&layout.design(0), 0) };
        let mut list = search.variables.clone();
        for v in &mut list {
            let farthest = layout.reach()[1];
            if v.quantity == Quantity::Column(Column::Length) && farthest > v.min && farthest < v.max {
                v.min = farthest;
            }
        }
        let drive_varies = list.iter().any(|v| v.quantity == Quantity::Column(Column::Drive));
        let drives = if drive_varies {
            vec![f64::NAN]
        } else {
            (0..layout.n_drives).map(|j| layout.stroke(&base, j).drive).collect()
        };
        let middle = |v: &Variable| v.start.unwrap_or(0.5 * (v.min + v.max));
        let start = list
            .iter()
            .any(|v| v.start.is_some())
            .then(|| list.iter().map(|v| ((middle(v) - v.min) / (v.max - v.min)).clamp(0.0, 1.0)).collect());
        Self { list, base, drives, setup: setup.clone(), start }
    }

    pub fn drives(&self) -> usize {
        self.drives.len()
    }

    /// The design at `u` in the unit box, with its drive, or drive `j` of the list.
    pub fn point(&self, u: &[f64], j: usize) -> Tuple {
        let mut values = self.base.to_array();
        values[Column::Drive as usize] = self.drives[j];
        let (mut properties, mut scale) = (Vec::new(), 1.0);
        for (v, u) in self.list.iter().zip(u) {
            let value = match *u {
                u if u <= 0.0 => v.min,
                u if u >= 1.0 => v.max,
                u => v.min + (v.max - v.min) * u,
            };
            match v.quantity {
                Quantity::Column(column) => values[column as usize] = value,
                Quantity::Property(property) => {
                    properties.push(value);
                    scale = if property == Property::Scale { value } else { scale };
                }
            }
        }
        let point = Tuple::from_array(values);
        match &self.setup.rigs {
            Some(rigs) => {
                Tuple { D: scale * point.D, d: scale * point.d, rig: rigs.number(&properties), ..point }
            }
            None => point,
        }
    }

    pub fn place(&self, point: &Tuple) -> Place {
        let u = |v: &Variable| (value(&self.setup, point, v.quantity) - v.min) / (v.max - v.min);
        (self.list.iter().map(u).collect(), self.drives.iter().position(|d| *d == point.drive).unwrap_or(0))
    }

    pub fn at_bounds(&self, point: &Tuple) -> Vec<(Quantity, &'static str)> {
        let (u, _) = self.place(point);
        let at = |(v, u): (&Variable, &f64)| match *u {
            u if u <= 1e-6 => Some((v.quantity, "min")),
            u if u >= 1.0 - 1e-6 => Some((v.quantity, "max")),
            _ => None,
        };
        self.list.iter().zip(&u).filter_map(at).collect()
    }
}

/// The quantities of a design with its drive, in the order of tables.
pub fn quantities(setup: &Setup) -> impl Iterator<Item = Quantity> {
    let whisker = Column::ALL.into_iter().take_while(|column| *column != Column::Distance);
    let properties = setup.rigs.iter().flat_map(|rigs| rigs.properties.iter().copied());
    let whisker = whisker.map(Quantity::Column).chain(properties.map(Quantity::Property));
    whisker.chain([Quantity::Column(Column::Drive)])
}

/// Value of `quantity` at `point`; NaN for a property that does not vary.
pub fn value(setup: &Setup, point: &Tuple, quantity: Quantity) -> f64 {
    match (quantity, &setup.rigs) {
        (Quantity::Column(column), _) => point.to_array()[column as usize],
        (Quantity::Property(property), Some(rigs)) => rigs.value(point.rig, property),
        (Quantity::Property(_), None) => f64::NAN,
    }
}
