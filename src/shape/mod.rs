//! The shape of a tapped whisker. The solved tap gives force (P, T) and contact c; from there the rod is an initial value problem (model §3),
//! integrated to the clamp in fixed steps. Beyond the contact the whisker is straight.

mod table;

pub use table::{FILES, MOST_TAPS, rows, tables};

use glam::{DVec2, DVec3};

use crate::design::{Design, amount};
use crate::error::{Error, InputError};
use crate::evaluate::{Method, Outcome, Task};
use crate::locate::locator::opener;
use crate::physics::body::Body;
use crate::physics::section::SectionLaw;
use crate::physics::solid::{Bonded, Held, Soft};
use crate::physics::taper::Taper;
use crate::scene::{BackendChoice, Drive, Geometry, Model, RunOptions, Setup};

/// Sections from the contact to the tip of a built whisker.
const FREE: usize = 16;

/// Runge–Kutta steps between two nodes.
const STEPS: usize = 8;

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

/// ψ, x, y in the contact frame, mm and rad.
type State = [f64; 3];

type Section = (f64, State, f64);

struct Rod<'a> {
    model: &'a Model,
    taper: Taper,
    law: SectionLaw,
    arc: f64,
    force: DVec2,
    point: DVec2,
    /// 1/(kG), 1/MPa; 0 without shear.
    compliance: f64,
    /// Start of the rod, mm from the face of its clamp.
    start: f64,
    foil: Option<Bonded>,
    /// Present for a built whisker, which is not a plain cone.
    body: Option<&'a Body>,
}

/// `nodes` ≥ 3 sections from clamp to contact. `None` without a solution, or if the material cannot carry the load.
pub fn shape(setup: &Setup, design: &Design, task: &Task, outcome: &Outcome, nodes: usize) -> Option<Shape> {
    let setup = design.setup(setup);
    let model = &setup.model;
    let shared = design.shared.as_ref()?;
    let taper = shared.taper;
    let (arc, normal, tangential) = (outcome.arc, outcome.normal_force, outcome.tangential_force);
    if model.geometry == Geometry::Linear || ![arc, normal, tangential].iter().all(|x| x.is_finite()) {
        return None;
    }
    let body = shared.body.as_deref();
    let tilt = match body {
        Some(body) => body.tilt(arc, task.a, model.surface).into(),
        None if model.surface => DVec2::new(taper.sin_alpha(), taper.cos_alpha()),
        None => DVec2::Y,
    };
    let height = match (model.surface, body) {
        (false, _) => 0.0,
        (true, Some(body)) => body.radius(arc, task.a),
        (true, None) => taper.radius(arc),
    };
    let rod = Rod {
        model,
        taper,
        law: SectionLaw::new(&model.material),
        arc,
        force: -normal * tilt + tangential * DVec2::new(tilt.y, -tilt.x),
        point: DVec2::new(0.0, height),
        compliance: Held::new(model).shear_compliance(model),
        start: shared.start,
        foil: shared.foil,
        body,
    };
    let (bent, held) = rod.bend(nodes)?;
    let turn = match setup.drive {
        Drive::Angle => amount(setup.drive, task.drive),
        Drive::Displacement => 0.0,
    };
    let [base, x, y] = held;
    // The face of the clamp, in line with the section that does not turn.
    let clamp = DVec2::new(x, y) - shared.start * DVec2::from_angle(base);
    // A compliant root turns and moves the base.
    let root = body.map(|body| body.root);
    let force = rod.force;
    let moment = (rod.point - DVec2::new(x, y)).perp_dot(force);
    let given = root.map_or(0.0, |root| moment / root.k_theta);
    let moved = root.map_or(DVec2::ZERO, |root| {
        DVec2::from_angle(given - base).rotate(force) / DVec2::new(root.k_x, root.k_y)
    });
    let frame = turn + given - base;
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
    let diameter = |s: f64| 2.0 * body.map_or_else(|| taper.radius(s), |body| body.radius(s, s));
    let node = |(s, [psi, x, y], strain): &Section| Node {
        s: *s,
        at: to_lab(DVec2::new(*x, *y)),
        psi: *psi,
        direction: direction(*psi),
        strain: *strain,
        diameter: diameter(*s),
    };
    let mut all: Vec<Node> = bent.iter().rev().map(node).collect();
    if rod.start > 0.0 {
        all.insert(0, node(&(0.0, [base, clamp.x, clamp.y], 0.0)));
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
            node(&(s, [psi, at.x, at.y], 0.0))
        };
        let parts = if body.is_none() { 1 } else { FREE };
        all.extend((0..parts).map(|k| free(arc + (length - arc) * k as f64 / parts as f64)));
        all.push(free(length));
    }
    let sunk = Soft::new(model, &taper, task.a).map_or(0.0, |soft| soft.depth(normal));
    let pole = to_lab(rod.point + (model.pole_radius - sunk) * tilt);
    Some(Shape { nodes: all, contact: to_lab(rod.point), pole })
}

impl Rod<'_> {
    /// Sections from the contact to the clamp (s, state, strain of the touching side), and the clamped section.
    fn bend(&self, nodes: usize) -> Option<(Vec<Section>, State)> {
        let parts = nodes.max(3) - 1;
        let end = self.start.max(0.0);
        let length = self.arc - end;
        let h = length / (parts * STEPS) as f64;
        let mut state = [0.0; 3];
        let mut all = vec![(self.arc, state, self.slope(0.0, &state)?.1)];
        for i in 0..parts {
            for k in 0..STEPS {
                state = self.step(state, (i * STEPS + k) as f64 * h, h)?;
            }
            let s = if i + 1 == parts { end } else { end + length * (1.0 - (i + 1) as f64 / parts as f64) };
            all.push((s, state, self.slope(self.arc - s, &state)?.1));
        }
        // A rod that is clamped behind the clamp's face.
        let behind = (end - self.start) / STEPS as f64;
        let mut last = (0..STEPS).filter(|_| behind > 0.0);
        let held = last.try_fold(state, |state, k| self.step(state, self.arc + k as f64 * behind, behind));
        Some((all, held?))
    }

    fn step(&self, state: State, sigma: f64, h: f64) -> Option<State> {
        let at = |by: f64, d: &State| -> State { std::array::from_fn(|n| state[n] + by * d[n]) };
        let (k1, _) = self.slope(sigma, &state)?;
        let (k2, _) = self.slope(sigma + 0.5 * h, &at(0.5 * h, &k1))?;
        let (k3, _) = self.slope(sigma + 0.5 * h, &at(0.5 * h, &k2))?;
        let (k4, _) = self.slope(sigma + h, &at(h, &k3))?;
        Some(std::array::from_fn(|n| state[n] + h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n])))
    }

    /// Derivatives with respect to σ = c − s, and the strain of the touching side; model §3.
    fn slope(&self, sigma: f64, [psi, x, y]: &State) -> Option<(State, f64)> {
        let (d1, s) = (DVec2::from_angle(*psi), self.arc - sigma);
        let arm = self.point - DVec2::new(*x, *y);
        let (axial, shear, moment) =
            (self.force.dot(d1), self.force.dot(d1.perp()), arm.perp_dot(self.force));
        let extension = self.model.extension;
        let (r, section) = match self.body {
            Some(body) => body.deform((&self.law, extension), (s, s), [axial, moment])?,
            None => {
                let r = self.taper.radius(s);
                let n = if extension { axial / (r * r) } else { 0.0 };
                (r, self.law.deform(n, moment / (r * r * r))?)
            }
        };
        let stretch = if self.model.extension { section.axial } else { 0.0 };
        let slide = match self.body {
            Some(_) if self.compliance == 0.0 => 0.0,
            Some(body) => shear / body.section(s, s).shear,
            None => shear * self.compliance / (std::f64::consts::PI * r * r),
        };
        let along = (1.0 + stretch) * d1 + slide * d1.perp();
        let under = self.foil.filter(|foil| foil.span[0] < s && s < foil.span[1]);
        let bends = under.map_or(1.0, |foil| 1.0 - foil.stiffening);
        let rest = self.body.map_or(0.0, |body| body.curvature(s));
        Some(([rest - bends * section.bending / r, -along.x, -along.y], section.axial - section.bending))
    }
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
