//! Ranking on a GPU: tuples made, reduced and selected there; only counts, the designs that have a row below the bound and those that
//! must be solved tap by tap come back. The host lists the rows of the former. Batches overlap: the next one runs while the last is read.

mod shader;
mod tuples;

use std::collections::VecDeque;

use super::lanes::Words;
use super::scope::Scope;
use crate::gpu::{Gpu, shader::validate};
use shader::WORKGROUP;
use vibrissa_core::layout::Layout;

/// The text of a scope's shader, for tests that read it.
#[doc(hidden)]
pub use shader::Shader;

/// Designs of a batch at most.
const MOST: u64 = 1 << 20;

/// Taps of a batch at most: bounds a dispatch in time and keeps its counts within 32 bits.
const MOST_TAPS: u64 = 1 << 28;

/// Designs that one invocation goes through.
const EACH: u32 = 8;

/// Batches in flight.
const DEPTH: usize = 2;

/// Counters at the head of the tally.
const COUNTERS: usize = 16;

/// A device with the pipeline of one scope.
pub struct Ranker {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::ComputePipeline,
    tables: wgpu::Buffer,
    lengths: Vec<u32>,
    slots: Vec<Slot>,
    flying: VecDeque<(usize, std::ops::Range<u64>)>,
    most: u64,
}

/// Buffers of one batch in flight.
struct Slot {
    job: wgpu::Buffer,
    tally: wgpu::Buffer,
    best: wgpu::Buffer,
    hard: wgpu::Buffer,
    readback: wgpu::Buffer,
}

/// What a finished batch brings.
pub struct Batch {
    /// Its designs.
    pub range: std::ops::Range<u64>,
    /// Rows that are complete; designs that have one where designs compete.
    pub complete: u64,
    /// Taps per status word.
    pub words: Words,
    /// Designs with a row below the bound.
    pub best: Vec<u64>,
    /// Designs that must be solved tap by tap.
    pub hard: Vec<u64>,
}

/// Designs of a batch at most, of `block` taps each.
fn most(block: u64) -> u64 {
    MOST.min((MOST_TAPS / block).max(1))
}

impl Ranker {
    /// The pipeline of `scope` over `layout` on the device of `gpu`; `None` where the scope does not fit a device.
    pub fn new(gpu: &Gpu, scope: &Scope, layout: &Layout) -> Result<Option<Self>, String> {
        let Some(shader) = Shader::new(scope, layout) else { return Ok(None) };
        let (device, queue) = gpu.handles();
        validate("smooth", &shader.wgsl)?;
        let source = wgpu::ShaderModuleDescriptor {
            label: Some("smooth"),
            source: wgpu::ShaderSource::Wgsl(shader.wgsl.as_str().into()),
        };
        // SAFETY: the text is ours and validated; its loops are bounded, its indices below the lengths of what they index.
        let module =
            unsafe { device.create_shader_module_trusted(source, wgpu::ShaderRuntimeChecks::unchecked()) };
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("smooth"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let buffer = |bytes: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as U;
        let tables = buffer(4 * shader.tables.len() as u64, U::STORAGE | U::COPY_DST);
        queue.write_buffer(&tables, 0, bytemuck::cast_slice(&shader.tables));
        let most = most(layout.block());
        let list = 4 * most.max(COUNTERS as u64);
        let slot = |_| Slot {
            job: buffer(48, U::UNIFORM | U::COPY_DST),
            tally: buffer(4 * COUNTERS as u64, U::STORAGE | U::COPY_SRC | U::COPY_DST),
            best: buffer(list, U::STORAGE | U::COPY_SRC),
            hard: buffer(list, U::STORAGE | U::COPY_SRC),
            readback: buffer(list, U::MAP_READ | U::COPY_DST),
        };
        Ok(Some(Self {
            pipeline,
            tables,
            lengths: shader.lengths,
            slots: (0..DEPTH).map(slot).collect(),
            flying: VecDeque::new(),
            most,
            device,
            queue,
        }))
    }

    /// Designs of a batch at most.
    pub fn most(&self) -> u64 {
        self.most
    }

    /// Whether another batch can start.
    pub fn free(&self) -> bool {
        self.flying.len() < self.slots.len()
    }

    /// Starts a batch that looks for rows below `bound`.
    pub fn start(&mut self, range: std::ops::Range<u64>, bound: f32) {
        let used: Vec<usize> = self.flying.iter().map(|(slot, _)| *slot).collect();
        let at = (0..self.slots.len()).find(|s| !used.contains(s)).expect("a slot is free");
        let slot = &self.slots[at];
        let count = (range.end - range.start) as u32;
        let invocations = count.div_ceil(EACH).max(1).next_multiple_of(WORKGROUP);
        let mut job = [0u32; 12];
        job[..4].copy_from_slice(&[count, invocations, bound.min(3e38).to_bits(), 0]);
        let mut rest = range.start;
        for (f, n) in self.lengths.iter().enumerate().rev() {
            job[4 + f] = (rest % u64::from(*n)) as u32;
            rest /= u64::from(*n);
        }
        self.queue.write_buffer(&slot.job, 0, bytemuck::cast_slice(&job));
        self.queue.write_buffer(&slot.tally, 0, &[0; 4 * COUNTERS]);
        let buffers = [&slot.job, &self.tables, &slot.tally, &slot.best, &slot.hard];
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
            .collect();
        let bind = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("smooth"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &bind, &[]);
            pass.dispatch_workgroups(invocations / WORKGROUP, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&slot.tally, 0, &slot.readback, 0, 4 * COUNTERS as u64);
        self.queue.submit([encoder.finish()]);
        self.flying.push_back((at, range));
    }

    /// Waits for the oldest batch; `None` when none is in flight.
    pub fn finish(&mut self) -> Option<Result<Batch, String>> {
        let (at, range) = self.flying.pop_front()?;
        Some(self.collect(at, range))
    }

    fn collect(&self, at: usize, range: std::ops::Range<u64>) -> Result<Batch, String> {
        let slot = &self.slots[at];
        let tally = self.read(&slot.readback, COUNTERS)?;
        let [best, hard, ok, slipped, strain, rootless, ambiguous, invalid, complete] = tally[..9] else {
            return Err("the tally is too short".into());
        };
        let word = u64::from;
        let words = Words {
            ok: word(ok),
            slipped: word(slipped),
            strain: word(strain),
            rootless: word(rootless),
            ambiguous: word(ambiguous),
            invalid: word(invalid),
        };
        let list = |from: &wgpu::Buffer, count: u32| -> Result<Vec<u64>, String> {
            let mut ks: Vec<u64> =
                self.copy(slot, from, count as usize)?.into_iter().map(|i| range.start + word(i)).collect();
            ks.sort_unstable();
            Ok(ks)
        };
        let (best, hard) = (list(&slot.best, best)?, list(&slot.hard, hard)?);
        Ok(Batch { range, complete: word(complete), words, best, hard })
    }

    /// The first `count` words of a buffer of `slot`.
    fn copy(&self, slot: &Slot, from: &wgpu::Buffer, count: usize) -> Result<Vec<u32>, String> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(from, 0, &slot.readback, 0, 4 * count as u64);
        self.queue.submit([encoder.finish()]);
        self.read(&slot.readback, count)
    }

    fn read(&self, readback: &wgpu::Buffer, count: usize) -> Result<Vec<u32>, String> {
        let bytes = 4 * count as u64;
        let (send, receive) = std::sync::mpsc::channel();
        readback.map_async(wgpu::MapMode::Read, 0..bytes, move |r| {
            let _ = send.send(r);
        });
        loop {
            self.device.poll(wgpu::PollType::Poll).map_err(|e| e.to_string())?;
            match receive.recv_timeout(std::time::Duration::from_micros(200)) {
                Ok(done) => break done.map_err(|e| e.to_string())?,
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {}
                Err(e) => return Err(e.to_string()),
            }
        }
        let words = {
            let view = readback.get_mapped_range(0..bytes).map_err(|e| e.to_string())?;
            bytemuck::cast_slice(&view).to_vec()
        };
        readback.unmap();
        Ok(words)
    }
}
