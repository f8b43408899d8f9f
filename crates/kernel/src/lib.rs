//! The fast tap kernel: many small, independent taps, in lanes on the CPU or in invocations on the GPU.
//!
//! From the contact towards the base the rod is an initial value problem in two unknowns, the force P and the contact arc c. Angles are small and
//! smooth, so that the whole tap is one collocation/Picard loop on n Gauss–Legendre nodes ([`nodes`]): integrate the angle, integrate the position,
//! correct P and c from the two closure equations. The state is the *deviation from the linear solution*, so that K − 1, which is O(θ²), keeps its
//! full relative precision in f32. The derivation is in `cpu::exact`.
//!
//! Taps are dimensionless ([`Tap`]; unit of length is the contact distance, E drops out) and solved in batches by a [`Solver`], on a small rule
//! first; taps whose error estimate exceeds the tolerance climb to a larger one ([`Rule`]). The estimate includes the iteration, the truncation of the
//! rule, the section chart, and rounding of terms that cancel. What no rung solves, and an equilibrium at which the material may fail or that may not
//! lie on the path from the unloaded whisker, is left to the solver of every whisker.
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
mod onset;
pub mod ranking;
pub mod rule;
pub mod tap;

pub use chart::Chart;
use cpu::Cpu;
pub use effects::Effects;
pub use rule::Rule;
pub use tap::{Solution, Tap};
pub use vibrissa_core::physics::nodes;

use std::sync::{Arc, OnceLock};

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

/// The section law of a material over ranges of loads, each charted on first use; clones share the charts.
#[derive(Debug, Clone)]
pub struct Section {
    /// `None` for Hooke's law.
    law: Option<Material>,
    /// Largest loads, ascending, and errors of the charts.
    ranges: &'static [rule::Range],
    errors: [f64; 2],
    charts: Arc<[OnceLock<Option<Chart>>; rule::CHART_RANGES.len()]>,
}

impl Section {
    fn new(material: &Material, ranges: &'static [rule::Range], errors: [f64; 2]) -> Self {
        let law = Some(*material).filter(|material| !matches!(material, Material::Hooke(_)));
        Self { law, ranges, errors, charts: Arc::default() }
    }

    /// The same for another material.
    fn of(&self, material: &Material) -> Self {
        Self::new(material, self.ranges, self.errors)
    }

    fn over(&self, place: usize) -> Option<&Chart> {
        let (axial, bending) = self.ranges[place];
        let made = || Chart::new(&self.law?, axial, bending, self.errors);
        self.charts[place].get_or_init(made).as_ref()
    }

    /// The chart of the largest loads; `None` for Hooke's law, and where none can be fitted.
    pub fn chart(&self) -> Option<&Chart> {
        self.over(self.ranges.len() - 1)
    }

    /// Its charts from the smallest loads to the largest, of ranges where one can be fitted; none for Hooke's law.
    pub fn charts(&self) -> Vec<&Chart> {
        (0..self.ranges.len()).filter_map(|place| self.over(place)).collect()
    }
}

/// A rung of the kernel's ladder.
#[derive(Debug, Clone)]
pub struct Rung {
    /// Nodes, terms, sweeps.
    pub rule: Rule,
    precision: Precision,
    /// Section law over the range of this rung.
    pub section: Section,
}

/// Rungs and section law for taps of a material, to a tolerance.
#[derive(Debug, Clone)]
pub struct Ladder {
    /// Rungs of the kernel, cheapest first; after those in f32 come those in f64, for contacts that stick.
    pub rungs: Vec<Rung>,
    /// The section law over all ranges, for taps that the kernel does not solve.
    pub section: Section,
}

/// Share of the tolerance to which full Newton, sticking contacts and the section law of the whole range are solved: few taps use them.
const SPARE: f64 = 0.01;

const SCANNED: usize = 1 << 14;

impl Ladder {
    /// For taps in `precision`.
    pub fn new(precision: Precision, material: &Material, tolerance: f64) -> Self {
        let rungs = |precision, finest: f64| {
            rule::ladder(precision, finest).into_iter().map(move |rule| {
                let (range, shares) = rule::charted(precision, &rule);
                let section = Section::new(material, range, shares.map(|share| share * tolerance));
                Rung { rule, precision, section }
            })
        };
        let mut all: Vec<Rung> = rungs(precision, tolerance).collect();
        if precision == Precision::F32 {
            all.extend(rungs(Precision::F64, SPARE * tolerance));
        }
        // Next to the gauge's near end bending and the force along the whisker nearly cancel, which amplifies errors of the law.
        let fine = (SPARE * tolerance).max(rule::smallest_tolerance(Precision::F64)).min(tolerance);
        let section =
            Section::new(material, &rule::CHART_RANGES, rule::COARSE_SHARES.map(|share| share * fine));
        Self { rungs: all, section }
    }

    /// The same for another material of a law, its charts not yet made.
    pub fn of(&self, material: &Material) -> Self {
        let rung = |rung: &Rung| Rung { section: rung.section.of(material), ..rung.clone() };
        Self { rungs: self.rungs.iter().map(rung).collect(), section: self.section.of(material) }
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

    /// Its device, if any: for other kernels, and to rank.
    fn device(&mut self) -> Option<&mut gpu::Gpu> {
        None
    }
}

/// Share of the tolerance above which a tap climbs: with an offset force, estimates are up to three times too small.
fn trusted(effects: &Effects) -> f64 {
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

/// Solves `taps` on the first rung, then those whose error is near the tolerance on the next, and so on. `out` has the order of `taps`. Returns the error
/// up to which answers are to be believed: after full Newton the tolerance, else a share of it. Contacts that stick are solved on the CPU in f64, far
/// below the tolerance: the small stretch that holds them is a difference, which f32 loses for half of them.
pub fn solve(
    solver: &mut dyn Solver,
    effects: Effects,
    rungs: &[Rung],
    tolerance: f64,
    taps: &[Tap],
    out: &mut Vec<Solution>,
) -> Result<f64, SolveError> {
    out.clear();
    let (enough, limit) = (trusted(&effects) * tolerance, solver.batch_limit());
    let (mut cpu, mut part) = (Cpu::new(Precision::F64), Vec::new());
    let own = rungs.first().map_or(Precision::F64, |rung| rung.precision);
    let precision = if effects.stick { Precision::F64 } else { own };
    let fine = (SPARE * tolerance).max(rule::smallest_tolerance(Precision::F64)).min(tolerance);
    let mut believed = enough;
    for (step, rung) in rungs.iter().filter(|rung| rung.precision == precision).enumerate() {
        if rung.rule.full {
            believed = tolerance;
        }
        let open = |i: &usize| step > 0 && !out[*i].is_told(enough);
        let hard: Vec<usize> = (0..out.len()).into_par_iter().with_min_len(SCANNED).filter(open).collect();
        if taps.is_empty() || step > 0 && hard.is_empty() {
            continue;
        }
        let alone = effects.stick || rung.rule.full && !solver.has_full_newton();
        let solver: &mut dyn Solver = if alone { &mut cpu } else { &mut *solver };
        // Few taps take full Newton, and contacts that stick need more digits than f32 has.
        let goal = if rung.rule.full || precision != own { fine } else { tolerance };
        let job = Job { effects, rule: &rung.rule, tolerance: goal, chart: rung.section.chart() };
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
    Ok(believed)
}
