//! Contacts in a record, and their readings.

use super::Record;
use super::rest::{AWAY, Rest, STILL, apart, blocks_of, rest, spreads};
use crate::error::InputError;
use crate::reduce::median;

/// Contacts that are nearer to each other, in samples, are one.
const APART: usize = 3;
/// So much smaller contacts without a rest between are none: a whisker swings when it comes free, and rubber creeps back.
const SWINGS: f64 = 0.35;
/// Smoothed samples of a contact at least: of a disturbance of two samples there are four.
const LEAST: usize = 5;
/// What is higher for no more than this share of a contact, and this many samples, is no part of it.
const RARE: (f64, usize) = (0.03, 5);
/// Share of a contact that a plateau lasts at least.
const LASTS: f64 = 0.15;
/// Band of a plateau beside its noise: share of its level.
const BAND: f64 = 0.02;
/// Parts of a contact that are looked at together for a drive that stands still.
const PARTS: usize = 60;
/// Standard deviations of noise within which samples are at one level.
const NEAR: f64 = 3.0;
/// A plateau is a reading where its level is at least this share of the largest of the contact.
const HIGH: f64 = 0.5;
/// Share of a plateau at its beginning that is left out: there the rubber still creeps most.
const SETTLES: f64 = 1.0 / 3.0;
/// Drives that differ by no more than this share of the largest are one.
const SAME: f64 = 0.01;
/// Share of a peak by which a sample may stand out of its neighbours.
const SHARP: f64 = 0.1;
/// What is at its top: within so many standard deviations of noise ([`NEAR`]), or this share of it.
const NEXT: f64 = 0.01;

/// What of a contact is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Take {
    /// A plateau where there is one, else the peak.
    Auto,
    /// Plateaus alone.
    Plateau,
    /// Peaks alone.
    Peak,
}

/// What a reading is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// No contact.
    Rest,
    /// A contact that stands still.
    Plateau,
    /// The largest signal of a contact.
    Peak,
}

impl Kind {
    /// In tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Plateau => "plateau",
            Self::Peak => "peak",
        }
    }
}

/// A reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// What it is of.
    pub kind: Kind,
    /// First and last sample of the contact, or of the rest.
    pub contact: [usize; 2],
    /// First and last sample of which it is the mean.
    pub mean: [usize; 2],
    /// The signal.
    pub signal: f64,
    /// The level of the rest there.
    pub rest: f64,
    /// Standard deviation of its samples.
    pub sd: f64,
    /// The drive, as recorded.
    pub drive: Option<f64>,
}

/// Rests and contacts of `record` in the order of time.
///
/// # Errors
/// A record without rest, or without contact.
pub fn find(record: &Record, take: Take) -> Result<(Vec<Reading>, Rest), InputError> {
    if let Some((kind, drives)) = &record.drive
        && drives.iter().all(|d| *d == 0.0)
    {
        let error = InputError::new("this drive is 0 throughout, so that it says of no tap")
            .at(record.file.clone(), None);
        return Err(error
            .key(kind.column())
            .allowed("the drive of each sample; --columns ignore=NAME leaves it out"));
    }
    let rest = rest(record);
    let fault = |message: &str, value: String, allowed: &str| {
        InputError::new(message).at(record.file.clone(), None).key("signal").value(value).allowed(allowed)
    };
    if rest.blocks.is_empty() {
        let (what, allowed) = match &record.drive {
            Some((kind, _)) => (
                format!("nowhere does this signal rest while {} is near 0", kind.column()),
                "a record that also shows the sensor without contact; --columns ignore=NAME leaves a drive out",
            ),
            None => (
                "nowhere does this signal rest".to_owned(),
                "a record that also shows the sensor without contact, for five samples or more",
            ),
        };
        return Err(fault(&what, format!("noise {:.3e}", rest.noise), allowed));
    }
    let off = |k: usize| (rest.signal[k] - rest.level[k]).abs();
    let mut readings: Vec<Reading> =
        rest.blocks.iter().map(|&block| mean(record, &rest, Kind::Rest, block, block)).collect();
    let n = record.signal.len();
    let largest = |[first, last]: [usize; 2]| (first..=last).map(off).fold(0.0, f64::max);
    let mut found: Vec<[usize; 2]> = Vec::new();
    for contact in contacts(n, |k| off(k) > rest.away) {
        let [first, last] = grown(contact, |k| off(k) > 2.0 * rest.scatter, n);
        let before = found.last_mut().filter(|before| {
            let rested = || rest.blocks.iter().any(|b| (2 * before[1]..2 * first).contains(&(b[0] + b[1])));
            let (one, other) = (largest(**before), largest([first, last]));
            first <= before[1] + APART || one.min(other) < SWINGS * one.max(other) && !rested()
        });
        match before {
            Some(before) => before[1] = before[1].max(last),
            None => found.push([first, last]),
        }
    }
    for contact in found {
        readings.extend(of_contact(record, &rest, contact, take));
    }
    if readings.iter().all(|r| r.kind == Kind::Rest) {
        let value = format!("noise {:.3e}", rest.noise);
        let allowed = "taps that stand out of the noise by six standard deviations; --take peak where none stands still";
        return Err(fault("no tap is found in this signal", value, allowed));
    }
    readings.sort_by_key(|r| r.mean[0]);
    Ok((readings, rest))
}

/// First and last sample of each contact.
fn contacts(n: usize, away: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let mut all: Vec<[usize; 2]> = Vec::new();
    for k in (0..n).filter(|k| away(*k)) {
        match all.last_mut() {
            Some(last) if k - last[1] <= APART => last[1] = k,
            _ => all.push([k, k]),
        }
    }
    all.retain(|c| c[1] - c[0] + 1 >= LEAST);
    all
}

/// A contact with the samples around it that are off the rest.
fn grown([mut first, mut last]: [usize; 2], off: impl Fn(usize) -> bool, n: usize) -> [usize; 2] {
    while first > 0 && off(first - 1) {
        first -= 1;
    }
    while last + 1 < n && off(last + 1) {
        last += 1;
    }
    [first, last]
}

/// The sample `k` of a peak. It may be one sample; but what springs out of its neighbours is none.
fn sample(record: &Record, rest: &Rest, k: usize) -> f64 {
    let (smooth, raw) = (rest.signal[k], record.signal[k]);
    let most = AWAY * rest.noise + SHARP * (smooth - rest.level[k]).abs();
    raw.clamp(smooth - most, smooth + most)
}

/// The mean of the samples `of` in a contact.
fn mean(record: &Record, rest: &Rest, kind: Kind, contact: [usize; 2], of: [usize; 2]) -> Reading {
    let n = (of[1] - of[0] + 1) as f64;
    let sum = |values: &[f64]| values[of[0]..=of[1]].iter().sum::<f64>() / n;
    let peaks = kind == Kind::Peak;
    let of_kind = |k: usize| if peaks { sample(record, rest, k) } else { rest.signal[k] };
    let samples: Vec<f64> = (of[0]..=of[1]).map(of_kind).collect();
    let signal = samples.iter().sum::<f64>() / n;
    let square = samples.iter().map(|y| (y - signal).powi(2)).sum::<f64>();
    Reading {
        kind,
        contact,
        mean: of,
        signal,
        rest: sum(&rest.level),
        sd: (square / (n - 1.0).max(1.0)).sqrt(),
        // A plateau may hold the last sample of a ramp: not the mean.
        drive: record.drive.as_ref().map(|(_, drives)| match kind {
            Kind::Rest => 0.0,
            _ => median(&mut drives[of[0]..=of[1]].to_vec()),
        }),
    }
}

/// What is read of a contact.
fn of_contact(record: &Record, rest: &Rest, contact: [usize; 2], take: Take) -> Vec<Reading> {
    let [first, last] = contact;
    let off = |k: usize| (rest.signal[k] - rest.level[k]).abs();
    let top = (first..=last).max_by(|j, k| off(*j).total_cmp(&off(*k))).unwrap_or(first);
    if take == Take::Peak {
        return vec![peak(record, rest, contact, top)];
    }
    let plateaus = match &record.drive {
        None => {
            let mut heights: Vec<f64> = (first..=last).map(off).collect();
            let rare = ((RARE.0 * heights.len() as f64) as usize).max(RARE.1).min(heights.len() - 1);
            let high = *heights.select_nth_unstable_by(rare, |p, q| q.total_cmp(p)).1;
            plateau(record, rest, contact, contact, HIGH * high).into_iter().collect()
        }
        Some((_, drives)) => {
            let most = drives.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let stays = steady(drives, contact, SAME * most);
            let of = |stay: [usize; 2]| plateau(record, rest, contact, stay, 0.0);
            let found = stays.into_iter().filter_map(of);
            let pushed = found.filter(|r| r.drive.is_none_or(|d| d.abs() > SAME * most));
            joined(record, rest, pushed.collect(), SAME * most)
        }
    };
    match (plateaus.is_empty(), take) {
        (true, Take::Auto) => vec![peak(record, rest, contact, top)],
        _ => plateaus,
    }
}

/// Stretches of a contact in which the drive stands still.
fn steady(drives: &[f64], [first, last]: [usize; 2], same: f64) -> Vec<[usize; 2]> {
    let length = last - first + 1;
    let window = STILL.max(length / PARTS);
    let (spreads, moves) = (spreads(drives, window, [first, last]), same.max(AWAY * apart(drives)));
    let still = blocks_of(length, window, |k| spreads[k] <= moves);
    still.into_iter().map(|[p, q]| [first + p, first + q]).collect()
}

/// The plateau in the `stretch` of a contact, at least so `high`: the level near which the signal is longest, and the longest time that it is near it without break.
fn plateau(
    record: &Record,
    rest: &Rest,
    contact: [usize; 2],
    stretch: [usize; 2],
    high: f64,
) -> Option<Reading> {
    let [first, last] = stretch;
    let off = |k: usize| rest.signal[k] - rest.level[k];
    let band = |level: f64| (NEAR * rest.scatter).max(BAND * level.abs());
    let mut sorted: Vec<f64> = (first..=last).map(off).collect();
    sorted.sort_by(f64::total_cmp);
    // The densest band of levels.
    let mut dense = (0, 0.0);
    let mut low = 0;
    for (k, &value) in sorted.iter().enumerate() {
        while value - sorted[low] > 2.0 * band(value) {
            low += 1;
        }
        let level = sorted[low + (k - low) / 2];
        if level.abs() >= high && k - low + 1 > dense.0 {
            dense = (k - low + 1, level);
        }
    }
    let level = dense.1;
    let near = |k: usize| (off(first + k) - level).abs() <= band(level);
    let runs = blocks_of(last - first + 1, 1, near);
    let [p, q] = runs.into_iter().max_by_key(|[p, q]| (q - p, *p))?;
    let lasts = q - p + 1;
    if lasts < STILL.max((LASTS * (last - first + 1) as f64) as usize) {
        return None;
    }
    let from = p + (lasts as f64 * SETTLES) as usize;
    Some(mean(record, rest, Kind::Plateau, contact, [first + from, first + q]))
}

/// The largest signal of a contact: the top of the parabola through the samples next to it that are as high but for noise, three or more.
fn peak(record: &Record, rest: &Rest, contact: [usize; 2], top: usize) -> Reading {
    let off = |k: usize| (rest.signal[k] - rest.level[k]).abs();
    let near = |k: usize| off(k) >= off(top) - (NEAR * rest.scatter).max(NEXT * off(top));
    let [mut first, mut last] = [top.saturating_sub(1).max(contact[0]), (top + 1).min(contact[1])];
    while first > contact[0] && near(first - 1) {
        first -= 1;
    }
    while last < contact[1] && near(last + 1) {
        last += 1;
    }
    let told = mean(record, rest, Kind::Peak, contact, [first, last]);
    // Least squares of level + slope x + curve x² on places −1 … 1.
    let n = last - first;
    let place = |k: usize| 2.0 * (k - first) as f64 / n as f64 - 1.0;
    let mut sums = [0.0; 4];
    for k in first..=last {
        let (x, y) = (place(k), sample(record, rest, k) - told.signal);
        for (sum, value) in sums.iter_mut().zip([x * x, x.powi(4), x * y, x * x * y]) {
            *sum += value;
        }
    }
    let [xx, xxxx, xy, xxy] = sums;
    let curve = xxy / (xxxx - xx * xx / (n + 1) as f64);
    let (slope, level) = (xy / xx, -curve * xx / (n + 1) as f64);
    // Its top lies between the samples, or is none.
    let at = -0.5 * slope / curve;
    match at.abs() <= 1.0 {
        true => {
            let signal = told.signal + level + at * (slope + at * curve);
            let place = first as f64 + 0.5 * (at + 1.0) * n as f64;
            let (k, t) = (place as usize, place.fract());
            let drive = record.drive.as_ref().map(|(_, d)| d[k] + t * (d[(k + 1).min(last)] - d[k]));
            Reading { signal, drive, ..told }
        }
        false => told,
    }
}

/// Plateaus of one drive that follow each other, as one.
fn joined(record: &Record, rest: &Rest, found: Vec<Reading>, same: f64) -> Vec<Reading> {
    let mut all: Vec<Reading> = Vec::new();
    for reading in found {
        match (all.last().copied(), reading.drive) {
            (Some(before), Some(drive)) if before.drive.is_some_and(|d| (d - drive).abs() <= same) => {
                // The later one has settled more.
                let of = [reading.mean[0], reading.mean[1]];
                let last = all.len() - 1;
                all[last] = mean(record, rest, Kind::Plateau, reading.contact, of);
            }
            _ => all.push(reading),
        }
    }
    all
}
