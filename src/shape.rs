//! The shape of a tapped whisker. The solved tap gives force (P, T) and contact c; from there the reference's rod is integrated to the clamp.
//! Beyond the contact the whisker is straight. The tables are `shape.csv` and `contacts.csv`.

use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use crate::census::Taps;
use crate::design::Design;
use crate::error::{Error, InputError};
use crate::evaluate::{Evaluator, Method, Outcome, Task, problem};
use crate::locate::locator::opener;
use crate::physics::{rod::BentSection, solid::Soft};
use crate::progress::{Progress, go_on};
use crate::scene::{BackendChoice, Geometry, Model, RunOptions, Setup, Space, Spec, Tuple};
use crate::sink::{Field, Frame, heading};
use crate::status::Status;

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
    let driven = task.driven(setup);
    let rod = problem(setup, shared, task.a, driven);
    let bent = rod.bent(arc, [normal, tangential], nodes.max(3) as u32 - 1)?;
    let [turn, _] = driven.turn_and_lift();
    let (base, (moved, turned)) = (bent.clamp.angle, bent.base);
    // The face of the clamp, in line with the section that does not turn.
    let clamp = bent.clamp.place - shared.start * DVec2::from_angle(base);
    let frame = turn + turned;
    let azimuth = if outcome.azimuth.is_nan() { 0.0 } else { outcome.azimuth };
    // The plane of bending is the plane of rotation, turned about the base tangent by φ.
    let out = |v: DVec2| {
        let m = azimuth.cos() * v.y;
        (DVec2::from_angle(turn).rotate(DVec2::new(v.x, m))).extend(azimuth.sin() * v.y)
    };
    let to_lab = |r: DVec2| match azimuth {
        0.0 => (DVec2::from_angle(turn).rotate(DVec2::X * setup.hub + moved)
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
    let node = |s: f64, psi: f64, at: DVec2, strain: f64| {
        let diameter = 2.0 * body.map_or_else(|| rod.taper.radius(s), |body| body.radius(s, s));
        Node { s, at: to_lab(at), psi, direction: direction(psi), strain, diameter }
    };
    let section = |one: &BentSection| node(one.arc, one.angle, one.place, one.strain);
    let mut all: Vec<Node> = bent.sections.iter().rev().map(section).collect();
    if shared.start > 0.0 {
        all.insert(0, node(0.0, base, clamp, 0.0));
    }
    let length = design.tuple.L_a;
    if arc < length {
        let free = |s: f64| {
            let (at, psi) = match body.filter(|body| !body.built.is_straight()) {
                None => (DVec2::new(s - arc, 0.0), 0.0),
                Some(body) => {
                    let at = body.rest_angle(arc);
                    let way = DVec2::from_angle(-at).rotate(body.rest(s) - body.rest(arc));
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
    let point = bent.point;
    let pole = to_lab(point + (model.pole_radius - sunk) * bent.normal);
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

pub const FILES: [&str; 2] = ["shape.csv", "contacts.csv"];
pub const MOST_TAPS: u64 = 10_000;
const PART: usize = 256;

pub fn tables(
    spec: &Spec,
    method: Method,
    nodes: usize,
    (stop, progress): (&AtomicBool, &mut dyn Progress),
) -> Result<([usize; 2], [Frame; 2]), Error> {
    let setup = &spec.study.setup;
    let tuples = tuples(&spec.study.space)?;
    let Taps { designs, tasks, .. } = Taps::of(setup, &tuples);
    let mut evaluator = Evaluator::new(setup, method).stopping(stop);
    let mut outcomes = Vec::with_capacity(tasks.len());
    for some in tasks.chunks(PART) {
        outcomes.extend(evaluator.run(&designs, some)?);
        progress.at(outcomes.len() as u64, tasks.len() as u64);
    }
    let [mut sections, mut contacts] = ["shape", "contacts"].map(|table| heading(table).frame_for(setup));
    let mut shapes = 0;
    for (i, ((design, task), outcome)) in designs.iter().zip(&tasks).zip(&outcomes).enumerate() {
        go_on(stop)?;
        let bent = shape(setup, design, task, outcome, nodes);
        shapes += usize::from(bent.is_some());
        let (shown, o) = (setup.directions, outcome);
        let tap = || std::iter::once(Field::Count(i as u64)).chain(tap_columns(shown, &tuples[i]));
        for node in bent.iter().flat_map(|shape| &shape.nodes) {
            let angles = [node.psi, node.direction].map(f64::to_degrees);
            let numbers =
                [node.s].into_iter().chain(place(shown, node.at)).chain(angles).chain([node.strain]);
            let numbers = numbers.chain(setup.built.is_some().then_some(node.diameter));
            sections.row(tap().chain(numbers.map(Field::Number)))?;
        }
        let gauge = design.shared.as_ref().map_or([f64::NAN; 2], |s| s.gauge);
        let at = bent.as_ref().map_or([DVec3::NAN; 2], |s| [s.contact, s.pole]);
        let at = at.into_iter().flat_map(|at| place(shown, at));
        let solved = [o.strain, o.normal_force, o.tangential_force, o.arc];
        let rig = design.setup(setup);
        let numbers = [rig.hub].into_iter().chain(gauge).chain(solved).chain(at);
        let numbers = numbers.chain([rig.model.pole_radius]).map(Field::Number);
        let state = match (o.arc.is_finite(), o.sticking) {
            (false, _) => "",
            (_, true) => "stick",
            _ => "slide",
        };
        let status = if bent.is_none() && o.status == Status::OK { Status::MATERIAL_LIMIT } else { o.status };
        contacts.row(tap().chain(numbers).chain([state.into(), status.into()]))?;
    }
    Ok(([tuples.len(), shapes], [sections, contacts]))
}

/// Fails if `shape.csv` may have more rows than `room` for all taps of `space`.
pub fn rows(space: &Space, nodes: usize, room: u64) -> Result<(), InputError> {
    // Two more from contact to tip, or up to `FREE` + 1 for a built whisker.
    let rows = tuples(space)?.len() as u64 * (nodes + FREE + 1) as u64;
    if rows <= room {
        return Ok(());
    }
    let error = InputError::new("there is no memory for so many sections").key("nodes").value(nodes);
    Err(error.allowed(format!("{room} sections of all taps")))
}

fn tuples(space: &Space) -> Result<Vec<Tuple>, InputError> {
    let (n, at) = space.tuples();
    if n > MOST_TAPS {
        let error = InputError::new("these are too many taps to look at").value(n).key("tuples");
        return Err(error.allowed(format!("{MOST_TAPS} at most")));
    }
    Ok((0..n).map(at).collect())
}

fn tap_columns([tilt, lean]: [bool; 2], t: &Tuple) -> impl Iterator<Item = Field> {
    let whisker = [t.D, t.d, t.L_a, t.x_ss, t.l, t.a].into_iter();
    let stroke = tilt.then_some(t.tilt).into_iter().chain(lean.then_some(t.lean)).chain([t.drive]);
    whisker.chain(stroke).map(Field::Number)
}

/// x, y and, with directions of the pole, z.
fn place([tilt, lean]: [bool; 2], at: DVec3) -> impl Iterator<Item = f64> {
    [at.x, at.y].into_iter().chain((tilt || lean).then_some(at.z))
}
