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
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::progress::Progress;
use crate::scene::{Setup, Study, Tuple};
use census::Census;
use rayon::prelude::*;

/// Random taps of each built-in configuration, beside its hard cases.
pub const RANDOM: u32 = 24;

/// Random taps of each configuration of a quick run, beside its hard cases.
pub const QUICK: u32 = 4;

/// Random taps of a spec.
pub const SAMPLES: u32 = 1000;

/// Random taps of a spec in a quick run.
pub const QUICK_SAMPLES: u32 = 100;

/// Random taps where nobody says how many: of a spec, or of each built-in configuration.
pub fn samples(of_spec: bool, quick: bool) -> u32 {
    match (of_spec, quick) {
        (true, false) => SAMPLES,
        (true, true) => QUICK_SAMPLES,
        (false, false) => RANDOM,
        (false, true) => QUICK,
    }
}

/// Taps that are solved together, between two looks at the clock: a second's work of the reference on a slow core.
const PART: usize = 256;

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
    /// The built-in configurations, or in a `quick` run one of each kind, with their hard cases and `samples` random taps each.
    pub fn built_in(samples: u32, seed: u64, quick: bool) -> Vec<Self> {
        let case = |c: &configuration::Configuration| {
            let setup = c.setup();
            let mut tuples = taps::hard(&setup);
            tuples.extend(taps::random(c.drive, c.hub, samples, seed));
            if c.tilted {
                taps::tilt(&mut tuples, seed);
            }
            Self { name: c.name.to_owned(), setup, study: None, tuples }
        };
        let wanted = |c: &&configuration::Configuration| !quick || configuration::QUICK.contains(&c.name);
        configuration::all().par_iter().filter(wanted).map(case).collect()
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

/// Solves every case by the reference and on every place; `each` is handed the lines of the census, one for each pair. When `stop` is set, the
/// lines of the case under way are those of its taps so far. The number of taps that were solved everywhere.
///
/// # Errors
/// Where a device fails.
pub fn run(
    cases: &[Case],
    places: &mut [Place],
    stop: &AtomicBool,
    progress: &mut dyn Progress,
    each: &mut dyn FnMut(Line),
) -> Result<u64, Error> {
    let total = cases.iter().map(|c| c.tuples.len() as u64).sum();
    let mut done = 0;
    for case in cases {
        let setup = &case.setup;
        let designs: Vec<Design> = case.tuples.par_iter().map(|t| Design::new(setup, *t)).collect();
        let mut solved = Solved::default();
        solved.found.resize_with(places.len(), Vec::new);
        let mut reference = Evaluator::new(setup, Method::Reference);
        let evaluator = |place: &mut Place| Ok(Evaluator::new(setup, place.open(&setup.model)?));
        let mut evaluators = places.iter_mut().map(evaluator).collect::<Result<Vec<_>, Error>>()?;
        for start in (0..designs.len()).step_by(PART) {
            let part = start..(start + PART).min(designs.len());
            let (designs, tuples) = (&designs[part.clone()], &case.tuples[part]);
            if !solved.part(designs, tuples, (&mut reference, &mut evaluators), stop)? {
                break;
            }
            progress.at(done + solved.expected.len() as u64, total);
        }
        for (place, evaluator) in places.iter_mut().zip(evaluators) {
            place.keep(evaluator.into_method());
        }
        solved.lines(case, places, &designs, each);
        done += solved.expected.len() as u64;
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    Ok(done)
}

/// The first taps of a case, as solved by the reference and on every place.
#[derive(Default)]
struct Solved {
    expected: Vec<Outcome>,
    found: Vec<Vec<Outcome>>,
}

impl Solved {
    /// Solves some more taps; `false`, and nothing is added, where `stop` is set before all have solved them.
    fn part(
        &mut self,
        designs: &[Design],
        tuples: &[Tuple],
        (reference, evaluators): (&mut Evaluator<'_>, &mut [Evaluator<'_>]),
        stop: &AtomicBool,
    ) -> Result<bool, Error> {
        let taps = tasks(tuples);
        let stopped = || stop.load(Ordering::Relaxed);
        if stopped() {
            return Ok(false);
        }
        let expected = reference.run(designs, &taps)?;
        let mut found = Vec::with_capacity(evaluators.len());
        for evaluator in evaluators {
            if stopped() {
                return Ok(false);
            }
            found.push(evaluator.run_beside(designs, &taps, &expected)?);
        }
        self.expected.extend(expected);
        self.found.iter_mut().zip(found).for_each(|(all, more)| all.extend(more));
        Ok(true)
    }

    /// The lines of the census; none where nothing was solved.
    fn lines(&self, case: &Case, places: &[Place], designs: &[Design], each: &mut dyn FnMut(Line)) {
        let (setup, tuples) = (&case.setup, &case.tuples[..self.expected.len()]);
        for (number, (place, found)) in
            places.iter().zip(&self.found).enumerate().filter(|_| !tuples.is_empty())
        {
            let mut census = Census::default();
            for ((design, t), (e, f)) in designs.iter().zip(tuples).zip(self.expected.iter().zip(found)) {
                census.push(compare::compare(setup, &facts(setup, design, t), e, f, place.bound), f.sweeps);
            }
            let at = (number, place.bound);
            charted::line(case, place, at, (tuples, designs), &self.expected)
                .into_iter()
                .for_each(&mut *each);
            let (kind, solved) = ((setup.drive, setup.built.is_some()), (&self.expected[..], &found[..]));
            each(census.close(&case.name, kind, at, tuples, solved));
        }
    }
}

fn tasks(tuples: &[Tuple]) -> Vec<Task> {
    let task = |(i, t): (usize, &Tuple)| Task::of(i as u32, t);
    tuples.iter().enumerate().map(task).collect()
}

fn facts(setup: &Setup, design: &Design, tuple: &Tuple) -> compare::TapScale {
    let shared = design.shared.as_ref();
    compare::TapScale {
        least: 1e-3 * shared.map_or(0.0, |s| s.peak) * amount(setup.drive, tuple.drive),
        length: tuple.L_a,
        near: shared.map_or(0.0, |s| s.gauge[0]),
        limit: shared.map_or(setup.gauge.strain_limit, |s| s.strain_limit(&setup.gauge)),
    }
}
