//! Expected benefit of one more tap of an object: what is known after it, if it gives the signal that is most likely where the object may be.
//! n more taps at one drive count as their mean; the information in their scatter is neglected.

use super::object::{Object, likely, spread_of};
use super::{Joint, NEAR};
use crate::invert::lagrange;

/// State of an object before one more tap.
pub struct Outlook<'a> {
    joint: &'a Joint,
    object: &'a Object,
    same_run: bool,
    spread: f64,
    likely: Vec<(f64, f64)>,
}

impl<'a> Outlook<'a> {
    /// State after the taps of `object`; `same_run` if the next taps are of a run of the calibration.
    pub fn new(joint: &'a Joint, object: &'a Object, same_run: bool) -> Self {
        let heights = object.heights(joint);
        let (spread, likely) = (spread_of(joint, &heights), likely(joint, &heights));
        Self { joint, object, same_run, spread, likely }
    }

    /// RMS deviation from the mean of the present posterior, mm.
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// Nodes in ln a that represent the posterior, from the base of the first tap, with their shares.
    pub fn likely(&self) -> &[(f64, f64)] {
        &self.likely
    }

    /// Expected [`Self::spread`] after `times` more taps at drive `u`, with the base shifted by `shift` mm from the first tap.
    pub fn after(&self, u: f64, shift: f64, times: f64) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (x, share) in &self.likely {
            let mut tap = self.object.next(u, shift);
            tap.y = self.joint.signal(u, self.joint.seen(*x, shift)) + self.beside(*x, u, shift);
            let mut then = self.object.clone();
            then.weigh(self.joint, tap, self.same_run, times);
            sum += share * spread_of(self.joint, &then.heights(self.joint));
            total += share;
        }
        sum / total
    }

    /// By how much the shared numbers, as the taps so far tell them, move the next tap if the object is at ln a = x.
    fn beside(&self, x: f64, u: f64, shift: f64) -> f64 {
        let (first, t) = self.joint.place(x);
        let slice = self.joint.shifted(u, shift, self.same_run, first..first + NEAR);
        let points = slice.chunks(self.joint.width()).zip(first..);
        let moved = points.map(|(point, k)| self.object.moved(k, &point[2..]));
        lagrange::<NEAR>(t).iter().zip(moved).map(|(w, e)| w * e).sum()
    }
}
