//! A solver that is watched: how long its kernel takes, how many sweeps, and, for a single rung, what it answers when no tap is
//! turned away.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::error::SolveError;
use crate::kernel::gpu::Gpu;
use crate::kernel::{Job, Solution, Solver, Tap};

/// What a probed solver has spent.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spent {
    /// Seconds in the solver.
    pub seconds: f64,
    /// Sweeps of all taps.
    pub sweeps: f64,
}

/// The account of a probe; clones share it.
#[derive(Debug, Clone, Default)]
pub struct Account(Arc<Mutex<Spent>>);

impl Account {
    /// What was spent since the last call.
    pub fn take(&self) -> Spent {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(|e| e.into_inner()))
    }
}

/// Passes everything on to `inner`.
pub struct Probe {
    inner: Box<dyn Solver>,
    /// Solve to this tolerance whatever is asked, and let every finite solution pass.
    alone: Option<f64>,
    account: Account,
}

impl Probe {
    /// Watches `inner`; with `alone`, as the only rung, solved to that tolerance.
    pub fn new(inner: Box<dyn Solver>, alone: Option<f64>) -> (Self, Account) {
        let account = Account::default();
        (Self { inner, alone, account: account.clone() }, account)
    }
}

impl Solver for Probe {
    fn solve(
        &mut self,
        job: &Job<'_>,
        taps: &[Tap<f64>],
        out: &mut Vec<Solution<f64>>,
    ) -> Result<(), SolveError> {
        let job = Job { tolerance: self.alone.unwrap_or(job.tolerance), ..*job };
        let start = Instant::now();
        self.inner.solve(&job, taps, out)?;
        let seconds = start.elapsed().as_secs_f64();
        let mut spent = self.account.0.lock().unwrap_or_else(|e| e.into_inner());
        spent.seconds += seconds;
        spent.sweeps += out.iter().map(|s| s.sweeps).sum::<f64>();
        if self.alone.is_some() {
            out.iter_mut().for_each(|s| s.error = 0.0);
        }
        Ok(())
    }

    fn device(&mut self) -> Option<&mut Gpu> {
        self.inner.device()
    }

    fn has_full_newton(&self) -> bool {
        self.inner.has_full_newton()
    }

    fn batch_limit(&self) -> usize {
        self.inner.batch_limit()
    }
}
