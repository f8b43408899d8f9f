//! A census: taps of a space, answered in several ways and compared with one of them.
//!
//! [`sample`] has the taps: rows of a space, or random ones; [`hard`] those that are hard to solve. A way to answer them is a setup (whisker, rig,
//! model) and what solves it: a [`Place`] is a backend in a precision, an [`effect`] is switched in the setup. [`Taps`] are made ready for a setup,
//! [`compare`] compares the answers and reduces them to a line of a table. The views: [`verify`] compares backends with the reference, `bench`
//! measures the time of it too, [`explain`] switches effects of the model one by one, [`needed`] leaves off those that change less than a bound.

#[cfg(feature = "commands")]
pub mod bench;
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
use serde::{Serialize, Serializer};

use crate::design::{Design, amount};
use crate::error::SolveError;
use crate::evaluate::{Evaluator, Method, Outcome, Task};
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
        let rows: Vec<Row> = tuples.iter().map(|t| Row::new(*t, [t.a].into())).collect();
        Self::of_rows(setup, &rows)
    }

    /// What `method` answers.
    pub fn answers(&self, method: Method) -> Result<Vec<Outcome>, SolveError> {
        Evaluator::new(&self.setup, method).run(&self.designs, &self.tasks)
    }

    /// The whisker of tap `i`.
    pub fn design(&self, i: usize) -> &Design {
        &self.designs[self.tasks[i].design as usize]
    }

    /// Tap `i`.
    fn tuple(&self, i: usize) -> Tuple {
        let Task { a, direction, drive, .. } = self.tasks[i];
        Tuple { a, drive, ..self.design(i).tuple }.towards(direction)
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

/// A tap that stands out. It is written by the names of columns, of an upright pole without its direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct At(pub Drive, pub Tuple);

impl Serialize for At {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let Self(drive, t) = *self;
        let lengths =
            [("D_mm", t.D), ("d_tip_mm", t.d), ("L_a_mm", t.L_a), ("x_ss_mm", t.x_ss), ("l_mm", t.l)];
        let contact = [("a_mm", t.a), (drive.column(), t.drive)];
        let pole = [("tilt_deg", t.tilt), ("lean_deg", t.lean)].into_iter().filter(|(_, x)| x.abs() > 0.0);
        to.collect_map(lengths.into_iter().chain(contact).chain(pole))
    }
}
