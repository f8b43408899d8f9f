//! A census: taps of a space, answered in several ways and compared with one of them.
//!
//! [`sample`] has the taps: rows of a space, or random ones; [`hard`] those that are hard to solve. A way to answer them is a setup (whisker, rig,
//! model) and what solves it: [`Place`], a backend in a precision. [`Taps`] are made ready for a setup, and say what an error is relative to;
//! [`Figures`] are what many errors come to. The views: [`verify`] compares backends with the reference, `bench` measures the time of it too,
//! [`explain`] switches effects of the model one by one, [`needed`] leaves off those that change less than a bound.

#[cfg(feature = "commands")]
pub mod bench;
pub mod bound;
pub mod compare;
pub mod configuration;
pub mod effect;
pub mod explain;
pub mod hard;
pub mod needed;
mod place;
pub mod sample;
pub mod verify;

use rayon::prelude::*;
use serde_json::{Value, json};

use crate::design::{Design, amount};
use crate::error::SolveError;
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::reduce::percentile;
use crate::scene::{Drive, Setup, Tuple};
pub use place::{Place, present};
use sample::Row;

/// Taps made ready for a setup.
#[derive(Debug)]
pub struct Taps {
    /// What is computed.
    pub setup: Setup,
    /// Whiskers.
    pub designs: Vec<Design>,
    /// Taps, those of one whisker after another.
    pub tasks: Vec<Task>,
}

impl Taps {
    /// Of `rows`, each a whisker of its own.
    pub fn of_rows(setup: &Setup, rows: &[Row]) -> Self {
        let designs = rows.par_iter().map(|row| Design::new(setup, row.point)).collect();
        let tasks = (0..).zip(rows).flat_map(|(k, row)| row.taps().map(move |t| Task::of(k, &t))).collect();
        Self { setup: setup.clone(), designs, tasks }
    }

    /// Of `tuples`, each a whisker of its own.
    pub fn of(setup: &Setup, tuples: &[Tuple]) -> Self {
        let designs = tuples.par_iter().map(|t| Design::new(setup, *t)).collect();
        let tasks = (0..).zip(tuples).map(|(k, t)| Task::of(k, t)).collect();
        Self { setup: setup.clone(), designs, tasks }
    }

    /// What `method` answers.
    pub fn answers(&self, method: Method) -> Result<Vec<Outcome>, SolveError> {
        Evaluator::new(&self.setup, method).run(&self.designs, &self.tasks)
    }

    /// The whisker of tap `i`.
    pub fn design(&self, i: usize) -> &Design {
        &self.designs[self.tasks[i].design as usize]
    }

    /// 1e-3 θ f_max of tap `i`: a strain error is relative to the strain, or to this where the strain is smaller.
    pub fn least(&self, i: usize) -> f64 {
        let peak = self.design(i).shared.as_ref().map_or(0.0, |s| s.peak);
        1e-3 * peak * amount(self.setup.drive, self.tasks[i].drive)
    }
}

/// `apart` over `size`; 0 where nothing is apart.
fn relative(apart: f64, size: f64) -> f64 {
    if apart == 0.0 { 0.0 } else { apart / size }
}

/// What many errors come to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// Largest; NaN if any is not a number.
    pub worst: f64,
    /// Middle one.
    pub median: f64,
    /// 99 of 100 are not larger ([`percentile`]).
    pub p99: f64,
    /// Number above the bound.
    pub over: usize,
    /// Place of the worst among the taps.
    pub at: usize,
}

impl Figures {
    /// Of (error, place) pairs against `bound`; `None` of nothing.
    fn new(mut errors: Vec<(f64, usize)>, bound: f64) -> Option<Self> {
        errors.sort_by(|a, b| a.0.total_cmp(&b.0));
        let &(worst, at) = errors.last()?;
        let rank = |percent| errors[percentile(errors.len(), percent)].0;
        let over = errors.iter().filter(|(e, _)| e.is_nan() || *e > bound).count();
        Some(Self { worst, median: rank(50), p99: rank(99), over, at })
    }
}

/// A tap, by the names of columns.
pub fn tap_json(drive: Drive, t: &Tuple) -> Value {
    let mut at =
        json!({ "D_mm": t.D, "d_tip_mm": t.d, "L_a_mm": t.L_a, "x_ss_mm": t.x_ss, "l_mm": t.l, "a_mm": t.a });
    at[drive.column()] = t.drive.into();
    at
}
