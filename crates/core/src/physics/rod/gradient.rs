//! Derivatives of a tap by its inputs, by the implicit function theorem; the reference's closure is run once in [`Dual`] numbers.

use std::array::from_fn;

use super::collocation::Shapes;
use super::shoot::{Shooter, Unknowns};
use super::statics::EndLoad;
use super::{RodProblem, TiltedTap};
use crate::physics::number::Number;
use crate::physics::real::{Dual, Real};
use crate::scene::model::{Contact, Drive};
use crate::status::Status;

/// Derivatives of a [`Dual`] by the unknowns: P, c or T, and the azimuth.
pub const UNKNOWNS: usize = 3;

/// Inputs of one run.
pub const INPUTS: usize = 5;

/// A number with its derivatives by the unknowns, then by inputs.
pub type Traced = Dual<{ UNKNOWNS + INPUTS }>;

/// Largest Newton step, relative, up to [`GENTLE`]: of 24 000 random taps derivatives then err by at most 4e-9 of their column's largest.
const NEAR: f64 = 1e-10;

/// Drive, rad or δ/a, above which [`NEAR`] shrinks with the square of the drive, down to [`NEAREST`].
const GENTLE: f64 = 0.2;

/// Smallest tolerance, for large drives and for K: its derivative by the drive is a difference of numbers larger by drive⁻².
const NEAREST: f64 = 1e-11;

/// Tolerance where rounding stops the steps: next to the clamp of a thick whisker, whose radius is many distances.
const NEARLY: f64 = 1e-7;

/// Drive, rad or δ/a, below which the tolerance shrinks with the drive.
const SMALL: f64 = 0.01;

const MOST_STEPS: usize = 6;

/// A known equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equilibrium {
    /// P and T, N.
    pub force: [f64; 2],
    /// c, mm from the face of the clamp.
    pub arc: f64,
    /// True if the contact sticks.
    pub sticking: bool,
    /// φ, rad, for a tilted pole or derivatives by its direction.
    pub azimuth: Option<f64>,
    /// True if a second gauge is read.
    pub second: bool,
    /// True if derivatives of K are wanted.
    pub deviation: bool,
}

impl RodProblem<'_, Traced> {
    /// Outputs of the tap and their derivatives by the inputs, at the equilibrium next to `at`.
    ///
    /// # Errors
    /// No equilibrium is found, or the path folds there.
    pub fn trace(
        &self,
        direction: [Traced; 2],
        at: &Equilibrium,
    ) -> Result<TiltedTap<[f64; 1 + INPUTS]>, Status> {
        let (held, start) = self.held();
        let force = at.force[0].abs().max(at.force[1].abs());
        let (unknowns, second) = match (at.sticking, self.model.contact) {
            (true, _) => (Unknowns::Stick, at.force[1] / force),
            (false, Contact::Coulomb(mu)) => {
                (Unknowns::Slide(mu * at.force[1].signum()), at.arc - start.value)
            }
            (false, _) => (Unknowns::Slide(Traced::of(0.0)), at.arc - start.value),
        };
        let turns = at.azimuth.filter(|_| !at.sticking);
        let count = if turns.is_some() { 3 } else { 2 };
        let mut z = [at.force[0] / force, second, turns.unwrap_or(0.0)];
        // Near an end of the gauge strain goes as the square of the distance from it; a contact that sticks on an edge does not move.
        let beside = |x: &Traced| ((at.arc - start.value - x.value) / at.arc).abs();
        let room = held.gauge.iter().map(beside).fold(1.0, f64::min);
        // At small drives K is the difference of two numbers over the drive.
        let unit = if self.drive == Drive::Angle { 1.0 } else { self.distance.value };
        let drive = self.amount.value / unit;
        let driven = (drive / SMALL).min(1.0);
        let gentle = if at.deviation { NEAREST } else { NEAR * (GENTLE / drive).min(1.0).powi(2) };
        let stays = at.sticking && self.model.pole_radius.value == 0.0;
        let near = gentle.max(NEAREST) * if stays { driven } else { driven.min(room) };
        let mut last = f64::INFINITY;
        let mut nearest: Option<(f64, TiltedTap<[f64; 1 + INPUTS]>)> = None;
        let mut shape = Shapes::default();
        for _ in 0..MOST_STEPS {
            let seeds = from_fn(|k| Traced::seed(z[k], k, if k < count { 1.0 } else { 0.0 }));
            let (lack, mut shown) =
                held.look(unknowns, force, direction, (seeds, turns.is_some()), at.second, &mut shape)?;
            let steps = close(lack, count).ok_or(Status::NOT_CONVERGED)?;
            let size = |k: usize| match (k, at.sticking) {
                (1, false) => at.arc,
                (2, _) => 1.0,
                _ => 1.0_f64,
            };
            let step = (0..count).map(|k| (steps[k][0] / size(k)).abs()).fold(0.0, f64::max);
            if !step.is_finite() {
                break;
            }
            if nearest.as_ref().is_none_or(|(smallest, _)| step < *smallest) {
                shown.tap.contact_arc = shown.tap.contact_arc + start;
                nearest = Some((step, shown.map(|x| follow(&x, &steps))));
            }
            let settled = step >= 0.5 * last;
            if step <= near || settled && nearest.as_ref().is_some_and(|(nearest, _)| *nearest <= NEARLY) {
                break;
            }
            last = step;
            z = from_fn(|k| z[k] + steps[k][0]);
        }
        nearest.filter(|(step, _)| *step <= NEARLY).map(|(_, shown)| shown).ok_or(Status::NOT_CONVERGED)
    }

    fn look(
        &self,
        unknowns: Unknowns<Traced>,
        force: f64,
        direction: [Traced; 2],
        ([p, second, phi], turns): ([Traced; 3], bool),
        gauges: bool,
        shape: &mut Shapes,
    ) -> Result<([Traced; 3], TiltedTap<Traced>), Status> {
        let zero = Traced::of(0.0);
        let (mut plane, mut slide) = (*self, zero);
        let pole = turns.then(|| self.pole(direction));
        if let Some(pole) = &pole {
            slide = pole.slide(phi);
            // Distance and angle are even in azimuth and direction, so that an upright pole keeps those of the tap. One that moves
            // next to the clamp may lie where no straight whisker reaches, and has none.
            if direction.iter().any(|angle| angle.value != 0.0) {
                plane = self.in_plane(&pole.planar(phi).ok_or(Status::NOT_CONVERGED)?);
            }
        }
        let shooter = Shooter::with(&plane, unknowns, force);
        let z = match unknowns {
            Unknowns::Stick => second,
            Unknowns::Slide(_) => (second - plane.distance) / plane.distance,
        };
        let bend = |shooter: &Shooter<'_, Traced>, load: &EndLoad<Traced>, shape: &mut Shapes| {
            let found = load.collocated(&shooter.whisker, plane.gauge, shape);
            found.map_or_else(|| load.bend(&shooter.whisker, plane.gauge), Ok)
        };
        let shot = shooter.shot(plane.amount, [p, z], |load| bend(&shooter, load, &mut *shape));
        let shot = shot.map_err(|_| Status::NOT_CONVERGED)?;
        let tap = plane.tap_of(&shooter, &shot);
        let lacking = match &pole {
            Some(pole) => {
                let alpha = if self.model.surface { self.taper.tan_alpha.atan() } else { zero };
                pole.azimuth(shot.bent.angle + alpha).ok_or(Status::NOT_CONVERGED)? - phi
            }
            None => zero,
        };
        let mut shown = TiltedTap { tap, strain_2: tap.strain, axial: zero, azimuth: phi, slide };
        if turns || gauges {
            // The gauge in the plane of bending reads axial + bending; on the far side both gauges are turned by 180°.
            let mirrored = plane.mirrored();
            let mirrored = Shooter::with(&mirrored, unknowns, force);
            let beyond = bend(&mirrored, &shot.load, shape).map_err(|_| Status::NOT_CONVERGED)?.elongation;
            let axial = (tap.strain + beyond / (plane.gauge[1] - plane.gauge[0])) * 0.5;
            let (sin, cos) = phi.sin_cos();
            let bending = tap.strain - axial;
            shown.axial = axial;
            (shown.tap.strain, shown.strain_2) = (axial + bending * cos, axial + bending * sin);
        }
        Ok(([shot.miss.x, shot.miss.y, lacking], shown))
    }
}

/// The step of each of `count` unknowns that meets the closure, followed by its derivatives by the inputs.
fn close(lack: [Traced; 3], count: usize) -> Option<[[f64; 1 + INPUTS]; 3]> {
    let mut rows: [[f64; UNKNOWNS + 1 + INPUTS]; 3] = from_fn(|r| {
        from_fn(|c| match c {
            0..UNKNOWNS => lack[r].slope[c],
            UNKNOWNS => -lack[r].value,
            _ => -lack[r].slope[c - 1],
        })
    });
    for c in 0..count {
        let size = |row: &[f64; UNKNOWNS + 1 + INPUTS]| {
            row[c].abs() / row[..count].iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()))
        };
        let best = (c..count).max_by(|&a, &b| size(&rows[a]).total_cmp(&size(&rows[b])))?;
        rows.swap(c, best);
        let pivot = rows[c];
        if pivot[c] == 0.0 || !pivot[c].is_finite() {
            return None;
        }
        for (r, row) in rows.iter_mut().enumerate().take(count) {
            let share = if r == c { 1.0 - 1.0 / pivot[c] } else { row[c] / pivot[c] };
            *row = from_fn(|k| row[k] - share * pivot[k]);
        }
    }
    Some(from_fn(|r| from_fn(|k| if r < count { rows[r][UNKNOWNS + k] } else { 0.0 })))
}

/// The value stays at the last iterate: next to an end of the gauge K is a ratio of numbers of the same iterate.
fn follow(x: &Traced, steps: &[[f64; 1 + INPUTS]; 3]) -> [f64; 1 + INPUTS] {
    from_fn(|k| match k {
        0 => x.value,
        _ => x.slope[UNKNOWNS + k - 1] + (0..UNKNOWNS).map(|u| x.slope[u] * steps[u][k]).sum::<f64>(),
    })
}
