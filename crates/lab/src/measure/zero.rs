//! The sensor's zero: rows without contact (drive 0, or before contact where the drive has its own zero), joined by straight lines in file order.

use super::{Data, Groups, Row};
use crate::reduce::median;
use serde::{Deserialize, Serialize};

/// Source of a signal's zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TaredBy {
    /// Rows with drive 0.
    Rows,
    /// Rows before contact, whose signal does not depend on drive and distance.
    Plateau,
    /// A constant with which the signals of all drives agree.
    Fitted,
    /// None: the signal counts as tared.
    None,
}

/// The zero of the signal of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tared {
    /// Its source.
    pub from: TaredBy,
    /// Mean subtracted value, in strain or the unit of the reading.
    pub value: f64,
    /// Standard error of a constant zero, same unit; 0 if the zero is not known.
    pub error: f64,
    /// Largest drive before contact, if other than 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
    /// True if readings are 16-bit counts that wrap.
    pub wraps: bool,
}

impl Tared {
    /// True if a row with this drive is a zero reading.
    pub fn rests(&self, drive: f64) -> bool {
        drive == 0.0 || self.until.is_some_and(|until| drive <= until)
    }

    /// Standard error of an unread zero, which may have drifted; 0 if the zero was read or is unknown.
    pub fn unread(&self) -> f64 {
        if matches!(self.from, TaredBy::Rows | TaredBy::Plateau) { 0.0 } else { self.error }
    }
}

/// One of three or four readings is an outlier if the others agree within this share of its deviation.
const TOGETHER: f64 = 0.01;

/// Zero readings of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Zero {
    /// Of each run of zero readings, in file order: mean index in the file, mean value, number of readings.
    runs: Vec<(f64, f64, usize)>,
    /// Number of zero readings.
    pub count: usize,
}

impl Zero {
    /// From (index in the file, value) in file order. Readings without a tap between them form one run.
    pub fn new(readings: &[(usize, f64)]) -> Self {
        let add = |(p, v, n): (f64, f64, usize), &(place, value): &(usize, f64)| {
            let n = n + 1;
            (p + (place as f64 - p) / n as f64, v + (value - v) / n as f64, n)
        };
        let run = |readings: &[(usize, f64)]| readings.iter().fold((0.0, 0.0, 0), add);
        let runs = readings.chunk_by(|p, q| q.0 == p.0 + 1).map(run).collect();
        Self { runs, count: readings.len() }
    }

    /// Zero at an index of the file; constant before the first and after the last reading; 0 without any.
    pub fn at(&self, place: usize) -> f64 {
        self.weights(place).iter().filter(|w| w.1 != 0.0).map(|(r, w, _)| w * self.runs[*r].1).sum()
    }

    /// The runs that determine the zero at an index: their weights, and the variance of their means in units of a reading's.
    pub fn weights(&self, place: usize) -> [(usize, f64, f64); 2] {
        let x = place as f64;
        let next = self.runs.partition_point(|run| run.0 < x);
        let of = |run: usize, weight: f64| (run, weight, 1.0 / self.runs[run].2 as f64);
        match (next.checked_sub(1).map(|i| self.runs[i].0), self.runs.get(next)) {
            (Some(p), Some(&(q, ..))) => {
                let w = (x - p) / (q - p);
                [of(next - 1, 1.0 - w), of(next, w)]
            }
            (Some(_), None) => [of(next - 1, 1.0), (0, 0.0, 0.0)],
            (None, Some(_)) => [of(next, 1.0), (0, 0.0, 0.0)],
            (None, None) => [(0, 0.0, 0.0); 2],
        }
    }

    /// Largest zero minus smallest.
    pub fn drift(&self) -> f64 {
        let values = || self.runs.iter().map(|run| run.1);
        (values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)).max(0.0)
    }

    /// Zero readings off the median of their neighbours by more than 8 standard deviations and a tenth of `scale`: probably taps. Of three or four
    /// readings, one is an outlier if the others agree.
    pub fn outliers(readings: &[(usize, f64)], scale: f64) -> Vec<usize> {
        if readings.len() < 5 {
            let middle = median(&mut readings.iter().map(|r| r.1).collect::<Vec<_>>());
            let mut off: Vec<(usize, f64)> = readings.iter().map(|r| (r.0, (r.1 - middle).abs())).collect();
            off.sort_by(|p, q| q.1.total_cmp(&p.1));
            return match off[..] {
                [(place, off), (_, next), _, ..] if off > 0.1 * scale && next < TOGETHER * off => vec![place],
                _ => Vec::new(),
            };
        }
        let off = |i: usize| {
            let from = i.saturating_sub(2).min(readings.len() - 5);
            let mut near: Vec<f64> = readings[from..from + 5].iter().map(|r| r.1).collect();
            (readings[i].1 - median(&mut near)).abs()
        };
        let off: Vec<f64> = (0..readings.len()).map(off).collect();
        let usual = median(&mut off.clone());
        let far = |&i: &usize| off[i] > 8.0 * 1.4826 * usual && off[i] > 0.1 * scale;
        (0..readings.len()).filter(far).map(|i| readings[i].0).collect()
    }
}

/// Rows before contact agree within this share of the median tap.
const STILL: f64 = 0.1;
/// A tap at a negative drive gives less than this share of one at the smallest positive drive.
const LESS: f64 = 0.95;

/// Rows without contact.
pub struct Rest {
    /// True for rows without contact.
    pub rest: Vec<bool>,
    /// Source of the zero.
    pub from: TaredBy,
    /// Largest negative drive before contact.
    pub until: Option<f64>,
    /// Drive that counts as 0: `until` if contact begins at drives ≤ 0, else 0.
    pub origin: f64,
    /// Distance from `origin` to the first drive in contact.
    pub step: f64,
}

impl Rest {
    /// Finds them in `data` with these `signals`: the most negative drives, up to where the signal changes. A negative drive that also occurs as a
    /// positive one is a wrong sign or the other side, unless its signals are constant and beyond those of the smallest positive drive.
    pub fn of(data: &Data, signals: &[f64], distances: &Groups) -> Self {
        let rows = RestRows { data, signals, distances };
        let all = 0..signals.len();
        let drive = |i: usize| data.rows[i].drive;
        let at_zero = |i: usize| data.drive.is_some() && drive(i) == 0.0;
        let mut before: Vec<_> = all.clone().filter(|&i| drive(i) < 0.0 && signals[i].is_finite()).collect();
        before.sort_by(|i, j| drive(*i).total_cmp(&drive(*j)));
        let lowest = before.chunk_by(|i, j| drive(*i) == drive(*j)).find(|level| rows.before_contact(level));
        let Some(level) = lowest else {
            let rest = all.map(at_zero).collect();
            return Self { rest, from: TaredBy::Rows, until: None, origin: 0.0, step: 0.0 };
        };
        let base = median(&mut level.iter().map(|i| signals[*i]).collect::<Vec<_>>());
        let mut sizes: Vec<f64> =
            all.clone().filter(|&i| drive(i) > 0.0).map(|i| (signals[i] - base).abs()).collect();
        sizes.retain(|s| s.is_finite());
        let near = if sizes.is_empty() { 0.0 } else { STILL * median(&mut sizes) };
        let still = |i: usize| (signals[i] - base).abs() <= near;
        let first = drive(level[0]);
        let moved = |i: &usize| {
            drive(*i) >= first && !still(*i) && (!rows.mirrored(drive(*i)) || rows.less(*i, base))
        };
        let end = before.iter().copied().find(moved).map_or(0.0, drive);
        let rest: Vec<bool> =
            all.clone().map(|i| still(i) && (at_zero(i) || (first..end).contains(&drive(i)))).collect();
        let until = all.clone().filter(|&i| rest[i] && drive(i) < 0.0).map(drive).reduce(f64::max);
        let touching = |&i: &usize| drive(i) <= 0.0 && drive(i) > first && !rest[i] && rows.less(i, base);
        let touched = all.filter(touching).map(drive).reduce(f64::min);
        let (origin, step) =
            until.zip(touched).map_or((0.0, 0.0), |(until, touched)| (until, touched - until));
        Self { rest, from: TaredBy::Plateau, until, origin, step }
    }
}

struct RestRows<'a> {
    data: &'a Data,
    signals: &'a [f64],
    distances: &'a Groups,
}

impl RestRows<'_> {
    fn forward(&self, wanted: impl Fn(&Row) -> bool) -> Vec<(f64, f64)> {
        let rows = self.data.rows.iter().zip(self.signals);
        let taps = rows.filter(|(r, s)| r.drive > 0.0 && s.is_finite() && wanted(r));
        let mut all: Vec<(f64, f64)> = taps.map(|(r, s)| (r.drive, *s)).collect();
        all.sort_by(|p, q| p.0.total_cmp(&q.0));
        all
    }

    /// Median signals at the smallest and the largest positive drive of the row's distance; of all rows if it has none.
    fn ends(&self, i: usize) -> Option<[f64; 2]> {
        let place = |r: &Row| self.distances.centre(r.a);
        let own = place(&self.data.rows[i]);
        let here = self.forward(|r| place(r) == own);
        let taps = if here.is_empty() { self.forward(|_| true) } else { here };
        let (first, last) = (taps.first()?.0, taps.last()?.0);
        let at = |d: f64| median(&mut taps.iter().filter(|t| t.0 == d).map(|t| t.1).collect::<Vec<_>>());
        Some([at(first), at(last)])
    }

    fn mirrored(&self, drive: f64) -> bool {
        self.data.rows.iter().any(|r| (r.drive + drive).abs() <= -1e-6 * drive)
    }

    /// True if the row's signal above `base` is less than that of the smallest positive drive.
    fn less(&self, i: usize, base: f64) -> bool {
        self.ends(i).is_some_and(|[small, _]| {
            let share = (self.signals[i] - base) / (small - base);
            (0.0..LESS).contains(&share)
        })
    }

    /// True if most other distances have this drive with a positive sign, and the row's own has not: a wrong sign.
    fn slipped(&self, i: usize) -> bool {
        let row = &self.data.rows[i];
        let place = |r: &Row| self.distances.centre(r.a).to_bits();
        let mut places = std::collections::BTreeMap::<u64, bool>::new();
        for other in self.data.rows.iter().filter(|r| r.drive > 0.0) {
            *places.entry(place(other)).or_default() |= (row.drive + other.drive).abs() <= 1e-6 * other.drive;
        }
        let own = places.remove(&place(row));
        own == Some(false) && 2 * places.values().filter(|has| **has).count() > places.len()
    }

    /// True if rows of the most negative drive are before contact.
    fn before_contact(&self, level: &[usize]) -> bool {
        if !self.mirrored(self.data.rows[level[0]].drive) {
            return true;
        }
        if level.iter().all(|i| self.slipped(*i)) {
            return false;
        }
        let negative = |d: &f64| self.data.rows.iter().any(|r| (r.drive + d).abs() <= 1e-6 * d);
        let mut forward: Vec<f64> = self.forward(|_| true).iter().map(|t| t.0).collect();
        forward.dedup();
        let mut signals: Vec<f64> = level.iter().map(|i| self.signals[*i]).collect();
        let places = |i: &usize| self.distances.centre(self.data.rows[*i].a).to_bits();
        let several = level.iter().any(|i| places(i) != places(&level[0]));
        let base = median(&mut signals);
        let beyond = |i: &usize| {
            self.ends(*i).is_some_and(|[small, large]| {
                let signal = self.signals[*i];
                let other_side = self.data.unit.is_absolute()
                    && signal * large < 0.0
                    && signal.abs() > STILL * large.abs();
                let still = (signal - base).abs() <= STILL * (small - base).abs();
                (signal - small) * (small - large) > 0.0 && still && !other_side
            })
        };
        let both_sides = 2 * forward.iter().filter(|d| negative(d)).count() >= forward.len();
        level.iter().all(beyond) && (several || !both_sides)
    }
}
