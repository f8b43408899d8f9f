//! A device that is watched: it answers only with kernels that have passed the self-check, a batch that fails is tried once more on the
//! device opened anew, and then handed over to the CPU. Some answers of each batch are compared with those of the CPU; where one is wrong, the device is not
//! used again.

use std::collections::HashSet;
use std::sync::Arc;

use super::adapter::Adapter;
use super::check::{Passed, check, compare};
use super::compute::Program;
use super::dispatch::{Gpu, Kernel};
use super::fault::{Fault, Log, quietly};
use super::ranking::Ranker;
use crate::cpu::Cpu;
use crate::ranking::{Charts, DeviceRanking, Ranking};
use crate::{Job, Solution, Solver, Tap};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::{Layout, Precision};

/// Batches handed over after which a device is given up.
const STRIKES: u32 = 3;

/// Taps below which a batch is not made smaller.
const LEAST: usize = 1 << 10;

/// Answers of a batch that are left to the reference at most.
const FEW: usize = 1 << 10;

/// Verdicts of self-checks of one adapter with one driver, by the WGSL text of the kernel.
pub trait Verdicts: Send + Sync {
    /// Whether anything is to be checked at all, or compared.
    fn wanted(&self) -> bool;
    /// Whether this kernel has passed before.
    fn known(&self, text: &str) -> bool;
    /// Keeps that it has passed.
    fn keep(&self, text: &str, passed: &Passed);
}

/// A GPU with what to do when it fails.
pub struct Watched {
    adapter: Adapter,
    precision: Precision,
    gpu: Option<Gpu>,
    cpu: Cpu,
    verdicts: Arc<dyn Verdicts>,
    /// Texts of the kernels that have passed.
    passed: HashSet<Arc<str>>,
    log: Log,
    limit: usize,
    strikes: u32,
}

impl std::fmt::Debug for Watched {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watched").field("gpu", &self.gpu).field("log", &self.log).finish_non_exhaustive()
    }
}

/// How a batch ended.
enum Done {
    /// With an answer for each tap.
    Answered,
    /// It was too large.
    Again,
}

impl Watched {
    /// The device `gpu`; what happens goes to `log`.
    pub fn new(gpu: Gpu, verdicts: Arc<dyn Verdicts>, log: Log) -> Self {
        Self {
            adapter: gpu.adapter().clone(),
            precision: gpu.precision(),
            cpu: Cpu::new(gpu.precision()),
            limit: gpu.batch_limit(),
            gpu: Some(gpu),
            verdicts,
            passed: HashSet::new(),
            log,
            strikes: 0,
        }
    }

    /// Whether the kernel of `job` is right on this device; known taps are solved, unless it has passed before.
    ///
    /// # Errors
    /// Wrong answers, with figures; a device that fails.
    pub fn admit(&mut self, job: &Job<'_>) -> Result<(), Fault> {
        let admitted = self.admitted(job).map(drop);
        if let Err(fault @ Fault::Slow(_)) = &admitted {
            self.give_up(fault);
        }
        admitted
    }

    /// Leaves the device, whose driver is still at work, and hands over to the CPU whatever comes.
    fn give_up(&mut self, fault: &Fault) {
        self.log.say(format!("{}: {fault}: the CPU ranks and solves from here on", self.adapter.name));
        self.strikes = STRIKES;
        // To close it would wait for its driver.
        std::mem::forget(self.gpu.take());
    }

    /// The kernel of `job`, which is right on this device.
    fn admitted(&mut self, job: &Job<'_>) -> Result<Kernel, Fault> {
        let gpu = self.gpu.as_mut().ok_or_else(|| Fault::Lost("it does not open".into()))?;
        let kernel = gpu.kernel(job)?;
        if self.passed.contains(&kernel.text) || !self.verdicts.wanted() {
            return Ok(kernel);
        }
        if self.verdicts.known(&kernel.text) {
            self.log.note(|told| {
                told.self_checked_kernels += 1;
                told.self_checked_before += 1;
            });
        } else {
            let passed = check(gpu, &kernel, job)?;
            self.verdicts.keep(&kernel.text, &passed);
            self.log.note(|told| {
                told.self_checked_kernels += 1;
                told.self_check_worst = told.self_check_worst.max(passed.worst);
            });
        }
        self.passed.insert(kernel.text.clone());
        Ok(kernel)
    }

    /// The device gives it up after `fault`, and is opened again if it can be.
    fn reopen(&mut self, fault: &Fault) {
        let old = self.gpu.take();
        if let Fault::Late(_) = fault {
            // Its driver waits for what does not end.
            std::mem::forget(old);
        } else {
            // One that is lost may panic here once more.
            let _ = quietly(|| drop(old));
        }
        if self.strikes < STRIKES {
            // A driver that has failed once may fail in any way.
            self.gpu = Gpu::new(self.adapter.clone(), self.precision).ok();
            self.log.note(|told| told.reopened += u64::from(self.gpu.is_some()));
        }
    }

    /// After `fault` in a batch of so many `taps`: the device is opened again to try once more, or after the `last` try for what comes.
    fn strike(&mut self, fault: &Fault, last: bool, taps: usize) {
        if let Fault::Slow(_) = fault {
            return self.give_up(fault);
        }
        let next = if last { "handed over to the CPU" } else { "tried once more" };
        self.log.say(format!("{}: {fault}: a batch of {taps} taps was {next}", self.adapter.name));
        self.strikes += u32::from(last);
        self.reopen(fault);
    }

    /// One try; `last` leaves the answers that are missing to the reference, if they are few.
    fn attempt(
        &mut self,
        (job, last): (&Job<'_>, bool),
        taps: &[Tap],
        out: &mut Vec<Solution>,
    ) -> Result<(), Fault> {
        let kernel = self.admitted(job)?;
        let gpu = self.gpu.as_mut().ok_or_else(|| Fault::Lost("it does not open".into()))?;
        let unwritten = gpu.batch(&kernel, taps, out)?;
        let mut left = 0;
        for s in out.iter_mut() {
            let finite = s.values().iter().all(|x| x.is_finite());
            left += usize::from(!finite);
            if !finite {
                *s = Solution::UNWRITTEN;
            }
        }
        if left > FEW || unwritten > 0 && !last {
            return Err(Fault::Damaged(left, taps.len()));
        }
        self.log.note(|told| told.recomputed_taps += left as u64);
        if unwritten > 0 {
            self.strikes += 1;
            self.log.say(format!("{}; they were left to the reference", Fault::Damaged(left, taps.len())));
        }
        if self.compares() {
            self.agreed(&compare(job, taps, out)?);
        }
        Ok(())
    }

    fn batch(&mut self, job: &Job<'_>, taps: &[Tap], out: &mut Vec<Solution>) -> Result<Done, SolveError> {
        for last in [false, true] {
            if self.gpu.is_none() {
                break;
            }
            match self.attempt((job, last), taps, out) {
                Ok(()) => return Ok(Done::Answered),
                Err(Fault::Solve(e @ SolveError::Nodes(_))) => return Err(e),
                Err(Fault::Memory) if taps.len() > LEAST => {
                    self.limit = (taps.len() / 2).max(LEAST);
                    self.log.note(|told| told.smaller_batches += 1);
                    let (name, from, to) = (&self.adapter.name, taps.len(), self.limit);
                    self.log
                        .say(format!("{name}: out of memory with {from} taps: batches of {to} from here"));
                    return Ok(Done::Again);
                }
                Err(fault @ Fault::Wrong(_)) => self.refuse(&fault.to_string(), 0),
                Err(fault) => self.strike(&fault, last, taps.len()),
            }
        }
        self.log.note(|told| told.handed_over_taps += taps.len() as u64);
        self.cpu.solve(job, taps, out).map(|()| Done::Answered)
    }
}

impl Solver for Watched {
    fn solve(&mut self, job: &Job<'_>, taps: &[Tap], out: &mut Vec<Solution>) -> Result<(), SolveError> {
        out.clear();
        let (mut rest, mut part) = (taps, Vec::new());
        while !rest.is_empty() {
            let (now, later) = rest.split_at(rest.len().min(self.limit));
            if let Done::Answered = self.batch(job, now, &mut part)? {
                out.append(&mut part);
                rest = later;
            }
        }
        Ok(())
    }

    fn computes(&self) -> bool {
        true
    }

    fn compares(&self) -> bool {
        self.verdicts.wanted()
    }

    fn agreed(&mut self, passed: &Passed) {
        self.log.note(|told| {
            told.compared_taps += passed.taps as u64;
            told.compared_worst = told.compared_worst.max(passed.worst);
        });
    }

    fn compute(&mut self, program: &Program<'_>) -> Result<Option<Vec<f64>>, SolveError> {
        for last in [false, true] {
            let Some(gpu) = self.gpu.as_mut() else { break };
            match gpu.compute(program) {
                Ok(numbers) => return Ok(Some(numbers)),
                Err(fault) => self.strike(&fault, last, program.count),
            }
        }
        self.log.note(|told| told.handed_over_taps += program.count as u64);
        Ok(None)
    }

    fn refuse(&mut self, why: &str, taps: usize) {
        self.log.note(|told| told.handed_over_taps += taps as u64);
        self.log.say(format!("{}: {why}: the CPU solves from here on", self.adapter.name));
        self.strikes = STRIKES;
        self.gpu = None;
    }

    fn batch_limit(&self) -> usize {
        self.limit
    }

    fn ranking(&mut self, charts: &dyn Charts, layout: &Layout) -> DeviceRanking {
        let Some(gpu) = self.gpu.as_ref().filter(|gpu| gpu.adapter().ranks()) else { return Ok(None) };
        match Ranker::new(gpu, charts, layout) {
            Ok(ranker) => return Ok(ranker.map(|ranker| Box::new(ranker) as Box<dyn Ranking>)),
            Err(fault @ Fault::Slow(_)) => self.give_up(&fault),
            Err(fault) => self.log.say(format!("{}: {fault}: the CPU ranks", self.adapter.name)),
        }
        Ok(None)
    }

    fn failed(&mut self, why: &SolveError) {
        self.log.say(format!("{}: {why}, while it ranked", self.adapter.name));
        self.reopen(&Fault::Lost(why.to_string()));
    }
}
