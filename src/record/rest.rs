//! The noise of a record, and its level without contact.

use crate::reduce::median;

use super::Record;

/// Standard deviations of noise, and share of the largest signal, beyond which a sample is in contact.
pub const AWAY: f64 = 6.0;
const SHARE: f64 = 0.005;
/// Samples of a rest at least.
pub const STILL: usize = 5;
/// Times that the level is looked at again.
const ROUNDS: usize = 12;
/// Drives up to this share of the largest are none.
const NONE: f64 = 1e-3;

/// What a record is without contact.
pub struct Rest {
    /// Standard deviation of a sample.
    pub noise: f64,
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

/// Largest less smallest of the samples around `k`, [`STILL`] together, between two `ends`.
pub fn spread(values: &[f64], k: usize, ends: [usize; 2]) -> f64 {
    let around = k.saturating_sub(STILL / 2).max(ends[0])..=(k + STILL / 2).min(ends[1]);
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for x in &values[around] {
        (least, most) = (least.min(*x), most.max(*x));
    }
    most - least
}

/// The value around which most lie (half-sample mode).
fn mode(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut part = sorted.as_slice();
    while part.len() > 3 {
        let half = part.len().div_ceil(2);
        let width = |k: &usize| part[k + half - 1] - part[*k];
        let first = (0..=part.len() - half).min_by(|j, k| width(j).total_cmp(&width(k))).unwrap_or(0);
        part = &part[first..first + half];
    }
    part.iter().sum::<f64>() / part.len() as f64
}

/// The rest of `record`.
pub fn rest(record: &Record) -> Rest {
    let y = &record.signal;
    let noise = noise(y);
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    // Where the drive is known it says what is no contact: no sample with a drive is at rest.
    let driven: Option<Vec<bool>> = record.drive.as_ref().map(|(_, drives)| {
        let none = NONE * largest(drives);
        drives.iter().map(|d| *d > none).collect()
    });
    let free = |k: usize| driven.as_ref().is_none_or(|driven| !driven[k]);
    // A signal that passes through the level on its way does not rest there.
    let quiet: Vec<bool> = (0..y.len()).map(|k| spread(y, k, [0, y.len() - 1]) <= AWAY * noise).collect();
    let free = |k: usize| free(k) && quiet[k];
    let resting: Vec<f64> = (0..y.len()).filter(|k| free(*k)).map(|k| y[k]).collect();
    let start = if resting.is_empty() { mode(y) } else { mode(&resting) };
    let mut level = vec![start; y.len()];
    let (mut away, mut blocks) = (0.0, Vec::new());
    for _ in 0..ROUNDS {
        let middle = |k: usize| {
            let (a, b, c) = (y[k.saturating_sub(1)], y[k], y[(k + 1).min(y.len() - 1)]);
            a.max(b).min(a.min(b).max(c)) - level[k]
        };
        let span = (0..y.len()).map(|k| middle(k).abs()).fold(0.0, f64::max);
        away = (AWAY * noise).max(SHARE * span);
        let found = blocks_of(y.len(), |k| free(k) && (y[k] - level[k]).abs() <= away);
        if found.is_empty() || found == blocks {
            break;
        }
        blocks = found;
        level = between(y, &blocks);
    }
    Rest { noise, level, away, blocks }
}

/// First and last of each run of samples that are `still`.
pub fn blocks_of(n: usize, still: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let mut all = Vec::new();
    let mut begun = None;
    for k in 0..=n {
        match (begun, k < n && still(k)) {
            (None, true) => begun = Some(k),
            (Some(first), false) => {
                if k - first >= STILL {
                    all.push([first, k - 1]);
                }
                begun = None;
            }
            _ => {}
        }
    }
    all
}

/// The level at each sample: the medians of the rests, joined by straight lines.
fn between(y: &[f64], blocks: &[[usize; 2]]) -> Vec<f64> {
    // A long rest has a median at each of its ends, so that a level that creeps is followed.
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
