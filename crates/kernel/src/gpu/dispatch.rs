//! Upload, dispatch, read-back.
//!
//! Every answer comes back sealed ([`seal`]): with a check of its bits, its place and its batch in the number of sweeps. One that was not
//! written, that is of another batch or place, or of which a bit has turned since it was computed, is found by its seal.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rayon::prelude::*;

use super::compute::Program;
use super::ranking::Ranker;
use super::{
    adapter::Adapter,
    clock::within,
    fault::{Fault, quietly},
    lie::{Kind, Lie},
    seal::unseal,
    shader::{Variant, WORKGROUP, validate},
};
use crate::ranking::{Charts, DeviceRanking, Ranking};
use crate::{Job, Solution, Solver, Tap};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::{Layout, Precision};

/// Taps of one dispatch: some milliseconds of work on a slow device, far below any watchdog.
const BATCH: usize = 1 << 18;

/// Taps that a thread of the host takes at least, to hand them over or to read their answers.
pub(super) const GRAIN: usize = 1 << 12;

/// Bound on the time of a dispatch and of compiling a kernel: thousands of times what a dispatch takes, and far more than lavapipe needs
/// for its slowest kernel on two busy cores.
const PATIENCE: Duration = Duration::from_secs(60);

/// A device with its compiled pipelines and buffers.
#[derive(Debug)]
pub struct Gpu {
    adapter: Adapter,
    precision: Precision,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// By WGSL text.
    pub(super) pipelines: HashMap<Arc<str>, wgpu::ComputePipeline>,
    buffers: Option<Buffers>,
    /// Dispatches so far.
    pub(super) stamp: u32,
    /// What the driver said that nothing else has asked for.
    mishap: Mishap,
}

/// What a driver says on its own.
type Mishap = Arc<Mutex<Option<Fault>>>;

/// A kernel compiled for a device.
#[derive(Debug, Clone)]
pub(super) struct Kernel {
    pub text: Arc<str>,
    /// Whether its answers have the fields of `spatial` effects.
    spatial: bool,
    pipeline: wgpu::ComputePipeline,
}

#[derive(Debug)]
struct Buffers {
    /// Taps they hold.
    capacity: usize,
    batch: wgpu::Buffer,
    taps: wgpu::Buffer,
    solutions: wgpu::Buffer,
    readback: wgpu::Buffer,
}

impl Gpu {
    /// Opens `adapter`; fails where `precision` is f64 and its shaders have none.
    pub fn new(adapter: Adapter, precision: Precision) -> Result<Self, SolveError> {
        let (device, queue) = adapter.open(precision == Precision::F64)?;
        let mishap = Mishap::default();
        let heard = Arc::clone(&mishap);
        let hear = move |fault| {
            heard.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(fault);
        };
        let lost = hear.clone();
        device.set_device_lost_callback(move |_, words| lost(Fault::Lost(words)));
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| match e {
            wgpu::Error::OutOfMemory { .. } => hear(Fault::Memory),
            other => hear(Fault::Lost(other.to_string())),
        }));
        let (pipelines, buffers, stamp) = (HashMap::new(), None, 0);
        Ok(Self { adapter, precision, device, queue, pipelines, buffers, stamp, mishap })
    }

    /// Fails with what the driver has said on its own.
    pub(super) fn heard(&self) -> Result<(), Fault> {
        heard(&self.mishap)
    }

    pub(super) fn mishap(&self) -> Mishap {
        Arc::clone(&self.mishap)
    }

    /// The adapter in use.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Handles of the device and its queue.
    pub fn handles(&self) -> (wgpu::Device, wgpu::Queue) {
        (self.device.clone(), self.queue.clone())
    }

    /// Type of every number.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Bytes of one number.
    pub(super) fn word(&self) -> usize {
        match self.precision {
            Precision::F32 => 4,
            Precision::F64 => 8,
        }
    }

    /// The kernel of `job`, compiled on first use.
    ///
    /// # Errors
    /// Full Newton, which devices do not have.
    pub(super) fn kernel(&mut self, job: &Job<'_>) -> Result<Kernel, Fault> {
        if job.rule.full {
            return Err(SolveError::Device("devices have no kernel of full Newton".into()).into());
        }
        let variant = Variant { job: *job, precision: self.precision };
        let (name, wgsl) = (variant.name(), variant.wgsl());
        if let Some((text, pipeline)) = self.pipelines.get_key_value(wgsl.as_str()) {
            return Ok(Kernel {
                text: Arc::clone(text),
                spatial: job.effects.spatial,
                pipeline: pipeline.clone(),
            });
        }
        let pipeline = self.compile(&name, &wgsl)?;
        self.heard()?;
        let text: Arc<str> = wgsl.into();
        self.pipelines.insert(Arc::clone(&text), pipeline.clone());
        Ok(Kernel { text, spatial: job.effects.spatial, pipeline })
    }

    /// A compute pipeline from the WGSL text `wgsl`, whose entry point is `main`.
    ///
    /// # Errors
    /// A text that the driver refuses; one that it does not compile in time ([`Fault::Slow`]), after which the device is not to be used.
    pub(super) fn compile(&self, name: &str, wgsl: &str) -> Result<wgpu::ComputePipeline, Fault> {
        validate(name, wgsl)?;
        let stalls = self.adapter.lie.as_ref().is_some_and(|lie| lie.stalls());
        let patience = if stalls { Duration::ZERO } else { PATIENCE };
        let what = format!("compiling kernel {name} on {}", self.adapter.name);
        let (device, label, text) = (self.device.clone(), name.to_owned(), wgsl.to_owned());
        let compiled = within(patience, &what, move || pipeline(&device, &label, &text));
        let refused = |e| SolveError::Device(format!("shader {name} on {}: {e}", self.adapter.name)).into();
        compiled.filter(|_| !stalls).ok_or(Fault::Slow(patience))?.map_err(refused)
    }

    /// Buffers for `count` taps, made anew where the last are too small.
    fn reserve(&mut self, count: usize) -> Result<(), Fault> {
        let word = self.word();
        if self.buffers.as_ref().is_none_or(|b| b.capacity < count) {
            let capacity = count.next_power_of_two().min(self.batch_limit()).max(count);
            // Room for the larger ones is made of that of the smaller.
            self.buffers = None;
            let buffer = |label, bytes: usize, usage| buffer(&self.device, label, bytes as u64, usage);
            use wgpu::BufferUsages as U;
            let (taps, solutions) = (capacity * word * TAP_WORDS, capacity * word * SOLUTION_WORDS);
            let made = Buffers {
                capacity,
                batch: buffer("batch", 16, U::UNIFORM | U::COPY_DST),
                taps: buffer("taps", taps, U::STORAGE | U::COPY_DST),
                solutions: buffer("solutions", solutions, U::STORAGE | U::COPY_SRC),
                readback: buffer("readback", solutions, U::MAP_READ | U::COPY_DST),
            };
            self.heard()?;
            self.buffers = Some(made);
        }
        Ok(())
    }

    /// Solves `taps`, no more than [`Solver::batch_limit`] and not none, into the same places of `out`; how many answers were not
    /// written. In their places stands [`Solution::UNWRITTEN`].
    pub(super) fn batch(
        &mut self,
        kernel: &Kernel,
        taps: &[Tap],
        out: &mut Vec<Solution>,
    ) -> Result<usize, Fault> {
        quietly(|| self.dispatched(kernel, taps, out)).map_err(Fault::Lost)?
    }

    fn dispatched(&mut self, kernel: &Kernel, taps: &[Tap], out: &mut Vec<Solution>) -> Result<usize, Fault> {
        out.clear();
        let (precision, count, word) = (self.precision, taps.len(), self.word());
        let lie = self.adapter.lie.clone();
        let told = lie.as_ref().and_then(|lie| lie.next());
        if matches!(told, Some(Kind::Room(room)) if count > room) {
            return Err(Fault::Memory);
        }
        self.reserve(count)?;
        self.stamp = self.stamp.wrapping_add(1);
        let buffers = self.buffers.as_ref().expect("reserved");
        self.queue.write_buffer(&buffers.batch, 0, bytemuck::bytes_of(&[count as u32, self.stamp, 0, 0]));
        let spoiled = |t: &Tap| if told == Some(Kind::Wrong) { t.map(|x| 1.01 * x) } else { *t };
        match precision {
            Precision::F32 => {
                let narrow: Vec<Tap<f32>> =
                    taps.par_iter().with_min_len(GRAIN).map(|t| spoiled(t).map(|x| x as f32)).collect();
                self.queue.write_buffer(&buffers.taps, 0, bytemuck::cast_slice(&narrow));
            }
            Precision::F64 if told.is_none() => {
                self.queue.write_buffer(&buffers.taps, 0, bytemuck::cast_slice(taps));
            }
            Precision::F64 => {
                let all: Vec<Tap> = taps.iter().map(spoiled).collect();
                self.queue.write_buffer(&buffers.taps, 0, bytemuck::cast_slice(&all));
            }
        }
        let answer = Solution::<f32>::words(kernel.spatial) * word;
        let bytes = (count * answer) as u64;
        let at = submit(
            (&self.device, &self.queue),
            ("taps", &kernel.pipeline),
            &[&buffers.batch, &buffers.taps, &buffers.solutions],
            count as u32,
            (&buffers.solutions, &buffers.readback, bytes),
            told,
        );
        assert!(told != Some(Kind::Panic), "the device was lost while it was waited for");
        wait(&self.device, (&buffers.readback, bytes), at, told == Some(Kind::Hang), &self.mishap)?;
        let view = buffers.readback.get_mapped_range(0..bytes).map_err(lost)?;
        let stamp = self.stamp;
        let unwritten = match lie {
            None => unseal(precision, &view, (stamp, kernel.spatial), out),
            Some(lie) => {
                let mut copy = view.to_vec();
                lie.spoil(told, &mut copy, WORKGROUP as usize * answer, word);
                unseal(precision, &copy, (stamp, kernel.spatial), out)
            }
        };
        drop(view);
        buffers.readback.unmap();
        if let Some(Kind::Off(_)) = told {
            out.iter_mut().for_each(|s| *s = Solution::gather(|k| Lie::off(told, k, s.values()[k])));
        }
        Ok(unwritten)
    }
}

/// A pipeline of the validated text `wgsl`, in words why there is none.
fn pipeline(device: &wgpu::Device, name: &str, wgsl: &str) -> Result<wgpu::ComputePipeline, String> {
    // Scopes belong to a thread: it begins and ends on this one.
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let source =
        wgpu::ShaderModuleDescriptor { label: Some(name), source: wgpu::ShaderSource::Wgsl(wgsl.into()) };
    // SAFETY: the text is ours and validated; its loops are bounded by constants and its indices by array lengths.
    let module =
        unsafe { device.create_shader_module_trusted(source, wgpu::ShaderRuntimeChecks::unchecked()) };
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    pollster::block_on(scope.pop()).map_or(Ok(pipeline), |e| Err(e.to_string()))
}

const TAP_WORDS: usize = size_of::<Tap<f32>>() / 4;
const SOLUTION_WORDS: usize = size_of::<Solution<f32>>() / 4;

impl Solver for Gpu {
    fn solve(&mut self, job: &Job<'_>, taps: &[Tap], out: &mut Vec<Solution>) -> Result<(), SolveError> {
        out.clear();
        if taps.is_empty() {
            return Ok(());
        }
        let kernel = self.kernel(job)?;
        match self.batch(&kernel, taps, out)? {
            0 => Ok(()),
            n => Err(Fault::Damaged(n, taps.len()).into()),
        }
    }

    fn computes(&self) -> bool {
        true
    }

    fn compute(&mut self, program: &Program<'_>) -> Result<Option<Vec<f64>>, SolveError> {
        Ok(Some(Self::compute(self, program)?))
    }

    fn ranking(&mut self, charts: &dyn Charts, layout: &Layout) -> DeviceRanking {
        if !self.adapter.ranks() {
            return Ok(None);
        }
        Ok(Ranker::new(self, charts, layout)?.map(|ranker| Box::new(ranker) as Box<dyn Ranking>))
    }

    fn batch_limit(&self) -> usize {
        let bytes = self.word() * TAP_WORDS.max(SOLUTION_WORDS);
        let by_binding = (self.adapter.max_binding / bytes as u64) as usize;
        let by_groups = self.adapter.max_workgroups as usize * WORKGROUP as usize;
        BATCH.min(by_binding).min(by_groups)
    }
}

fn heard(mishap: &Mishap) -> Result<(), Fault> {
    mishap.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
}

/// A fault that the driver tells in its own words.
pub(super) fn lost(why: impl std::fmt::Display) -> Fault {
    Fault::Lost(why.to_string())
}

/// Waits until the submission `at` is done and the first `bytes` of `readback` are mapped, not longer than [`PATIENCE`]; not at
/// all for what `hangs`.
pub(super) fn wait(
    device: &wgpu::Device,
    (readback, bytes): (&wgpu::Buffer, u64),
    at: wgpu::SubmissionIndex,
    hangs: bool,
    mishap: &Mishap,
) -> Result<(), Fault> {
    let (send, receive) = std::sync::mpsc::channel();
    readback.map_async(wgpu::MapMode::Read, 0..bytes, move |r| {
        let _ = send.send(r);
    });
    let patience = if hangs { Duration::ZERO } else { PATIENCE };
    let waiting = wgpu::PollType::Wait { submission_index: Some(at), timeout: Some(patience) };
    let polled = quietly(|| device.poll(waiting)).map_err(Fault::Lost)?;
    heard(mishap)?;
    match polled {
        _ if hangs => return Err(Fault::Late(patience)),
        Err(wgpu::PollError::Timeout) => return Err(Fault::Late(patience)),
        other => other.map_err(lost)?,
    };
    receive.try_recv().map_err(lost)?.map_err(lost)
}

/// A buffer of so many bytes.
pub(super) fn buffer(
    device: &wgpu::Device,
    label: &str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// Submits `pipeline` over `buffers`, bound in their order, with an invocation for each of `count`, and after it a copy of the first bytes of a buffer to
/// another. What is `told` to lose its device loses it before.
pub(super) fn submit(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    (label, pipeline): (&str, &wgpu::ComputePipeline),
    buffers: &[&wgpu::Buffer],
    count: u32,
    (from, to, bytes): (&wgpu::Buffer, &wgpu::Buffer, u64),
    told: Option<Kind>,
) -> wgpu::SubmissionIndex {
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    let bind = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bind, &[]);
        pass.dispatch_workgroups(count.div_ceil(WORKGROUP), 1, 1);
    }
    encoder.copy_buffer_to_buffer(from, 0, to, 0, bytes);
    if told == Some(Kind::Lose) {
        device.destroy();
    }
    queue.submit([encoder.finish()])
}
