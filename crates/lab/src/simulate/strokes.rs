//! Synthetic strokes: the exact rod turned against an object that it touches without friction, as rows that `contour` reads, with the true places of
//! the contacts beside.
//!
//! Where rod and object touch, they have a common tangent, and the rod is in the state of a tap of that very point (ρ = 0): so the place on
//! the edge is looked for whose direction is that of the rod that taps it. A corner has all directions between those of its faces.

use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

use rayon::prelude::*;

use super::object::Object;
use super::{Counts, PIECE, Recorder, SOURCE, Settings};
use crate::error::{Error, InputError};
use crate::measure::{Rig, Skin};
use crate::physics::driven::Driven;
use crate::physics::rod::{RodProblem, RodTap};
use crate::scene::{Axis, Contact as Grip, Drive, Geometry, Model, Signal};
use crate::sink::{Field, Frame, heading};
use crate::{contour::point::Pose, reduce::sorted};
use vibrissa_learned::fit::lowest;

pub const FILE: &str = "strokes.csv";

#[derive(Debug, Clone, PartialEq)]
pub struct Strokes {
    pub object: Object,
    /// Where the motor's axis stands, and the heading from which the whisker turns until it touches.
    pub starts: Vec<Pose>,
    /// Standard deviation of the angle at which a touch is noticed, degrees.
    pub touch_noise: f64,
    pub files: Vec<PathBuf>,
}

impl Strokes {
    /// `settings` of the run with what is stroked.
    pub fn described(&self, mut settings: serde_json::Value) -> serde_json::Value {
        settings["object"] = format!("{:?}", self.object).into();
        settings["starts"] = self.starts.len().into();
        settings["touch_noise_deg"] = self.touch_noise.into();
        settings
    }
}

pub fn check(rig: &Rig, settings: &Settings) -> Result<(), InputError> {
    let (setup, model, defaults) = (&rig.setup, &rig.setup.model, Settings::default());
    let of_taps = |key: &'static str, other: bool| {
        (other, key, "this belongs to taps at labelled distances", "nothing, with --object")
    };
    let (moved, linear) = (setup.drive != Drive::Angle, model.geometry != Geometry::Exact);
    let rough = model.contact != Grip::Frictionless;
    let checks = [
        (
            setup.built.is_some() || setup.signal != Signal::Strain,
            "whisker",
            "its whisker is a cone clamped at its base, its signal a strain",
            "D, d, L_a and hub only, read by a gauge",
        ),
        (setup.gauge.second, "gauge.second", "one gauge reads it, at upright edges", "false"),
        (moved, "tap.drive", "the whisker must be turned", "theta (degrees after first touch)"),
        (linear, "model.geometry", "linear theory has no contact that does", "exact"),
        (rough, "model.contact", "with friction it would depend on its path", "frictionless"),
        of_taps("--repeats", settings.repeats != defaults.repeats),
        of_taps("--drift", settings.drift != defaults.drift),
        of_taps("--outliers", settings.outliers != defaults.outliers),
        of_taps("--hysteresis", settings.hysteresis != defaults.hysteresis),
        of_taps("--drive-offset", settings.drive_offset != defaults.drive_offset),
        of_taps("--a-offset", settings.a_offset != defaults.a_offset),
    ];
    let fault = checks.into_iter().find(|check| check.0);
    let Some((_, key, message, allowed)) = fault else { return Ok(()) };
    let error = InputError::new(format!("a stroke slides along an object: {message}"));
    Err(error.key(key).allowed(allowed))
}

/// Simulates a stroke from each start at these drives (degrees after first touch); `miss` gets the number of a start that makes none, and why.
pub fn simulate(
    rig: &Rig,
    strokes: &Strokes,
    drives: &Axis,
    settings: &Settings,
    miss: &mut dyn FnMut(usize, Missed),
    write: &mut dyn FnMut(&Frame) -> Result<(), Error>,
) -> Result<Counts, Error> {
    let degrees = sorted(drives.iter().filter(|d| *d > 0.0));
    let angles: Vec<f64> = degrees.iter().map(|d| d.to_radians()).collect();
    let solve = |start: &Pose| Stroker::new(rig, &strokes.object, start.sense).stroke(*start, &angles);
    let solved: Vec<_> = strokes.starts.par_iter().map(solve).collect();
    let table = heading("strokes").frame(&[settings.unit.column()]);
    let mut recorder = Recorder::new((rig, settings), [false; 2], table, write);
    for (k, solved) in solved.into_iter().enumerate() {
        let Ok((pose, first, contacts)) = solved.map_err(|why| miss(k + 1, why)) else { continue };
        // Degrees by which the touch is seen late: heading too large, drive too small.
        let late = strokes.touch_noise * recorder.normal(0)[0];
        recorder.row = recorder.row.wrapping_add(1);
        let heading = pose.heading.to_degrees() + pose.sense * late;
        let before = [(k + 1) as f64, pose.base[0], pose.base[1], heading, pose.sense];
        let row = |table: &mut Frame, rest: [f64; 4], status: &'static str| {
            let numbers = before.iter().chain(&rest).chain(&first).copied().map(Field::Number);
            table.row(numbers.chain([SOURCE.into(), status.into()]))
        };
        for (i, degree) in degrees.iter().enumerate() {
            if recorder.rests() {
                let ([value, _], _) = recorder.record([0.0; 2]);
                recorder.counts.zeros += 1;
                row(&mut recorder.table, [0.0, value, f64::NAN, f64::NAN], "ok")?;
            }
            if *degree <= late {
                continue;
            }
            recorder.counts.taps += 1;
            let contact = contacts.get(i);
            let [value, x, y] = contact.map_or([f64::NAN; 3], |contact| {
                let ([value, _], _) = recorder.record([contact.strain, 0.0]);
                [value, contact.at[0], contact.at[1]]
            });
            recorder.counts.unsolved += u64::from(contact.is_none());
            let status = if contact.is_some() { "ok" } else { "slipped_off" };
            row(&mut recorder.table, [degree - late, value, x, y], status)?;
        }
        recorder.write(PIECE)?;
    }
    if recorder.counts.taps == 0 {
        let error =
            InputError::new("no start leads to a stroke: the whisker misses the object").key("--object");
        return Err(error.allowed("starts from which the whisker's side touches it").into());
    }
    recorder.write(0)?;
    Ok(recorder.counts)
}

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

    /// True if a straight side of direction `side` may rest on the corner at `t`.
    fn admits(&self, t: f64, side: f64) -> bool {
        let [before, after] = [self.object.at(t - 0.5).direction, self.object.at(t + 0.5).direction];
        wrapped(side - before) > 0.0 && wrapped(after - side) > 0.0
    }

    /// The tap by which the whisker with `heading` touches the place `at`, and the direction of its side there.
    fn tap(&self, base: [f64; 2], heading: f64, at: [f64; 2]) -> Option<(RodTap, f64)> {
        let (a, touch) = self.reach(base, at)?;
        let turn = wrapped(heading - touch);
        let (shared, model, driven) = (self.rig.shared(), &self.model, Driven::Radians(turn));
        let (taper, gauge, foil) = (shared.taper, shared.gauge, shared.foil);
        let (side, hub, distance) = (self.rig.setup.gauge.side, self.rig.setup.hub, a);
        let problem = RodProblem { taper, gauge, side, distance, hub, driven, foil, body: None, model };
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
