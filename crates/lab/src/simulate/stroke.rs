//! Strokes: the exact rod turned against an object that it touches without friction.
//!
//! Where rod and object touch, they have a common tangent, and the rod is in the state of a tap of that very point (ρ = 0): so the place on
//! the edge is looked for whose direction is that of the rod that taps it. A corner has all directions between those of its faces.

use std::f64::consts::{PI, TAU};

use vibrissa_learned::start::lowest;

use super::object::Object;
use crate::contour::point::Pose;
use crate::measure::{Rig, Skin};
use crate::physics::rod::{RodProblem, RodTap};
use crate::scene::{Drive, Model};

/// Places of the edge that are looked at for the first touch.
const LOOKS: usize = 4000;
/// Directions agree to this, rad.
const AGREE: f64 = 1e-11;
/// Most taps in search of one contact.
const TRIES: usize = 60;
/// Longest step along the edge, as a share of its length.
const STRIDE: f64 = 0.02;
/// Widest angle between the whisker's side and the edge at first touch, rad.
const GRAZING: f64 = 1e-3;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Gauge strain, tension positive.
    pub strain: f64,
    pub at: [f64; 2],
    /// Arc length of the contact, mm.
    pub arc: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Missed {
    #[error("the whisker does not reach the object")]
    OutOfReach,
    /// The first place that is reached is met by the tip, or is the end of an open curve.
    #[error("the object is first touched by the whisker's tip, or at its end")]
    ByTip,
}

/// A whisker and what it strokes, seen so that it turns counterclockwise.
pub struct Stroker<'a> {
    rig: &'a Rig,
    model: Model,
    skin: Skin,
    object: Object,
    sense: f64,
}

impl<'a> Stroker<'a> {
    /// Of `rig`, whose pole the object takes the place of.
    pub fn new(rig: &'a Rig, object: &Object, sense: f64) -> Self {
        let model = Model { pole_radius: 0.0, indentation: false, ..rig.setup.model };
        let mut plain = rig.clone();
        plain.setup.model = model;
        let skin = Skin::new(&plain, None);
        let object = if sense < 0.0 { object.mirrored() } else { object.clone() };
        Self { rig, model, skin, object, sense }
    }

    fn seen(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x, self.sense * y]
    }

    /// Distance along the whisker at which it touches the place `at` from `base`, and the heading with which it does; `None` beyond reach.
    fn reach(&self, base: [f64; 2], at: [f64; 2]) -> Option<(f64, f64)> {
        let [x, y] = [at[0] - base[0], at[1] - base[1]];
        let a = self.skin.distance(x.hypot(y));
        let [u, v] = self.skin.place(a);
        let within = a > 0.0 && a <= self.rig.design.tuple.L_a;
        within.then(|| (a, y.atan2(x) - v.atan2(u)))
    }

    /// Angle between the edge and the whisker's side when it touches.
    fn taper(&self) -> f64 {
        let [_, slope] = self.skin.slope();
        slope.atan()
    }

    /// The whisker from `start` when it first touches, and the place on the edge of the object as it sees it.
    fn touch(&self, start: Pose) -> Result<(Pose, f64), Missed> {
        let base = self.seen([start.base[0], start.base[1]]);
        let heading = self.sense * start.heading;
        let length = self.object.length();
        let travel = |t: f64| -> f64 {
            let found = self.reach(base, self.object.at(t).at);
            found.map_or(f64::INFINITY, |(_, touch)| (touch - heading).rem_euclid(TAU))
        };
        let corners = matches!(self.object, Object::Corners(_));
        let looks = if corners { LOOKS - LOOKS % length as usize } else { LOOKS };
        let step = length / looks as f64;
        let first = (0..=looks).map(|k| k as f64 * step).min_by(|s, t| travel(*s).total_cmp(&travel(*t)));
        let t = first.filter(|t| travel(*t).is_finite()).ok_or(Missed::OutOfReach)?;
        let t = if corners { t } else { lowest(travel, [t - step, t + step], 1) };
        let place = self.object.at(t);
        let (_, touch) = self.reach(base, place.at).ok_or(Missed::OutOfReach)?;
        let side = touch + self.taper();
        let along = match &self.object {
            // A corner, not the inside of a face.
            Object::Corners(_) => (t.round() - t).abs() < 1e-9 && self.admits(t, side),
            _ => wrapped(place.direction - side).abs() < GRAZING,
        };
        let t = if corners { t.round() } else { t };
        let pose = Pose { heading: self.sense * touch, sense: self.sense, ..start };
        if along { Ok((pose, t)) } else { Err(Missed::ByTip) }
    }

    /// Whether a straight side of direction `side` may rest on the corner at `t`.
    fn admits(&self, t: f64, side: f64) -> bool {
        let [before, after] = [self.object.at(t - 0.5).direction, self.object.at(t + 0.5).direction];
        wrapped(side - before) > 0.0 && wrapped(after - side) > 0.0
    }

    /// The tap by which the whisker with `heading` touches the place `at`, and the direction of its side there.
    fn tap(&self, base: [f64; 2], heading: f64, at: [f64; 2]) -> Option<(RodTap, f64)> {
        let (a, touch) = self.reach(base, at)?;
        let turn = wrapped(heading - touch);
        let shared = self.rig.shared();
        let problem = RodProblem {
            taper: shared.taper,
            gauge: shared.gauge,
            side: self.rig.setup.gauge.side,
            distance: a,
            hub: self.rig.setup.hub,
            drive: Drive::Angle,
            amount: turn,
            foil: shared.foil,
            body: None,
            model: &self.model,
        };
        let tap = (0.0..PI).contains(&turn).then(|| problem.solve().ok())??;
        Some((tap, heading - tap.base_angle + self.taper()))
    }

    /// The whisker from `start` and the place (mm) when it first touches, and contacts at `angles` (rad, ascending) since then, until it slips off, lies
    /// along a face, or has no equilibrium.
    pub fn stroke(&self, start: Pose, angles: &[f64]) -> Result<(Pose, [f64; 2], Vec<Contact>), Missed> {
        let (pose, mut t) = self.touch(start)?;
        let (base, from) = (self.seen([pose.base[0], pose.base[1]]), self.sense * pose.heading);
        let first = self.seen(self.object.at(t).at);
        let mut all = Vec::with_capacity(angles.len());
        for angle in angles {
            let Some((place, tap)) = self.contact(base, from + angle, t) else { break };
            if tap.contact_arc > self.rig.design.tuple.L_a {
                break;
            }
            t = place;
            let at = self.seen(self.object.at(t).at);
            all.push(Contact { strain: tap.strain, at, arc: tap.contact_arc });
        }
        Ok((pose, first, all))
    }

    /// Place on the edge, near `t`, where whisker and edge have one direction.
    fn contact(&self, base: [f64; 2], heading: f64, mut t: f64) -> Option<(f64, RodTap)> {
        if let Object::Corners(_) = self.object {
            let (tap, side) = self.tap(base, heading, self.object.at(t).at)?;
            return self.admits(t, side).then_some((t, tap));
        }
        let longest = STRIDE * self.object.length();
        let mut last: Option<(f64, f64)> = None;
        for _ in 0..TRIES {
            let place = self.object.at(t);
            let (tap, side) = self.tap(base, heading, place.at)?;
            let off = wrapped(place.direction - side);
            if off.abs() < AGREE {
                return Some((t, tap));
            }
            // Newton's step with the bend of the edge alone, then secants.
            let slope = match last {
                Some((s, before)) if s != t && off != before => (off - before) / (t - s),
                _ => place.bend,
            };
            last = Some((t, off));
            let step = (off / slope).clamp(-longest, longest);
            if !step.is_finite() || step == 0.0 {
                return None;
            }
            t -= step;
            if !self.object.is_closed() && !(0.0..=self.object.length()).contains(&t) {
                return None;
            }
        }
        None
    }
}

/// An angle in [−π, π).
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}
