//! Batches on a device: upload, dispatch, read-back. A [watched](Gpu::watched) device serves until its first fault: an answer not written, or
//! different from the CPU's; a call that fails, panics or hangs. The CPU then solves that batch and all later ones.

use std::collections::HashMap;

use rayon::prelude::*;

use super::adapter::Adapter;
use super::check::{Passed, compare};
use super::device::Device;
use super::log::Log;
use super::ranking::DeviceRanker;
use super::shader::{Variant, WORKGROUP};
use crate::cpu::Cpu;
use crate::ranking::{OnCpu, Sheet};
use crate::rule::limits::LOST;
use crate::{Job, Solution, Solver, Tap};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::{Layout, Precision};

/// Taps of one dispatch: some milliseconds of work on a slow device, far below any watchdog.
const BATCH: usize = 1 << 18;

/// Least numbers per host thread in conversions.
pub(super) const GRAIN: usize = 1 << 12;

/// A device with its compiled pipelines and buffers.
#[derive(Debug)]
pub struct Gpu {
    device: Device,
    precision: Precision,
    pipelines: HashMap<String, wgpu::ComputePipeline>,
    /// Count, taps, answers and read-back of the last batch.
    buffers: [Option<wgpu::Buffer>; 4],
    cpu: Cpu,
    /// Faults and checks, if the device is watched.
    log: Option<Log>,
    given_up: bool,
}

impl Gpu {
    /// Opens `adapter`; fails where `precision` is f64 and its shaders have none.
    pub fn new(adapter: Adapter, precision: Precision) -> Result<Self, SolveError> {
        let device = Device::open(adapter, precision == Precision::F64)?;
        let (pipelines, buffers, cpu) = (HashMap::new(), Default::default(), Cpu::new(precision));
        Ok(Self { device, precision, pipelines, buffers, cpu, log: None, given_up: false })
    }

    /// Compares some answers of each batch with the CPU, which takes over at the first fault; logs to `log`.
    pub fn watched(self, log: Log) -> Self {
        Self { log: Some(log), ..self }
    }

    /// Leaves the device: the CPU solves from here on, `taps` of this batch.
    pub fn give_up(&mut self, why: &str, taps: usize) {
        self.given_up = true;
        if let Some(log) = &self.log {
            log.handed_over(taps);
            log.say(format!("{}: {why}: the CPU solves from here on", self.device.adapter.name));
        }
    }

    /// The result of `call` for `taps` taps, if `compare` passes; `None` where the CPU must answer.
    fn attempt<T>(
        &mut self,
        taps: usize,
        call: impl FnOnce(&mut Self) -> Result<T, SolveError>,
        compare: impl FnOnce(&T) -> Result<Passed, SolveError>,
    ) -> Result<Option<T>, SolveError> {
        let Some(log) = self.log.clone() else { return call(self).map(Some) };
        if self.given_up {
            log.handed_over(taps);
            return Ok(None);
        }
        let done = call(self).and_then(|found| compare(&found).map(|passed| (found, passed)));
        match done {
            Ok((found, passed)) => {
                log.agreed(passed);
                Ok(Some(found))
            }
            Err(SolveError::Device(why)) => {
                self.give_up(&why, taps);
                Ok(None)
            }
            Err(other) => Err(other),
        }
    }

    /// Buffer `slot` of the last batch, replaced if too small.
    fn buffer(&mut self, slot: usize, size: usize, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let kept = self.buffers[slot].take().filter(|kept| kept.size() >= size as u64);
        let most = self.device.adapter.max_binding as usize;
        let buffer =
            kept.unwrap_or_else(|| self.device.buffer(size.next_power_of_two().min(most).max(size), usage));
        self.buffers[slot] = Some(buffer.clone());
        buffer
    }

    fn uploaded(&mut self, numbers: &[f64]) -> wgpu::Buffer {
        use wgpu::BufferUsages as U;
        let buffer = self.buffer(1, size_of_val(numbers), U::STORAGE | U::COPY_DST);
        match self.precision {
            Precision::F64 => self.device.write(&buffer, bytemuck::cast_slice(numbers)),
            Precision::F32 => {
                let narrow: Vec<f32> = numbers.par_iter().with_min_len(GRAIN).map(|x| *x as f32).collect();
                self.device.write(&buffer, bytemuck::cast_slice(&narrow));
            }
        }
        buffer
    }

    /// Numbers of the answers to `taps`, one answer after the other. Bindings: 0 uniform `vec4<u32>` (count), 1 taps, 2 answers.
    fn answers(&mut self, job: &Job<'_>, taps: &[Tap]) -> Result<Vec<f64>, SolveError> {
        let variant = Variant { job: *job, precision: self.precision };
        let (wgsl, count, words) = (variant.wgsl(), taps.len(), Solution::<f64>::FIELDS.len());
        let pipeline = match self.pipelines.get(&wgsl) {
            Some(pipeline) => pipeline.clone(),
            None => {
                let pipeline = self.device.compile(&variant.name(), &wgsl, true)?;
                self.pipelines.insert(wgsl, pipeline.clone());
                pipeline
            }
        };
        use wgpu::BufferUsages as U;
        let word = if self.precision == Precision::F32 { 4 } else { 8 };
        let bytes = count * words * word;
        let head = self.buffer(0, 16, U::UNIFORM | U::COPY_DST);
        self.device.write(&head, bytemuck::bytes_of(&[count as u32, 0, 0, 0]));
        let taps = self.uploaded(bytemuck::cast_slice(taps));
        let answers = self.buffer(2, bytes, U::STORAGE | U::COPY_SRC | U::COPY_DST);
        let readback = self.buffer(3, bytes, U::MAP_READ | U::COPY_DST);
        self.device.heard()?;
        let copy = (&answers, &readback, bytes);
        let at = self.device.submit(&pipeline, &[&head, &taps, &answers], count as u32, &[&answers], copy);
        let numbers: Vec<f64> = self.device.read(&readback, bytes, at, |view| match word {
            8 => bytemuck::pod_collect_to_vec(view),
            _ => {
                let narrow: Vec<f32> = bytemuck::pod_collect_to_vec(view);
                narrow.par_iter().with_min_len(GRAIN).map(|x| f64::from(*x)).collect()
            }
        })?;
        match numbers.chunks_exact(words).filter(|answer| answer[SWEEPS] == 0.0).count() {
            0 => Ok(numbers),
            n => Err(SolveError::Device(format!("{n} of {count} answers were not written"))),
        }
    }

    fn solved(&mut self, job: &Job<'_>, taps: &[Tap]) -> Result<Vec<Solution>, SolveError> {
        let numbers = self.answers(job, taps)?;
        let read = |answer: &[f64]| match answer.iter().all(|x| x.is_finite()) {
            true => Solution::gather(|k| answer.get(k).copied().unwrap_or(0.0)),
            false => Solution { error: LOST, sweeps: answer[SWEEPS], ..Solution::default() },
        };
        Ok(numbers.par_chunks_exact(Solution::<f64>::FIELDS.len()).with_min_len(GRAIN).map(read).collect())
    }

    /// Ranks the designs of `layout` by charts as a `sheet`, if it ranks them as `on_cpu` does; `None` where they do not fit, or the CPU must rank.
    /// Errors: a device that is not watched and fails.
    pub fn ranking(
        &mut self,
        sheet: impl FnOnce() -> Option<Sheet>,
        layout: &Layout,
        on_cpu: &OnCpu<'_>,
    ) -> Result<Option<DeviceRanker>, SolveError> {
        let Some(sheet) = self.device.adapter.ranks().then(sheet).flatten() else { return Ok(None) };
        let call = |gpu: &mut Self| DeviceRanker::new(&gpu.device, &sheet, layout, on_cpu);
        Ok(self.attempt(0, call, |_| Ok(Passed::default()))?.flatten())
    }
}

const SWEEPS: usize = std::mem::offset_of!(Solution<f32>, sweeps) / 4;

impl Solver for Gpu {
    fn solve(&mut self, job: &Job<'_>, taps: &[Tap], out: &mut Vec<Solution>) -> Result<(), SolveError> {
        out.clear();
        if taps.is_empty() {
            return Ok(());
        }
        match self.attempt(taps.len(), |gpu| gpu.solved(job, taps), |found| compare(job, taps, found))? {
            Some(found) => *out = found,
            None => self.cpu.solve(job, taps, out)?,
        }
        Ok(())
    }

    fn batch_limit(&self) -> usize {
        let adapter = &self.device.adapter;
        let by_binding = adapter.max_binding as usize / size_of::<Tap>();
        BATCH.min(by_binding).min(adapter.max_workgroups as usize * WORKGROUP as usize)
    }

    fn device(&mut self) -> Option<&mut Gpu> {
        Some(self)
    }
}
