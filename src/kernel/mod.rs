//! The fast tap kernel: many small, independent taps, in lanes on the CPU or in invocations on the GPU.
//!
//! # Theory
//! From the contact towards the base the rod is an initial value problem in two unknowns, the force P and the contact
//! arc c. Angles are small and smooth, so that the whole tap is one collocation/Picard loop on n Gauss–Legendre nodes
//! ([`nodes`]): integrate the angle, integrate the position, correct P and c from the two closure equations.
//! What is carried is the *deviation from the linear solution*, so that K − 1, which is O(θ²), keeps its full
//! relative precision in f32. The derivation stands at the top of `cpu::exact`.
//!
//! # Practice
//! Taps are reduced to dimensionless groups ([`Tap`]; unit of length is the contact distance, E drops out), solved
//! in batches by one of the [`Solver`]s, and brought back to mm and N by `tap::Frame` in f64. A batch is solved on a
//! small rule first; the taps whose own error estimate exceeds the tolerance are solved again on a larger one
//! ([`Rule`]).
//!
//! # Cost
//! Counted on frictionless Hooke taps of 0.5–10°: 3381 flops a tap in f32 at 1e-5 (3.3 sweeps, 6 nodes), 8115 in f64 at 1e-8 (4.2 sweeps, 10
//! nodes), all rungs and the gauge together (`vibrissa bench`, `roofline.csv`).

pub mod chart;
pub mod cpu;
pub mod effects;
pub mod gpu;
pub mod nodes;
pub mod rule;
pub mod tap;

pub use chart::Chart;
pub use effects::{Effects, Kernel};
pub use rule::{Rule, ladder};
pub use tap::{Solution, Tap};

use crate::scene::{Material, Precision};

/// What one batch is solved with.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// Kernel.
    pub kernel: Kernel,
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
    /// Section law over the range of this rung.
    pub chart: Option<Chart>,
}

impl Rung {
    /// The rung of `rule` for `material`, at `tolerance`.
    pub fn new(rule: Rule, precision: Precision, material: &Material, tolerance: f64) -> Self {
        let (axial, bending) = rule::chart_range(precision, &rule);
        let errors = rule::chart_shares(precision, &rule).map(|share| share * tolerance);
        Self { rule, chart: Chart::new(material, axial, bending, errors) }
    }

    /// The rungs for `tolerance`, cheapest first.
    pub fn ladder(precision: Precision, material: &Material, tolerance: f64) -> Vec<Self> {
        let rules = rule::ladder(precision, tolerance);
        rules.into_iter().map(|rule| Self::new(rule, precision, material, tolerance)).collect()
    }
}

/// A backend that solves batches of dimensionless taps.
pub trait Solver: Send {
    /// Solves every tap of `taps` into the same place of `out`.
    fn solve(&mut self, job: &Job<'_>, taps: &[Tap<f64>], out: &mut Vec<Solution<f64>>)
    -> Result<(), String>;

    /// Taps that one call takes at most.
    fn batch_limit(&self) -> usize;

    /// The GPU it runs on, if it does.
    fn gpu(&self) -> Option<&gpu::Gpu> {
        None
    }
}

/// Share of the tolerance above which a tap's own error estimate sends it to the next rung. Where the force does not act
/// across the centreline, estimates are up to three times too small: contacts with friction next to the gauge.
fn trusted(kernel: Kernel) -> f64 {
    match kernel {
        Kernel::Exact(effects) if effects.offset => 0.3,
        Kernel::Exact(effects) if !effects.plain() => 0.6,
        _ => 1.0,
    }
}

/// What to believe of a tap after a finer rung. Estimates of full Newton are generous: where it converged it is nearer than an
/// answer whose own estimate is not trusted, even if it does not claim so.
fn finer(old: &Solution<f64>, new: Solution<f64>, tolerance: f64) -> Solution<f64> {
    match (old.within(tolerance), new.within(10.0 * tolerance)) {
        (true, true) => Solution { error: new.error.min(old.error), ..new },
        (true, false) => *old,
        (false, _) => new,
    }
}

/// Solves `taps` on the first rung, then those whose error is near the tolerance on the next, and so on. The order of `out` is
/// that of `taps`; a tap that no rung brought below the tolerance keeps an `error` above it.
pub fn solve(
    solver: &mut dyn Solver,
    kernel: Kernel,
    rungs: &[Rung],
    tolerance: f64,
    taps: &[Tap<f64>],
    out: &mut Vec<Solution<f64>>,
) -> Result<(), String> {
    out.clear();
    let (limit, trusted) = (solver.batch_limit(), trusted(kernel));
    let mut part = Vec::new();
    for (step, rung) in rungs.iter().enumerate() {
        let job = Job { kernel, rule: &rung.rule, tolerance, chart: rung.chart.as_ref() };
        if step == 0 {
            for chunk in taps.chunks(limit) {
                solver.solve(&job, chunk, &mut part)?;
                out.append(&mut part);
            }
            continue;
        }
        let hard: Vec<usize> = (0..out.len()).filter(|&i| !out[i].within(trusted * tolerance)).collect();
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
