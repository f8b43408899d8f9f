//! What the kernels compute, counted: the same generic code, run on numbers that note every operation.
//!
//! A crate of its own, compiled without optimisation: counting needs no speed, and nothing but the benchmark needs counting.

use std::cell::Cell;
use std::cmp::Ordering;
use std::sync::{Arc, Mutex};

use vibrissa_core::error::SolveError;
use vibrissa_kernel::cpu::{Scalar, one_by_one};
use vibrissa_kernel::{Job, Solution, Solver, Tap};

/// Arithmetic operations on the numbers of a kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Operations {
    /// Sums, differences, changes of sign.
    pub add: u64,
    /// Products.
    pub mul: u64,
    /// Fused a b + c.
    pub fma: u64,
    /// Quotients.
    pub div: u64,
    /// Square roots.
    pub sqrt: u64,
    /// Comparisons; each also selects one of two numbers.
    pub compare: u64,
}

impl Operations {
    /// Floating-point operations as peaks are counted: a fused one is two, a comparison none, all others one.
    pub fn flops(&self) -> u64 {
        self.add + self.mul + 2 * self.fma + self.div + self.sqrt
    }

    fn plus(&mut self, o: &Self) {
        self.add += o.add;
        self.mul += o.mul;
        self.fma += o.fma;
        self.div += o.div;
        self.sqrt += o.sqrt;
        self.compare += o.compare;
    }
}

thread_local! {
    static SEEN: Cell<Operations> = const { Cell::new(Operations { add: 0, mul: 0, fma: 0, div: 0, sqrt: 0, compare: 0 }) };
}

#[inline(never)]
fn note(f: fn(&mut Operations)) {
    SEEN.with(|seen| {
        let mut now = seen.get();
        f(&mut now);
        seen.set(now);
    });
}

/// An f64 that notes what is done with it. Constants cost nothing.
#[derive(Debug, Clone, Copy)]
pub struct Counted(f64);

impl PartialEq for Counted {
    fn eq(&self, o: &Self) -> bool {
        note(|n| n.compare += 1);
        self.0 == o.0
    }
}

impl PartialOrd for Counted {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        note(|n| n.compare += 1);
        self.0.partial_cmp(&o.0)
    }
}

impl Scalar for Counted {
    const ROUNDING: f64 = f64::ROUNDING;

    fn of(x: f64) -> Self {
        Self(x)
    }
    fn get(self) -> f64 {
        self.0
    }
    fn add(self, o: Self) -> Self {
        note(|n| n.add += 1);
        Self(self.0 + o.0)
    }
    fn sub(self, o: Self) -> Self {
        note(|n| n.add += 1);
        Self(self.0 - o.0)
    }
    fn mul(self, o: Self) -> Self {
        note(|n| n.mul += 1);
        Self(self.0 * o.0)
    }
    fn div(self, o: Self) -> Self {
        note(|n| n.div += 1);
        Self(self.0 / o.0)
    }
    fn sqrt(self) -> Self {
        note(|n| n.sqrt += 1);
        Self(self.0.sqrt())
    }
    fn fma(self, b: Self, c: Self) -> Self {
        note(|n| n.fma += 1);
        Self(self.0.mul_add(b.0, c.0))
    }
}

/// The CPU kernel in f64, one tap at a time on one thread, counting. What a tap costs others in its lanes, which wait for
/// the slowest, is not counted: these are the operations that the answers need.
#[derive(Debug, Clone, Default)]
pub struct Counter(Arc<Mutex<Operations>>);

impl Counter {
    /// Operations of all batches so far; clones of a counter share them.
    pub fn total(&self) -> Operations {
        *self.0.lock().unwrap_or_else(|e| e.into_inner())
    }
}

impl Solver for Counter {
    fn solve(
        &mut self,
        job: &Job<'_>,
        taps: &[Tap<f64>],
        out: &mut Vec<Solution<f64>>,
    ) -> Result<(), SolveError> {
        out.clear();
        out.resize(taps.len(), Solution::FAILED);
        SEEN.set(Operations::default());
        match job.rule.nodes {
            6 => one_by_one::<Counted, 6>(job, taps, out),
            10 => one_by_one::<Counted, 10>(job, taps, out),
            16 => one_by_one::<Counted, 16>(job, taps, out),
            24 => one_by_one::<Counted, 24>(job, taps, out),
            n => return Err(SolveError::Nodes(n)),
        }
        self.0.lock().unwrap_or_else(|e| e.into_inner()).plus(&SEEN.get());
        Ok(())
    }

    fn batch_limit(&self) -> usize {
        1 << 20
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vibrissa_kernel::{Effects, Rule, cpu::Pack};

    #[test]
    fn every_operation_is_seen_once() {
        let of = Pack::<Counted, 1, true>::of;
        SEEN.set(Operations::default());
        let x = of(2.0) + of(3.0) - of(1.0) * of(4.0) / of(5.0);
        let y = (-x).abs().sqrt().mul_add(of(1.0), x).max(of(0.0));
        let seen = SEEN.get();
        assert!(y.0[0].get().is_finite());
        // abs is a change of sign and a comparison.
        assert_eq!(seen, Operations { add: 4, mul: 1, fma: 1, div: 1, sqrt: 1, compare: 2 });
        assert_eq!(seen.flops(), 9);
    }

    /// More nodes cost what the formula says: two n × n products and the work at n nodes in every sweep.
    #[test]
    fn flops_grow_with_the_square_of_the_nodes() {
        let tap = Tap {
            taper: 0.3,
            rest: 0.7,
            angle: 0.1,
            near: 0.8,
            far: 0.75,
            width: 0.05,
            weight: 1.0,
            force: 0.21,
            strain: 0.03,
            shear: 0.01,
            pole_x: 1.0,
            ..Tap::default()
        };
        let flops = |effects: Effects, nodes: usize, sweeps: u32| {
            let rule = Rule { nodes, terms: 9, full: false, sweeps };
            let mut counter = Counter::default();
            // A tolerance that is never met: exactly `sweeps` sweeps.
            let job = Job { effects, rule: &rule, tolerance: 0.0, chart: None };
            let mut out = Vec::new();
            counter.solve(&job, &[tap], &mut out).unwrap();
            assert_eq!(out[0].sweeps, f64::from(sweeps));
            counter.total().flops() as f64
        };
        let sweep = |e, n| flops(e, n, 5) - flops(e, n, 4);
        let (off, shear) = (Effects::default(), Effects { shear: true, ..Effects::default() });
        for n in [6, 10, 16, 24] {
            let (per_sweep, more) = (sweep(off, n), flops(off, n, 9) - flops(off, n, 8));
            assert_eq!(per_sweep, more, "every sweep costs the same");
            println!("{n} nodes: {per_sweep} flops a sweep, {} once", flops(off, n, 4) - 4.0 * per_sweep);
        }
        // Second difference over 6, 10, 16 of one kernel: the coefficient of n², of two products of n² fused operations.
        let (a, b, c) = (sweep(shear, 6), sweep(shear, 10), sweep(shear, 16));
        let square = ((c - b) / 6.0 - (b - a) / 4.0) / 10.0;
        assert!((square - 4.0).abs() < 1e-9, "{square}");
    }
}
