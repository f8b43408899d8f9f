//! Rows of a data file as taps: which are zero readings, what is subtracted, which belong to one distance and one drive.

use crate::measure::group::Groups;
use crate::measure::zero::{Tared, TaredBy, Zero};
use crate::measure::{Data, Rig, counts};
use crate::reduce::median;

use super::reason::Reason;

/// Rows before contact agree within this share of what half of all taps give.
const STILL: f64 = 0.1;

/// A row with a drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Tap {
    /// Place among the rows of the file.
    pub place: usize,
    /// 1-based line.
    pub line: usize,
    /// Contact distance as labelled, mm.
    pub a: f64,
    /// Drive as labelled, degrees or mm; 1 where it was not recorded.
    pub drive: f64,
    /// Means of the distances and of the drives that are one with those of this tap.
    pub group: [f64; 2],
    /// Signal as recorded.
    pub value: f64,
    /// Zero that was subtracted, in the unit of `signal`.
    pub zero: f64,
    /// Variance that each run of zero readings brings: its place, weight, and share of a reading's variance.
    pub zeros: [(usize, f64, f64); 2],
    /// Drift that was subtracted for want of zero readings, in the unit of `signal`.
    pub drift: f64,
    /// Strain, or the reading; tension positive.
    pub signal: f64,
    /// Why it is not used.
    pub reason: Option<Reason>,
    /// First line with the same text.
    pub twin: Option<usize>,
}

/// A zero reading.
#[derive(Debug, Clone, PartialEq)]
pub struct ZeroReading {
    /// Place among the rows of the file.
    pub place: usize,
    /// Strain, or the reading.
    pub signal: f64,
    /// Why it is not used.
    pub reason: Option<Reason>,
}

/// What a user says of the rows.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Said {
    /// Drive of every tap where no column says.
    pub drive: Option<f64>,
    /// Widths within which distances, and drives, are one; by default from the data.
    pub group: [Option<f64>; 2],
}

/// The rows of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Sorted {
    /// Rows with a drive.
    pub taps: Vec<Tap>,
    /// Rows without contact.
    pub zeros: Vec<ZeroReading>,
    /// The zero that was subtracted.
    pub zero: Zero,
    /// How it was found.
    pub tared: Tared,
    /// Distances and drives that are one.
    pub groups: [Groups; 2],
    /// How far below its zero the drive was without contact, in its unit; 0 where it was not.
    pub before: f64,
}

/// Sorts the rows of `data` into taps and zero readings. Rows that cannot be taps of this whisker have their reason.
pub fn taps(data: &Data, rig: &Rig, said: &Said) -> Sorted {
    let factor = rig.setup.gauge.factor;
    let turn = match data.unit.is_strain() {
        true => None,
        false => counts::turn(data.rows.iter().map(|r| r.value)),
    };
    let signals: Vec<f64> =
        data.rows.iter().map(|r| data.unit.strain(counts::unwrapped(r.value, turn), factor)).collect();
    let (rest, from) = resting(data, &signals);
    let mut zeros = Vec::new();
    let mut taps = Vec::new();
    let mut first_lines = std::collections::HashMap::with_capacity(data.rows.len());
    for (place, row) in data.rows.iter().enumerate() {
        let signal = signals[place];
        if rest[place] {
            let reason = (!signal.is_finite()).then_some(Reason::NotANumber);
            zeros.push(ZeroReading { place, signal, reason });
            continue;
        }
        let twin = match first_lines.entry(row.text) {
            std::collections::hash_map::Entry::Occupied(e) => Some(*e.get()),
            std::collections::hash_map::Entry::Vacant(e) => {
                e.insert(row.line);
                None
            }
        };
        let drive = if data.drive.is_some() { row.drive } else { said.drive.unwrap_or(1.0) };
        let tap = Tap {
            place,
            line: row.line,
            a: row.a,
            drive,
            group: [row.a, drive],
            value: row.value,
            zero: 0.0,
            zeros: [(0, 0.0, 0.0); 2],
            drift: 0.0,
            signal,
            reason: None,
            twin,
        };
        taps.push(tap);
    }
    let usable = |z: &&ZeroReading| z.reason.is_none();
    let readings: Vec<(usize, f64)> = zeros.iter().filter(usable).map(|z| (z.place, z.signal)).collect();
    let mut sizes: Vec<f64> = taps.iter().map(|t| t.signal.abs()).filter(|s| s.is_finite()).collect();
    for place in Zero::outliers(&readings, median(&mut sizes)) {
        zeros.iter_mut().filter(|z| z.place == place).for_each(|z| z.reason = Some(Reason::ZeroOutlier));
    }
    let readings: Vec<(usize, f64)> = zeros.iter().filter(usable).map(|z| (z.place, z.signal)).collect();
    let zero = Zero::new(&readings);
    let groups = [
        Groups::of(taps.iter().map(|t| t.a), said.group[0], false),
        Groups::of(taps.iter().map(|t| t.drive), said.group[1], true),
    ];
    for tap in &mut taps {
        tap.group = [groups[0].centre(tap.a), groups[1].centre(tap.drive)];
        tap.zero = zero.at(tap.place);
        tap.signal -= tap.zero;
        let share = |(r, w): (usize, f64)| (r, w, zero.sizes().get(r).map_or(0.0, |n| 1.0 / *n as f64));
        tap.zeros = zero.weights(tap.place).map(share);
        tap.reason = unusable(tap, rig);
    }
    let mut spread = crate::reduce::Spread::default();
    readings.iter().for_each(|r| spread.push(r.1));
    let error = spread.sd().map_or(0.0, |sd| sd / (readings.len() as f64).sqrt());
    let from = if readings.is_empty() { TaredBy::None } else { from };
    let drives =
        data.rows.iter().enumerate().filter(|(i, r)| rest[*i] && r.drive < 0.0).map(|(_, r)| r.drive);
    let until = drives.reduce(f64::max);
    let tared = Tared { from, value: spread.mean().unwrap_or(0.0), error, until, wraps: turn.is_some() };
    let lowest = data.rows.iter().enumerate().filter(|(i, _)| rest[*i]).map(|(_, r)| -r.drive);
    let before = lowest.fold(0.0, f64::max);
    Sorted { taps, zeros, zero, tared, groups, before }
}

/// Rows without contact: those whose drive is 0, and, where the drive has a zero of its own, those of negative drives up to where the
/// signal begins to change. A negative drive that is also there as a positive one is a slip of the sign.
fn resting(data: &Data, signals: &[f64]) -> (Vec<bool>, TaredBy) {
    let drive = |i: usize| data.rows[i].drive;
    let all = 0..signals.len();
    let at_zero = |i: usize| data.drive.is_some() && drive(i) == 0.0;
    let mut forward: Vec<f64> = all.clone().map(drive).filter(|d| *d > 0.0).collect();
    forward.sort_by(f64::total_cmp);
    let slip = |d: f64| {
        let near = forward.partition_point(|x| *x < -d * (1.0 - 1e-6));
        forward.get(near).is_some_and(|x| *x <= -d * (1.0 + 1e-6))
    };
    let mut before: Vec<usize> =
        all.clone().filter(|&i| drive(i) < 0.0 && signals[i].is_finite() && !slip(drive(i))).collect();
    if before.is_empty() {
        return (all.map(at_zero).collect(), TaredBy::Rows);
    }
    before.sort_by(|i, j| drive(*i).total_cmp(&drive(*j)));
    let lowest = drive(before[0]);
    let mut still: Vec<f64> = before.iter().filter(|i| drive(**i) == lowest).map(|i| signals[*i]).collect();
    let base = median(&mut still);
    let mut sizes: Vec<f64> =
        all.clone().filter(|&i| drive(i) > 0.0).map(|i| (signals[i] - base).abs()).collect();
    sizes.retain(|s| s.is_finite());
    let near = if sizes.is_empty() { 0.0 } else { STILL * median(&mut sizes) };
    let end = before.iter().find(|i| (signals[**i] - base).abs() > near).map_or(0.0, |i| drive(*i));
    let still = |i: usize| (signals[i] - base).abs() <= near;
    let mut rest: Vec<bool> = all.map(|i| at_zero(i) && still(i)).collect();
    before.iter().for_each(|&i| rest[i] = still(i) && drive(i) < end);
    (rest, TaredBy::Plateau)
}

fn unusable(tap: &Tap, rig: &Rig) -> Option<Reason> {
    if !(tap.a.is_finite() && tap.drive.is_finite() && tap.signal.is_finite()) {
        return Some(Reason::NotANumber);
    }
    if !rig.design.admits(rig.setup.drive, tap.a, tap.drive) {
        return Some(Reason::OutsideDomain);
    }
    if tap.a <= rig.shared().gauge[0] {
        return Some(Reason::NoStrain);
    }
    (tap.signal == 0.0).then_some(Reason::ZeroSignal)
}
