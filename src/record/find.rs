//! Contacts in a record, and their readings.

use super::Record;
use super::rest::{AWAY, Rest, STILL, blocks_of, noise, rest, spreads};
use crate::error::InputError;
use crate::reduce::median;

/// Contacts that are nearer to each other, in samples, are one.
const APART: usize = 3;
/// Samples of a contact at least.
const LEAST: usize = 3;
/// Share of a contact that a plateau lasts at least.
const LASTS: f64 = 0.15;
/// Band of a plateau beside its noise: share of its level.
const BAND: f64 = 0.02;
/// Parts of a contact that are looked at together: of one that has one plateau, and of one that may have many.
const PARTS: [usize; 2] = [20, 60];
/// A plateau is a reading where its level is at least this share of the largest of the contact.
const HIGH: f64 = 0.5;
/// Share of a plateau at its beginning that is left out: there the rubber still creeps most.
const SETTLES: f64 = 1.0 / 3.0;
/// Drives that differ by no more than this share of the largest are one.
const SAME: f64 = 0.01;
/// Share of a peak by which a sample may stand out of its neighbours.
const SHARP: f64 = 0.1;
/// Samples at a peak whose mean is the reading.
const TOP: usize = 3;

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
    let mut found: Vec<[usize; 2]> = Vec::new();
    for contact in contacts(n, |k| off(k) > rest.away) {
        let [first, last] = grown(contact, |k| off(k) > 2.0 * rest.noise, n);
        match found.last_mut() {
            Some(before) if first <= before[1] + APART => before[1] = before[1].max(last),
            _ => found.push([first, last]),
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

/// The mean of the samples `of` in a contact.
fn mean(record: &Record, rest: &Rest, kind: Kind, contact: [usize; 2], of: [usize; 2]) -> Reading {
    let n = (of[1] - of[0] + 1) as f64;
    let sum = |values: &[f64]| values[of[0]..=of[1]].iter().sum::<f64>() / n;
    // A peak may be one sample; but what springs out of its neighbours is none.
    let sample = |k: usize| {
        let (smooth, raw) = (rest.signal[k], record.signal[k]);
        let most = AWAY * rest.noise + SHARP * (smooth - rest.level[k]).abs();
        if kind == Kind::Peak { raw.clamp(smooth - most, smooth + most) } else { smooth }
    };
    let samples: Vec<f64> = (of[0]..=of[1]).map(sample).collect();
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

fn of_contact(record: &Record, rest: &Rest, contact: [usize; 2], take: Take) -> Vec<Reading> {
    let [first, last] = contact;
    let off = |k: usize| rest.signal[k] - rest.level[k];
    let top = (first..=last).max_by(|j, k| off(*j).abs().total_cmp(&off(*k).abs())).unwrap_or(first);
    let peak = || {
        let of = [top.saturating_sub(TOP / 2).max(first), (top + TOP / 2).min(last)];
        vec![mean(record, rest, Kind::Peak, contact, of)]
    };
    if take == Take::Peak {
        return peak();
    }
    let drives = record.drive.as_ref().map(|(_, drives)| drives.as_slice());
    let most = drives.map_or(0.0, |d| d.iter().fold(0.0_f64, |m, x| m.max(x.abs())));
    let length = last - first + 1;
    // Quiet around it: the samples next to it lie within the band, and so do their drives. A part of the contact, since a ramp of many samples is no plateau.
    let window = STILL.max(length / PARTS[usize::from(drives.is_some())]);
    let bands = spreads(&rest.signal, window, contact);
    let moved = drives.map(|d| (spreads(d, window, contact), AWAY * noise(d)));
    let quiet = |k: usize| {
        bands[k] <= AWAY * rest.noise + BAND * off(first + k).abs()
            && moved.as_ref().is_none_or(|(spreads, noise)| spreads[k] <= noise.max(SAME * most))
    };
    let enough = STILL.max((LASTS * length as f64) as usize);
    // Of several drives in one contact each plateau counts, however short beside the whole.
    let least = if drives.is_some() { window } else { enough };
    let plateaus = blocks_of(length, 1, quiet).into_iter().map(|[p, q]| [first + p, first + q]);
    let plateaus: Vec<[usize; 2]> = plateaus.filter(|[p, q]| q - p + 1 >= least).collect();
    let settled = |&[p, q]: &[usize; 2]| {
        let from = p + ((q - p + 1) as f64 * SETTLES) as usize;
        mean(record, rest, Kind::Plateau, contact, [from, q])
    };
    let mut found: Vec<Reading> = plateaus.iter().map(settled).collect();
    found.retain(|r| r.drive.is_none_or(|d| d.abs() > SAME * most));
    if drives.is_none() {
        // One tap: its highest plateau.
        found.sort_by(|p, q| (q.signal - q.rest).abs().total_cmp(&(p.signal - p.rest).abs()));
        found.truncate(1);
        found.retain(|r| (r.signal - r.rest).abs() >= HIGH * off(top).abs());
    } else {
        found = joined(record, rest, found, SAME * most);
    }
    match (found.is_empty(), take) {
        (true, Take::Auto) => peak(),
        _ => found,
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
