//! Readings of one contact: plateaus, or its peak.

use super::Record;
use super::find::{Kind, Reading, Take};
use super::rest::{AWAY, Rest, STILL, Span, apart, blocks_of, spreads};
use crate::reduce::{median, sorted};

/// What is higher for no more than this share of a contact, and this many samples, is no part of it.
const RARE: (f64, usize) = (0.03, 5);
/// Share of a contact that a plateau lasts at least.
const LASTS: f64 = 0.15;
/// Band of a plateau, in addition to its noise: share of its level.
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

/// The sample `k` of a peak: one sample is enough, unless it is an isolated spike.
fn sample(record: &Record, rest: &Rest, k: usize) -> f64 {
    let (smooth, raw) = (rest.signal[k], record.signal[k]);
    let most = AWAY * rest.noise + SHARP * (smooth - rest.level[k]).abs();
    raw.clamp(smooth - most, smooth + most)
}

/// The mean of the samples `of` in a contact.
pub fn mean(record: &Record, rest: &Rest, kind: Kind, contact: Span, of: Span) -> Reading {
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
        // The median: a plateau may hold the last sample of a ramp.
        drive: record.drive.as_ref().map(|(_, drives)| match kind {
            Kind::Rest => 0.0,
            _ => median(&mut drives[of[0]..=of[1]].to_vec()),
        }),
    }
}

pub fn of_contact(record: &Record, rest: &Rest, contact: Span, take: Take) -> Vec<Reading> {
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
            let length = last - first + 1;
            let window = STILL.max(length / PARTS);
            let (spreads, moves) =
                (spreads(drives, window, contact), (SAME * most).max(AWAY * apart(drives)));
            // Stretches in which the drive stands still.
            let stays = blocks_of(length, window, |k| spreads[k] <= moves);
            let of = |[p, q]: [usize; 2]| plateau(record, rest, contact, [first + p, first + q], 0.0);
            let found = stays.into_iter().filter_map(of);
            let pushed = found.filter(|r| r.drive.is_none_or(|d| d.abs() > SAME * most));
            let mut plateaus: Vec<Reading> = pushed.collect();
            // Of neighbours of one drive the last has settled most.
            plateaus.dedup_by(|later, before| {
                let drives = before.drive.zip(later.drive);
                let same = drives.is_some_and(|(p, q)| (p - q).abs() <= SAME * most);
                *before = if same { *later } else { *before };
                same
            });
            plateaus
        }
    };
    match (plateaus.is_empty(), take) {
        (true, Take::Auto) => vec![peak(record, rest, contact, top)],
        _ => plateaus,
    }
}

/// The plateau in the `stretch` of a contact, at least so `high`: the level near which the signal is longest, and the longest time that it is near it without break.
fn plateau(record: &Record, rest: &Rest, contact: Span, stretch: Span, high: f64) -> Option<Reading> {
    let [first, last] = stretch;
    let off = |k: usize| rest.signal[k] - rest.level[k];
    let band = |level: f64| (NEAR * rest.scatter).max(BAND * level.abs());
    let sorted = sorted((first..=last).map(off));
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
fn peak(record: &Record, rest: &Rest, contact: Span, top: usize) -> Reading {
    let off = |k: usize| (rest.signal[k] - rest.level[k]).abs();
    let near = |k: &usize| off(*k) >= off(top) - (NEAR * rest.scatter).max(NEXT * off(top));
    let [first, last] = [top.saturating_sub(1).max(contact[0]), (top + 1).min(contact[1])];
    let first = (contact[0]..first).rev().take_while(near).last().unwrap_or(first);
    let last = (last + 1..=contact[1]).take_while(near).last().unwrap_or(last);
    let told = mean(record, rest, Kind::Peak, contact, [first, last]);
    // Least squares of level + slope x + curve x² on places −1 … 1.
    let n = last - first;
    let place = |k: usize| 2.0 * (k - first) as f64 / n as f64 - 1.0;
    let [xx, xxxx, xy, xxy] = (first..=last).fold([0.0; 4], |[xx, xxxx, xy, xxy], k| {
        let (x, y) = (place(k), sample(record, rest, k) - told.signal);
        [xx + x * x, xxxx + x.powi(4), xy + x * y, xxy + x * x * y]
    });
    let curve = xxy / (xxxx - xx * xx / (n + 1) as f64);
    let (slope, level) = (xy / xx, -curve * xx / (n + 1) as f64);
    // A top outside the samples is none.
    let at = -0.5 * slope / curve;
    if !(-1.0..=1.0).contains(&at) || !curve.is_finite() {
        return told;
    }
    let signal = told.signal + level + at * (slope + at * curve);
    let place = first as f64 + 0.5 * (at + 1.0) * n as f64;
    let (k, t) = (place as usize, place.fract());
    let drive = record.drive.as_ref().map(|(_, d)| d[k] + t * (d[(k + 1).min(last)] - d[k]));
    Reading { signal, drive, ..told }
}
