//! The closure of a tap: the miss of the object under trial forces (model §3).

use glam::DVec2;

use super::super::RodProblem;
use super::super::statics::{Bent, EndLoad, Whisker};
use super::{Shooter, Shot};
use crate::physics::section::SectionLaw;
use crate::physics::solid::{Held, Soft};
use crate::physics::{body::Touched, driven::Driven};
use crate::scene::Grip;
use crate::status::Status;

const MOST_ROLLS: u32 = 30;

/// Allowed difference of the two rolled lengths, in roundings.
const ROLLED: f64 = 8.0;

/// The same where rounding stops convergence: the integration is accurate to 1e-13.
const NEARLY_ROLLED: f64 = 4e3;

const FLAT: f64 = 1e-9;

type Rod = (EndLoad, Bent);

impl<'a> Shooter<'a> {
    pub fn with(problem: &'a RodProblem<'a>, unknowns: Grip) -> Self {
        let RodProblem { taper, model, distance: a, body, .. } = *problem;
        let (hub, unit) = match problem.driven {
            Driven::Radians(_) => (problem.hub, 1.0),
            Driven::Millimetres(_) => (0.0, a),
        };
        let touched = match body {
            Some(body) => body.touched(a, model.surface),
            None => {
                let [height, sin, cos] = taper.touched(a, model.surface);
                Touched { height, tilt: DVec2::new(sin, cos), angle: 0.0, place: DVec2::new(a, 0.0) }
            }
        };
        // D' = D − 2 tan α c₀ D.
        let held = Held::new(model);
        let behind = held.c0 * taper.D / (1.0 - taper.tan_alpha * 2.0 * held.c0);
        let whole = taper.from(-behind);
        Self {
            problem,
            unknowns,
            whisker: Whisker {
                problem,
                law: SectionLaw::new(&model.material),
                shear_compliance: held.shear_compliance(model),
                whole: (whole, behind),
            },
            soft: Soft::new(model, &whole, a + behind),
            lever: a + hub,
            touched,
            hub,
            unit,
            force: 1.0,
        }
    }

    /// The rod under trial forces, when the object is driven by `size`, rad or mm.
    pub fn shoot(&self, size: f64, z: DVec2) -> Result<Shot, Status> {
        let driven = self.problem.driven.map(|_| size);
        let a = self.problem.distance;
        let normal = z.x * self.force;
        let (slid, tangential) = match self.unknowns {
            Grip::Slide(ratio) => (a * z.y, ratio * normal),
            Grip::Stick => (0.0, z.y * self.force),
        };
        let under = |slid: f64| {
            let arc = a + slid;
            if !(arc > 0.0 && self.radius(arc) > 0.0) {
                return Err(Status::NOT_CONVERGED);
            }
            let load = self.load(arc, [normal, tangential]);
            let bent = load.bend(&self.whisker, self.problem.gauge)?;
            Ok((load, bent))
        };
        let rolls = self.unknowns == Grip::Stick && self.problem.model.pole_radius > 0.0;
        let (slid, (load, bent)) = if rolls { self.roll(driven, under)? } else { (slid, under(slid)?) };
        let depth = self.soft.map_or(0.0, |soft| soft.depth(normal));
        let miss = self.miss(driven, slid, &load, &bent) - self.touched.tilt * depth;
        let shot = Shot { normal, tangential, load, bent, miss };
        if miss.is_finite() { Ok(shot) } else { Err(Status::NOT_CONVERGED) }
    }

    /// Distance that the contact rolls on a pole that does not turn, mm, and the rod there. Equal lengths of circumference and skin have touched.
    fn roll(&self, driven: Driven, under: impl Fn(f64) -> Result<Rod, Status>) -> Result<(f64, Rod), Status> {
        let RodProblem { distance: a, body, model, .. } = *self.problem;
        let lean = |tilt: DVec2| (tilt.x / tilt.y).atan();
        let begun = lean(self.touched.tilt) - self.touched.angle;
        let [turned, _] = driven.turn_and_lift();
        let skin = |slid: f64| match body {
            Some(body) if model.surface => body.skin(a, slid),
            Some(_) => slid,
            None => slid / self.touched.tilt.y,
        };
        let mut slid = 0.0;
        let (mut slope, mut last) = (1.0, None::<(f64, f64)>);
        let mut close = 0;
        for _ in 0..MOST_ROLLS {
            let rod = under(slid)?;
            let (angle, leaned) = (self.base(&rod.0, &rod.1).1, lean(self.tilt(rod.0.arc)));
            let gap = skin(slid) - model.pole_radius * (turned + angle + begun - leaned);
            let rounding =
                f64::EPSILON * (slid.abs() + model.pole_radius * (turned.abs() + angle.abs() + begun.abs()));
            // A gap that no longer shrinks is rounding of the rod.
            let stays = last.is_some_and(|(_, before)| gap.abs() >= 0.5 * before.abs());
            let most = if stays { NEARLY_ROLLED } else { ROLLED };
            close += u32::from(gap.abs() <= most * rounding);
            if close > 0 {
                return Ok((slid, rod));
            }
            if let Some((place, before)) = last.replace((slid, gap))
                && (slid - place).abs() > FLAT * a
            {
                slope = (gap - before) / (slid - place);
            }
            slid -= gap / slope;
        }
        Err(Status::NOT_CONVERGED)
    }

    fn radius(&self, arc: f64) -> f64 {
        let RodProblem { taper, body, distance, .. } = *self.problem;
        match body {
            Some(body) if self.problem.model.surface => body.radius(arc, distance),
            Some(body) => body.radius(arc, arc),
            None => taper.radius(arc),
        }
    }

    pub fn tilt(&self, arc: f64) -> DVec2 {
        let RodProblem { body, distance, model, .. } = *self.problem;
        body.map_or(self.touched.tilt, |body| body.tilt(arc, distance, model.surface))
    }

    pub fn load(&self, arc: f64, [normal, tangential]: [f64; 2]) -> EndLoad {
        let tilt = self.tilt(arc);
        let force = tilt * -normal + DVec2::new(tilt.y, -tilt.x) * tangential;
        let height = if self.problem.model.surface { self.radius(arc) } else { 0.0 };
        EndLoad { arc, force, point: DVec2::new(0.0, height) }
    }

    fn moment(load: &EndLoad, bent: &Bent) -> f64 {
        (load.point + DVec2::new(load.arc, 0.0) - bent.offset).perp_dot(load.force)
    }

    pub fn base(&self, load: &EndLoad, bent: &Bent) -> (DVec2, f64) {
        let Some(root) = self.problem.body.map(|body| body.built.root) else {
            return (DVec2::ZERO, -bent.angle);
        };
        let turned = Self::moment(load, bent) / root.k_theta - bent.angle;
        let force = DVec2::from_angle(turned).rotate(load.force);
        (DVec2::new(force.x / root.k_x, force.y / root.k_y), turned)
    }

    /// Wrench on the root in the motor's frame: M₀, N mm, F_x and F_y, N.
    pub fn wrench(&self, load: &EndLoad, bent: &Bent) -> [f64; 3] {
        let force = DVec2::from_angle(self.base(load, bent).1).rotate(load.force);
        [Self::moment(load, bent), force.x, force.y]
    }

    /// The object's centre from the motor's axis, less where the drive has put it; mm, in the contact frame, without lengths that cancel.
    fn miss(&self, driven: Driven, slid: f64, load: &EndLoad, bent: &Bent) -> DVec2 {
        let RodProblem { taper, body, distance, model, .. } = *self.problem;
        let [turn, lift] = driven.turn_and_lift();
        let (moved, angle) = self.base(load, bent);
        let angle = -angle;
        let moved = DVec2::from_angle(angle).rotate(moved) - bent.offset;
        if body.is_some_and(|body| !body.built.is_straight()) {
            let centre = load.point + self.tilt(load.arc) * model.pole_radius + DVec2::new(load.arc, 0.0);
            let hub = DVec2::new(self.hub, 0.0);
            let begun = self.touched.pole(model.pole_radius) + hub - DVec2::new(0.0, lift);
            return DVec2::from_angle(angle).rotate(hub) + centre + moved
                - DVec2::from_angle(angle - turn).rotate(begun);
        }
        // Growth of the radius from a to c; a difference of radii would lose its digits at small a.
        let widening = match (model.surface, body) {
            (false, _) => 0.0,
            (true, None) => -taper.tan_alpha * slid,
            (true, Some(body)) => body.widening(distance, slid),
        };
        let leaned = if body.is_some() { self.tilt(load.arc) - self.touched.tilt } else { DVec2::ZERO };
        let centre = self.touched.tilt * model.pole_radius;
        let reach = distance + centre.x + self.hub;
        let across = self.touched.height + centre.y - lift;
        let turned = angle - turn;
        DVec2::new(
            slid - self.hub * versine(angle) + reach * versine(turned) + across * turned.sin(),
            widening + lift + self.hub * angle.sin() + across * versine(turned) - reach * turned.sin(),
        ) + leaned * model.pole_radius
            + moved
    }
}

fn versine(x: f64) -> f64 {
    let half = (x * 0.5).sin();
    half * 2.0 * half
}
