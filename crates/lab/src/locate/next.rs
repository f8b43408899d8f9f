//! Which drive the next tap of an object should have, and where its base should stand: those after which its distance is expected to be known best.

use rayon::prelude::*;

use super::object::{doubts, limit};
use super::{Locator, Opened, Reading};
use crate::status::Status;
use vibrissa_learned::joint::{Joint, Object, Outlook, Tap};

/// Drives that are tried where the base stands.
const TRIED: usize = 33;
/// Places of the base that are tried with [`SOME`] drives, and as many around the best; the best and the present one then with all drives.
const SHIFTS: usize = 9;
/// Drives that are tried at each of these places.
const SOME: usize = 9;
/// Taps more bring nothing where all there could be would not lower σ by more than this share.
pub const NOTHING: f64 = 0.05;
const ALL: f64 = 1e4;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    /// Degrees or mm, as it is recorded.
    pub drive: f64,
    /// Shift of the base towards the object from where distances are counted, mm.
    pub shift: f64,
    /// The signal above its zero that is expected where the object is most likely: strain, or the unit of the reading.
    pub signal: f64,
    /// σ that is expected after the tap, mm.
    pub sigma: f64,
    pub status: Status,
}

/// Knowledge of an object, and the gain by one more tap.
#[derive(Debug, Clone, PartialEq)]
pub struct Next {
    pub taps: usize,
    /// Distance and σ so far, mm; the middle of the calibrated distances where nothing is known.
    pub now: [f64; 2],
    pub near: Option<f64>,
    /// Shift of the base now, towards the object from where distances are counted, mm.
    pub stands: f64,
    /// In the order of their shifts, and of their drives.
    pub tried: Vec<Tried>,
    pub best: Option<usize>,
    /// σ expected after 1, 2, 4 … taps of the best drive.
    pub more: Vec<(u32, f64)>,
    /// σ that no number of taps of the best drive goes below: what they share.
    pub floor: Option<f64>,
    pub status: Status,
    /// Place of the tap that is farthest from what the others say, and by how many standard deviations.
    pub apart: Option<(usize, f64)>,
    /// Places of taps that tell nothing: of the other side, of a drive that was not calibrated, without a distance.
    pub left: Vec<usize>,
}

impl Next {
    /// True if more than one place of the base was tried.
    pub fn moves(&self) -> bool {
        self.tried.first().zip(self.tried.last()).is_some_and(|(first, last)| first.shift != last.shift)
    }

    pub fn is_enough(&self) -> bool {
        self.status != Status::INCONSISTENT
            && self.floor.is_some_and(|floor| self.now[1] * (1.0 - NOTHING) <= floor)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct May {
    /// The least and the largest drive that the motor can do.
    pub within: [f64; 2],
    /// Least and largest shift of the base towards the object, mm; `None` if it stays where it stood for the last tap.
    pub shifts: Option<[f64; 2]>,
    pub same_run: bool,
}

/// A value, or the reason why there is none.
type Said<T> = Result<T, &'static str>;

pub fn next(locator: &Locator, taps: &[Reading], May { within, shifts, same_run }: May) -> Said<Next> {
    let learned = |k: usize| locator.sides[k].learned();
    let first = (0..locator.sides.len()).find(|k| learned(*k).is_some());
    let first = first.ok_or("taps are taken together by `learned`, with one gauge")?;
    // A tap without a distance alone is left out.
    let asked = |(k, tap): (usize, &Reading)| {
        let (signal, share) = (tap.signals[0], tap.shares[0]);
        let asked = locator.asked(tap.drive, signal).ok().filter(|asked| learned(asked.side).is_some())?;
        let alone = locator.locate_above(tap.drive, signal, 0.0, share);
        (alone.distance.is_finite() && tap.shift.is_finite()).then_some((k, asked))
    };
    let mut own: Vec<_> = taps.iter().enumerate().filter_map(asked).collect();
    let place = own.first().map_or(first, |(_, tap)| tap.side);
    own.retain(|(_, tap)| tap.side == place);
    let side = &locator.sides[place];
    let learned = learned(place).ok_or("taps are taken together by `learned`")?;
    let (signal, share) = own.first().map_or((1.0, 0.0), |(k, tap)| (tap.signal, taps[*k].shares[0]));
    let joint = learned.joint(learned.read(signal, share).0, false);
    let mut object = Object::new(joint, same_run);
    for (k, asked) in &own {
        let Reading { zeros: zero, shift, ref shares, .. } = taps[*k];
        let (_, y, of_zero) = learned.read(asked.signal, shares[0]);
        object.add(Tap { u: asked.drive, y, of_zero, zero, shift });
    }
    let places: Vec<usize> = own.iter().map(|(k, _)| *k).collect();
    let stands = places.last().map_or(0.0, |k| taps[*k].shift);
    let left = (0..taps.len()).filter(|k| !places.contains(k)).collect();
    let told = object.told().ok_or("these taps fit no distance")?;
    let outlook = Outlook::new(&object);
    let known = Known { locator, side, joint, outlook: &outlook, frame: object.frame, a: told.a };
    // Before the first tap the object may be anywhere.
    let shifts = shifts.filter(|_| object.count > 0);
    let tried = known.tried(within, shifts, stands)?;
    let best = best(&tried);
    let of_best = best.map(|k| &tried[k]);
    let after = |best: &Tried, times: f64| {
        outlook.after(best.drive - locator.drive_origin, best.shift - object.frame, times)
    };
    let more =
        of_best.map_or(Vec::new(), |best| (0..6).map(|k| (1 << k, after(best, f64::from(1 << k)))).collect());
    let now = [told.a, outlook.spread];
    let least = more.iter().map(|(_, sigma)| *sigma).fold(now[1], f64::min);
    let floor =
        of_best.map(|best| after(best, ALL)).filter(|floor| floor.is_finite()).map(|floor| floor.min(least));
    let mut status = Status::OK;
    let apart = object.apart(told.a).map(|(ago, by)| (places[places.len() - 1 - ago], by));
    if object.count > 0 {
        status |= doubts(side, &object, &told);
    }
    if apart.is_some_and(|(_, by)| by.abs() > limit(object.taps.len())) {
        status |= Status::INCONSISTENT;
    }
    let (taps, near) = (object.count, told.near);
    Ok(Next { taps, now, near, stands, tried, best, more, floor, status, apart, left })
}

struct Known<'a> {
    locator: &'a Locator,
    side: &'a Opened,
    joint: &'a Joint,
    outlook: &'a Outlook<'a>,
    /// Shift of the base for the first tap, towards the object from where distances are counted.
    frame: f64,
    /// Distance that the taps so far tell, mm.
    a: f64,
}

impl Known<'_> {
    /// Tries drives `within` these ends, with the base where it `stands`, or between `shifts`, if any, from where the object is reached.
    fn tried(&self, within: [f64; 2], shifts: Option<[f64; 2]>, stands: f64) -> Said<Vec<Tried>> {
        let origin = self.locator.drive_origin;
        let [first, last] = self.side.ends();
        let ends = [first.max(within[0] - origin), last.min(within[1] - origin)];
        if ends[0] > ends[1] {
            return Err("no calibrated drive lies within these limits");
        }
        // By so many drives, with the base at one place.
        let tried = |shift: f64, count: usize| -> Vec<Tried> {
            let near = shift - self.frame;
            let seen: Vec<f64> = self.outlook.likely.iter().map(|(x, _)| x.exp() - near).collect();
            let one = |u: f64| {
                let signals = seen.iter().map(|a| self.joint.signal(u, a.ln()));
                let largest = signals.fold(f64::NEG_INFINITY, f64::max);
                let stops = largest >= self.side.end_stop;
                let strained = self.locator.limit_of(self.side.sign * largest);
                Tried {
                    drive: u + origin,
                    shift,
                    signal: self.side.sign * self.joint.signal(u, (self.a - shift).ln()),
                    sigma: self.outlook.after(u, near, 1.0),
                    status: if stops { Status::STRAIN_LIMIT } else { strained },
                }
            };
            between(ends, count).collect::<Vec<f64>>().into_par_iter().map(one).collect()
        };
        let [lo, hi] = match shifts.map(|shifts| (shifts, self.reachable(shifts))) {
            Some((_, Some(reachable))) => reachable,
            // The present place is always allowed.
            Some(([nearest, farthest], None)) if !(nearest..=farthest).contains(&stands) => {
                let status = Status::OUTSIDE_CALIBRATION;
                let [shift, signal, sigma] = [nearest, f64::NAN, f64::NAN];
                let none = |u: f64| Tried { drive: u + origin, shift, signal, sigma, status };
                return Ok(between(ends, TRIED).map(none).collect());
            }
            _ => [stands; 2],
        };
        if lo == hi {
            return Ok(tried(lo, TRIED));
        }
        let mut all: Vec<Tried> = between([lo, hi], SHIFTS).flat_map(|shift| tried(shift, SOME)).collect();
        if let Some(k) = best(&all) {
            let step = (hi - lo) / (SHIFTS - 1) as f64;
            let around = [-1.0, 1.0].map(|side| (all[k].shift + side * step).clamp(lo, hi));
            let known: Vec<f64> = all.iter().map(|t| t.shift).collect();
            let is_new = |shift: &f64| !known.iter().any(|k| (k - shift).abs() < 0.01 * step);
            all.extend(between(around, SHIFTS).filter(is_new).flat_map(|shift| tried(shift, SOME)));
        }
        let best = best(&all).map(|k| all[k].shift);
        let here = (lo..=hi).contains(&stands).then_some(stands);
        for shift in best.into_iter().chain(here.filter(|here| Some(*here) != best)) {
            all.retain(|t| t.shift != shift);
            all.extend(tried(shift, TRIED));
        }
        all.sort_by(|p, q| p.shift.total_cmp(&q.shift).then(p.drive.total_cmp(&q.drive)));
        Ok(all)
    }

    /// Of these places of the base those from which the object is within the calibrated distances wherever it is likely.
    fn reachable(&self, [lo, hi]: [f64; 2]) -> Option<[f64; 2]> {
        let likely = || self.outlook.likely.iter().map(|(x, _)| x.exp() + self.frame);
        let [first, last] = self.side.distances;
        let nearest = likely().fold(f64::INFINITY, f64::min) - first;
        let farthest = likely().fold(f64::NEG_INFINITY, f64::max) - last;
        let ends = [lo.max(farthest), hi.min(nearest)];
        (ends[0] <= ends[1]).then_some(ends)
    }
}

fn best(tried: &[Tried]) -> Option<usize> {
    let allowed = tried.iter().enumerate().filter(|(_, t)| t.status == Status::OK && t.sigma.is_finite());
    allowed.min_by(|(_, t), (_, u)| t.sigma.total_cmp(&u.sigma)).map(|(k, _)| k)
}

/// So many numbers from one end to the other, or the one that both are.
fn between([lo, hi]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let count = if lo < hi { count } else { 1 };
    (0..count).map(move |k| lo + (hi - lo) * k as f64 / (count.max(2) - 1) as f64)
}
