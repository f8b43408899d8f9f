//! Ranking on a GPU: tuples are made, reduced and selected there; only counts and lists of designs come back. A batch reports its number of designs,
//! and its lists start as zeros, with entries counted from 1: so a batch that did not run completely is detected.

// Index loops read like the shader's.
#![allow(clippy::needless_range_loop)]

mod check;
mod shader;
mod tuples;

use std::collections::VecDeque;

use crate::gpu::device::Device;
use crate::ranking::{Batch, COMBINED, Found, OnCpu, Sheet, Words};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Layout;

use shader::Shader;

const MOST: u64 = 1 << 20;

/// Bounds a dispatch in time and keeps its counts within 32 bits.
const MOST_TAPS: u64 = 1 << 28;

/// Most loop rounds of an invocation. Mesa's software device ends loops after 65 535 rounds.
const MOST_ROUNDS: usize = 40_000;

const DEPTH: usize = 2;

/// Counters of the tally: designs of both lists, taps of each combination of words and without a gauge, complete rows, designs done.
const COUNTERS: usize = COMBINED + 5;

/// A device with the charts of one sweep.
pub struct DeviceRanker {
    device: Device,
    pipeline: wgpu::ComputePipeline,
    /// The shader's `numbers`, `shape`, `rows` and `axes`.
    charts: [wgpu::Buffer; 4],
    listed: bool,
    lengths: Vec<u32>,
    slots: Vec<Slot>,
    flying: VecDeque<Flight>,
    most: u64,
}

/// Slot and designs of a batch, and its submission.
type Flight = (usize, std::ops::Range<u64>, wgpu::SubmissionIndex);

struct Slot {
    job: wgpu::Buffer,
    tally: wgpu::Buffer,
    best: wgpu::Buffer,
    hard: wgpu::Buffer,
    readback: wgpu::Buffer,
}

fn most(block: u64) -> u64 {
    MOST.min((MOST_TAPS / block).max(1))
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(bytes)
}

impl DeviceRanker {
    /// Ranks the designs of `layout` by `sheet` on `device`; `None` where they do not fit. Fails if it differs from `on_cpu`.
    pub(super) fn new(
        device: &Device,
        sheet: &Sheet,
        layout: &Layout,
        on_cpu: &OnCpu<'_>,
    ) -> Result<Option<Self>, SolveError> {
        let shader = Shader::new(sheet, layout).filter(|_| sheet.rounds <= MOST_ROUNDS);
        let Some(shader) = shader else { return Ok(None) };
        // The lengths of its loops are data.
        let pipeline = device.compile("ranking", &shader.wgsl, false)?;
        use wgpu::BufferUsages as U;
        let uploaded = |bytes: &[u8]| {
            let of = device.buffer(bytes.len(), U::STORAGE | U::UNIFORM | U::COPY_DST);
            device.write(&of, bytes);
            of
        };
        let charts_there = [
            uploaded(bytemuck::cast_slice(&shader.numbers)),
            uploaded(bytemuck::cast_slice(&shader.shape)),
            uploaded(bytemuck::cast_slice(&sheet.rows)),
            uploaded(bytemuck::cast_slice(&shader.axes)),
        ];
        let most = most(layout.block());
        // One entry more shows if a list is longer than its count.
        let list = 4 * (most as usize + 1).max(COUNTERS);
        let output = U::STORAGE | U::COPY_SRC | U::COPY_DST;
        let slot = |_| Slot {
            job: device.buffer(48, U::UNIFORM | U::COPY_DST),
            tally: device.buffer(4 * COUNTERS, output),
            best: device.buffer(list, output),
            hard: device.buffer(list, output),
            readback: device.buffer(list, U::MAP_READ | U::COPY_DST),
        };
        let slots = (0..DEPTH).map(slot).collect();
        device.heard()?;
        let mut ranker = Self {
            device: device.clone(),
            pipeline,
            charts: charts_there,
            listed: !shader.axes.is_empty(),
            lengths: shader.lengths,
            slots,
            flying: VecDeque::new(),
            most,
        };
        check::check(&mut ranker, layout, on_cpu)?;
        Ok(Some(ranker))
    }

    fn next_batch(&mut self) -> Result<Batch, SolveError> {
        let (slot, range, at) = self.flying.pop_front().expect("a batch is under way");
        let slot = &self.slots[slot];
        let tally = self.device.read(&slot.readback, 4 * COUNTERS, at, words)?;
        let count = (range.end - range.start) as usize;
        let damaged = || SolveError::Device(format!("a ranking of {count} designs was not written"));
        if tally[COUNTERS - 1] as usize != count || tally[0].max(tally[1]) as usize > count {
            return Err(damaged());
        }
        let list = |from: &wgpu::Buffer, n: u32| {
            let bytes = 4 * (n as usize + 1);
            let mut entries = self.device.fetch((from, &slot.readback, bytes), words)?;
            let beyond = entries.pop();
            entries.sort_unstable();
            entries.dedup();
            let inside = entries.first() != Some(&0) && entries.last().is_none_or(|i| *i as usize <= count);
            if beyond != Some(0) || !inside || entries.len() < n as usize {
                return Err(damaged());
            }
            Ok(entries.into_iter().map(|i| range.start + u64::from(i) - 1).collect())
        };
        let (best, hard) = (list(&slot.best, tally[0])?, list(&slot.hard, tally[1])?);
        let taps = std::array::from_fn(|k| u64::from(tally[2 + k]));
        let [invalid, complete] = [0, 1].map(|k| u64::from(tally[2 + COMBINED + k]));
        let found = Found { rows: Vec::new(), complete, words: Words { taps, invalid }, hard };
        Ok(Batch { range, best, found })
    }

    /// Most designs of a batch.
    pub fn most(&self) -> u64 {
        self.most
    }

    /// True if another batch can start.
    pub fn free(&self) -> bool {
        self.flying.len() < self.slots.len()
    }

    /// Starts a batch that looks for rows below `bound`.
    pub fn start(&mut self, range: std::ops::Range<u64>, bound: f32) {
        let used: Vec<usize> = self.flying.iter().map(|(slot, ..)| *slot).collect();
        let free = (0..self.slots.len()).find(|s| !used.contains(s)).expect("a slot is free");
        let slot = &self.slots[free];
        let count = (range.end - range.start) as u32;
        let mut job = [0u32; 12];
        job[..2].copy_from_slice(&[count, bound.min(3e38).to_bits()]);
        let mut rest = range.start;
        for (f, n) in self.lengths.iter().enumerate().rev() {
            job[4 + f] = (rest % u64::from(*n)) as u32;
            rest /= u64::from(*n);
        }
        self.device.write(&slot.job, bytemuck::cast_slice(&job));
        let [numbers, shape, rows, axes] = &self.charts;
        let buffers = [&slot.job, numbers, shape, rows, &slot.tally, &slot.best, &slot.hard, axes];
        let at = self.device.submit(
            &self.pipeline,
            // An unread buffer has no binding.
            &buffers[..7 + usize::from(self.listed)],
            count,
            &[&slot.tally, &slot.best, &slot.hard],
            (&slot.tally, &slot.readback, 4 * COUNTERS),
        );
        self.flying.push_back((free, range, at));
    }

    /// Waits for the oldest batch; `None` when none is in flight.
    pub fn finish(&mut self) -> Option<Result<Batch, SolveError>> {
        (!self.flying.is_empty()).then(|| self.next_batch())
    }
}
