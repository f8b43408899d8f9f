//! The closure of a tap: how far the object is from where it must be, under forces that are tried (model §3).

use std::cell::Cell;

use super::super::RodProblem;
use super::super::ode::Ended;
use super::super::statics::{Bent, EndLoad, Skin, Whisker};
use super::{Missed, Shooter, Shot, Unknowns, soft};
use crate::physics::body::Touched;
use crate::physics::real::{Real, Vector};
use crate::physics::section::SectionLaw;
use crate::physics::solid::Held;
use crate::scene::model::Drive;

impl<'a, T: Real> Shooter<'a, T> {
    /// Of forces over `force`, N.
    pub fn with(problem: &'a RodProblem<'a, T>, unknowns: Unknowns<T>, force: f64) -> Self {
        let RodProblem { taper, model, distance: a, body, .. } = *problem;
        let zero = T::of(0.0);
        let (hub, unit) = match problem.drive {
            Drive::Angle => (problem.hub, 1.0),
            Drive::Displacement => (zero, a.value()),
        };
        let touched = match body {
            Some(body) => body.touched(a, model.surface),
            None => Touched {
                height: if model.surface { taper.radius(a) } else { zero },
                tilt: match model.surface {
                    true => Vector::new(taper.sin_alpha(), taper.cos_alpha()),
                    false => Vector::of(0.0, 1.0),
                },
                angle: zero,
                place: Vector::new(a, zero),
            },
        };
        Self {
            problem,
            unknowns,
            whisker: Whisker {
                taper,
                body,
                law: SectionLaw::new(&model.material),
                extension: model.extension,
                shear_compliance: Held::new(model).shear_compliance(model),
                side: problem.side,
                foil: problem.foil,
                skin: Skin::new(problem),
                near: Cell::default(),
            },
            soft: soft(problem),
            lever: (a + hub).value(),
            touched,
            hub,
            unit,
            force,
        }
    }

    /// Bends the whisker under the forces `z` says and compares the object's place with where it must be.
    pub fn shoot(&self, amount: T, z: [T; 2]) -> Result<Shot<T>, Missed> {
        self.shot(amount, z, |load| load.bend(&self.whisker, self.problem.gauge))
    }

    /// The same of a whisker that bends as `bend` says.
    pub fn shot(
        &self,
        amount: T,
        z: [T; 2],
        bend: impl FnOnce(&EndLoad<T>) -> Result<Bent<T>, Ended>,
    ) -> Result<Shot<T>, Missed> {
        let a = self.problem.distance;
        let normal = z[0] * self.force;
        let (slid, tangential) = match self.unknowns {
            Unknowns::Slide(ratio) => (a * z[1], ratio * normal),
            Unknowns::Stick => (T::of(0.0), z[1] * self.force),
        };
        let arc = a + slid;
        if !(arc.value() > 0.0 && self.radius(arc).value() > 0.0) {
            return Err(Missed::Stalled);
        }
        let load = self.load(arc, [normal, tangential]);
        let bent = bend(&load)?;
        let depth = self.soft.map_or(T::of(0.0), |soft| soft.depth(normal));
        let miss = self.miss(amount, slid, &load, &bent) - self.touched.tilt * depth;
        let shot = Shot { normal, tangential, load, bent, miss };
        let finite = miss.x.value().is_finite() && miss.y.value().is_finite();
        if finite { Ok(shot) } else { Err(Missed::Stalled) }
    }

    /// R of the whisker at the arc `arc`, by the piece that holds the contact before the tap.
    fn radius(&self, arc: T) -> T {
        let RodProblem { taper, body, distance, .. } = *self.problem;
        match body {
            Some(body) if self.problem.model.surface => body.radius(arc, distance.value()),
            Some(body) => body.radius(arc, arc.value()),
            None => taper.radius(arc),
        }
    }

    /// sin α and cos α of a contact at the arc `arc`.
    fn tilt(&self, arc: T) -> Vector<T> {
        let RodProblem { body, distance, model, .. } = *self.problem;
        body.map_or(self.touched.tilt, |body| body.tilt(arc, distance.value(), model.surface))
    }

    /// P and T, N, on the whisker at the arc `arc`.
    pub fn load(&self, arc: T, [normal, tangential]: [T; 2]) -> EndLoad<T> {
        let (tilt, zero) = (self.tilt(arc), T::of(0.0));
        let force = tilt * -normal + Vector::new(tilt.y, -tilt.x) * tangential;
        let height = if self.problem.model.surface { self.radius(arc) } else { zero };
        EndLoad { arc, force, point: Vector::new(zero, height) }
    }

    /// ∫ of the gauge fibre's strain over the gauge, mm, in an equilibrium with P and T, N, at the arc `arc`.
    pub fn elongation(&self, arc: T, force: [T; 2]) -> Option<T> {
        let load = self.load(arc, force);
        load.bend(&self.whisker, self.problem.gauge).ok().map(|bent| bent.elongation)
    }

    /// M₀, N mm, about the base section, of a rod bent by `load`.
    fn moment(load: &EndLoad<T>, bent: &Bent<T>) -> T {
        (load.point + Vector::new(load.arc, T::of(0.0)) - bent.offset).perp_dot(load.force)
    }

    /// How far the base section has moved, mm, and the angle from the contact's frame to the motor's.
    fn base(&self, load: &EndLoad<T>, bent: &Bent<T>) -> (Vector<T>, T) {
        let Some(root) = self.problem.body.map(|body| body.root) else {
            return (Vector::of(0.0, 0.0), -bent.angle);
        };
        let turned = Self::moment(load, bent) / root.k_theta - bent.angle;
        let force = Vector::from_angle(turned).rotate(load.force);
        (Vector::new(force.x / root.k_x, force.y / root.k_y), turned)
    }

    /// What the whisker exerts on its root: M₀, F_x and F_y in the motor's frame, N mm and N.
    pub fn wrench(&self, load: &EndLoad<T>, bent: &Bent<T>) -> [T; 3] {
        let force = Vector::from_angle(self.base(load, bent).1).rotate(load.force);
        [Self::moment(load, bent), force.x, force.y]
    }

    /// The object's centre from the motor's axis, less where the drive has put it; mm, in the contact frame. The
    /// lengths that cancel are left out, so that a small tap keeps its digits.
    fn miss(&self, amount: T, slid: T, load: &EndLoad<T>, bent: &Bent<T>) -> Vector<T> {
        let RodProblem { taper, body, distance, model, drive, .. } = *self.problem;
        let zero = T::of(0.0);
        let (turn, lift) = match drive {
            Drive::Angle => (amount, zero),
            Drive::Displacement => (zero, amount),
        };
        let (moved, angle) = self.base(load, bent);
        let angle = -angle;
        let moved = Vector::from_angle(angle).rotate(moved) - bent.offset;
        if body.is_some_and(|body| !body.is_straight()) {
            let centre = load.point + self.tilt(load.arc) * model.pole_radius + Vector::new(load.arc, zero);
            let hub = Vector::new(self.hub, zero);
            let begun = self.touched.pole(model.pole_radius) + hub - Vector::new(zero, lift);
            return Vector::from_angle(angle).rotate(hub) + centre + moved
                - Vector::from_angle(angle - turn).rotate(begun);
        }
        // What the radius grows from a to c. As a difference of radii it would lose its digits where a is small.
        let widening = match (model.surface, body) {
            (false, _) => zero,
            (true, None) => -taper.tan_alpha * slid,
            (true, Some(body)) => body.widening(distance, slid),
        };
        let leaned =
            if body.is_some() { self.tilt(load.arc) - self.touched.tilt } else { Vector::of(0.0, 0.0) };
        let centre = self.touched.tilt * model.pole_radius;
        let reach = distance + centre.x + self.hub;
        let across = self.touched.height + centre.y - lift;
        let turned = angle - turn;
        Vector::new(
            slid - self.hub * versine(angle) + reach * versine(turned) + across * turned.sin(),
            widening + lift + self.hub * angle.sin() + across * versine(turned) - reach * turned.sin(),
        ) + leaned * model.pole_radius
            + moved
    }
}

/// 1 − cos x.
fn versine<T: Real>(x: T) -> T {
    let half = (x * 0.5).sin();
    half * 2.0 * half
}
