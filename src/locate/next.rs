//! Which drive the next tap of an object should have: the one after which its distance is expected to be known best.

use vibrissa_learned::joint::{Joint, Object, Tap};

use super::Locator;
use super::locator::Opened;
use crate::status::Status;

/// Drives that are tried.
const TRIED: usize = 33;
/// Taps more bring nothing where all there could be would not lower σ by more than this share.
pub const NOTHING: f64 = 0.05;
/// As many taps as there could be.
const ALL: f64 = 1e4;

/// A drive that is tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    /// Degrees or mm, as it is recorded.
    pub drive: f64,
    /// The signal above its zero that is expected where the object is most likely: strain, or the unit of the reading.
    pub signal: f64,
    /// σ that is expected after the tap, mm.
    pub sigma: f64,
    /// What forbids it.
    pub status: Status,
}

/// What is known of an object, and what one more tap would bring.
#[derive(Debug, Clone, PartialEq)]
pub struct Next {
    /// Taps so far.
    pub taps: usize,
    /// Distance and σ so far, mm; the middle of the calibrated distances where nothing is known.
    pub now: [f64; 2],
    /// Another distance that fits.
    pub near: Option<f64>,
    /// In the order of their drives.
    pub tried: Vec<Tried>,
    /// Place of the best one that is allowed.
    pub best: Option<usize>,
    /// σ expected after 1, 2, 4 … taps of the best drive.
    pub more: Vec<(u32, f64)>,
    /// σ that no number of taps of the best drive goes below: what they share.
    pub floor: f64,
}

impl Next {
    /// Whether taps more bring nothing.
    pub fn is_enough(&self) -> bool {
        self.now[1] * (1.0 - NOTHING) <= self.floor
    }
}

/// A tap of the object: its drive, as it is recorded, its signal above its zero, and the variance of that zero in units of that of one reading.
pub type Read = (f64, f64, f64);

/// The next tap after `taps`, by drives `within` these ends; they are of a run of the calibration where `same_run`.
///
/// # Errors
/// Why nothing can be said, in words: no learned curve; no drive; taps that fit no distance.
pub fn next(
    locator: &Locator,
    taps: &[Read],
    (within, same_run): ([f64; 2], bool),
) -> Result<Next, &'static str> {
    let asked =
        taps.iter().filter_map(|(drive, signal, share)| Some((locator.asked(*drive, *signal).ok()?, *share)));
    let asked: Vec<_> = asked.collect();
    let place = asked.first().map_or(0, |(tap, _)| tap.side);
    let side = locator.sides().get(place).ok_or("nothing is calibrated")?;
    let learned = side.answers.shape().learned().ok_or("taps are taken together by `learned` only")?;
    let tared = asked
        .first()
        .map_or_else(|| learned.read(1.0, 0.0).0, |(tap, share)| learned.read(tap.signal, *share).0);
    let joint = learned.joint(tared);
    let mut object = Object::new(&joint);
    for (tap, share) in asked.iter().filter(|(tap, _)| tap.side == place) {
        let (_, y, of_zero) = learned.read(tap.signal, *share);
        object.add(&joint, Tap { u: tap.drive, y, of_zero }, same_run);
    }
    let told = object.told(&joint).ok_or("these taps fit no distance")?;
    let known = Known { locator, side, joint: &joint, object: &object, a: told.a, same_run };
    let tried = known.tried(within)?;
    let allowed = tried.iter().enumerate().filter(|(_, t)| t.status == Status::OK && t.sigma.is_finite());
    let best = allowed.min_by(|(_, t), (_, u)| t.sigma.total_cmp(&u.sigma)).map(|(k, _)| k);
    let after = |times: f64| {
        let u = best.map(|k| tried[k].drive - locator.drive_origin);
        u.map_or(f64::NAN, |u| object.after(&joint, u, same_run, times))
    };
    let more = (0..6).map(|k| (1 << k, after(f64::from(1 << k)))).collect();
    let now = [told.a, object.spread(&joint)];
    let floor = after(ALL).min(now[1]);
    Ok(Next { taps: object.count(), now, near: told.near, tried, best, more, floor })
}

/// What is known of an object.
struct Known<'a> {
    locator: &'a Locator,
    side: &'a Opened,
    joint: &'a Joint,
    object: &'a Object,
    a: f64,
    same_run: bool,
}

impl Known<'_> {
    fn tried(&self, within: [f64; 2]) -> Result<Vec<Tried>, &'static str> {
        let origin = self.locator.drive_origin;
        let [first, last] = [self.side.drives[0], self.side.drives[self.side.drives.len() - 1]];
        let [lo, hi] = [first.max(within[0] - origin), last.min(within[1] - origin)];
        if lo > hi {
            return Err("no calibrated drive lies within these limits");
        }
        let count = if lo < hi { TRIED } else { 1 };
        let drives = (0..count).map(|k| lo + (hi - lo) * k as f64 / (count.max(2) - 1) as f64);
        let try_one = |u: f64| {
            let sigma = self.object.after(self.joint, u, self.same_run, 1.0);
            let [signal, largest] = self.signals(u);
            let drive = u + origin;
            Tried { drive, signal: self.side.sign * signal, sigma, status: self.forbids(largest) }
        };
        Ok(drives.map(try_one).collect())
    }

    /// The signal that is expected by the drive u, and the largest of what is likely.
    fn signals(&self, u: f64) -> [f64; 2] {
        let likely = self.object.likely(self.joint);
        let signals = likely.iter().map(|(x, _)| self.joint.signal(u, *x));
        [self.joint.signal(u, self.a.ln()), signals.fold(f64::NEG_INFINITY, f64::max)]
    }

    fn forbids(&self, signal: f64) -> Status {
        if signal >= self.side.end_stop {
            Status::STRAIN_LIMIT
        } else {
            self.locator.limit_of(self.side.sign * signal)
        }
    }
}
