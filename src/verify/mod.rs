//! Every backend against the f64 reference, tap by tap, and the census of what that shows.
//!
//! Of each tap that both solve, strain, K, forces and contact arc are compared, and the words of the status. A tap that only
//! one of them solves is counted; it is hidden in no figure.

mod census;
mod charted;
mod compare;
pub mod configuration;
mod places;
pub mod taps;
pub mod write;

use std::sync::atomic::{AtomicBool, Ordering};

pub use census::{FORCE, Figures, Line, QUANTITIES, UNSOLVED};
pub use places::{Place, present};

use crate::design::{Design, amount};
use crate::error::Error;
use crate::evaluate::{Evaluator, Method, Task};
use crate::progress::Progress;
use crate::scene::{Setup, Study, Tuple};
use census::Census;
use rayon::prelude::*;

/// Random taps of each built-in configuration, beside its hard cases.
pub const RANDOM: u32 = 24;

/// Random taps of a spec.
pub const SAMPLES: u32 = 1000;

/// Taps that are solved together, between two looks at the clock.
const PART: usize = 512;

/// Taps of one setup.
#[derive(Debug)]
pub struct Case {
    /// Name in the census.
    pub name: String,
    /// Rig, gauge, model.
    pub setup: Setup,
    /// The study that the taps were drawn from, if there is one: a chart may rank it.
    pub study: Option<Study>,
    /// Taps.
    pub tuples: Vec<Tuple>,
}

impl Case {
    /// The built-in configurations with their hard cases and `samples` random taps each.
    pub fn built_in(samples: u32, seed: u64) -> Vec<Self> {
        let case = |c: &configuration::Configuration| {
            let setup = c.setup();
            let mut tuples = taps::hard(&setup);
            tuples.extend(taps::random(c.drive, c.hub, samples, seed));
            Self { name: c.name.to_owned(), setup, study: None, tuples }
        };
        configuration::ALL.par_iter().map(case).collect()
    }

    /// About `samples` random taps of `study`.
    ///
    /// # Errors
    /// A tuple file that cannot be read again.
    pub fn of_study(name: &str, study: Study, samples: u32, seed: u64) -> Result<Self, Error> {
        let tuples = taps::of_space(&study.space, samples, seed)?;
        Ok(Self { name: name.to_owned(), tuples, setup: study.setup.clone(), study: Some(study) })
    }
}

/// Solves every case by the reference and on every place; one line of the census for each pair.
///
/// # Errors
/// Where a device fails, or `stop` is set.
pub fn run(
    cases: &[Case],
    places: &mut [Place],
    stop: &AtomicBool,
    progress: &mut dyn Progress,
) -> Result<Vec<Line>, Error> {
    let total = cases.iter().map(|c| c.tuples.len() as u64).sum();
    let mut done = 0;
    let mut lines = Vec::new();
    for case in cases {
        let setup = &case.setup;
        let designs: Vec<Design> = case.tuples.par_iter().map(|t| Design::new(setup, *t)).collect();
        let mut expected = Vec::with_capacity(designs.len());
        let mut reference = Evaluator::new(setup, Method::Reference);
        for start in (0..designs.len()).step_by(PART) {
            let part = start..(start + PART).min(designs.len());
            let taps = tasks(&case.tuples[part.clone()]);
            expected.extend(reference.run(&designs[part], &taps)?);
            if stop.load(Ordering::Relaxed) {
                return Err(Error::Run("stopped; nothing was written".into()));
            }
            progress.at(done + expected.len() as u64, total);
        }
        done += expected.len() as u64;
        for (number, place) in places.iter_mut().enumerate() {
            let mut evaluator = Evaluator::new(setup, place.open(&setup.model)?);
            let found = evaluator.run_beside(&designs, &tasks(&case.tuples), &expected)?;
            place.keep(evaluator.into_method());
            let mut census = Census::default();
            for ((design, t), (e, f)) in designs.iter().zip(&case.tuples).zip(expected.iter().zip(&found)) {
                census.push(compare::compare(setup, &facts(setup, design, t), e, f, place.bound), f.sweeps);
            }
            let at = (number, place.bound);
            lines.extend(charted::line(case, place, at, &designs, &expected));
            lines.push(census.close(&case.name, setup.drive, at, &case.tuples, (&expected, &found)));
        }
    }
    Ok(lines)
}

fn tasks(tuples: &[Tuple]) -> Vec<Task> {
    let task = |(i, t): (usize, &Tuple)| Task { design: i as u32, a: t.a, drive: t.drive };
    tuples.iter().enumerate().map(task).collect()
}

fn facts(setup: &Setup, design: &Design, tuple: &Tuple) -> compare::Tap {
    let shared = design.shared.as_ref();
    compare::Tap {
        least: 1e-3 * shared.map_or(0.0, |s| s.peak) * amount(setup.drive, tuple.drive),
        length: tuple.L_a,
        near: shared.map_or(0.0, |s| s.gauge[0]),
    }
}
