//! Contacts in a record, their readings, and whether it is certain where the record rests: nothing but its shape says what is no contact.

use super::Record;
use super::contact::{mean, of_contact};
use super::rest::{Rest, rest};
use crate::{error::InputError, reduce::median};

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
    /// The kind of a reading.
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
    if let Some((kind, _)) = record.drive.as_ref().filter(|(_, drives)| drives.iter().all(|d| *d == 0.0)) {
        let error = InputError::new("this drive is 0 throughout, so that it says of no tap");
        let error = error.at(record.file.clone(), None).key(kind.column());
        return Err(error.allowed("the drive of each sample; --columns ignore=NAME leaves it out"));
    }
    let rest = rest(record);
    let fault = |message: &str, allowed: &str| {
        let error = InputError::new(message).at(record.file.clone(), None).key("signal");
        Err(error.value(format!("noise {:.3e}", rest.noise)).allowed(allowed))
    };
    if rest.blocks.is_empty() {
        let (what, shows) =
            ("nowhere does this signal rest", "a record that also shows the sensor without contact");
        return match record
            .drive
            .as_ref()
            .map(|(kind, _)| format!("{what} while {} is near 0", kind.column()))
        {
            Some(what) => fault(&what, &format!("{shows}; --columns ignore=NAME leaves a drive out")),
            None => fault(what, &format!("{shows}, for five samples or more")),
        };
    }
    let off = |k: usize| (rest.signal[k] - rest.level[k]).abs();
    let mut readings: Vec<Reading> =
        rest.blocks.iter().map(|&block| mean(record, &rest, Kind::Rest, block, block)).collect();
    let n = record.signal.len();
    let largest = |[first, last]: [usize; 2]| (first..=last).map(off).fold(0.0, f64::max);
    let mut found: Vec<[usize; 2]> = Vec::new();
    let away: Vec<usize> = (0..n).filter(|k| off(*k) > rest.away).collect();
    let beyond = away.chunk_by(|j, k| k - j <= APART).map(|c| [c[0], c[c.len() - 1]]);
    for [first, last] in beyond.filter(|c| c[1] - c[0] + 1 >= LEAST) {
        // With the samples around it that are off the rest.
        let stands = |k: &usize| off(*k) > 2.0 * rest.scatter;
        let first = (0..first).rev().take_while(stands).last().unwrap_or(first);
        let last = (last + 1..n).take_while(stands).last().unwrap_or(last);
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
        let allowed = "taps that stand out of the noise by six standard deviations; --take peak where none stands still";
        return fault("no tap is found in this signal", allowed);
    }
    readings.sort_by_key(|r| r.mean[0]);
    certain(record, &rest, &readings)?;
    Ok((readings, rest))
}

/// A rest is at the level of the one before it, but for this share of the contact between them.
const MOVED: f64 = 0.4;
/// And near the line through the one before and the one after, but for this share of the larger contact beside it.
const JAGGED: f64 = 0.1;
/// Humps of a contact: one ends below the first share of the height, another begins above the second and lasts for the third of the longest.
const ONCE: [f64; 3] = [0.4, 0.6, 0.25];
/// A contact is to one side of the rests: no more than this share of it to the other...
const OTHER: f64 = 0.5;
/// ...for no more than this share of the time: a whisker that comes free swings.
const FREE: f64 = 0.25;
/// A signal that rests is as long within a band about its level as within a wider one, but for this share; one that only turns is 0.63 or 0.4 of it.
const STAYS: f64 = 0.75;
/// The narrow band: share of the contacts beside it, and standard deviations of smoothed noise.
const BAND: (f64, f64) = (0.02, 4.0);
/// The wide one, in narrow ones.
const WIDER: f64 = 2.5;
/// Share of the rests that may be too short to judge.
const SHORT: f64 = 0.25;
/// Contacts whose levels differ by less than this share, and last as long as rests but for this factor, may as well be the rests.
const EQUAL: f64 = 0.05;
const AS_LONG: f64 = 1.5;
/// Contacts that make a pattern, at least.
const PATTERN: usize = 3;

/// A contact between two rests: largest deviations to either side, and the samples beyond half of the larger.
struct Between {
    height: f64,
    moved: f64,
    least: f64,
    times: [usize; 2],
}

/// Refuses a record without drive whose rests are not certain.
fn certain(record: &Record, rest: &Rest, readings: &[Reading]) -> Result<(), InputError> {
    if record.drive.is_some() {
        return Ok(());
    }
    let fault = |what: String, value: f64| {
        let message = format!("it is not certain where this signal rests: {what}");
        let error = InputError::new(message).at(record.file.clone(), None).key("signal");
        Err(error.value(format!("{value:.4e}")).allowed(
            "a record that rests at one level before and after each contact; or a column theta_deg or delta_mm with the drive of each \
             sample, which says what is no contact",
        ))
    };
    let time = |k: usize| record.time[k];
    let blocks = &rest.blocks;
    let levels: Vec<f64> = blocks.iter().map(|block| level(rest, *block)).collect();
    let between = |k: usize| {
        let off = (blocks[k][1]..=blocks[k + 1][0]).map(|k| rest.signal[k] - rest.level[k]);
        let off: Vec<f64> = off.collect();
        let [up, down] = [1.0, -1.0].map(|sign| off.iter().map(|x| sign * x).fold(0.0, f64::max));
        let height = up.max(down);
        let times = [1.0, -1.0].map(|sign| off.iter().filter(|x| sign * **x > OTHER * height).count());
        Between { height, moved: (levels[k + 1] - levels[k]).abs(), least: up.min(down), times }
    };
    let all: Vec<Between> = (1..blocks.len()).map(|k| between(k - 1)).collect();
    for (w, b) in blocks.windows(2).zip(&all).filter(|(_, b)| b.height > rest.away) {
        let [from, to] = [time(w[0][1]), time(w[1][0])];
        if b.moved > MOVED * b.height {
            let what =
                format!("what is still before {from} s and after {to} s differs by much of what is between");
            return fault(what, b.moved);
        }
        let [up, down] = b.times;
        if b.least > OTHER * b.height && up.min(down) as f64 > FREE * up.max(down) as f64 {
            let what = format!("from {from} to {to} s it goes to both sides without a rest between");
            return fault(what, b.least);
        }
    }
    for [first, last] in readings.iter().filter(|r| r.kind != Kind::Rest).map(|r| r.contact) {
        let off = (first..=last).map(|k| (rest.signal[k] - rest.level[k]).abs());
        let n = humps(&off.collect::<Vec<_>>());
        if n > 1 {
            let [from, to] = [time(first), time(last)];
            let what = format!("from {from} to {to} s it goes up and down {n} times without a rest between");
            return fault(what, rest.signal[first]);
        }
    }
    let heights = |k: usize| {
        let beside = [k.checked_sub(1).and_then(|i| all.get(i)), all.get(k)];
        beside.into_iter().flatten().map(|b| b.height).filter(|h| *h > rest.away).reduce(f64::min)
    };
    // Rests that are not at the begin or at the end of the record.
    let near = |k: usize| (rest.signal[k] - rest.level[k]).abs() <= rest.away;
    let within =
        |[first, last]: [usize; 2]| !(0..first).all(near) && !(last + 1..rest.signal.len()).all(near);
    let inner: Vec<usize> = (0..blocks.len()).filter(|k| within(blocks[*k])).collect();
    let often = |so: &[usize], of: usize| so.first().copied().filter(|_| so.len() as f64 > SHORT * of as f64);
    let turns = |k: &usize| heights(*k).is_some_and(|height| !stays(rest, blocks[*k], height));
    let turns: Vec<usize> = inner.iter().copied().filter(turns).collect();
    if let Some(first) = often(&turns, inner.len()) {
        let what = format!("at {} s, and elsewhere, it turns rather than rests", time(blocks[first][0]));
        return fault(what, rest.level[blocks[first][0]]);
    }
    let jagged = |k: &usize| {
        let beside = all[k - 1].height.max(all[*k].height);
        (levels[*k] - 0.5 * (levels[k - 1] + levels[k + 1])).abs() > JAGGED * beside && beside > rest.away
    };
    let several = 1..blocks.len().saturating_sub(1);
    let jagged: Vec<usize> = several.clone().filter(jagged).collect();
    if let Some(first) = often(&jagged, several.len()).filter(|_| jagged.len() > 1) {
        let at = time(blocks[first][0]);
        let what = "and elsewhere, is at another level than what is before and after";
        return fault(format!("what is still at {at} s, {what}"), levels[first]);
    }
    let contacts: Vec<&Reading> = readings.iter().filter(|r| r.kind != Kind::Rest).collect();
    if let Some(level) = alike(rest, &contacts, &inner) {
        let what =
            "rests and contacts are alike, each at one level for the same time: which of them is contact?";
        return fault(what.to_owned(), level);
    }
    Ok(())
}

fn level(rest: &Rest, [first, last]: [usize; 2]) -> f64 {
    median(&mut rest.signal[first..=last].to_vec())
}

/// How often a contact, which is so far `off` its rest, goes up and down.
fn humps(off: &[f64]) -> usize {
    let [ends, begins, lasts] = ONCE;
    let height = off.iter().copied().fold(0.0, f64::max);
    let ups = off.iter().scan(false, |up, off| {
        *up = *off > begins * height || *up && *off > ends * height;
        Some(*up)
    });
    let ups: Vec<bool> = ups.collect();
    let all: Vec<usize> = ups.chunk_by(|p, q| p == q).filter(|c| c[0]).map(<[bool]>::len).collect();
    let longest = all.iter().copied().max().unwrap_or_default();
    all.iter().filter(|n| **n as f64 > lasts * longest as f64).count()
}

/// True if the signal stays at a rest, which may drift, beside contacts of this `height`, rather than turns there.
fn stays(rest: &Rest, [first, last]: [usize; 2], height: f64) -> bool {
    let middle = (first + last) / 2;
    let [p, q] = [level(rest, [first, middle]), level(rest, [(middle + 1).min(last), last])];
    let slope = (q - p) / (0.5 * (last - first + 1) as f64);
    let off = |k: usize| rest.signal[k] - 0.5 * (p + q) - slope * (k as f64 - 0.5 * (first + last) as f64);
    let band = (BAND.0 * height).max(BAND.1 * rest.scatter);
    let lasts = |band: f64| {
        let near = |k: &usize| off(*k).abs() <= band;
        let before = (0..first).rev().take_while(near).count();
        let after = (last + 1..rest.signal.len()).take_while(near).count();
        (first..=last).filter(near).count() + before + after
    };
    lasts(band) as f64 >= STAYS * lasts(WIDER * band) as f64
}

/// The level of the contacts where they are all at one, and last as long as the rests between them, and those at the ends of the record.
fn alike(rest: &Rest, contacts: &[&Reading], inner: &[usize]) -> Option<f64> {
    if contacts.len() < PATTERN || inner.is_empty() {
        return None;
    }
    let mut heights: Vec<f64> = contacts.iter().map(|r| r.signal - r.rest).collect();
    let [lo, hi] = [f64::min, f64::max].map(|of| heights.iter().copied().fold(heights[0], of));
    let usual = median(&mut heights);
    let length = |[first, last]: [usize; 2]| (last - first + 1) as f64;
    // Without its ramps.
    let held = |r: &&Reading| {
        let near = |k: &usize| (rest.signal[*k] - r.signal).abs() <= EQUAL * (r.signal - r.rest).abs();
        (r.contact[0]..=r.contact[1]).filter(near).count() as f64
    };
    let of_contacts = median(&mut contacts.iter().map(held).collect::<Vec<_>>());
    let of_rests = median(&mut inner.iter().map(|k| length(rest.blocks[*k])).collect::<Vec<_>>());
    let longest = rest.blocks.iter().map(|b| length(*b)).fold(0.0, f64::max);
    let same_time =
        (1.0 / AS_LONG..AS_LONG).contains(&(of_contacts / of_rests)) && longest < AS_LONG * of_rests;
    (hi - lo < EQUAL * usual.abs() && same_time).then_some(contacts[0].signal)
}
