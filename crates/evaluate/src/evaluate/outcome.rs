//! From solutions to outcomes: values in users' units, and the statuses of the physics.

use super::solve::Solved;
use super::{Outcome, Task};
use crate::design::{Design, Shared, radians, tilted};
use crate::kernel::rule::limits::EDGE;
use crate::physics::driven::Driven;
use crate::physics::rod::{RodProblem, TiltedTap};
use crate::scene::{Direction, Geometry, Setup, Side, Signal};
use crate::status::Status;

/// Distance, over a, from a corner or the tip within which it is not decided on which side the contact is.
const CLOSE: f64 = 1e-6;

/// A tap of the domain.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    pub setup: &'a Setup,
    pub shared: &'a Shared,
    pub task: &'a Task,
    /// The drive.
    pub driven: Driven,
    /// θ f, f of the estimator's theory.
    pub linear: f64,
}

impl<'a> Asked<'a> {
    /// The tap `task` of `design`; `None` outside the domain.
    pub fn new(setup: &'a Setup, design: &'a Design, task: &'a Task) -> Option<Self> {
        Self::of(setup, design, task, f64::NAN)
    }

    /// The same, with θ f if that is known, else NaN.
    pub fn of(setup: &'a Setup, design: &'a Design, task: &'a Task, linear: f64) -> Option<Self> {
        let Direction { tilt, lean } = task.direction;
        let inside =
            design.admits(setup, task.a, task.drive) && [tilt, lean].iter().all(|angle| angle.abs() < 90.0);
        if inside { Self::known(setup, design, task, linear) } else { None }
    }

    /// The same for a tap known to be in the domain, or next to it; `None` for an invalid whisker.
    pub fn known(setup: &'a Setup, design: &'a Design, task: &'a Task, linear: f64) -> Option<Self> {
        let (setup, shared) = (design.setup(setup), design.shared.as_ref()?);
        let driven = task.driven(setup);
        let theory = || driven.size() * shared.theory.curve().value(task.a);
        Some(Self { setup, shared, task, driven, linear: if linear.is_nan() { theory() } else { linear } })
    }
}

/// The outcome of chart values: δ = ε/(θ f cos² β) − 1 of the strain before a foil, c/a − 1, P (N) and T/P; with a second gauge also its differences
/// to linear theory ([`beside_linear`]). `None` for an invalid whisker.
pub fn outcome_of_chart(
    setup: &Setup,
    design: &Design,
    task: &Task,
    ([strain, arc, normal, friction], beside): ([f64; 4], Option<[f64; 3]>),
    sticking: bool,
) -> Option<Outcome> {
    let asked = Asked::known(setup, design, task, f64::NAN)?;
    let Asked { setup, shared, driven, linear, .. } = asked;
    let share = tilted(task.direction)[1] * shared.foil.map_or(1.0, |foil| foil.transfer);
    let deviation =
        if share == 1.0 { -strain / (1.0 + strain) } else { 1.0 / (share + share * strain) - 1.0 };
    let [strain_2, azimuth, slide] = beside.map_or([f64::NAN; 3], |found| {
        let [strain_2, azimuth, slide] = std::array::from_fn(|f| beside_linear(task.direction)[f] + found[f]);
        [linear * strain_2, azimuth, driven.path(task.a + setup.hub) * slide]
    });
    let found = Outcome {
        strain: share * (linear + linear * strain),
        strain_2,
        azimuth,
        slide,
        deviation,
        normal_force: normal,
        tangential_force: friction * normal,
        arc: task.a + task.a * arc,
        sticking,
        ..Outcome::NOTHING
    };
    Some(asked.outcome(found))
}

/// ε₂/(θ f), φ (rad) and λ over the path of the pole, in linear theory, for a pole of `direction` (model §6).
pub fn beside_linear(direction: Direction) -> [f64; 3] {
    let [tilt, lean] = radians(direction);
    [tilt.cos() * tilt.sin(), tilt, -tilt.sin() / lean.cos()]
}

/// f of the estimator's theory over f of the linear model, less 1, free of cancellation.
fn theories_apart(shared: &Shared, task: &Task) -> f64 {
    if !shared.model.is_plain() {
        return shared.theory.curve().value(task.a) / shared.model.value(task.a) - 1.0;
    }
    let u2 = 1.0 / (task.a * task.a);
    let (model, theory) = (shared.model.shear * u2, shared.theory.curve().shear * u2);
    (model - theory) / (1.0 + theory)
}

/// The reference's outcome of a tap, or that of the closed forms for a linear geometry.
pub(super) fn reference(setup: &Setup, design: &Design, task: &Task) -> Outcome {
    Asked::new(setup, design, task).map_or(Outcome::OUTSIDE, by_reference)
}

/// The same of a tap known to be in the domain.
pub(super) fn by_reference(asked: Asked<'_>) -> Outcome {
    let Asked { setup, shared, task, driven, linear } = asked;
    if setup.model.geometry == Geometry::Linear {
        let (e0, size) = (setup.model.material.e0(), driven.size());
        let upright = Outcome {
            strain: size * shared.model.value(task.a),
            deviation: theories_apart(shared, task),
            normal_force: size * shared.model.force(e0, task.a),
            tangential_force: 0.0,
            arc: task.a,
            wrench: shared.model.wrench(e0, task.a).map(|x| size * x),
            ..Outcome::NOTHING
        };
        return asked.outcome(if task.is_spatial(setup) { asked.tilted(upright) } else { upright });
    }
    let problem = problem(setup, shared, task.a, driven);
    let [strain_2, axial, azimuth, slide] = [f64::NAN; 4];
    let solved = match task.is_spatial(setup) {
        true => problem.solve_tilted(radians(task.direction)),
        false => problem.solve().map(|tap| TiltedTap { tap, strain_2, axial, azimuth, slide }),
    };
    match solved {
        Ok(TiltedTap { tap, strain_2, axial, azimuth, slide }) => {
            let strain = reading(setup, tap.wrench, tap.strain);
            asked.outcome(Outcome {
                strain,
                strain_2: sign(setup) * strain_2,
                deviation: linear / strain - 1.0,
                normal_force: tap.normal_force,
                tangential_force: tap.tangential_force,
                arc: tap.contact_arc,
                wrench: tap.wrench,
                azimuth,
                slide,
                axial: sign(setup) * axial,
                sticking: tap.sticking,
                ..Outcome::NOTHING
            })
        }
        Err(why) => asked.unsolved(why),
    }
}

/// The rod of a tap at `a` mm.
pub fn problem<'a>(setup: &'a Setup, shared: &'a Shared, a: f64, driven: Driven) -> RodProblem<'a> {
    RodProblem {
        taper: shared.taper,
        gauge: shared.gauge,
        side: setup.gauge.side,
        distance: a,
        hub: setup.hub,
        driven,
        foil: shared.foil,
        body: shared.body.as_deref().filter(|_| setup.built.is_some()),
        model: &setup.model,
    }
}

/// The sensor's reading for this wrench and strain, positive as on the contact side.
pub(super) fn reading(setup: &Setup, wrench: [f64; 3], strain: f64) -> f64 {
    sign(setup) * setup.signal.of(setup.felt(wrench)).unwrap_or(strain)
}

/// Sign of the sensor's reading: a tap turns and pushes the root back.
#[inline]
pub(super) fn sign(setup: &Setup) -> f64 {
    if (setup.signal, setup.gauge.side) == (Signal::Strain, Side::Contact) { 1.0 } else { -1.0 }
}

/// A strain as the gauge shows it; never −0.
#[inline]
pub(super) fn signed(setup: &Setup, strain: f64) -> f64 {
    sign(setup) * strain + 0.0
}

/// True if a contact meant for `a`, now at `arc`, bends no part of a gauge that begins at `x1`.
#[inline]
pub(super) fn off_gauge(x1: f64, a: f64, arc: f64) -> bool {
    a <= x1 || arc <= x1
}

/// True if a contact is behind the clamp: the equations have solutions there, but no whisker does.
pub(super) fn is_behind(arc: f64) -> bool {
    arc <= 0.0
}

impl Asked<'_> {
    /// Linear theory of a tilted pole: the rod bends by θ cos β towards its contact, at the azimuth β.
    fn tilted(&self, upright: Outcome) -> Outcome {
        let Self { setup, task, driven, .. } = *self;
        let [cos, share] = tilted(task.direction);
        let [strain_2, azimuth, slide] = beside_linear(task.direction);
        let t2 = azimuth.tan().powi(2);
        Outcome {
            strain: upright.strain * share,
            strain_2: upright.strain * strain_2,
            deviation: upright.deviation + t2 + upright.deviation * t2,
            normal_force: upright.normal_force * cos,
            wrench: upright.wrench.map(|x| x * share),
            azimuth,
            slide: driven.path(task.a + setup.hub) * slide,
            axial: 0.0,
            ..upright
        }
    }

    /// The outcome by `s`; `None` where that does not tell the tap to `tolerance`.
    pub fn told(&self, s: &Solved, tolerance: f64) -> Option<Outcome> {
        let Self { setup, shared, task, .. } = self;
        let Solved { found: Outcome { arc, .. }, error, load, sweeps, .. } = *s;
        if [error, load].iter().any(|x| x.is_nan()) || error > tolerance || (load - 1.0).abs() <= EDGE {
            return None;
        }
        if load > 1.0 {
            return Some(self.unsolved(Status::MATERIAL_LIMIT));
        }
        if let Some(body) = shared.body.as_deref().filter(|_| setup.built.is_some()) {
            let near = |place: f64| (arc - place).abs() <= CLOSE * task.a;
            let power = body.power();
            // A blunt tip has no slope: a contact that begins there has no normal.
            let blunt = setup.model.surface && power.is_some_and(|[_, _, n]| n < 1.0);
            // Beyond the tip of a power the diameter stays constant: the path may have ended before.
            let beyond = arc > body.length && power.is_some();
            if near(body.length) || beyond || blunt && task.a >= (1.0 - CLOSE) * body.length {
                return None;
            }
            if arc > body.length {
                return Some(self.unsolved(Status::SLIPPED_OFF));
            }
            if setup.model.surface {
                let [begin, end] = body.piece(task.a);
                if near(begin) && begin > 0.0 || near(end) {
                    return None;
                }
                if !(begin..=end).contains(&arc) {
                    return Some(self.unsolved(Status::AT_KNOT));
                }
            }
        }
        Some(Outcome { sweeps: sweeps as f32, ..self.outcome(s.found) })
    }

    /// True if a contact at `arc` bends no part of the gauge.
    pub fn unread(&self, arc: f64) -> bool {
        self.setup.signal == Signal::Strain && off_gauge(self.shared.gauge[0], self.task.a, arc)
    }

    /// No values but the linear theory's.
    pub fn unsolved(&self, why: Status) -> Outcome {
        let off = if self.unread(f64::INFINITY) { Status::NO_STRAIN } else { Status::OK };
        Outcome { strain_linear: sign(self.setup) * self.linear, status: why | off, ..Outcome::NOTHING }
    }

    /// The outcome of a tap `found` without its words, whose strains are as on the contact side.
    pub fn outcome(&self, found: Outcome) -> Outcome {
        self.outcome_where(found, self.unread(found.arc))
    }

    /// The same, where it is known whether the gauge shows `no_strain`.
    pub fn outcome_where(&self, found: Outcome, no_strain: bool) -> Outcome {
        let Self { setup, shared, linear, .. } = *self;
        if is_behind(found.arc) {
            return self.unsolved(Status::NOT_CONVERGED);
        }
        let shown = |strain: f64| if no_strain && !strain.is_nan() { 0.0 } else { strain };
        let strain = if no_strain { 0.0 } else { found.strain };
        let strain_2 = if setup.gauge.second { shown(found.strain_2) } else { f64::NAN };
        // With two gauges K = θ f cos β̂/√(ε₁² + ε₂²), tan β̂ = ε₂/ε₁.
        let deviation = match () {
            () if no_strain => f64::NAN,
            () if strain_2.is_nan() => found.deviation,
            () if found.azimuth == 0.0 => {
                let t2 = (strain_2 / strain).powi(2);
                (found.deviation - t2) / (1.0 + t2)
            }
            () => linear * strain / (strain * strain + strain_2 * strain_2) - 1.0,
        };
        let outcome = Outcome {
            strain: signed(setup, strain),
            strain_2: signed(setup, strain_2),
            strain_linear: signed(setup, linear),
            deviation,
            axial: signed(setup, shown(found.axial)),
            ..found
        };
        let words = [
            (no_strain, Status::NO_STRAIN),
            (found.arc > shared.length * (1.0 + 1e-12), Status::SLIPPED_OFF),
            (outcome.magnitude() > shared.strain_limit(&setup.gauge), Status::STRAIN_LIMIT),
        ];
        let status = words.iter().filter(|(holds, _)| *holds).fold(Status::OK, |all, (_, word)| all | *word);
        Outcome { status, ..outcome }
    }
}
