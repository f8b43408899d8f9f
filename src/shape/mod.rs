//! The shape of a tapped whisker. The solved tap gives force (P, T) and contact c; from there the reference's rod is integrated to the clamp.
//! Beyond the contact the whisker is straight.

mod table;

pub use table::{FILES, MOST_TAPS, rows, tables};

use glam::{DVec2, DVec3};

use crate::design::{Design, amount};
use crate::error::{Error, InputError};
use crate::evaluate::{Method, Outcome, Task, problem};
use crate::locate::locator::opener;
use crate::physics::rod::BentSection;
use crate::physics::solid::Soft;
use crate::scene::{BackendChoice, Drive, Geometry, Model, RunOptions, Setup};

/// Sections from the contact to the tip of a built whisker.
const FREE: usize = 16;

/// A section, in the frame of model §6: origin at the motor's axis, x along the whisker at first touch, y towards the object, z along the motor's
/// axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Arc length s from the clamp in the unloaded whisker, mm.
    pub s: f64,
    /// Centre of the section, mm.
    pub at: DVec3,
    /// Rotation ψ(s) of the section relative to the one at the contact, rad.
    pub psi: f64,
    /// Direction of the whisker's axis (with shear, of the section's normal) against x, seen along the motor's axis, rad.
    pub direction: f64,
    /// Strain of the fibre on the touching side.
    pub strain: f64,
    /// Diameter of the unloaded section, mm.
    pub diameter: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// From the clamp to the tip, or to the contact beyond the tip if slipped off; two nodes at the contact, where the strain ends.
    pub nodes: Vec<Node>,
    /// Point of the force, mm.
    pub contact: DVec3,
    pub pole: DVec3,
}

/// `nodes` ≥ 3 sections from clamp to contact. `None` without a solution, or if the material cannot carry the load.
pub fn shape(setup: &Setup, design: &Design, task: &Task, outcome: &Outcome, nodes: usize) -> Option<Shape> {
    let setup = design.setup(setup);
    let model = &setup.model;
    let shared = design.shared.as_ref()?;
    let (arc, normal, tangential) = (outcome.arc, outcome.normal_force, outcome.tangential_force);
    if model.geometry == Geometry::Linear || ![arc, normal, tangential].iter().all(|x| x.is_finite()) {
        return None;
    }
    let amount = amount(setup.drive, task.drive);
    let rod = problem(setup, shared, task.a, amount);
    let bent = rod.bent(arc, [normal, tangential], nodes.max(3) as u32 - 1)?;
    let turn = if setup.drive == Drive::Angle { amount } else { 0.0 };
    let (base, (moved, turned)) = (bent.clamp.angle, bent.base);
    // The face of the clamp, in line with the section that does not turn.
    let clamp = DVec2::from(bent.clamp.place) - shared.start * DVec2::from_angle(base);
    let frame = turn + turned;
    let azimuth = if outcome.azimuth.is_nan() { 0.0 } else { outcome.azimuth };
    // The plane of bending is the plane of rotation, turned about the base tangent by φ.
    let out = |v: DVec2| {
        let m = azimuth.cos() * v.y;
        (DVec2::from_angle(turn).rotate(DVec2::new(v.x, m))).extend(azimuth.sin() * v.y)
    };
    let to_lab = |r: DVec2| match azimuth {
        0.0 => (DVec2::from_angle(turn).rotate(DVec2::X * setup.hub + DVec2::from(moved))
            + DVec2::from_angle(frame).rotate(r - clamp))
        .extend(0.0),
        _ => out(DVec2::X * setup.hub + DVec2::from_angle(-base).rotate(r - clamp)),
    };
    let direction = |psi: f64| match azimuth {
        0.0 => frame + psi,
        _ => {
            let along = out(DVec2::from_angle(psi - base));
            along.y.atan2(along.x)
        }
    };
    let body = rod.body;
    let node = |s: f64, psi: f64, at: DVec2, strain: f64| Node {
        s,
        at: to_lab(at),
        psi,
        direction: direction(psi),
        strain,
        diameter: 2.0 * body.map_or_else(|| rod.taper.radius(s), |body| body.radius(s, s)),
    };
    let section = |one: &BentSection| node(one.arc, one.angle, one.place.into(), one.strain);
    let mut all: Vec<Node> = bent.sections.iter().rev().map(section).collect();
    if shared.start > 0.0 {
        all.insert(0, node(0.0, base, clamp, 0.0));
    }
    let length = design.tuple.L_a;
    if arc < length {
        let free = |s: f64| {
            let (at, psi) = match body.filter(|body| !body.is_straight()) {
                None => (DVec2::new(s - arc, 0.0), 0.0),
                Some(body) => {
                    let at = body.rest_angle(arc);
                    let way = DVec2::from_angle(-at).rotate((body.rest(s) - body.rest(arc)).into());
                    (way, body.rest_angle(s) - at)
                }
            };
            node(s, psi, at, 0.0)
        };
        let parts = if body.is_none() { 1 } else { FREE };
        all.extend((0..parts).map(|k| free(arc + (length - arc) * k as f64 / parts as f64)));
        all.push(free(length));
    }
    let sunk = Soft::new(model, &rod.taper, task.a).map_or(0.0, |soft| soft.depth(normal));
    let point = DVec2::from(bent.point);
    let pole = to_lab(point + (model.pole_radius - sunk) * DVec2::from(bent.normal));
    Some(Shape { nodes: all, contact: to_lab(point), pole })
}

pub fn check(setup: &Setup) -> Result<(), InputError> {
    if setup.model.geometry != Geometry::Linear {
        return Ok(());
    }
    let message = "linear theory has a deflection but no shape: its whisker would grow longer";
    Err(InputError::new(message).key("model.geometry").value("linear").allowed("exact"))
}

/// Solver of the few taps of shapes, and its word in run.json: the reference, unless `options` choose another.
pub fn method(options: &RunOptions, model: &Model) -> Result<(Method, &'static str), Error> {
    let free = options.backend.is_none() && options.precision.is_none() && options.adapter.is_none();
    match free || options.backend == Some(BackendChoice::Reference) {
        true => Ok((Method::Reference, "reference")),
        false => Ok((opener(options)(model)?, "kernel")),
    }
}
