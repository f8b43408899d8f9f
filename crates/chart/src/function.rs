//! The charted functions of a tap, the power of the drive with which they vanish, and their error bounds.

use super::axis::{AXES, Map, Quantity};
use super::build::Bound;
use super::taps::{design, driven};
use crate::design::{Shared, tilted};
use crate::evaluate::Outcome;
use crate::physics::{driven::Driven, linear::shear_length2, solid::is_solid};
use crate::scene::{Clamp, Contact, Direction, Drive, Material, Setup, Theory};
use crate::status::Status;

/// A charted function of a tap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    /// (1 − x/a) δ with δ = ε/(θ f cos² β) − 1 at a point, f of the estimator's theory; δ of a gauge is 1/K − 1 of an upright pole. f vanishes at the
    /// contact as 1 − x/a does, and δ is steep there. With a foil ε is that of a grid around the point, over the share that the foil passes on.
    Strain,
    /// c/a − 1; times 1 − x/a with a foil.
    Arc,
    /// P over that of linear theory, [`linear_force`] times cos β, less 1; times 1 − x/a with a foil.
    Force,
}

/// Number of functions of a chart.
pub const FUNCTIONS: usize = 3;

/// Share of the tolerance for the error of the strain.
pub(super) const SHARE: f64 = 0.1;

/// Share of the tolerance for the arc of a contact that chooses: T follows from the arc.
const HELD: f64 = 0.003;

/// Error of δ/θᵉ relative to itself plus SMALL: keeps SD(K) where K → 1.
const RELATIVE: f64 = 1e-4;
const SMALL: f64 = 0.02;

/// Power of the drive with which K − 1 vanishes: 2 if the rod is symmetric in the force, 1 if the theory is the model's limit, else 0. `leans`: a pole
/// does, so that a tap depends on the sign of its drive.
pub fn power(setup: &Setup, leans: bool) -> i32 {
    let model = &setup.model;
    let frictionless = matches!(model.contact, Contact::Frictionless | Contact::Coulomb(0.0));
    let theory = model.shear == (setup.estimate.theory == Theory::Timoshenko);
    let solid = is_solid(model) || model.clamp != Clamp::Rigid;
    let limit = frictionless && !model.surface && theory && !solid && setup.gauge.foil.is_none();
    let straight = setup.built.as_ref().is_none_or(|built| built.is_straight());
    let hooke = matches!(model.material, Material::Hooke(_));
    let even = straight && !leans && !model.extension && model.pole_radius == 0.0 && hooke;
    let angle = setup.drive == Drive::Angle;
    match (limit, even && angle) {
        (false, _) => 0,
        (true, false) => 1,
        (true, true) => 2,
    }
}

/// The variables over which series are smooth, by axis.
pub fn variables(setup: &Setup, power: i32) -> [Map; AXES] {
    let (drive, taper) = match power {
        2 => (Map::Square, Map::Inverse),
        _ if setup.model.indentation => (Map::Fourth, Map::Root),
        _ => (Map::Linear, Map::Root),
    };
    [drive, Map::Linear, Map::Linear, taper, Map::Linear]
}

/// 1 − x/a.
pub fn room(q: &[f64; AXES]) -> f64 {
    1.0 - q[Quantity::Place as usize]
}

/// Bounds on the errors of the functions over driveᵉ, in boxes that end at a drive and at a place x/a.
pub fn bounds(
    setup: &Setup,
    [drive, place]: [f64; 2],
    (power, tolerance): (i32, f64),
    chooses: bool,
) -> [Bound; FUNCTIONS] {
    let most = drive.powi(power);
    let rest = if setup.gauge.foil.is_some() { 1.0 - place } else { 1.0 };
    // Close to the contact strain is small and δ may err more: by (1 − x/a)^½.
    let strain = SHARE * tolerance / most * (1.0 - place).sqrt();
    [
        match power {
            0 => Bound::of(strain),
            _ => Bound { error: strain, relative: RELATIVE, small: SMALL },
        },
        Bound::of(if chooses { HELD } else { SHARE } * tolerance / most * rest),
        Bound::of(10.0 * SHARE * tolerance / most * rest),
    ]
}

/// The functions of a solved tap at quantities `q`; `None` without a reading.
pub fn functions(
    setup: &Setup,
    (a, direction): (f64, Direction),
    q: &[f64; AXES],
    o: &Outcome,
) -> Option<[f64; FUNCTIONS]> {
    if o.status.has(Status::NO_READING) || !o.deviation.is_finite() {
        return None;
    }
    let [cos, share] = tilted(direction);
    let strain = match setup.gauge.second || !direction.is_upright() {
        true => o.strain / (o.strain_linear * share) - 1.0,
        false => -o.deviation / (1.0 + o.deviation),
    };
    let force = linear_force(setup, &design(setup, None, a, q).shared?, a, driven(setup, a, q));
    let (arc, force) = (o.arc / a - 1.0, o.normal_force / (force * cos) - 1.0);
    // A foil stiffens the rod at the gauge, so arc and force vary with x/a as the strain does.
    let rest = if setup.gauge.foil.is_some() { room(q) } else { 1.0 };
    Some([room(q) * strain, rest * arc, rest * force])
}

/// Tolerance of solved taps: where K → 1 at small drives they must be accurate relative to K − 1.
pub fn solved(power: i32, chooses: bool) -> f64 {
    match (power, chooses) {
        (0, false) => 1e-8,
        (0, true) => 1e-9,
        _ => 1e-10,
    }
}

/// P of linear theory, N, with shear if the model of a cone has it, of a tap at `a` mm, `driven`.
pub fn linear_force(setup: &Setup, shared: &Shared, a: f64, driven: Driven) -> f64 {
    let with_shear = setup.model.shear && setup.built.is_none();
    let shear = if with_shear { shear_length2(&shared.taper, setup.model.nu) / (a * a) } else { 0.0 };
    driven.size() * shared.model.force(setup.model.material.e0(), a) / (1.0 + shear)
}
