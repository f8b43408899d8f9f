//! The noise of a record, which of its quiet parts are rests, and its level without contact.

use super::Record;
use crate::estimator::between as held;
use crate::reduce::{distinct, median, range};

/// Standard deviations of noise, and share of the largest signal, beyond which a sample is in contact.
pub const AWAY: f64 = 6.0;
const SHARE: f64 = 0.005;
/// Standard deviation of a smoothed sample ([`smoothed`]) over that which its differences would have if samples were independent (2 000 000 normal samples).
const SMOOTH: f64 = 2.62;
/// And over that of a sample.
const SMOOTHED: f64 = 0.553;
/// Samples that are looked at together, at least.
pub const STILL: usize = 5;
/// Parts of a record that are tried as windows: few samples of a slow ramp look like a rest.
pub const WINDOWS: [usize; 6] = [100, 200, 400, 800, 1600, 3200];
/// The same where the drive says what is no contact, and no rest is longer.
const SHORT: usize = 3;
/// Standard deviations of smoothed noise by which a window spreads that is still.
const SPREADS: f64 = 6.5;
/// This share of all windows is still, and what spreads by [`ALIKE`] times as much, up to [`HUM`] of the whole signal (hum, drift).
const SURELY: f64 = 0.1;
const ALIKE: f64 = 2.0;
const HUM: f64 = 0.06;
/// Standard deviations of smoothed noise within which the ends of a rest are.
const AT: f64 = 2.0;
/// Rest: the least drive, if below [`OFF`] of the largest, and up to this share of the largest above it (encoders have offsets).
const NONE: f64 = 0.02;
const OFF: f64 = 0.1;

/// First and last of samples that belong together.
pub type Span = [usize; 2];

pub struct Rest {
    /// Standard deviation of a sample.
    pub noise: f64,
    /// The same of a smoothed one.
    pub scatter: f64,
    pub signal: Vec<f64>,
    pub level: Vec<f64>,
    /// Largest distance from it of a sample without contact.
    pub away: f64,
    /// Each rest.
    pub blocks: Vec<Span>,
}

/// Median and lowest quarter of a normal deviate's absolute value, in standard deviations.
const MEDIAN: f64 = 0.674_5;
const QUARTER: f64 = 0.318_6;

/// Standard deviation of independent samples: of their least differences, which no tap makes.
pub fn apart(values: &[f64]) -> f64 {
    let ends = [f64::max, f64::min].map(|of| values.iter().copied().reduce(of));
    // At an end stop there is no noise.
    let stands = |w: &[f64]| w[0] == w[1] && ends.contains(&Some(w[0]));
    let pairs = values.windows(2).filter(|w| !stands(w));
    let mut all: Vec<f64> = pairs.map(|w| (w[1] - w[0]).abs()).collect();
    if all.is_empty() { 0.0 } else { quantile(&mut all, 0.25) / (QUARTER * std::f64::consts::SQRT_2) }
}

/// Standard deviation of a converter's rounding: its step is the least difference of any two values, not of neighbours.
fn step(values: &[f64]) -> f64 {
    let least = distinct(values.iter().copied()).windows(2).map(|w| w[1] - w[0]).reduce(f64::min);
    least.map_or(0.0, |least| least / 12_f64.sqrt())
}

/// Median of three, which removes single spikes, then weights 1, 2, 1, which remove hum at half the sampling rate.
fn smoothed(y: &[f64]) -> Vec<f64> {
    let three = |y: &[f64], f: fn(f64, f64, f64) -> f64| -> Vec<f64> {
        (0..y.len()).map(|k| f(y[k.saturating_sub(1)], y[k], y[(k + 1).min(y.len() - 1)])).collect()
    };
    let middle = three(y, |a, b, c| a.max(b).min(a.min(b).max(c)));
    three(&middle, |a, b, c| 0.25 * (a + 2.0 * b + c))
}

/// For each sample the largest less the smallest of the `window` samples around it, between two `ends`.
pub fn spreads(values: &[f64], window: usize, [first, last]: [usize; 2]) -> Vec<f64> {
    // The extremes of a window are those of two shorter ones that cover it; beyond the ends there is nothing.
    let (half, none) = (window / 2, vec![[f64::NAN; 2]; window / 2]);
    let here: Vec<[f64; 2]> = values[first..=last].iter().map(|x| [*x; 2]).collect();
    let (mut all, mut length) = ([&*none, &here, &none].concat(), 1);
    while length < 2 * half + 1 {
        let step = length.min(2 * half + 1 - length);
        for k in 0..all.len() - step {
            all[k] = [all[k][0].max(all[k + step][0]), all[k][1].min(all[k + step][1])];
        }
        all.truncate(all.len() - step);
        length += step;
    }
    all.iter().map(|[most, least]| most - least).collect()
}

/// For each sample, true if the motor pushes; `None` without a recorded drive.
fn driven(record: &Record) -> Option<Vec<bool>> {
    let (_, drives) = record.drive.as_ref()?;
    let sizes = || drives.iter().map(|d| d.abs());
    let (least, most) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    let rests = least <= OFF * most || most == 0.0;
    let limit = if rests { least + NONE * most } else { -1.0 };
    Some(sizes().map(|d| d > limit).collect())
}

pub fn rest(record: &Record) -> Rest {
    let y = smoothed(&record.signal);
    let scatter = (SMOOTH * apart(&y)).max(SMOOTHED * step(&record.signal));
    let [least, most] = range(y.iter().copied());
    let span = most - least;
    let driven = driven(record);
    let by = |window: usize| {
        let spreads = spreads(&y, window, [0, y.len() - 1]);
        let least = quantile(&mut spreads.clone(), SURELY);
        let steady = if driven.is_some() { HUM * span } else { (ALIKE * least).min(HUM * span) };
        let still = (SPREADS * scatter).max(steady);
        let free = |k: usize| spreads[k] <= still && driven.as_ref().is_none_or(|driven| !driven[k]);
        (blocks_of(y.len(), window, free), still)
    };
    let windows = WINDOWS.map(|parts| (y.len() / parts).max(STILL));
    let found = windows.map(by);
    let known = driven.is_some();
    let blocks = match known {
        // The drive, if known, tells rests; else the level to which the signal returns.
        true => found.into_iter().find(|(blocks, _)| blocks.len() > 1).unwrap_or_else(|| by(SHORT)).0,
        false => returns(&y, span, found),
    };
    let blocks: Vec<_> = blocks.into_iter().map(|block| trimmed(&y, block, scatter)).collect();
    let level = between(&y, &blocks);
    // From the rests themselves, so that hum and drift are included.
    let by_rests = |values: &[f64], least: f64| {
        let samples = blocks.iter().flat_map(|[first, last]| *first..=*last);
        let mut off: Vec<f64> = samples.map(|k| (values[k] - level[k]).abs()).collect();
        if off.is_empty() { least } else { least.max(median(&mut off) / MEDIAN) }
    };
    // Rounding errors are not independent: averaging hardly reduces them.
    let step = step(&record.signal);
    let (noise, scatter) =
        (by_rests(&record.signal, step), by_rests(&y, if known { step } else { scatter.max(step) }));
    let span = y.iter().zip(&level).map(|(y, level)| (y - level).abs()).fold(0.0, f64::max);
    let away = (AWAY * scatter).max(SHARE * span);
    Rest { noise, scatter, signal: y, level, away, blocks }
}

/// The value below which `share` of `values` lie.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    let place = (share * values.len() as f64) as usize;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

/// First and last of each run of samples that are `still`, `least` or more together.
pub fn blocks_of(n: usize, least: usize, still: impl Fn(usize) -> bool) -> Vec<Span> {
    let (still, mut next): (Vec<bool>, _) = ((0..n).map(still).collect(), 0);
    let spans = still.chunk_by(|p, q| p == q).map(|same| {
        next += same.len();
        (same[0] && same.len() >= least).then_some([next - same.len(), next - 1])
    });
    spans.flatten().collect()
}

/// A rest without the samples at its ends that are off the line through its middle: of a slow ramp not all is seen.
fn trimmed(y: &[f64], [first, last]: Span, scatter: f64) -> Span {
    let quarter = (last - first + 1) / 4;
    let middle = |from: usize| median(&mut y[from..from + quarter].to_vec());
    if quarter < STILL {
        return [first, last];
    }
    let [p, q] = [middle(first + quarter), middle(first + 2 * quarter)];
    let line = |k: usize| p + (q - p) * (k as f64 - (first as f64 + 1.5 * quarter as f64)) / quarter as f64;
    let on = |k: &usize| (y[*k] - line(*k)).abs() <= AT * scatter.max((q - p).abs());
    let from = (first..first + quarter).find(on).unwrap_or(first + quarter);
    let to = (last - quarter..=last).rev().find(on).unwrap_or(last - quarter);
    [from, to]
}

/// The level at each sample: the medians of the rests, joined by straight lines.
fn between(y: &[f64], blocks: &[Span]) -> Vec<f64> {
    // A long rest has a median at each of its quarters, so that a level that creeps is followed.
    let (places, levels): (Vec<f64>, Vec<f64>) = blocks
        .iter()
        .flat_map(|&[first, last]| {
            let parts = if last - first >= 4 * STILL { 4 } else { 1 };
            let length = (last - first + 1) / parts;
            let part = |p: usize| {
                let (from, to) = (first + p * length, first + (p + 1) * length - 1);
                (0.5 * (from + to) as f64, median(&mut y[from..=to].to_vec()))
            };
            let mut all: Vec<(f64, f64)> = (0..parts).map(part).collect();
            if let [p, q, .., r, s] = all[..] {
                let line =
                    |p: (f64, f64), q: (f64, f64), x: f64| (x, p.1 + (q.1 - p.1) * (x - p.0) / (q.0 - p.0));
                all.insert(0, line(p, q, first as f64));
                all.push(line(r, s, last as f64));
            }
            all
        })
        .unzip();
    let at = |k: usize| if places.is_empty() { f64::NAN } else { held(&places, &levels, k as f64) };
    (0..y.len()).map(at).collect()
}

/// A level may move between two rests by this share of the contact between them, and without contact by this one of the whole signal.
const MOVED: f64 = 0.5;
const SLOW: f64 = 0.1;
/// The most that a way may cost.
const WORST: f64 = 4.0;
/// Cost of a contact that the beginning or the end of the record cuts.
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
    let Some(at) = (0..ends.len()).max_by(|i, j| whole(*i).total_cmp(&whole(*j)).then(j.cmp(i))) else {
        return (0.0, Vec::new(), true);
    };
    let mut way: Vec<usize> = std::iter::successors(Some(at), |at| ends[*at].1).collect();
    way.reverse();
    let cut = begun(way[0]) < 0.0 || ended(at) < 0.0;
    (whole(at), way.iter().map(|k| blocks[*k]).collect(), cut)
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
