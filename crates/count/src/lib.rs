//! What the kernels compute, counted: the same generic code, run on numbers that note every operation.
//!
//! A crate of its own, compiled with little optimisation: counting needs no speed, and nothing but the benchmark needs counting. (Not with none:
//! generic functions of the standard library are shared with the crates behind it, and their loops then call them one by one.)

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

/// The operations that `work` does on this thread.
pub fn seen(work: impl FnOnce()) -> Operations {
    let before = SEEN.replace(Operations::default());
    work();
    SEEN.replace(before)
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
        let kernel = match job.rule.nodes {
            6 => one_by_one::<Counted, 6>,
            10 => one_by_one::<Counted, 10>,
            16 => one_by_one::<Counted, 16>,
            24 => one_by_one::<Counted, 24>,
            n => return Err(SolveError::Nodes(n)),
        };
        let seen = seen(|| kernel(job, taps, out));
        self.0.lock().unwrap_or_else(|e| e.into_inner()).plus(&seen);
        Ok(())
    }

    fn batch_limit(&self) -> usize {
        1 << 20
    }
}
