//! The self-check of a ranking: some designs of the sweep itself, ranked on the device and in the lanes of the CPU.

use std::collections::BTreeSet;
use std::ops::Range;

use super::Ranker;
use crate::gpu::fault::Fault;
use crate::smooth::{Batch, Case, Found, Ranking, Scope, Tables};
use vibrissa_core::scene::{Layout, Tuple};

/// Stretches of designs that are compared, and designs of each.
const STRETCHES: [u64; 2] = [4, 64];

/// What the ranks of device and CPU, both in f32, may differ by: a share of them, and a K.
const MARGIN: [f32; 2] = [2e-3, 1e-7];

/// Share of the taps whose words may differ: those next to an edge.
const EDGES: f64 = 0.01;

/// What the CPU says of the designs of `range`.
fn expected(scope: &Scope, tables: &Tables, layout: &Layout, range: &Range<u64>, bound: f32) -> Found {
    let mut found = Found::default();
    let mut easy: (Vec<u64>, Vec<Tuple>) = (Vec::new(), Vec::new());
    for k in range.clone() {
        let tuple = layout.design(k);
        match scope.case(&tuple) {
            Case::Easy => {
                easy.0.push(k);
                easy.1.push(tuple);
            }
            Case::Hard => found.hard.push(k),
            Case::Void => found.words.invalid += layout.block(),
        }
    }
    tables.rank(&easy.0, &easy.1, bound, &mut found);
    found
}

/// Ranks some designs of `layout` and compares.
///
/// # Errors
/// Designs ranked otherwise than by the CPU, with figures; a device that fails.
pub(super) fn check(ranker: &mut Ranker, scope: &Scope, layout: &Layout) -> Result<(), Fault> {
    let tables = Tables::new(scope);
    let [stretches, length] = STRETCHES;
    let n = layout.n_designs;
    for s in 0..stretches {
        let from = (n.saturating_sub(length) / (stretches - 1)).saturating_mul(s);
        let range = from..(from + length.min(ranker.most())).min(n);
        let every = expected(scope, &tables, layout, &range, f32::INFINITY);
        let mut ranks: Vec<f32> = every.rows.iter().map(|row| row.0).collect();
        ranks.sort_by(f32::total_cmp);
        let bound = ranks.get(ranks.len() / 2).copied().unwrap_or(1.0);
        ranker.start(range.clone(), bound);
        let batch = ranker.next_batch()?;
        compare(&batch, &every, bound, layout.block())?;
    }
    Ok(())
}

fn compare(batch: &Batch, every: &Found, bound: f32, block: u64) -> Result<(), Fault> {
    let of = batch.range.end - batch.range.start;
    let wrong = |why: String| Err(Fault::Wrong(format!("its self-check of the ranking failed: {why}")));
    let margin = MARGIN[0] * bound.abs() + MARGIN[1];
    let below = |limit: f32| -> BTreeSet<u64> {
        every.rows.iter().filter(|row| row.0 < limit).map(|row| row.1).collect()
    };
    let (hard, found): (BTreeSet<u64>, BTreeSet<u64>) =
        (batch.hard.iter().copied().collect(), batch.best.iter().copied().collect());
    let (surely, perhaps) = (below(bound - margin), below(bound + margin));
    let missed = surely.iter().filter(|k| !found.contains(k) && !hard.contains(k)).count();
    let added = found.difference(&perhaps).count();
    if missed + added > 0 {
        return wrong(format!(
            "of {of} designs {missed} with a row below {bound:e} are missing, and {added} without one are there"
        ));
    }
    let pairs =
        |w: &crate::smooth::lanes::Words| [w.ok, w.slipped, w.strain, w.rootless, w.ambiguous, w.invalid];
    // A design next to the border of the chart may be hard here and easy there.
    let unlike = hard.symmetric_difference(&every.hard.iter().copied().collect()).count() as u64;
    let most = (EDGES * (of * block) as f64) as u64 + 2 + unlike * block;
    let apart = pairs(&batch.words).into_iter().zip(pairs(&every.words)).map(|(a, b)| a.abs_diff(b)).max();
    if apart > Some(most) || unlike > 1 + of / 16 {
        return wrong(format!(
            "the words of {} of {} taps differ, and {unlike} of {of} designs are to be solved otherwise",
            apart.unwrap_or(0),
            of * block
        ));
    }
    Ok(())
}
