//! Which quiet parts of a record are rests.

use super::rest::{Span, WINDOWS};
use crate::reduce::median;

/// A level may move between two rests by this share of the contact between them, and without contact by this one of the whole signal.
const MOVED: f64 = 0.5;
const SLOW: f64 = 0.1;
/// The most that a way may cost.
const WORST: f64 = 4.0;
/// What a contact costs that the begin or the end of the record cuts.
const CUT: f64 = 1.5;
/// Blocks that lie between two rests, at most.
const BETWEEN: usize = 24;
/// A rest that lasts less than this share of what others last counts less.
const BRIEF: f64 = 1.0 / 8.0;

/// The rests among blocks that are quiet, which several windows found (with what they may spread by): those between which the signal leaves a level and
/// comes back to it most often and nearest. A plateau is quiet too, but the next has another level.
///
/// Each way from a rest to a later one counts 1 where there is contact between, less by how far the level has moved, in halves of the contact;
/// a way without contact costs what the level moved by. Rests that last much less than most count less: the signal turns there. The best chain, by dynamic programming.
pub fn returns(y: &[f64], span: f64, found: [(Vec<Span>, f64); WINDOWS.len()]) -> Vec<Span> {
    let mut best: (f64, Vec<Span>) = (0.0, Vec::new());
    let (mut lasts, mut still) = (None, 0.0_f64);
    for (blocks, own) in found {
        still = still.max(own);
        let (mut score, mut chain, cut) = chain(y, span, &blocks, still, lasts);
        let mut lengths: Vec<usize> = chain.iter().map(|[first, last]| last - first + 1).collect();
        lengths.sort_unstable();
        if let (None, Some(long)) = (lasts, lengths.get(lengths.len() * 3 / 4)) {
            let long = Some(*long as f64);
            // If the record begins and ends at rest, these rests are right; else a smaller window may find better ones.
            lasts = long.filter(|_| score > 0.5 && !cut);
            (score, chain, _) = self::chain(y, span, &blocks, still, long);
        }
        if score > best.0 + 0.1 || best.1.is_empty() {
            best = (score, chain);
        }
    }
    best.1
}

/// The best chain of rests among `blocks`, what it counts, and whether the record begins or ends in contact; of equals the first.
fn chain(y: &[f64], span: f64, blocks: &[Span], away: f64, lasts: Option<f64>) -> (f64, Vec<Span>, bool) {
    let level = |[first, last]: Span| median(&mut y[first..=last].to_vec());
    let levels: Vec<f64> = blocks.iter().map(|block| level(*block)).collect();
    let weight = |k: usize| {
        let length = (blocks[k][1] - blocks[k][0] + 1) as f64;
        lasts.map_or(1.0, |lasts| (length / (BRIEF * lasts)).min(1.0))
    };
    // A record begins and ends with a rest, or else in the middle of a contact: largest and smallest of the signals so far, and of those left.
    let (before, after) = (extremes(y.iter()), extremes(y.iter().rev()));
    let cut = |k: usize, [hi, lo]: [f64; 2]| {
        if (hi - levels[k]).max(levels[k] - lo) > away { -CUT } else { 0.0 }
    };
    let begun = |k: usize| cut(k, before[blocks[k][0]]);
    let ended = |k: usize| cut(k, after[y.len() - blocks[k][1]]);
    // Score of the best chain that ends in each block, and the block before.
    let mut ends: Vec<(f64, Option<usize>)> = Vec::with_capacity(blocks.len());
    for j in 0..blocks.len() {
        let mut best = (begun(j), None);
        let [mut hi, mut lo] = [f64::NEG_INFINITY, f64::INFINITY];
        for i in (j.saturating_sub(BETWEEN)..j).rev() {
            for value in &y[blocks[i][1]..=blocks[i + 1][0]] {
                (hi, lo) = (hi.max(*value), lo.min(*value));
            }
            let moved = (levels[j] - levels[i]).abs();
            // Excursion of the signal beyond both levels.
            let off = (hi - levels[i].max(levels[j])).max(levels[i].min(levels[j]) - lo);
            let counts = match off > away {
                true => weight(i).min(weight(j)) * (1.0 - moved / (MOVED * off)).max(-WORST),
                false => -(moved / (SLOW * span)).powi(2).min(WORST),
            };
            if ends[i].0 + counts > best.0 {
                best = (ends[i].0 + counts, Some(i));
            }
            (hi, lo) = (hi.max(levels[i]), lo.min(levels[i]));
        }
        ends.push(best);
    }
    let whole = |k: usize| ends[k].0 + ended(k);
    let Some(mut at) = (0..ends.len()).max_by(|i, j| whole(*i).total_cmp(&whole(*j)).then(j.cmp(i))) else {
        return (0.0, Vec::new(), true);
    };
    let score = whole(at);
    let ends_cut = ended(at) < 0.0;
    let mut all = vec![blocks[at]];
    while let Some(before) = ends[at].1 {
        at = before;
        all.push(blocks[at]);
    }
    all.reverse();
    (score, all, begun(at) < 0.0 || ends_cut)
}

/// Largest and smallest of the first 0, 1, 2 … values.
fn extremes<'a>(values: impl Iterator<Item = &'a f64>) -> Vec<[f64; 2]> {
    let mut all = vec![[f64::NEG_INFINITY, f64::INFINITY]];
    all.extend(values.scan(all[0], |[hi, lo], value| {
        (*hi, *lo) = (hi.max(*value), lo.min(*value));
        Some([*hi, *lo])
    }));
    all
}
