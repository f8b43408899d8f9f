//! Every backend against the f64 reference, tap by tap.
//!
//! Of each tap that both solve, strain, K, forces and contact arc are compared, and the words of the status. A tap that only
//! one of them solves is counted; it is hidden in no figure.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::cases::{self, Configuration};
use super::compare::{Compared, Line, Odd, compare};
use super::{Place, Taps, relative, sample};
use crate::chart::ranker::Ranker;
use crate::error::{Error, SolveError};
use crate::evaluate::{Evaluator, Method, Outcome, Referral};
use crate::kernel::Solver;
use crate::kernel::ranking::Case as Reading;
use crate::scene::{Setup, Study, Tuple};

/// Taps that are solved together, between two looks at the clock: a second's work of the reference on a slow core.
const PART: usize = 256;

/// Taps of one setup.
#[derive(Debug)]
pub struct Case {
    pub name: String,
    pub setup: Setup,
    /// The study that the taps were drawn from, if there is one: a chart may rank it.
    pub study: Option<Study>,
    pub tuples: Vec<Tuple>,
}

impl Case {
    /// The built-in configurations, or in a `quick` run one of each kind, with their hard cases and `samples` random taps each.
    pub fn built_in(samples: u32, seed: u64, quick: bool) -> Vec<Self> {
        let case = |c: &Configuration| {
            let setup = c.setup.clone();
            let mut tuples = cases::hard(&setup);
            tuples.extend(cases::random(setup.drive, setup.hub > 0.0, samples, seed));
            if setup.gauge.second {
                cases::tilt(&mut tuples, seed);
            }
            Self { name: c.name.to_owned(), setup, study: None, tuples }
        };
        let wanted = |c: &&Configuration| !quick || cases::QUICK.contains(&c.name);
        cases::all().par_iter().filter(wanted).map(case).collect()
    }

    /// About `samples` random taps of `study`.
    pub fn of_study(name: &str, study: Study, samples: u32, seed: u64) -> Self {
        let tuples = sample::random(&study.space, samples, seed);
        Self { name: name.to_owned(), tuples, setup: study.setup.clone(), study: Some(study) }
    }
}

/// Progress of a census.
pub enum CensusNews {
    /// So many taps are solved everywhere.
    Done(u64),
    /// The lines of a configuration, one for each place, and how many taps are done with it.
    Lines(u64, Vec<Line>),
}

/// Solves every case by the reference and on every place. When `stop` is set, the last lines are those of the taps of their case so far.
/// Errors: a backend that fails.
pub fn run(
    cases: &[Case],
    places: &[Place],
    stop: &AtomicBool,
    tell: &mut dyn FnMut(CensusNews),
) -> Result<(), Error> {
    // Each device is opened once, on its first use.
    let mut solvers: Vec<Option<Box<dyn Solver>>> = places.iter().map(|_| None).collect();
    let mut parts = cases.iter().flat_map(|case| case.tuples.chunks(PART).map(move |part| (case, part)));
    let mut solve = || {
        let (case, part) = parts.next()?;
        let taps = Taps::of(&case.setup, part);
        let mut evaluator = Evaluator::new(&taps.setup, Method::Reference).stopping(stop);
        let expected = evaluator.run(&taps.designs, &taps.tasks);
        Some((case, expected, taps))
    };
    let (mut done, mut solved, mut next) = (0, Solved::default(), solve());
    while let Some((case, expected, taps)) = next {
        // What waits for a device leaves time for the reference's next part.
        let found;
        (found, next) = rayon::join(|| solved.add(&taps, expected, places, &mut solvers, stop), &mut solve);
        let ended = match found {
            Err(Error::Solve(SolveError::Stopped)) => true,
            other => {
                other?;
                done += taps.tasks.len() as u64;
                tell(CensusNews::Done(done));
                stop.load(Ordering::Relaxed)
            }
        };
        let n = solved.expected.len();
        if n == case.tuples.len() || ended && n > 0 {
            tell(CensusNews::Lines(done, std::mem::take(&mut solved).lines(case, places)));
        }
        if ended {
            break;
        }
    }
    Ok(())
}

/// The first taps of a case, as solved by the reference and on every place.
#[derive(Default)]
struct Solved {
    expected: Vec<Outcome>,
    found: Vec<Vec<Outcome>>,
}

impl Solved {
    /// Solves more taps on every place, of which the reference says what is expected.
    fn add(
        &mut self,
        taps: &Taps,
        expected: Result<Vec<Outcome>, SolveError>,
        places: &[Place],
        solvers: &mut [Option<Box<dyn Solver>>],
        stop: &AtomicBool,
    ) -> Result<(), Error> {
        let expected = expected?;
        let answer = |(place, kept): (&Place, &mut Option<Box<dyn Solver>>)| -> Result<_, Error> {
            let solver = kept.take().map_or_else(|| place.choice.solver(), Ok)?;
            let method = place.choice.method(solver, &taps.setup.model);
            let mut evaluator = Evaluator::new(&taps.setup, method).stopping(stop);
            let found = evaluator.run_alike(&taps.designs, &taps.tasks, Referral::ALL, Some(&expected));
            if let Method::Fast { solver, .. } = evaluator.into_method() {
                *kept = Some(solver);
            }
            Ok(found?)
        };
        let found: Vec<_> = places.par_iter().zip(solvers).map(answer).collect::<Result<_, _>>()?;
        self.found.resize_with(places.len(), Vec::new);
        self.found.iter_mut().zip(found).for_each(|(all, found)| all.extend(found));
        self.expected.extend(expected);
        Ok(())
    }

    /// The lines of the census.
    fn lines(&self, case: &Case, places: &[Place]) -> Vec<Line> {
        let (expected, mut lines) = (&self.expected, Vec::new());
        let taps = Taps::of(&case.setup, &case.tuples[..expected.len()]);
        for (n, (place, found)) in places.iter().zip(&self.found).enumerate() {
            let mut add = |name: String, compared: &[Compared], found: &[Outcome]| {
                lines.push(Line::new(name, (n, place.bound), &taps, compared, [expected, found]));
            };
            if let Some(charted) = charted(case, place, &taps, expected) {
                add(format!("{} chart", case.name), &charted, expected);
            }
            add(case.name.clone(), &compare(&taps, expected, found, place.bound), found);
        }
        lines
    }
}

/// The strains that the rows are made of where `place` ranks the designs of `case` from a chart, against the reference. Taps that the
/// chart leaves to the kernel count as [`Odd::Neither`].
fn charted(case: &Case, place: &Place, taps: &Taps, expected: &[Outcome]) -> Option<Vec<Compared>> {
    let (study, tuples) = (case.study.as_ref()?, &case.tuples[..expected.len()]);
    let layout = study.space.layout()?;
    let tolerance = place.choice.chart_tolerance().filter(|_| place.backend().name == "cpu")?;
    let ranker = Ranker::new(study, &layout, tolerance).ok().flatten()?;
    let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
    let read = |i: usize| {
        let distance = distances.iter().position(|a| *a == tuples[i].a)?;
        let easy = ranker.case(&tuples[i]) == Reading::Easy && expected[i].strain.is_finite();
        easy.then_some((i, (tuples[i], distance)))
    };
    let (places, read): (Vec<usize>, Vec<(Tuple, usize)>) = (0..tuples.len()).filter_map(read).unzip();
    let mut compared = vec![Err(Odd::Neither); tuples.len()];
    for (i, deviation) in places.into_iter().zip(ranker.deviations(&read)) {
        let (exact, found) = (expected[i].strain, expected[i].strain_linear / (1.0 + deviation));
        let error = relative((found - exact).abs(), exact.abs().max(taps.least(i)));
        compared[i] = Ok([Some(error), None, None, None]);
    }
    Some(compared)
}
