//! Expected benefit of one more tap of an object: what is known after it, if it gives the signal that is most likely where the object may be.
//! n more taps at one drive count as their mean; the information in their scatter is neglected.

use super::NEAR;
use super::object::{Object, likely, spread_of};
use crate::invert::lagrange;

/// State of an object before one more tap.
pub struct Outlook<'a> {
    object: &'a Object<'a>,
    /// RMS deviation from the mean of the present posterior, mm.
    pub spread: f64,
    /// Nodes in ln a that represent the posterior, from the base of the first tap, with their shares.
    pub likely: Vec<(f64, f64)>,
}

impl<'a> Outlook<'a> {
    /// State after the taps of `object`; the next taps are of the same run or of none.
    pub fn new(object: &'a Object<'a>) -> Self {
        let heights = object.heights();
        let (spread, likely) = (spread_of(object.joint, &heights), likely(object.joint, &heights));
        Self { object, spread, likely }
    }

    /// Expected [`Self::spread`] after `times` more taps at drive `u`, with the base shifted by `shift` mm from the first tap.
    pub fn after(&self, u: f64, shift: f64, times: f64) -> f64 {
        let joint = self.object.joint;
        let (mut sum, mut total) = (0.0, 0.0);
        for (x, share) in &self.likely {
            let mut tap = self.object.next(u, shift);
            tap.y = joint.signal(u, joint.seen(*x, shift)) + self.beside(*x, u, shift);
            let mut then = self.object.clone();
            then.weigh(tap, times);
            sum += share * spread_of(joint, &then.heights());
            total += share;
        }
        sum / total
    }

    /// By how much the shared numbers, as the taps so far tell them, move the next tap if the object is at ln a = x.
    fn beside(&self, x: f64, u: f64, shift: f64) -> f64 {
        let joint = self.object.joint;
        let (first, t) = joint.place(x);
        let slice = joint.shifted(u, shift, self.object.same_run, first..first + NEAR);
        let points = slice.chunks(joint.width()).zip(first..);
        let moved = points.map(|(point, k)| self.object.moved(k, &point[2..]));
        lagrange::<NEAR>(t).iter().zip(moved).map(|(w, e)| w * e).sum()
    }
}
