//! Every backend against the f64 reference, tap by tap.
//!
//! Of each tap that both solve, strain, K, forces and contact arc are compared, and the words of the status. A tap that only
//! one of them solves is counted; it is hidden in no figure.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use serde_json::{Value, json};

use super::compare::{Compared, Line, Odd, QUANTITIES, compare};
use super::configuration::{self, Configuration};
use super::{Figures, Place, Taps, hard, present, relative, sample};
use crate::backend::Backend;
use crate::chart::ranker::Ranker;
use crate::error::{Error, SolveError};
use crate::evaluate::{Evaluator, Method, Outcome};
use crate::kernel::Solver;
use crate::kernel::ranking::{Case as Reading, Charts};
use crate::progress::Progress;
use crate::scene::{self, Drive, RunOptions, Setup, Spec, Study, Tuple};
use crate::sink::folder::hash;
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::run_json::{self, in_force, material_fit};
use crate::sink::values::{Field, named};

/// What a census is asked.
#[derive(Debug, Clone, Copy)]
pub struct CensusOptions {
    /// Few taps.
    pub quick: bool,
    /// Random taps; [`samples`] where nobody says how many.
    pub samples: Option<u32>,
    /// Their seed.
    pub seed: u64,
    /// Largest relative error of the strain that passes.
    pub bound: Option<f64>,
}

/// The census of a spec, or of the built-in configurations, as a table and as run.json; whether all was compared and no bound is broken.
///
/// # Errors
/// A bound that is none; a backend that fails.
pub fn census(
    spec: Option<&Spec>,
    options: &RunOptions,
    asked: CensusOptions,
    stop: &AtomicBool,
    progress: &mut dyn Progress,
) -> Result<(Frame, Value, bool), Error> {
    let (start, CensusOptions { quick, samples: said, seed, bound }) = (Instant::now(), asked);
    let places = present(options, bound)?;
    let samples = said.unwrap_or(samples(spec.is_some(), quick));
    let cases = match spec {
        Some(spec) => vec![Case::of_study(&spec.name, spec.study.clone(), samples, seed)],
        None => Case::built_in(samples, seed, quick),
    };
    let taps = cases.iter().map(|c| c.tuples.len() as u64).sum();
    let backends: Vec<Backend> = places.iter().map(Place::backend).cloned().collect();
    let mut lines = Vec::new();
    let done = run(&cases, &places, stop, progress, &mut |line| lines.push(line))?;
    let stopped = (done < taps).then_some([done, taps]);
    let seconds = start.elapsed().as_secs_f64();
    let verified = Verified { spec, samples, seed, backends: &backends, lines: &lines, stopped, seconds };
    let good = done == taps && lines.iter().all(|line| line.faults().is_empty());
    Ok((verified.table()?, verified.document(), good))
}

/// Random taps where nobody says how many: of a spec, or of each built-in configuration beside its hard cases.
pub fn samples(of_spec: bool, quick: bool) -> u32 {
    match (of_spec, quick) {
        (true, false) => 1000,
        (true, true) => 100,
        (false, false) => 24,
        (false, true) => 4,
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
        let case = |c: &Configuration| {
            let setup = c.setup.clone();
            let mut tuples = hard::hard(&setup);
            tuples.extend(hard::random(setup.drive, setup.hub > 0.0, samples, seed));
            if setup.gauge.second {
                hard::tilt(&mut tuples, seed);
            }
            Self { name: c.name.to_owned(), setup, study: None, tuples }
        };
        let wanted = |c: &&Configuration| !quick || configuration::QUICK.contains(&c.name);
        configuration::all().par_iter().filter(wanted).map(case).collect()
    }

    /// About `samples` random taps of `study`.
    pub fn of_study(name: &str, study: Study, samples: u32, seed: u64) -> Self {
        let tuples = sample::random(&study.space, samples, seed);
        Self { name: name.to_owned(), tuples, setup: study.setup.clone(), study: Some(study) }
    }
}

/// Solves every case by the reference and on every place; `each` is handed the lines of the census, one for each pair. When `stop` is set, the
/// lines of the case under way are those of its taps so far. The number of taps that were solved everywhere.
pub fn run(
    cases: &[Case],
    places: &[Place],
    stop: &AtomicBool,
    progress: &mut dyn Progress,
    each: &mut dyn FnMut(Line),
) -> Result<u64, Error> {
    let total = cases.iter().map(|c| c.tuples.len() as u64).sum();
    let parts = |(k, case): (usize, &Case)| {
        let n = case.tuples.len();
        (0..n).step_by(PART).map(move |from| (k, from..(from + PART).min(n))).collect::<Vec<_>>()
    };
    let parts: Vec<(usize, Range<usize>)> = cases.iter().enumerate().flat_map(parts).collect();
    // The reference is a part ahead, so that it works while devices compile.
    let refer = |(k, range): &(usize, Range<usize>)| -> Result<(Taps, Vec<Outcome>), Error> {
        let taps = Taps::of(&cases[*k].setup, &cases[*k].tuples[range.clone()]);
        let mut reference = Evaluator::new(&taps.setup, Method::Reference).stopping(stop);
        let expected = reference.run(&taps.designs, &taps.tasks)?;
        Ok((taps, expected))
    };
    let (mut done, mut solved, mut ahead) = (0, Solved::default(), parts.first().map(refer).transpose());
    // Each device is opened once, on its first use.
    let mut solvers: Vec<Option<Box<dyn Solver>>> = places.iter().map(|_| None).collect();
    let answer = |(place, kept): (&Place, &mut Option<Box<dyn Solver>>),
                  (taps, expected): &(Taps, Vec<Outcome>)|
     -> Result<Vec<Outcome>, Error> {
        let solver = kept.take().map_or_else(|| place.choice.solver(), Ok)?;
        let method = place.choice.method(solver, &taps.setup.model);
        let mut evaluator = Evaluator::new(&taps.setup, method).stopping(stop);
        let found = evaluator.run_beside(&taps.designs, &taps.tasks, expected);
        if let Method::Fast { solver, .. } = evaluator.into_method() {
            *kept = Some(solver);
        }
        Ok(found?)
    };
    for (k, (at, range)) in parts.iter().enumerate() {
        let found = ahead.and_then(|taps| {
            let Some(taps) = taps else { return Ok(None) };
            let (next, found) = rayon::join(
                || parts.get(k + 1).map(refer).transpose(),
                || {
                    places
                        .par_iter()
                        .zip(&mut solvers)
                        .map(|one| answer(one, &taps))
                        .collect::<Result<Vec<_>, _>>()
                },
            );
            Ok(Some((next, taps, found?)))
        });
        let (next, (taps, expected), found) = match found {
            Ok(Some(found)) => found,
            Ok(None) | Err(Error::Solve(SolveError::Stopped)) => break,
            Err(e) => return Err(e),
        };
        ahead = next;
        done += range.len() as u64;
        solved.add(&taps, expected, found, places);
        progress.at(done, total);
        solved.case = *at;
        if range.end == cases[*at].tuples.len() {
            std::mem::take(&mut solved).lines(cases, places, each);
        }
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    if !solved.expected.is_empty() {
        solved.lines(cases, places, each);
    }
    Ok(done)
}

/// The first taps of a case, as solved by the reference and on every place.
#[derive(Default)]
struct Solved {
    case: usize,
    expected: Vec<Outcome>,
    /// Whether each is far from base and gauge.
    far: Vec<bool>,
    found: Vec<(Vec<Outcome>, Vec<Compared>)>,
}

impl Solved {
    fn add(&mut self, taps: &Taps, expected: Vec<Outcome>, found: Vec<Vec<Outcome>>, places: &[Place]) {
        self.found.resize_with(places.len(), Default::default);
        for ((place, found), all) in places.iter().zip(found).zip(&mut self.found) {
            let one = |i: usize| compare(taps, i, [&expected[i], &found[i]], place.bound);
            all.1.extend((0..found.len()).map(one));
            all.0.extend(found);
        }
        self.far.extend(taps.tasks.iter().enumerate().map(|(i, task)| task.is_far(taps.design(i))));
        self.expected.extend(expected);
    }

    /// The lines of the census.
    fn lines(self, cases: &[Case], places: &[Place], each: &mut dyn FnMut(Line)) {
        let case = &cases[self.case];
        let (tuples, expected) = (&case.tuples[..self.expected.len()], &self.expected);
        for (n, (place, (found, compared))) in places.iter().zip(&self.found).enumerate() {
            let (drive, at) = (case.setup.drive, (n, place.bound));
            if let Some(charted) = charted(case, place, tuples, expected) {
                let name = format!("{} chart", case.name);
                each(Line::new((name, drive), at, (tuples, &self.far), &charted, [expected, expected]));
            }
            each(Line::new((case.name.clone(), drive), at, (tuples, &self.far), compared, [expected, found]));
        }
    }
}

/// The strains that the rows are made of where `place` ranks the designs of `case` from a chart, against the reference. Taps that the
/// chart leaves to the kernel count as [`Odd::Neither`].
fn charted(case: &Case, place: &Place, tuples: &[Tuple], expected: &[Outcome]) -> Option<Vec<Compared>> {
    let study = case.study.as_ref()?;
    let layout = study.space.layout()?;
    let ranker = Ranker::new(study, &layout, place.chart_tolerance()?).ok().flatten()?;
    let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
    let read = |i: usize| {
        let distance = distances.iter().position(|a| *a == tuples[i].a)?;
        let easy = ranker.case(&tuples[i]) == Reading::Easy && expected[i].strain.is_finite();
        easy.then_some((i, (tuples[i], distance)))
    };
    let (places, read): (Vec<usize>, Vec<(Tuple, usize)>) = (0..tuples.len()).filter_map(read).unzip();
    let taps = Taps::of(&case.setup, tuples);
    let mut compared = vec![Err(Odd::Neither); tuples.len()];
    for (i, deviation) in places.into_iter().zip(ranker.deviations(&read)) {
        let (exact, found) = (expected[i].strain, expected[i].strain_linear / (1.0 + deviation));
        let error = relative((found - exact).abs(), exact.abs().max(taps.least(i)));
        compared[i] = Ok([Some(error), None, None, None]);
    }
    Some(compared)
}

/// A census of every backend.
#[derive(Debug)]
pub struct Verified<'a> {
    /// The spec, if there was one.
    pub spec: Option<&'a Spec>,
    /// Random taps of each configuration.
    pub samples: u32,
    /// Seed of the random taps.
    pub seed: u64,
    /// Backends, in the order of [`Line::place`].
    pub backends: &'a [Backend],
    /// The census.
    pub lines: &'a [Line],
    /// Taps that were solved everywhere, of how many, where a signal ended the run before all were.
    pub stopped: Option<[u64; 2]>,
    /// Start of the command to last byte, s.
    pub seconds: f64,
}

impl Verified<'_> {
    fn fields(&self, line: &Line) -> Vec<Field> {
        let backend = &self.backends[line.place];
        let count = |n: usize| Field::Count(n as u64);
        let value = |q: usize, f: fn(&Figures) -> f64| Field::from(line.errors[q].as_ref().map(f));
        let over = |q: usize| count(line.errors[q].map_or(0, |f| f.over));
        let Line { taps, compared, neither, unsolved, unanswered, differ, referred, .. } = *line;
        let mut fields: Vec<Field> = vec![
            line.configuration.clone().into(),
            backend.name.into(),
            backend.precision.into(),
            backend.adapter.clone().unwrap_or_default().into(),
            Field::Number(line.bound),
        ];
        fields.extend([taps, compared, neither, unsolved, unanswered, differ, referred].map(count));
        fields.extend([value(0, |f| f.worst), value(0, |f| f.median), value(0, |f| f.p99), over(0)]);
        fields.extend((1..QUANTITIES.len()).flat_map(|q| [value(q, |f| f.worst), over(q)]));
        fields.extend([line.sweeps.0, line.sweeps.1].map(Field::Number));
        let mut at = [f64::NAN; 1 + scene::COLUMNS];
        if let Some((tuple, _)) = &line.at {
            let [before @ .., drive] = tuple.to_array();
            at[..before.len()].copy_from_slice(&before);
            at[before.len() + usize::from(line.drive == Drive::Displacement)] = drive;
        }
        fields.extend(at.map(Field::Number));
        fields.extend([line.verdict().into(), line.other_words().into()]);
        fields.push(line.at.map_or("".into(), |(_, status)| status.into()));
        fields
    }

    /// The census as verify.csv.
    pub fn table(&self) -> Result<Frame, Error> {
        let mut table = heading("verify").frame(&[]);
        self.lines.iter().try_for_each(|line| table.row(self.fields(line)))?;
        Ok(table)
    }

    /// Its lines as JSON, by the names of the columns.
    pub fn census(&self) -> Vec<Value> {
        self.lines.iter().map(|line| named(heading("verify").names_as(&[]), self.fields(line))).collect()
    }

    /// Sums over the census.
    pub fn counts(&self) -> Value {
        let sum = |f: fn(&Line) -> usize| self.lines.iter().map(f).sum::<usize>();
        json!({
            "comparisons": sum(|l| l.taps),
            "compared": sum(|l| l.compared),
            "neither": sum(|l| l.neither),
            "unsolved": sum(|l| l.unsolved),
            "referred": sum(|l| l.referred),
            "unanswered": sum(|l| l.unanswered),
            "differ": sum(|l| l.differ),
            "strain_over": sum(|l| l.errors[0].map_or(0, |f| f.over)),
            "lines": self.lines.len(),
            "broken_lines": sum(|l| usize::from(!l.faults().is_empty())),
        })
    }

    /// The whole of `run.json`.
    pub fn document(&self) -> Value {
        let (name, text) = self.spec.map_or(("verify", ""), |s| (&s.name, &s.text));
        run_json::document(
            "verify",
            json!({ "name": name, "hash": hash(text), "text": text }),
            json!({
                "in_force": self.spec.map(in_force),
                "material_fit": self.spec.map(|s| material_fit(s, None)),
                "warnings": self.spec.map_or(&[][..], |s| &s.warnings),
                "samples": self.samples,
                "seed": self.seed,
                "backends": self.backends,
                "counts": self.counts(),
                "stopped": self.stopped.map(|[taps, of]| json!({ "taps": taps, "of": of })),
                "census": self.census(),
                "seconds": { "total": self.seconds },
            }),
        )
    }
}
