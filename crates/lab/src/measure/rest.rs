//! Rows without contact: drive 0, or before contact where the drive has its own zero.

use super::group::Groups;
use super::zero::TaredBy;
use super::{Data, Row};
use crate::reduce::median;

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
        let mut before: Vec<usize> =
            all.clone().filter(|&i| drive(i) < 0.0 && signals[i].is_finite()).collect();
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
