//! Work–precision points: time per tap against strain error.

use super::place::{Place, chosen};
use super::probe::{Account, Probe, Spent};
use super::stopwatch::{Times, repeat};
use super::taps::{self, Taps};
use super::{Part, Settings, Watch};
use crate::error::Error;
use crate::evaluate::{Evaluator, Method, Outcome};
use crate::kernel::{
    Rule, Rung,
    rule::{every_rule, smallest_tolerance},
};
use crate::reduce::percentile;
use crate::scene::{BackendChoice, Model, Precision};
use crate::verify::configuration::Configuration;

/// Which kernel solved a point's taps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solved {
    /// The closed forms of the linear theory.
    Linear,
    /// The whole ladder of rules, to a tolerance.
    Ladder,
    /// One rule alone, its sweeps converged: what so many nodes give.
    Nodes(usize),
    /// f64 shooting.
    Reference,
}

impl Solved {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Ladder => "exact",
            Self::Nodes(_) => "exact-nodes",
            Self::Reference => "reference",
        }
    }
}

/// Errors of many taps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quantiles {
    /// Half of the taps are not worse.
    pub median: f64,
    /// 99 of 100 taps are not worse ([`percentile`]).
    pub p99: f64,
    /// The worst tap.
    pub worst: f64,
}

impl Quantiles {
    /// Of `errors`; `None` of nothing.
    pub fn of(mut errors: Vec<f64>) -> Option<Self> {
        errors.sort_by(f64::total_cmp);
        let worst = *errors.last()?;
        let at = |percent| errors[percentile(errors.len(), percent)];
        Some(Self { median: at(50), p99: at(99), worst })
    }
}

/// One point: a configuration, solved somewhere, somehow.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Configuration of the taps.
    pub configuration: &'static str,
    /// Place, by number.
    pub place: usize,
    /// Kernel.
    pub solved: Solved,
    /// Tolerance asked for; of a single rule, the one to which its sweeps converge.
    pub tolerance: Option<f64>,
    /// Taps whose error was measured.
    pub taps: usize,
    /// Taps that the reference solved and this did not.
    pub failed: usize,
    /// Nanoseconds per tap, from tuple to outcome.
    pub whole: Times,
    /// Nanoseconds per tap in the kernel alone, transfers included; none for the reference.
    pub kernel: Option<Times>,
    /// Sweeps per tap, all rungs together.
    pub sweeps: Option<f64>,
    /// Strain errors; none where nothing was solved.
    pub errors: Option<Quantiles>,
}

/// What was solved, with its cost.
struct Run {
    outcomes: Vec<Outcome>,
    whole: Times,
    kernel: Option<Times>,
    sweeps: Option<f64>,
}

/// All points.
///
/// # Errors
/// A device that fails, or a request to stop.
pub fn measure(settings: &Settings, places: &[Place], watch: &mut Watch<'_>) -> Result<(), Error> {
    for (i, c) in settings.configurations.iter().enumerate() {
        let judge = Judge::new(settings, places, c, watch)?;
        (watch.each)(Part::Point(judge.point.clone()));
        let timed = Taps::new(c, settings.timed_of(c).max(judge.compared.tasks.len()))?;
        for (place, p) in places.iter().enumerate().filter(|(_, p)| !p.is_reference()) {
            for tolerance in settings.tolerances(p.precision) {
                watch.next(&format!("{} on {}, tolerance {tolerance:e}", c.name, p.name))?;
                let run = fast(&timed, p, settings.repeats, |m| rungs(p, m, tolerance), (tolerance, None))?;
                (watch.each)(Part::Point(judge.point((c, place, Solved::Ladder, Some(tolerance)), run)));
            }
            for nodes in settings.nodes(p) {
                watch.next(&format!("{} on {}, {nodes} nodes", c.name, p.name))?;
                let tolerance = smallest_tolerance(p.precision);
                let alone = |m: &Model| {
                    Ok(vec![Rung::new(rule(p.precision, nodes), p.precision, &m.material, tolerance)])
                };
                let run = fast(&timed, p, settings.repeats, alone, (1.0, Some(tolerance)))?;
                let point = judge.point((c, place, Solved::Nodes(nodes), Some(tolerance)), run);
                (watch.each)(Part::Point(point));
            }
            if i == 0 {
                // The same taps by the linear theory: what leaving the rod out costs.
                let taps = Taps::new(&taps::linear(), timed.tasks.len())?;
                let run = linear(&taps, p, settings, watch)?;
                (watch.each)(Part::Point(judge.point((c, place, Solved::Linear, None), run)));
            }
        }
    }
    Ok(())
}

fn linear(taps: &Taps, p: &Place, settings: &Settings, watch: &mut Watch<'_>) -> Result<Run, Error> {
    watch.next(&format!("linear theory on {}", p.name))?;
    let tolerance = p.choice.backend.tolerance.unwrap_or(1e-5);
    let run = fast(taps, p, settings.repeats, |m| rungs(p, m, tolerance), (tolerance, None))?;
    // Closed forms need no kernel.
    Ok(Run { kernel: None, sweeps: None, ..run })
}

/// The taps of a configuration with the answers of the reference.
struct Judge {
    compared: Taps,
    answers: Vec<Outcome>,
    /// The reference's own point.
    point: Point,
}

impl Judge {
    /// Solves the taps of `c` by the reference, and by cpu f64 as far as that goes: two methods that share nothing.
    fn new(
        settings: &Settings,
        places: &[Place],
        c: &Configuration,
        watch: &mut Watch<'_>,
    ) -> Result<Self, Error> {
        watch.next(&format!("{} on the reference", c.name))?;
        let place = places.iter().position(Place::is_reference);
        let place = place.ok_or_else(|| Error::Run("no reference to compare with".into()))?;
        let compared = Taps::new(c, settings.compared)?;
        let (answers, whole) = reference(&compared, 1)?;
        let point = Point {
            configuration: c.name,
            place,
            solved: Solved::Reference,
            tolerance: None,
            taps: 0,
            failed: 0,
            whole,
            kernel: None,
            sweeps: None,
            errors: None,
        };
        let mut judge = Self { compared, answers, point };
        let tolerance = smallest_tolerance(Precision::F64);
        let other = chosen(BackendChoice::Cpu, Precision::F64, None, Some(tolerance))?;
        let Taps { setup, designs, tasks } = &judge.compared;
        let other = Evaluator::new(setup, other.open(&setup.model)?).run(designs, tasks)?;
        let (taps, unsolved, errors) = judge.compare(&other);
        (judge.point.taps, judge.point.errors) = (taps - unsolved, errors);
        Ok(judge)
    }

    /// Taps compared, taps that only the reference solved, errors.
    fn compare(&self, found: &[Outcome]) -> (usize, usize, Option<Quantiles>) {
        let (mut taps, mut failed, mut errors) = (0, 0, Vec::new());
        for (i, (answer, found)) in self.answers.iter().zip(found).enumerate() {
            if !answer.strain.is_finite() {
                continue;
            }
            taps += 1;
            if found.strain.is_finite() {
                let scale = answer.strain.abs().max(self.compared.least(i));
                errors.push((found.strain - answer.strain).abs() / scale);
            } else {
                failed += 1;
            }
        }
        (taps, failed, Quantiles::of(errors))
    }

    fn point(
        &self,
        (c, place, solved, tolerance): (&Configuration, usize, Solved, Option<f64>),
        run: Run,
    ) -> Point {
        let (taps, failed, errors) = self.compare(&run.outcomes);
        let Run { whole, kernel, sweeps, .. } = run;
        let configuration = c.name;
        Point { configuration, place, solved, tolerance, taps, failed, whole, kernel, sweeps, errors }
    }
}

/// Answers of the reference to `taps`, and nanoseconds per tap.
fn reference(taps: &Taps, repeats: usize) -> Result<(Vec<Outcome>, Times), Error> {
    let mut evaluator = Evaluator::new(&taps.setup, Method::Reference);
    let (answers, times) = repeat(repeats, || evaluator.run(&taps.designs, &taps.tasks))?;
    Ok((answers, times.per(taps.tasks.len())))
}

/// Rungs of `place` at `tolerance`, as a sweep takes them.
fn rungs(place: &Place, model: &Model, tolerance: f64) -> Result<Vec<Rung>, Error> {
    match place.at(tolerance)?.open(model)? {
        Method::Fast { rungs, .. } => Ok(rungs),
        Method::Reference => Ok(Vec::new()),
    }
}

/// The rule of the ladder with `nodes`, or its first with another number of them.
fn rule(precision: Precision, nodes: usize) -> Rule {
    let ladder = every_rule(precision);
    let known = ladder.iter().find(|r| r.nodes == nodes);
    known.copied().unwrap_or(Rule { nodes, ..ladder[0] })
}

/// Times `taps` on `place` on the rungs that `rungs` makes for their model. `alone`: the only rung, solved to that tolerance,
/// all its answers taken.
fn fast(
    taps: &Taps,
    place: &Place,
    repeats: usize,
    rungs: impl Fn(&Model) -> Result<Vec<Rung>, Error>,
    (tolerance, alone): (f64, Option<f64>),
) -> Result<Run, Error> {
    let solver = place.solver()?.ok_or_else(|| Error::Run("the reference has no kernel".into()))?;
    let (probe, account) = Probe::new(solver, alone);
    let method = Method::Fast { solver: Box::new(probe), rungs: rungs(&taps.setup.model)?, tolerance };
    let mut evaluator = Evaluator::new(&taps.setup, method);
    let mut run = || evaluator.run(&taps.designs, &taps.tasks).map_err(Error::from);
    // The first run pays for pipelines and buffers.
    run()?;
    account.take();
    let mut spent: Vec<Spent> = Vec::new();
    let (outcomes, whole) = repeat(repeats, || {
        let outcomes = run();
        spent.push(Account::take(&account));
        outcomes
    })?;
    let n = taps.tasks.len();
    Ok(Run {
        outcomes,
        whole: whole.per(n),
        kernel: Some(Times::of(spent.iter().map(|s| s.seconds).collect()).per(n)),
        sweeps: spent.last().map(|s| s.sweeps / n as f64),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_sorted_errors() {
        let errors: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        assert_eq!(Quantiles::of(errors), Some(Quantiles { median: 50.0, p99: 99.0, worst: 100.0 }));
        assert_eq!(Quantiles::of(vec![2.0]), Some(Quantiles { median: 2.0, p99: 2.0, worst: 2.0 }));
        assert_eq!(Quantiles::of(vec![]), None);
        // The last of few is not cut off.
        assert_eq!(Quantiles::of(vec![0.0; 50].into_iter().chain([1.0]).collect()).unwrap().p99, 1.0);
    }
}
