//! Ranks some designs of a sweep on the device and in CPU lanes, and compares, before the device ranks all.

use std::collections::{BTreeMap, BTreeSet};

use super::DeviceRanker;
use crate::ranking::{Batch, Found, OnCpu, Words};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Layout;

/// Stretches of designs that are compared, and designs of each.
const STRETCHES: [u64; 2] = [8, 32];

/// Tolerated difference of ranks of device and CPU, both in f32: relative, and absolute in K.
const MARGIN: [f32; 2] = [5e-3, 2e-7];

/// Share of the taps whose words may differ: those next to an edge.
const EDGES: f64 = 0.01;

/// Ranks some designs of `layout` twice, with a bound below all of their ranks and one above; fails if they differ from the CPU's.
pub(super) fn check(
    ranker: &mut DeviceRanker,
    layout: &Layout,
    on_cpu: &OnCpu<'_>,
) -> Result<(), SolveError> {
    let [stretches, length] = STRETCHES;
    let n = layout.n_designs;
    for s in 0..stretches {
        let from = (n.saturating_sub(length) / (stretches - 1)).saturating_mul(s);
        let range = from..(from + length.min(ranker.most())).min(n);
        let every = on_cpu(&range.clone().collect::<Vec<_>>(), f32::INFINITY);
        let mut best: BTreeMap<u64, f32> = BTreeMap::new();
        for (rank, k, _) in &every.rows {
            let least = best.entry(*k).or_insert(f32::INFINITY);
            *least = least.min(*rank);
        }
        let least = best.values().copied().fold(f32::INFINITY, f32::min).min(f32::MAX);
        let most = best.values().copied().fold(0.0, f32::max);
        for bound in [least - MARGIN[0] * least - MARGIN[1], most + MARGIN[0] * most + MARGIN[1]] {
            ranker.start(range.clone(), bound);
            let batch = ranker.next_batch()?;
            compare(&batch, &every, &best, bound, layout.block())?;
        }
    }
    Ok(())
}

fn compare(
    batch: &Batch,
    every: &Found,
    best: &BTreeMap<u64, f32>,
    bound: f32,
    block: u64,
) -> Result<(), SolveError> {
    let of = batch.range.end - batch.range.start;
    let wrong = |why: String| Err(SolveError::Device(format!("it ranks otherwise than the CPU: {why}")));
    let [hard, found, left] =
        [&batch.found.hard, &batch.best, &every.hard].map(|ks| ks.iter().copied().collect::<BTreeSet<u64>>());
    let below = |k: &u64| best.get(k).is_some_and(|rank| *rank < bound);
    let missed = best.keys().filter(|k| below(k) && !found.contains(k) && !hard.contains(k)).count();
    let added = found.iter().filter(|k| !below(k) && !left.contains(k)).count();
    if missed + added > 0 {
        return wrong(format!(
            "of {of} designs {missed} with a row below {bound:e} are missing, and {added} without one are there"
        ));
    }
    let counts = |w: &Words| w.taps.into_iter().chain([w.invalid]);
    // A design next to the border of the chart may be hard here and easy there.
    let unlike = hard.symmetric_difference(&left).count() as u64;
    let most = (EDGES * (of * block) as f64) as u64 + 2 + unlike * block;
    let apart = counts(&batch.found.words).zip(counts(&every.words)).map(|(a, b)| a.abs_diff(b)).max();
    if apart > Some(most) || unlike > 1 + of / 16 {
        return wrong(format!(
            "the words of {} of {} taps differ, and {unlike} of {of} designs are to be solved otherwise",
            apart.unwrap_or(0),
            of * block
        ));
    }
    Ok(())
}
