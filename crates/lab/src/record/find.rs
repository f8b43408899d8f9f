//! Contacts in a record, and their readings.

use super::contact::{mean, of_contact};
use super::rest::{Rest, rest};
use super::{Record, certain};
use crate::error::InputError;

/// Contacts that are nearer to each other, in samples, are one.
const APART: usize = 3;
/// A contact below this share of its neighbour, with no rest between, is ringing or creep of the rubber.
const SWINGS: f64 = 0.35;
/// Smoothed samples of a contact at least: of a disturbance of two samples there are four.
const LEAST: usize = 5;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Take {
    /// A plateau where there is one, else the peak.
    Auto,
    Plateau,
    Peak,
}

vibrissa_core::words! {
    /// What a reading is of.
    Kind {
        /// The sensor without contact.
        Rest = "rest",
        /// A contact that stands still.
        Plateau = "plateau",
        /// The largest signal of a contact.
        Peak = "peak",
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    pub kind: Kind,
    /// First and last sample of the contact, or of the rest.
    pub contact: [usize; 2],
    /// First and last sample of which it is the mean.
    pub mean: [usize; 2],
    pub signal: f64,
    /// The level of the rest there.
    pub rest: f64,
    /// Standard deviation of its samples.
    pub sd: f64,
    /// The drive, as recorded.
    pub drive: Option<f64>,
}

/// Rests and contacts of `record` in the order of time.
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
    let mut beyond: Vec<[usize; 2]> = Vec::new();
    for k in (0..n).filter(|k| off(*k) > rest.away) {
        match beyond.last_mut() {
            Some(last) if k - last[1] <= APART => last[1] = k,
            _ => beyond.push([k, k]),
        }
    }
    beyond.retain(|c| c[1] - c[0] + 1 >= LEAST);
    for [mut first, mut last] in beyond {
        // With the samples around it that are off the rest.
        while first > 0 && off(first - 1) > 2.0 * rest.scatter {
            first -= 1;
        }
        while last + 1 < n && off(last + 1) > 2.0 * rest.scatter {
            last += 1;
        }
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
    certain::check(record, &rest, &readings)?;
    Ok((readings, rest))
}
