//! The fast tap kernel: many small, independent taps, in lanes on the CPU or in invocations on the GPU.
//!
//! From the contact towards the base the rod is an initial value problem in two unknowns, the force P and the contact arc c. Angles are small and
//! smooth, so that the whole tap is one collocation/Picard loop on n Gauss–Legendre nodes ([`nodes`]): integrate the angle, integrate the position,
//! correct P and c from the two closure equations. The state is the *deviation from the linear solution*, so that K − 1, which is O(θ²), keeps its
//! full relative precision in f32. The derivation is in `cpu::exact`.
//!
//! Taps are dimensionless ([`Tap`]; unit of length is the contact distance, E drops out) and solved in batches by a [`Solver`], on a small rule
//! first; taps whose error estimate exceeds the tolerance climb to a larger one ([`Rule`]), the last in f64 on the CPU. The estimate includes the
//! iteration, the truncation of the rule, the section chart, and rounding of terms that cancel. An equilibrium at which the material may fail, or
//! that may not lie on the path from the unloaded whisker, is [unsure](Solution::unsure): the reference decides.
//!
//! Frictionless Hooke taps of 0.5–10° take 3.3 sweeps of 6 nodes in f32 at 1e-5 and 4.2 of 10 nodes in f64 at 1e-8, all rungs together (`sweeps_mean`
//! of `vibrissa bench`): with the gauge 3381 and 8115 floating-point operations a tap.

/// Names as words.
#[macro_export]
macro_rules! names {
    ($($name:ident)+) => {
        [$(stringify!($name)),+]
    };
}

pub mod chart;
pub mod cpu;
pub mod effects;
pub mod frames;
pub mod gpu;
pub mod ranking;
pub mod rule;
pub mod tap;

pub use chart::Chart;
use cpu::Cpu;
pub use effects::Effects;
pub use rule::{Rule, ladder};
pub use tap::{Solution, Tap};
pub use vibrissa_core::physics::nodes;

use std::sync::OnceLock;

use rayon::prelude::*;
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::{Material, Precision};

/// Shared parameters of one batch.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// Effects of the kernel.
    pub effects: Effects,
    /// Nodes, terms, sweeps.
    pub rule: &'a Rule,
    /// Bound on the strain error.
    pub tolerance: f64,
    /// Section law, where the kernel needs one.
    pub chart: Option<&'a Chart>,
}

/// A rung of the ladder with the section law that belongs to it.
#[derive(Debug, Clone)]
pub struct Rung {
    /// Nodes, terms, sweeps.
    pub rule: Rule,
    /// Solved on the CPU in f64, far below the tolerance, for the few taps that the other rungs cannot solve.
    pub spare: bool,
    precision: Precision,
    /// Law of the sections, and the tolerance of its chart; None for Hooke's.
    law: Option<(Material, f64)>,
    chart: OnceLock<Option<Chart>>,
}

/// Spare rungs solve to this share of the tolerance: they are few.
const SPARE: f64 = 0.01;

const SCANNED: usize = 1 << 14;

impl Rung {
    /// The rung of `rule` for `material`, at `tolerance`.
    pub fn new(rule: Rule, precision: Precision, material: &Material, tolerance: f64) -> Self {
        let law = (!matches!(material, Material::Hooke(_))).then_some((*material, tolerance));
        Self { rule, spare: false, precision, law, chart: OnceLock::new() }
    }

    /// The same rung for another material of a law, its chart not yet made.
    pub fn of(&self, material: &Material) -> Self {
        let law = self.law.map(|(_, tolerance)| (*material, tolerance));
        Self { law, chart: OnceLock::new(), ..*self }
    }

    /// The rungs for `tolerance`, cheapest first.
    pub fn ladder(precision: Precision, material: &Material, tolerance: f64) -> Vec<Self> {
        let rules = rule::ladder(precision, tolerance);
        let mut rungs: Vec<Self> =
            rules.into_iter().map(|rule| Self::new(rule, precision, material, tolerance)).collect();
        let finest = rule::smallest_tolerance(Precision::F64);
        if SPARE * tolerance >= finest {
            // A finer section chart covers a smaller range of strain. After f32 no other rung covers the rest: the chart is as fine as the tolerance.
            let fine = if precision == Precision::F32 { 1.0 } else { SPARE };
            let spare = |rule: &Rule| Self {
                spare: true,
                ..Self::new(*rule, Precision::F64, material, fine * tolerance)
            };
            rungs.extend(rule::ladder(Precision::F64, SPARE * tolerance).iter().map(spare));
        }
        rungs
    }

    /// Type of its numbers.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// True if taps with these effects climb it: sticking contacts lack precision in f32, others lack nodes.
    fn suits(&self, effects: &Effects) -> bool {
        effects.stick || !self.spare || self.rule.nodes > rule::every_rule(Precision::F64)[0].nodes
    }

    fn is_for_the_cpu(&self, solver: &dyn Solver) -> bool {
        self.spare || self.rule.full && !solver.has_full_newton()
    }

    /// Section law over the range of this rung, charted on first use: few taps climb.
    pub fn chart(&self) -> Option<&Chart> {
        let chart = || {
            let (material, tolerance) = self.law.as_ref()?;
            let (axial, bending) = rule::chart_range(self.precision, &self.rule);
            let errors = rule::chart_shares(self.precision, &self.rule).map(|share| share * tolerance);
            Chart::new(material, axial, bending, errors)
        };
        self.chart.get_or_init(chart).as_ref()
    }
}

/// A backend that solves batches of dimensionless taps.
pub trait Solver: Send {
    /// Solves every tap of `taps` into the same place of `out`.
    fn solve(&mut self, job: &Job<'_>, taps: &[Tap], out: &mut Vec<Solution>) -> Result<(), SolveError>;

    /// Most taps of one call.
    fn batch_limit(&self) -> usize;

    /// True if it has kernels for rungs of full Newton. Devices have none.
    fn has_full_newton(&self) -> bool {
        false
    }

    /// Place of the rung on which taps with these effects begin; the first, unless that rung does not pay.
    fn begin(&self, _effects: &Effects, _rungs: &[Rung]) -> usize {
        0
    }

    /// Its device, if any: for other kernels, and to rank.
    fn device(&mut self) -> Option<&mut gpu::Gpu> {
        None
    }
}

/// Share of the tolerance above which a tap climbs: with an offset force, estimates are up to three times too small.
pub(crate) fn trusted(effects: &Effects) -> f64 {
    match effects {
        effects if effects.offset => 0.3,
        effects if !effects.plain() => 0.6,
        _ => 1.0,
    }
}

/// The answer to keep after a finer rung. Estimates of full Newton are generous: converged, it beats an answer whose estimate is not trusted.
fn finer(old: &Solution, new: Solution, tolerance: f64) -> Solution {
    match (old.within(tolerance), new.within(10.0 * tolerance)) {
        (true, true) => Solution { error: new.error.min(old.error), ..new },
        (true, false) => *old,
        (false, _) => new,
    }
}

/// Solves `taps` on the first rung, then those whose error is near the tolerance on the next, and so on. `out` has the order of `taps`; a tap that no
/// rung solved keeps an `error` above the tolerance.
pub fn solve(
    solver: &mut dyn Solver,
    effects: Effects,
    rungs: &[Rung],
    tolerance: f64,
    taps: &[Tap],
    out: &mut Vec<Solution>,
) -> Result<(), SolveError> {
    out.clear();
    let trusted = trusted(&effects);
    let mut cpu = Cpu::new(Precision::F64);
    let mut part = Vec::new();
    // A rolling contact is solved on the CPU in f64: the small stretch that holds it is the difference of two rolled lengths.
    let double = |rung: &Rung| rung.precision == Precision::F64;
    let begin = match effects.rolls {
        true => rungs.iter().position(double).unwrap_or(rungs.len()),
        false => solver.begin(&effects, rungs),
    };
    let climbed = rungs[begin..].iter().filter(|rung| rung.suits(&effects));
    for (step, rung) in climbed.enumerate() {
        // A material that has ended has ended in any precision.
        let open = |s: &Solution| !(s.within(trusted * tolerance) || rung.spare && s.ended());
        let hard: Vec<usize> =
            (0..out.len()).into_par_iter().with_min_len(SCANNED).filter(|&i| open(&out[i])).collect();
        if step > 0 && hard.is_empty() {
            continue;
        }
        let alone = effects.rolls || rung.is_for_the_cpu(solver);
        let solver: &mut dyn Solver = if alone { &mut cpu } else { &mut *solver };
        let limit = solver.batch_limit();
        let share = if rung.spare { SPARE } else { 1.0 };
        let job = Job { effects, rule: &rung.rule, tolerance: share * tolerance, chart: rung.chart() };
        if step == 0 && taps.len() <= limit {
            solver.solve(&job, taps, out)?;
            continue;
        }
        if step == 0 {
            for chunk in taps.chunks(limit) {
                solver.solve(&job, chunk, &mut part)?;
                out.append(&mut part);
            }
            continue;
        }
        for indices in hard.chunks(limit) {
            let again: Vec<_> = indices.iter().map(|&i| taps[i]).collect();
            solver.solve(&job, &again, &mut part)?;
            for (&i, new) in indices.iter().zip(part.drain(..)) {
                let sweeps = out[i].sweeps + new.sweeps;
                out[i] = Solution { sweeps, ..finer(&out[i], new, tolerance) };
            }
        }
    }
    Ok(())
}
