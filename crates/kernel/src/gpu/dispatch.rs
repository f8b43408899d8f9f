//! Upload, dispatch, read-back.

use std::collections::HashMap;

use super::ranking::Ranker;
use super::{
    adapter::Adapter,
    shader::{Variant, WORKGROUP, validate},
};
use crate::smooth::{Ranking, Scope};
use crate::{Job, Solution, Solver, Tap};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Layout;
use vibrissa_core::scene::Precision;

/// Taps of one dispatch: some milliseconds of work on a slow device, far below any watchdog.
const BATCH: usize = 1 << 18;

/// A device with its compiled pipelines and buffers.
#[derive(Debug)]
pub struct Gpu {
    adapter: Adapter,
    precision: Precision,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// By WGSL text.
    pipelines: HashMap<String, wgpu::ComputePipeline>,
    buffers: Option<Buffers>,
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
        Ok(Self { adapter, precision, device, queue, pipelines: HashMap::new(), buffers: None })
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

    pub(super) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    pub(super) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Bytes of one number.
    fn word(&self) -> usize {
        match self.precision {
            Precision::F32 => 4,
            Precision::F64 => 8,
        }
    }

    /// The pipeline of `variant`, compiled on first use.
    fn pipeline(&mut self, variant: &Variant<'_>) -> Result<wgpu::ComputePipeline, SolveError> {
        let (name, wgsl) = (variant.name(), variant.wgsl());
        if let Some(found) = self.pipelines.get(&wgsl) {
            return Ok(found.clone());
        }
        let pipeline = self.compile(&name, &wgsl)?;
        self.pipelines.insert(wgsl, pipeline.clone());
        Ok(pipeline)
    }

    /// A compute pipeline from the WGSL text `wgsl`, whose entry point is `main`.
    pub(super) fn compile(&self, name: &str, wgsl: &str) -> Result<wgpu::ComputePipeline, SolveError> {
        validate(name, wgsl)?;
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let source =
            wgpu::ShaderModuleDescriptor { label: Some(name), source: wgpu::ShaderSource::Wgsl(wgsl.into()) };
        // SAFETY: the text is ours and validated; its loops are bounded by constants and its indices by array lengths.
        let module = unsafe {
            self.device.create_shader_module_trusted(source, wgpu::ShaderRuntimeChecks::unchecked())
        };
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        if let Some(e) = pollster::block_on(scope.pop()) {
            return Err(SolveError::Device(format!("shader {name} on {}: {e}", self.adapter.name)));
        }
        Ok(pipeline)
    }

    /// Buffers for `count` taps, made anew where the last are too small.
    fn reserve(&mut self, count: usize) -> &Buffers {
        let word = self.word();
        if self.buffers.as_ref().is_none_or(|b| b.capacity < count) {
            let capacity = count.next_power_of_two().min(self.batch_limit()).max(count);
            let buffer = |label, bytes: usize, usage| {
                self.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size: bytes as u64,
                    usage,
                    mapped_at_creation: false,
                })
            };
            use wgpu::BufferUsages as U;
            let (taps, solutions) = (capacity * word * TAP_WORDS, capacity * word * SOLUTION_WORDS);
            self.buffers = Some(Buffers {
                capacity,
                batch: buffer("batch", 16, U::UNIFORM | U::COPY_DST),
                taps: buffer("taps", taps, U::STORAGE | U::COPY_DST),
                solutions: buffer("solutions", solutions, U::STORAGE | U::COPY_SRC),
                readback: buffer("readback", solutions, U::MAP_READ | U::COPY_DST),
            });
        }
        self.buffers.as_ref().expect("made above")
    }
}

const TAP_WORDS: usize = size_of::<Tap<f32>>() / 4;
const SOLUTION_WORDS: usize = size_of::<Solution<f32>>() / 4;

impl Solver for Gpu {
    fn solve(
        &mut self,
        job: &Job<'_>,
        taps: &[Tap<f64>],
        out: &mut Vec<Solution<f64>>,
    ) -> Result<(), SolveError> {
        out.clear();
        if taps.is_empty() {
            return Ok(());
        }
        let (precision, count) = (self.precision, taps.len());
        let pipeline = self.pipeline(&Variant { job: *job, precision })?;
        self.reserve(count);
        let buffers = self.buffers.as_ref().expect("reserved");
        self.queue.write_buffer(&buffers.batch, 0, bytemuck::bytes_of(&[count as u32, 0, 0, 0]));
        match precision {
            Precision::F32 => {
                let narrow: Vec<Tap<f32>> = taps.iter().map(|t| t.map(|x| x as f32)).collect();
                self.queue.write_buffer(&buffers.taps, 0, bytemuck::cast_slice(&narrow));
            }
            Precision::F64 => self.queue.write_buffer(&buffers.taps, 0, bytemuck::cast_slice(taps)),
        }
        let bind = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("taps"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[entry(0, &buffers.batch), entry(1, &buffers.taps), entry(2, &buffers.solutions)],
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind, &[]);
            pass.dispatch_workgroups((count as u32).div_ceil(WORKGROUP), 1, 1);
        }
        let bytes = (count * SOLUTION_WORDS * self.word()) as u64;
        encoder.copy_buffer_to_buffer(&buffers.solutions, 0, &buffers.readback, 0, bytes);
        self.queue.submit([encoder.finish()]);
        read(&self.device, &buffers.readback, bytes, precision, out)
            .map_err(|e| SolveError::Device(format!("{}: {e}", self.adapter.name)))
    }

    fn ranking(&self, scope: &Scope, layout: &Layout) -> Result<Option<Box<dyn Ranking>>, SolveError> {
        Ok(Ranker::new(self, scope, layout)?.map(|ranker| Box::new(ranker) as Box<dyn Ranking>))
    }

    fn batch_limit(&self) -> usize {
        let bytes = self.word() * TAP_WORDS.max(SOLUTION_WORDS);
        let by_binding = (self.adapter.max_binding / bytes as u64) as usize;
        let by_groups = self.adapter.max_workgroups as usize * WORKGROUP as usize;
        BATCH.min(by_binding).min(by_groups)
    }
}

/// Waits for the device and appends what `readback` holds.
fn read(
    device: &wgpu::Device,
    readback: &wgpu::Buffer,
    bytes: u64,
    precision: Precision,
    out: &mut Vec<Solution<f64>>,
) -> Result<(), SolveError> {
    let (send, receive) = std::sync::mpsc::channel();
    readback.map_async(wgpu::MapMode::Read, 0..bytes, move |r| {
        let _ = send.send(r);
    });
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(SolveError::device)?;
    receive.recv().map_err(SolveError::device)?.map_err(SolveError::device)?;
    {
        let view = readback.get_mapped_range(0..bytes).map_err(SolveError::device)?;
        match precision {
            Precision::F32 => {
                out.extend(bytemuck::cast_slice::<u8, Solution<f32>>(&view).iter().map(|s| s.map(f64::from)))
            }
            Precision::F64 => out.extend_from_slice(bytemuck::cast_slice(&view)),
        }
    }
    readback.unmap();
    Ok(())
}

pub(super) fn entry(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }
}
