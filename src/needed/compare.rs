//! One model against another, tap by tap, in f64 on the CPU.

use std::time::Instant;

use rayon::prelude::*;

use super::{DOUBT, rows::Row};
use crate::backend::Choice;
use crate::curve::{self, Ask, Reach, both};
use crate::design::{Design, amount};
use crate::error::Error;
use crate::evaluate::{Evaluator, Outcome, Task, doubts};
use crate::scene::{Setup, Tuple};
use crate::statistics::{Reduction, Told};
use crate::status::Status;

/// What a model says of one tap: strain, contact arc (mm), all words.
#[derive(Debug, Clone, Copy)]
struct ModelTap {
    strain: f64,
    arc: f64,
    status: Status,
}

/// What a model says of the taps of some rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Said {
    /// Taps row after row.
    taps: Vec<ModelTap>,
    /// K_sd and total_rms_mm of each row.
    figures: Vec<[Option<f64>; 2]>,
    /// What it took, s.
    pub seconds: f64,
}

impl Said {
    /// Of `rows` in `setup`, distances told as the setup says.
    pub fn of(setup: &Setup, choice: &Choice, rows: &[Row]) -> Result<Self, Error> {
        let begun = Instant::now();
        let designs: Vec<Design> = rows.par_iter().map(|row| Design::new(setup, row.point)).collect();
        let task = |(k, row): (usize, &Row)| {
            (0..row.distances.len()).map(|i| Task::of(k as u32, &row.tap(i))).collect::<Vec<_>>()
        };
        let tasks: Vec<Task> = rows.iter().enumerate().flat_map(task).collect();
        let mut evaluator = Evaluator::new(setup, choice.open(&setup.model)?);
        let outcomes = evaluator.run(&designs, &tasks)?;
        let ask = |(k, row): (usize, &Row)| Ask {
            design: k as u32,
            drive: row.point.drive,
            reach: Reach::of(row.point.direction(), row.reach),
        };
        let asks: Vec<Ask> = rows.iter().enumerate().map(ask).collect();
        let (own, _) = curve::solve(setup, &mut evaluator, &designs, &asks)?;
        let reach: Vec<[f64; 2]> = rows.iter().flat_map(|row| vec![row.reach; row.distances.len()]).collect();
        let ask = |i: usize| both::Ask::own(setup, tasks[i], &outcomes[i], reach[i]);
        let asks: Vec<both::Ask> = (0..tasks.len()).map(ask).collect();
        let (both, _) = both::both(setup, &mut evaluator, &designs, &asks)?;
        let (mut taps, mut figures, mut from) = (Vec::with_capacity(tasks.len()), Vec::new(), 0);
        for (k, row) in rows.iter().enumerate() {
            let these = &outcomes[from..from + row.distances.len()];
            let both = both.get(from..from + these.len()).unwrap_or_default();
            from += these.len();
            let mut reduced = Reduction::new(setup, &designs[k], row.reach, (these.len(), 1));
            for (i, tap) in these.iter().enumerate() {
                reduced.count((i, 0), (row.distances[i], row.point.drive), tap);
            }
            reduced.calibrate();
            taps.extend(these.iter().enumerate().map(|(i, tap): (usize, &Outcome)| {
                let at = (row.distances[i], row.point.drive);
                let told = Told::by(&own, k).towards(row.point.direction()).or_both(both.get(i));
                let estimated = reduced.estimate_by((i, 0), at, tap, told);
                ModelTap { strain: tap.strain, arc: tap.arc, status: tap.status | estimated.status }
            }));
            let row = &reduced.drives[0];
            figures.push([row.deviation.sd(), row.total_rms()].map(|x| x.filter(|_| row.complete())));
        }
        Ok(Self { taps, figures, seconds: begun.elapsed().as_secs_f64() })
    }

    /// Seconds of a tap.
    pub fn each(&self) -> f64 {
        self.seconds / self.taps.len().max(1) as f64
    }
}

/// How far a model is from the full one at some taps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Checked {
    /// Taps compared.
    pub taps: u64,
    /// Largest |ε − ε_full|/max(|ε_full|, 1e-3 θ f_max).
    pub error: f64,
    /// The tap that has it.
    pub at: Option<Tuple>,
    /// Taps so near to a threshold that the full model solves them.
    pub by_full: u64,
    /// Taps whose words differ, or of which only one model has a strain.
    pub statuses: u64,
    /// The first of them, the full model's words, and those of the other.
    pub status_at: Option<(Tuple, [Status; 2])>,
    /// Largest changes of K_sd and of total_rms_mm of a row, of themselves.
    pub figures: [f64; 2],
}

impl Checked {
    /// Whether taps were compared, no word differs and the strain is within `bound`.
    pub fn holds(&self, bound: f64) -> bool {
        self.taps > 0 && self.statuses == 0 && self.error <= bound
    }

    /// Compares `found` with what the model of `full` said of `rows`.
    pub(super) fn of(full: &Setup, rows: &[Row], expected: &Said, found: &Said, bound: f64) -> Self {
        let mut all = Self::default();
        let mut pairs = expected.taps.iter().zip(&found.taps);
        for row in rows {
            let design = Design::new(full, row.point);
            let peak = design.shared.as_ref().map_or(0.0, |shared| shared.peak);
            let least = 1e-3 * peak * amount(full.drive, row.point.drive);
            for (i, (expected, found)) in pairs.by_ref().take(row.distances.len()).enumerate() {
                let tap = (found.strain, found.arc, found.status);
                if doubts(full, &design, tap, DOUBT * bound) {
                    all.taps += 1;
                    all.by_full += 1;
                } else {
                    all.push(row.tap(i), least, *expected, *found);
                }
            }
        }
        for (full, found) in expected.figures.iter().zip(&found.figures) {
            for (k, largest) in all.figures.iter_mut().enumerate() {
                if let (Some(x), Some(y)) = (full[k], found[k]) {
                    *largest = largest.max(relative((y - x).abs(), x.abs()));
                }
            }
        }
        all
    }

    fn push(&mut self, tap: Tuple, least: f64, expected: ModelTap, found: ModelTap) {
        self.taps += 1;
        let one = expected.strain.is_nan() != found.strain.is_nan();
        if one || expected.status != found.status {
            self.statuses += 1;
            self.status_at = self.status_at.or(Some((tap, [expected.status, found.status])));
        }
        let error = relative((found.strain - expected.strain).abs(), expected.strain.abs().max(least));
        if self.at.is_none() || error > self.error {
            (self.error, self.at) = (error, Some(tap));
        }
    }

    /// Takes over other taps.
    pub fn merge(&mut self, other: &Self) {
        self.taps += other.taps;
        self.statuses += other.statuses;
        self.by_full += other.by_full;
        self.figures = std::array::from_fn(|k| self.figures[k].max(other.figures[k]));
        self.status_at = self.status_at.or(other.status_at);
        if other.at.is_some() && (self.at.is_none() || other.error > self.error) {
            (self.error, self.at) = (other.error, other.at);
        }
    }
}

/// `apart` over `size`; 0 where nothing is apart, or unknown.
fn relative(apart: f64, size: f64) -> f64 {
    if apart > 0.0 { apart / size } else { 0.0 }
}
