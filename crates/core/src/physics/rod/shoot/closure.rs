//! The closure of a tap: the miss of the object under trial forces (model §3).

use super::super::RodProblem;
use super::super::statics::{Bent, EndLoad, Skin, Whisker};
use super::{Shooter, Shot, Unknowns};
use crate::physics::body::Touched;
use crate::physics::real::{Real, Vector};
use crate::physics::section::SectionLaw;
use crate::physics::solid::{Held, Soft};
use crate::scene::model::Drive;
use crate::status::Status;

const MOST_ROLLS: u32 = 30;

/// Allowed difference of the two rolled lengths, in roundings.
const ROLLED: f64 = 8.0;

/// The same where rounding stops convergence: the integration is accurate to 1e-13.
const NEARLY_ROLLED: f64 = 4e3;

const FLAT: f64 = 1e-9;

type Rod<T> = (EndLoad<T>, Bent<T>);

impl<'a, T: Real> Shooter<'a, T> {
    pub fn with(problem: &'a RodProblem<'a, T>, unknowns: Unknowns<T>, force: f64) -> Self {
        let RodProblem { taper, model, distance: a, body, .. } = *problem;
        let zero = T::of(0.0);
        let (hub, unit) = match problem.drive {
            Drive::Angle => (problem.hub, 1.0),
            Drive::Displacement => (zero, a.value()),
        };
        let touched = match body {
            Some(body) => body.touched(a, model.surface),
            None => {
                let [height, sin, cos] = taper.touched(a, model.surface);
                Touched { height, tilt: Vector::new(sin, cos), angle: zero, place: Vector::new(a, zero) }
            }
        };
        let (whole, behind) = Skin::whisker(problem);
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
            },
            soft: Soft::new(model, &whole, a + behind),
            lever: (a + hub).value(),
            touched,
            hub,
            unit,
            force,
        }
    }

    pub fn shoot(&self, amount: T, z: [T; 2]) -> Result<Shot<T>, Status> {
        self.shot(amount, z, |load| load.bend(&self.whisker, self.problem.gauge))
    }

    pub fn shot(
        &self,
        amount: T,
        z: [T; 2],
        mut bend: impl FnMut(&EndLoad<T>) -> Result<Bent<T>, Status>,
    ) -> Result<Shot<T>, Status> {
        let a = self.problem.distance;
        let normal = z[0] * self.force;
        let (slid, tangential) = match self.unknowns {
            Unknowns::Slide(ratio) => (a * z[1], ratio * normal),
            Unknowns::Stick => (T::of(0.0), z[1] * self.force),
        };
        let mut under = |slid: T| {
            let arc = a + slid;
            if !(arc.value() > 0.0 && self.radius(arc).value() > 0.0) {
                return Err(Status::NOT_CONVERGED);
            }
            let load = self.load(arc, [normal, tangential]);
            Ok((load, bend(&load)?))
        };
        let rolls = self.unknowns == Unknowns::Stick && self.problem.model.pole_radius.value() > 0.0;
        let (slid, (load, bent)) = if rolls { self.roll(amount, &mut under)? } else { (slid, under(slid)?) };
        let depth = self.soft.map_or(T::of(0.0), |soft| soft.depth(normal));
        let miss = self.miss(amount, slid, &load, &bent) - self.touched.tilt * depth;
        let shot = Shot { normal, tangential, load, bent, miss };
        let finite = miss.x.value().is_finite() && miss.y.value().is_finite();
        if finite { Ok(shot) } else { Err(Status::NOT_CONVERGED) }
    }

    /// Distance that the contact rolls on a pole that does not turn, mm, and the rod there. Equal lengths of circumference and skin have touched.
    fn roll(
        &self,
        amount: T,
        mut under: impl FnMut(T) -> Result<Rod<T>, Status>,
    ) -> Result<(T, Rod<T>), Status> {
        let RodProblem { distance: a, body, model, drive, .. } = *self.problem;
        let lean = |tilt: Vector<T>| (tilt.x / tilt.y).atan();
        let begun = lean(self.touched.tilt) - self.touched.angle;
        let turned = if drive == Drive::Angle { amount } else { T::of(0.0) };
        let skin = |slid: T| match body {
            Some(body) if model.surface => body.skin(a, slid),
            Some(_) => slid,
            None => slid / self.touched.tilt.y,
        };
        let mut slid = T::of(0.0);
        let (mut slope, mut last) = (1.0, None::<(f64, f64)>);
        let mut close = 0;
        for _ in 0..MOST_ROLLS {
            let rod = under(slid)?;
            let (angle, leaned) = (self.base(&rod.0, &rod.1).1, lean(self.tilt(rod.0.arc)));
            let gap = skin(slid) - model.pole_radius * (turned + angle + begun - leaned);
            let rounding = f64::EPSILON
                * (slid.value().abs()
                    + model.pole_radius.value()
                        * (turned.value().abs() + angle.value().abs() + begun.value().abs()));
            // A gap that no longer shrinks is rounding of the rod.
            let stays = last.is_some_and(|(_, before)| gap.value().abs() >= 0.5 * before.abs());
            let most = if stays { NEARLY_ROLLED } else { ROLLED };
            close += u32::from(gap.value().abs() <= most * rounding);
            if close > 0 {
                return Ok((slid, rod));
            }
            if let Some((place, before)) = last.replace((slid.value(), gap.value()))
                && (slid.value() - place).abs() > FLAT * a.value()
            {
                slope = (gap.value() - before) / (slid.value() - place);
            }
            slid = slid - gap / slope;
        }
        Err(Status::NOT_CONVERGED)
    }

    fn radius(&self, arc: T) -> T {
        let RodProblem { taper, body, distance, .. } = *self.problem;
        match body {
            Some(body) if self.problem.model.surface => body.radius(arc, distance.value()),
            Some(body) => body.radius(arc, arc.value()),
            None => taper.radius(arc),
        }
    }

    pub fn tilt(&self, arc: T) -> Vector<T> {
        let RodProblem { body, distance, model, .. } = *self.problem;
        body.map_or(self.touched.tilt, |body| body.tilt(arc, distance.value(), model.surface))
    }

    pub fn load(&self, arc: T, [normal, tangential]: [T; 2]) -> EndLoad<T> {
        let (tilt, zero) = (self.tilt(arc), T::of(0.0));
        let force = tilt * -normal + Vector::new(tilt.y, -tilt.x) * tangential;
        let height = if self.problem.model.surface { self.radius(arc) } else { zero };
        EndLoad { arc, force, point: Vector::new(zero, height) }
    }

    pub fn elongation(&self, arc: T, force: [T; 2]) -> Option<T> {
        let load = self.load(arc, force);
        load.bend(&self.whisker, self.problem.gauge).ok().map(|bent| bent.elongation)
    }

    fn moment(load: &EndLoad<T>, bent: &Bent<T>) -> T {
        (load.point + Vector::new(load.arc, T::of(0.0)) - bent.offset).perp_dot(load.force)
    }

    pub fn base(&self, load: &EndLoad<T>, bent: &Bent<T>) -> (Vector<T>, T) {
        let Some(root) = self.problem.body.map(|body| body.built.root) else {
            return (Vector::of(0.0, 0.0), -bent.angle);
        };
        let turned = Self::moment(load, bent) / root.k_theta - bent.angle;
        let force = Vector::from_angle(turned).rotate(load.force);
        (Vector::new(force.x / root.k_x, force.y / root.k_y), turned)
    }

    /// Wrench on the root in the motor's frame: M₀, N mm, F_x and F_y, N.
    pub fn wrench(&self, load: &EndLoad<T>, bent: &Bent<T>) -> [T; 3] {
        let force = Vector::from_angle(self.base(load, bent).1).rotate(load.force);
        [Self::moment(load, bent), force.x, force.y]
    }

    /// The object's centre from the motor's axis, less where the drive has put it; mm, in the contact frame, without lengths that cancel.
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
        // Growth of the radius from a to c; a difference of radii would lose its digits at small a.
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

fn versine<T: Real>(x: T) -> T {
    let half = (x * 0.5).sin();
    half * 2.0 * half
}
