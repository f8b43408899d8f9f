//! Which drive the next tap of an object should have: the one after which its distance is expected to be known best.

use vibrissa_learned::joint::{Joint, Object, Outlook, Tap};

use super::Locator;
use super::object::limit;
use super::opened::Opened;
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
    pub floor: Option<f64>,
    /// What is doubtful of the taps so far.
    pub status: Status,
    /// Place of the tap that is farthest from what the others say, and by how many standard deviations.
    pub apart: Option<(usize, f64)>,
    /// Places of taps that tell nothing: of the other side, of a drive that was not calibrated, without a distance.
    pub left: Vec<usize>,
}

impl Next {
    /// Whether taps more bring nothing.
    pub fn is_enough(&self) -> bool {
        self.status != Status::INCONSISTENT
            && self.floor.is_some_and(|floor| self.now[1] * (1.0 - NOTHING) <= floor)
    }
}

/// A tap of the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Read {
    /// Drive, as it is recorded.
    pub drive: f64,
    /// Signal above its zero.
    pub signal: f64,
    /// Variance of that zero in units of that of one reading.
    pub share: f64,
    /// Which zero that is.
    pub zero: u64,
}

/// The next tap after `taps`, by drives `within` these ends; they are of a run of the calibration where `same_run`.
///
/// # Errors
/// Why nothing can be said, in words: no learned curve; no drive; taps that fit no distance.
pub fn next(
    locator: &Locator,
    taps: &[Read],
    (within, same_run): ([f64; 2], bool),
) -> Result<Next, &'static str> {
    let learned_side = |k: &usize| locator.sides()[*k].answers.shape().learned().is_some();
    let first = (0..locator.sides().len()).find(learned_side);
    let first = first.ok_or("taps are taken together by `learned`, with one gauge")?;
    // A tap without a distance of its own tells none together with others either.
    let asked = |tap: &Read| {
        let alone = locator.locate_above(tap.drive, tap.signal, 0.0, tap.share);
        locator
            .asked(tap.drive, tap.signal)
            .ok()
            .filter(|asked| learned_side(&asked.side) && alone.distance.is_finite())
    };
    let asked: Vec<_> = taps.iter().map(asked).collect();
    let place = asked.iter().flatten().next().map_or(first, |tap| tap.side);
    let side = &locator.sides()[place];
    let learned = side.answers.shape().learned().ok_or("taps are taken together by `learned`")?;
    let own = || {
        taps.iter().zip(&asked).enumerate().filter_map(|(k, (tap, asked))| Some((k, tap, asked.as_ref()?)))
    };
    let own = || own().filter(|(.., asked)| asked.side == place);
    let tared = own()
        .next()
        .map_or_else(|| learned.read(1.0, 0.0).0, |(_, tap, asked)| learned.read(asked.signal, tap.share).0);
    let joint = learned.joint(tared);
    let mut object = Object::new(&joint);
    let mut places = Vec::new();
    for (k, tap, asked) in own() {
        let (_, y, of_zero) = learned.read(asked.signal, tap.share);
        object.add(&joint, Tap { u: asked.drive, y, of_zero, zero: tap.zero }, same_run);
        places.push(k);
    }
    let left = (0..taps.len()).filter(|k| !places.contains(k)).collect();
    let told = object.told(&joint).ok_or("these taps fit no distance")?;
    let outlook = Outlook::new(&joint, &object, same_run);
    let known = Known { locator, side, joint: &joint, outlook: &outlook, a: told.a };
    let tried = known.tried(within)?;
    let allowed = tried.iter().enumerate().filter(|(_, t)| t.status == Status::OK && t.sigma.is_finite());
    let best = allowed.min_by(|(_, t), (_, u)| t.sigma.total_cmp(&u.sigma)).map(|(k, _)| k);
    let after = |u: f64, times: f64| outlook.after(u, times);
    let of_best = best.map(|k| tried[k].drive - locator.drive_origin);
    let more =
        of_best.map_or(Vec::new(), |u| (0..6).map(|k| (1 << k, after(u, f64::from(1 << k)))).collect());
    let now = [told.a, outlook.spread()];
    let floor =
        of_best.map(|u| after(u, ALL)).filter(|floor| floor.is_finite()).map(|floor| floor.min(now[1]));
    let mut status = Status::OK;
    let compared = places.len() - places.len().min(object.compared());
    let apart =
        object.apart(&joint, told.a.ln(), same_run).map(|(ago, by)| (places[places.len() - 1 - ago], by));
    if object.count() > 0 {
        status |= side.doubts(told.a, told.near, told.sigma);
    }
    if apart.is_some_and(|(_, by)| by.abs() > limit(places.len() - compared)) {
        status |= Status::INCONSISTENT;
    }
    Ok(Next { taps: object.count(), now, near: told.near, tried, best, more, floor, status, apart, left })
}

/// What is known of an object.
struct Known<'a> {
    locator: &'a Locator,
    side: &'a Opened,
    joint: &'a Joint,
    outlook: &'a Outlook<'a>,
    a: f64,
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
            let sigma = self.outlook.after(u, 1.0);
            let [signal, largest] = self.signals(u);
            let drive = u + origin;
            Tried { drive, signal: self.side.sign * signal, sigma, status: self.forbids(largest) }
        };
        Ok(drives.map(try_one).collect())
    }

    /// The signal that is expected by the drive u, and the largest of what is likely.
    fn signals(&self, u: f64) -> [f64; 2] {
        let signals = self.outlook.likely().iter().map(|(x, _)| self.joint.signal(u, *x));
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
