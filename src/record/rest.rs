//! The noise of a record, and its level without contact.

use crate::reduce::median;

use super::Record;

/// Standard deviations of noise, and share of the largest signal, beyond which a sample is in contact.
pub const AWAY: f64 = 6.0;
const SHARE: f64 = 0.005;
/// Samples that are looked at together, at least; and the parts of a record that are tried for them. The longest is taken with which there are two rests or
/// more: few samples of a slow ramp look like a rest.
pub const STILL: usize = 5;
const WINDOWS: [usize; 4] = [400, 800, 1600, 3200];
/// The level may drift between two rests by this share of the contact between them.
const DRIFT: f64 = 0.15;
/// Drives up to this share of the largest, from the least, are none; the least is that of a rest up to the other share: not every encoder has its zero
/// where contact begins.
const NONE: f64 = 0.02;
const OFF: f64 = 0.1;

/// What a record is without contact.
pub struct Rest {
    /// Standard deviation of a sample.
    pub noise: f64,
    /// The signal without single samples that spring out of it.
    pub signal: Vec<f64>,
    /// The level at each sample.
    pub level: Vec<f64>,
    /// How far from it a sample may be without contact.
    pub away: f64,
    /// First and last sample of each rest.
    pub blocks: Vec<[usize; 2]>,
}

/// Standard deviation of the noise of samples: of their differences, most of which no tap makes; of a converter at least that of its step.
pub fn noise(signal: &[f64]) -> f64 {
    let mut differences: Vec<f64> = signal.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let step = differences.iter().copied().filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    let middle = median(&mut differences) / (0.674_5 * std::f64::consts::SQRT_2);
    middle.max(if step.is_finite() { step / 12_f64.sqrt() } else { 0.0 })
}

/// Each sample's median with its two neighbours.
fn smoothed(y: &[f64]) -> Vec<f64> {
    let at = |k: usize| {
        let (a, b, c) = (y[k.saturating_sub(1)], y[k], y[(k + 1).min(y.len() - 1)]);
        a.max(b).min(a.min(b).max(c))
    };
    (0..y.len()).map(at).collect()
}

/// For each sample the largest less the smallest of the `window` samples around it, between two `ends`.
pub fn spreads(values: &[f64], window: usize, [first, last]: [usize; 2]) -> Vec<f64> {
    // Both extremes by a queue of candidates, whatever the window.
    let half = window / 2;
    let extreme = |sign: f64| -> Vec<f64> {
        let mut queue: std::collections::VecDeque<usize> = Default::default();
        let mut out = Vec::with_capacity(last - first + 1);
        let mut next = first;
        for k in first..=last {
            while next <= (k + half).min(last) {
                while queue.back().is_some_and(|j| sign * values[*j] <= sign * values[next]) {
                    queue.pop_back();
                }
                queue.push_back(next);
                next += 1;
            }
            while queue.front().is_some_and(|j| j + half < k) {
                queue.pop_front();
            }
            out.push(queue.front().map_or(f64::NAN, |j| values[*j]));
        }
        out
    };
    extreme(1.0).iter().zip(extreme(-1.0)).map(|(most, least)| most - least).collect()
}

/// Whether the motor pushes at each sample; none where no drive is recorded.
fn driven(record: &Record) -> Option<Vec<bool>> {
    let (_, drives) = record.drive.as_ref()?;
    let sizes = || drives.iter().map(|d| d.abs());
    let (least, most) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    let rests = least <= OFF * most || most == 0.0;
    let limit = if rests { least + NONE * most } else { -1.0 };
    Some(sizes().map(|d| d > limit).collect())
}

/// The rest of `record`.
pub fn rest(record: &Record) -> Rest {
    let noise = noise(&record.signal);
    let y = smoothed(&record.signal);
    let driven = driven(record);
    let by = |window: usize| {
        let spreads = spreads(&y, window, [0, y.len() - 1]);
        let free = |k: usize| spreads[k] <= AWAY * noise && driven.as_ref().is_none_or(|driven| !driven[k]);
        let quiet = blocks_of(y.len(), window, free);
        // Where the drive is known it says what is no contact; else the level to which the signal comes back.
        if driven.is_some() { quiet } else { returns(&y, &quiet, AWAY * noise) }
    };
    let windows = WINDOWS.map(|parts| (y.len() / parts).max(STILL));
    let mut found = windows.into_iter().map(by);
    let blocks = found.find(|blocks| blocks.len() > 1).unwrap_or_else(|| by(windows[WINDOWS.len() - 1]));
    let level = between(&y, &blocks);
    let span = y.iter().zip(&level).map(|(y, level)| (y - level).abs()).fold(0.0, f64::max);
    let away = (AWAY * noise).max(SHARE * span);
    Rest { noise, signal: y, level, away, blocks }
}

/// First and last of each run of samples that are `still`, `least` or more together.
pub fn blocks_of(n: usize, least: usize, still: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let mut all = Vec::new();
    let mut begun = None;
    for k in 0..=n {
        match (begun, k < n && still(k)) {
            (None, true) => begun = Some(k),
            (Some(first), false) => {
                if k - first >= least {
                    all.push([first, k - 1]);
                }
                begun = None;
            }
            _ => {}
        }
    }
    all
}

/// Those of the `quiet` blocks that are rests: from one of them on, in both directions, those whose level is that of the rest before, but for a share of
/// the contact between them. Of several to begin with, the one with which most are rests; of equals the first.
fn returns(y: &[f64], quiet: &[[usize; 2]], away: f64) -> Vec<[usize; 2]> {
    const TRIED: usize = 24;
    let levels: Vec<f64> =
        quiet.iter().map(|[first, last]| median(&mut y[*first..=*last].to_vec())).collect();
    // Largest and smallest signal between a block and the next.
    let gaps: Vec<[f64; 2]> = quiet
        .windows(2)
        .map(|pair| {
            let gap = &y[pair[0][0]..=pair[1][1]];
            let of = |start: f64, f: fn(f64, f64) -> f64| gap.iter().copied().fold(start, f);
            [of(f64::NEG_INFINITY, f64::max), of(f64::INFINITY, f64::min)]
        })
        .collect();
    let follow = |start: usize, way: &mut dyn Iterator<Item = usize>, back: bool, all: &mut Vec<usize>| {
        let (mut level, mut most) = (levels[start], 0.0_f64);
        for k in way {
            let [hi, lo] = gaps[if back { k } else { k - 1 }];
            most = most.max((hi - level).abs()).max((lo - level).abs());
            if (levels[k] - level).abs() <= away.max(DRIFT * most) {
                (level, most) = (levels[k], 0.0);
                all.push(k);
            }
        }
    };
    let from = |start: usize| {
        let mut all = vec![start];
        follow(start, &mut (start + 1..quiet.len()), false, &mut all);
        follow(start, &mut (0..start).rev(), true, &mut all);
        all.sort_unstable();
        all
    };
    let mut best: Vec<usize> = Vec::new();
    for start in 0..quiet.len().min(TRIED) {
        let all = from(start);
        if all.len() > best.len() {
            best = all;
        }
    }
    best.into_iter().map(|k| quiet[k]).collect()
}

/// The level at each sample: the medians of the rests, joined by straight lines.
fn between(y: &[f64], blocks: &[[usize; 2]]) -> Vec<f64> {
    // A long rest has a median at each of its quarters, so that a level that creeps is followed.
    let knots: Vec<(f64, f64)> = blocks
        .iter()
        .flat_map(|&[first, last]| {
            let parts = if last - first >= 4 * STILL { 4 } else { 1 };
            let length = (last - first + 1) / parts;
            (0..parts).map(move |p| (first + p * length, first + (p + 1) * length - 1))
        })
        .map(|(from, to)| (0.5 * (from + to) as f64, median(&mut y[from..=to].to_vec())))
        .collect();
    let at = |k: usize| {
        let x = k as f64;
        let after = knots.partition_point(|knot| knot.0 < x);
        match (after.checked_sub(1).map(|i| knots[i]), knots.get(after)) {
            (Some(p), Some(q)) => p.1 + (q.1 - p.1) * (x - p.0) / (q.0 - p.0),
            (Some(p), None) => p.1,
            (None, Some(q)) => q.1,
            (None, None) => f64::NAN,
        }
    };
    (0..y.len()).map(at).collect()
}
