//! Ranking on a GPU: tuples made, reduced and selected there; only counts, the best rows and the designs that must be solved tap by
//! tap come back. Batches overlap: the next one runs while the last is read.

mod shader;
mod tuples;

use std::collections::VecDeque;

use super::lanes::{Found, Words};
use super::scope::Scope;
use crate::kernel::gpu::{Gpu, shader::validate};
use crate::plan::Layout;
use shader::{Shader, WORKGROUP};

/// Rows that a batch may bring back.
const CAPACITY: u32 = 1 << 20;

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
    block: u64,
}

/// Buffers of one batch in flight.
struct Slot {
    job: wgpu::Buffer,
    tally: wgpu::Buffer,
    rows: wgpu::Buffer,
    hard: wgpu::Buffer,
    readback: wgpu::Buffer,
}

/// What a finished batch brings.
pub enum Batch {
    /// Counts, rows, hard designs of a range.
    Done(Found, std::ops::Range<u64>),
    /// More rows than fit: the designs to go through again, in smaller batches.
    Again(std::ops::Range<u64>),
}

impl Ranker {
    /// The pipeline of `scope` over `layout` on the device of `gpu`; `None` where the scope does not fit a device.
    pub fn new(gpu: &Gpu, scope: &Scope, layout: &Layout) -> Result<Option<Self>, String> {
        let Some(shader) = Shader::new(scope, layout) else { return Ok(None) };
        let (device, queue) = gpu.device();
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
        let (rows, hard) = (12 * u64::from(CAPACITY), 4 * MOST);
        let slot = |_| Slot {
            job: buffer(48, U::UNIFORM | U::COPY_DST),
            tally: buffer(4 * COUNTERS as u64, U::STORAGE | U::COPY_SRC | U::COPY_DST),
            rows: buffer(rows, U::STORAGE | U::COPY_SRC),
            hard: buffer(hard, U::STORAGE | U::COPY_SRC),
            readback: buffer(rows.max(hard), U::MAP_READ | U::COPY_DST),
        };
        Ok(Some(Self {
            pipeline,
            tables,
            lengths: shader.lengths,
            slots: (0..DEPTH).map(slot).collect(),
            flying: VecDeque::new(),
            block: layout.block(),
            device,
            queue,
        }))
    }

    /// Designs of a batch at most.
    pub fn most(&self) -> u64 {
        MOST.min((MOST_TAPS / self.block).max(1))
    }

    /// Whether another batch can start.
    pub fn free(&self) -> bool {
        self.flying.len() < self.slots.len()
    }

    /// Starts a batch; rows that rank no better than `bound` are left out.
    pub fn start(&mut self, range: std::ops::Range<u64>, bound: f32) {
        let used: Vec<usize> = self.flying.iter().map(|(slot, _)| *slot).collect();
        let at = (0..self.slots.len()).find(|s| !used.contains(s)).expect("a slot is free");
        let slot = &self.slots[at];
        let count = (range.end - range.start) as u32;
        let invocations = count.div_ceil(EACH).max(1).next_multiple_of(WORKGROUP);
        let mut job = [0u32; 12];
        job[..4].copy_from_slice(&[count, invocations, bound.min(3e38).to_bits(), CAPACITY]);
        let mut rest = range.start;
        for (f, n) in self.lengths.iter().enumerate().rev() {
            job[4 + f] = (rest % u64::from(*n)) as u32;
            rest /= u64::from(*n);
        }
        self.queue.write_buffer(&slot.job, 0, bytemuck::cast_slice(&job));
        self.queue.write_buffer(&slot.tally, 0, &[0; 4 * COUNTERS]);
        let buffers = [&slot.job, &self.tables, &slot.tally, &slot.rows, &slot.hard];
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
        let [rows, hard, ok, slipped, strain, rootless, ambiguous, invalid, complete] = tally[..9] else {
            return Err("the tally is too short".into());
        };
        if rows > CAPACITY {
            return Ok(Batch::Again(range));
        }
        let word = u64::from;
        let words = Words {
            ok: word(ok),
            slipped: word(slipped),
            strain: word(strain),
            rootless: word(rootless),
            ambiguous: word(ambiguous),
            invalid: word(invalid),
        };
        let rows = self.copy(slot, &slot.rows, 3 * rows as usize)?;
        let hard = self.copy(slot, &slot.hard, hard as usize)?;
        let row = |r: &[u32]| (f32::from_bits(r[0]), range.start + word(r[1]), r[2]);
        let found = Found {
            rows: rows.chunks_exact(3).map(row).collect(),
            complete: word(complete),
            words,
            hard: hard.iter().map(|&i| range.start + word(i)).collect(),
        };
        Ok(Batch::Done(found, range))
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
