//! Ranking on a GPU: tuples made, reduced and selected there; only counts, the designs that have a row below the bound and those that
//! must be solved tap by tap come back. The host lists the rows of the former. Batches overlap: the next one runs while the last is read.
//!
//! A batch brings its number back, the designs that it went through, and a sum of its counts; entries of its lists carry its number too. So
//! one that did not run, ran in part, or is that of an earlier batch is found.

// Index loops read like the shader's.
#![allow(clippy::needless_range_loop)]

mod check;
mod shader;
mod tuples;

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use crate::gpu::Gpu;
use crate::gpu::dispatch::{buffer, lost, submit, wait};
use crate::gpu::fault::Fault;
use crate::gpu::lie::{Kind, Lie};
use crate::ranking::{Batch, COMBINED, Charts, Ranking, Words};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Layout;

/// The text of the shader, for tests that read it.
#[doc(hidden)]
pub use shader::Shader;

/// Designs of a batch at most.
const MOST: u64 = 1 << 20;

/// Taps of a batch at most: bounds a dispatch in time and keeps its counts within 32 bits.
const MOST_TAPS: u64 = 1 << 28;

/// Rounds of all loops that an invocation goes through at most. Mesa's software device ends loops after 65 535 rounds.
const MOST_ROUNDS: usize = 40_000;

/// Batches in flight.
const DEPTH: usize = 2;

/// Counters at the head of the tally.
const COUNTERS: usize = 20;

/// Bits of a place in a batch; the others of an entry are those of the batch's number.
const PLACE_BITS: u32 = MOST.ilog2();

/// Weights of the counts of a batch in their sum.
const WEIGHTS: [u32; COMBINED + 3] = [1, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47];

/// A device with the charts of one sweep.
pub struct Ranker {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::ComputePipeline,
    /// The shader's `numbers`, `shape`, `rows` and `axes`.
    charts: [wgpu::Buffer; 4],
    /// Whether designs have an axis that is listed.
    listed: bool,
    lengths: Vec<u32>,
    slots: Vec<Slot>,
    flying: VecDeque<Flight>,
    most: u64,
    /// Batches so far.
    stamp: u32,
    mishap: Arc<Mutex<Option<Fault>>>,
    lie: Option<Arc<Lie>>,
}

/// A batch under way.
struct Flight {
    slot: usize,
    range: std::ops::Range<u64>,
    stamp: u32,
    at: wgpu::SubmissionIndex,
    told: Option<Kind>,
}

/// Buffers of one batch in flight.
struct Slot {
    job: wgpu::Buffer,
    tally: wgpu::Buffer,
    best: wgpu::Buffer,
    hard: wgpu::Buffer,
    readback: wgpu::Buffer,
}

/// Designs of a batch at most, of `block` taps each.
fn most(block: u64) -> u64 {
    MOST.min((MOST_TAPS / block).max(1))
}

impl Ranker {
    /// What ranks the designs of `layout` from `charts` on the device of `gpu`, which has passed its self-check; `None` where they do not fit a
    /// device.
    ///
    /// # Errors
    /// A device that fails, or ranks otherwise than the CPU.
    pub fn new(gpu: &Gpu, charts: &dyn Charts, layout: &Layout) -> Result<Option<Self>, Fault> {
        let Some(mut ranker) = Self::unchecked(gpu, charts, layout)? else { return Ok(None) };
        check::check(&mut ranker, charts, layout)?;
        Ok(Some(ranker))
    }

    fn unchecked(gpu: &Gpu, charts: &dyn Charts, layout: &Layout) -> Result<Option<Self>, Fault> {
        let shader = charts.sheet().and_then(|sheet| Shader::new(&sheet, layout));
        let Some(shader) = shader else { return Ok(None) };
        let (device, queue) = gpu.handles();
        if shader.rounds > MOST_ROUNDS {
            return Ok(None);
        }
        let pipeline = gpu.compile("ranking", &shader.wgsl)?;
        let buffer = |bytes: u64, usage| buffer(&device, "ranking", bytes, usage);
        use wgpu::BufferUsages as U;
        let uploaded = |bytes: &[u8]| {
            // One number at least: a buffer is not empty.
            let of = buffer(bytes.len().max(16) as u64, U::STORAGE | U::UNIFORM | U::COPY_DST);
            queue.write_buffer(&of, 0, bytes);
            of
        };
        let charts = [
            uploaded(bytemuck::cast_slice(&shader.numbers)),
            uploaded(bytemuck::cast_slice(&shader.shape)),
            uploaded(bytemuck::cast_slice(&shader.rows)),
            uploaded(bytemuck::cast_slice(&shader.axes)),
        ];
        let most = most(layout.block());
        // One entry more tells whether a list is longer than its count says.
        let list = 4 * (most + 1).max(COUNTERS as u64);
        let slot = |_| Slot {
            job: buffer(48, U::UNIFORM | U::COPY_DST),
            tally: buffer(4 * COUNTERS as u64, U::STORAGE | U::COPY_SRC | U::COPY_DST),
            best: buffer(list, U::STORAGE | U::COPY_SRC),
            hard: buffer(list, U::STORAGE | U::COPY_SRC),
            readback: buffer(list, U::MAP_READ | U::COPY_DST),
        };
        let slots = (0..DEPTH).map(slot).collect();
        gpu.heard()?;
        Ok(Some(Self {
            pipeline,
            charts,
            listed: !shader.axes.is_empty(),
            lengths: shader.lengths,
            slots,
            flying: VecDeque::new(),
            most,
            stamp: 0,
            mishap: gpu.mishap(),
            lie: gpu.adapter().lie.clone(),
            device,
            queue,
        }))
    }

    /// Waits for the oldest batch, of which there is one.
    fn next_batch(&mut self) -> Result<Batch, Fault> {
        let flight = self.flying.pop_front().expect("a batch is under way");
        self.collect(&flight)
    }

    fn collect(&self, flight: &Flight) -> Result<Batch, Fault> {
        let (slot, range) = (&self.slots[flight.slot], flight.range.clone());
        let tally = self.read(slot, COUNTERS, flight)?;
        let [best, hard, .., seen, sum] = tally[..COMBINED + 6] else {
            return Err(lost("the tally is too short"));
        };
        let count = (range.end - range.start) as usize;
        let right = tally[1..=WEIGHTS.len()]
            .iter()
            .zip(WEIGHTS)
            .fold(0u32, |sum, (n, w)| sum.wrapping_add(n.wrapping_mul(w)));
        let whole = tally[COUNTERS - 1] == flight.stamp && seen as usize == count && sum == right;
        if !whole || best.max(hard) as usize > count {
            return Err(Fault::Damaged(count, count));
        }
        let taps = std::array::from_fn(|k| u64::from(tally[2 + k]));
        let [invalid, complete] = [0, 1].map(|k| u64::from(tally[2 + COMBINED + k]));
        let words = Words { taps, invalid };
        let list = |from: &wgpu::Buffer, n: u32| -> Result<Vec<u64>, Fault> {
            let mut entries = self.copy(slot, from, n as usize + 1, flight)?;
            let own = |entry: u32| entry >> PLACE_BITS == flight.stamp;
            let beyond = entries.pop().is_some_and(own);
            let mut ks: Vec<u64> = entries.iter().map(|e| u64::from(e & ((1 << PLACE_BITS) - 1))).collect();
            ks.sort_unstable();
            ks.dedup();
            let inside = ks.last().is_none_or(|k| *k < count as u64);
            if beyond || !inside || ks.len() < entries.len() || !entries.iter().all(|e| own(*e)) {
                return Err(Fault::Damaged(entries.len(), count));
            }
            Ok(ks.into_iter().map(|i| range.start + i).collect())
        };
        let (best, hard) = (list(&slot.best, best)?, list(&slot.hard, hard)?);
        Ok(Batch { range, complete, words, best, hard })
    }

    /// The first `count` words of a buffer of `slot`.
    fn copy(
        &self,
        slot: &Slot,
        from: &wgpu::Buffer,
        count: usize,
        flight: &Flight,
    ) -> Result<Vec<u32>, Fault> {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(from, 0, &slot.readback, 0, 4 * count as u64);
        let at = self.queue.submit([encoder.finish()]);
        self.read(slot, count, &Flight { at, range: flight.range.clone(), ..*flight })
    }

    fn read(&self, slot: &Slot, count: usize, flight: &Flight) -> Result<Vec<u32>, Fault> {
        let bytes = 4 * count as u64;
        let hangs = flight.told == Some(Kind::Hang);
        wait(&self.device, (&slot.readback, bytes), flight.at.clone(), hangs, &self.mishap)?;
        let mut words: Vec<u32> = {
            let view = slot.readback.get_mapped_range(0..bytes).map_err(lost)?;
            view.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect()
        };
        slot.readback.unmap();
        if let Some(lie) = &self.lie {
            lie.spoil(flight.told, bytemuck::cast_slice_mut(&mut words), 16, 4);
        }
        Ok(words)
    }
}

impl Ranking for Ranker {
    fn most(&self) -> u64 {
        self.most
    }

    fn free(&self) -> bool {
        self.flying.len() < self.slots.len()
    }

    fn start(&mut self, range: std::ops::Range<u64>, bound: f32) {
        let used: Vec<usize> = self.flying.iter().map(|flight| flight.slot).collect();
        let free = (0..self.slots.len()).find(|s| !used.contains(s)).expect("a slot is free");
        let told = self.lie.as_ref().and_then(|lie| lie.next());
        // Never 0, which is what buffers hold at first.
        self.stamp = (self.stamp + 1) % (1 << (32 - PLACE_BITS));
        self.stamp = self.stamp.max(1);
        let (slot, stamp) = (&self.slots[free], self.stamp);
        let count = (range.end - range.start) as u32;
        let mut job = [0u32; 12];
        let bound = if told == Some(Kind::Wrong) { 1.5 * bound } else { bound };
        job[..3].copy_from_slice(&[count, bound.min(3e38).to_bits(), stamp << PLACE_BITS]);
        let mut rest = range.start;
        for (f, n) in self.lengths.iter().enumerate().rev() {
            job[4 + f] = (rest % u64::from(*n)) as u32;
            rest /= u64::from(*n);
        }
        self.queue.write_buffer(&slot.job, 0, bytemuck::cast_slice(&job));
        let mut tally = [0u32; COUNTERS];
        tally[COUNTERS - 1] = stamp;
        self.queue.write_buffer(&slot.tally, 0, bytemuck::cast_slice(&tally));
        let [numbers, shape, rows, axes] = &self.charts;
        let buffers = [&slot.job, numbers, shape, rows, &slot.tally, &slot.best, &slot.hard, axes];
        let at = submit(
            (&self.device, &self.queue),
            ("ranking", &self.pipeline),
            // What the shader does not read has no binding.
            &buffers[..7 + usize::from(self.listed)],
            count,
            (&slot.tally, &slot.readback, 4 * COUNTERS as u64),
            told,
        );
        self.flying.push_back(Flight { slot: free, range, stamp, at, told });
    }

    fn finish(&mut self) -> Option<Result<Batch, SolveError>> {
        (!self.flying.is_empty()).then(|| self.next_batch().map_err(SolveError::from))
    }
}
