//! Parameters of a model that can be fitted.

use std::sync::Arc;

use crate::scene::{Clamp, Contact, Drive, Material, Setup};
use crate::{error::InputError, measure::Rig};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// s: reading per strain; 1 for an ideal gauge, in the unit of the reading otherwise.
    Factor,
    /// θ₀ in degrees, or δ₀ in mm: minus the drive at contact, with the error of its zero.
    DriveOffset,
    /// a₀, mm: error of the distance labels.
    DistanceOffset,
    /// r₀, mm.
    Hub,
    /// Poisson's ratio ν.
    Nu,
    /// Coefficient of friction μ.
    Mu,
    /// Ratio C01/C10.
    Ratio,
    /// c₀, in D: where the clamp holds the rod (model §8).
    Clamp,
    /// k_θ of the root, N mm/rad (model §7).
    Root,
    /// z₀, in the unit of the signal: signal of an untared sensor without contact. It is fitted to be subtracted, not stored.
    Zero,
}

impl Parameter {
    /// All parameters of a calibration, in the order of [`Values`].
    pub const ALL: [Self; 9] = {
        use Parameter::*;
        [Factor, DriveOffset, DistanceOffset, Hub, Nu, Mu, Ratio, Clamp, Root]
    };

    /// Names and units for an angle and a displacement, domain, and the key of a spec that adds the parameter to the model.
    fn facts(self) -> ([&'static str; 2], [&'static str; 2], [f64; 2], &'static str) {
        let any = [f64::NEG_INFINITY, f64::INFINITY];
        let clamp = "clamp = c0 in [model]: 0.054 if bonded, -0.021 if glued, -0.358 in a smooth socket";
        let ratio = "material = { mooney-rivlin = … } or { neo-hookean = … } in [model]";
        let root = "root = { k_theta = … } in [whisker], about as stiff as it may be";
        match self {
            Self::Factor => (["factor"; 2], [""; 2], [f64::MIN_POSITIVE, f64::INFINITY], ""),
            Self::DriveOffset => (["theta_offset", "delta_offset"], ["degrees", "mm"], any, ""),
            Self::DistanceOffset => (["a_offset"; 2], ["mm"; 2], any, ""),
            Self::Hub => (["hub"; 2], ["mm"; 2], [0.0, 1e3], "an active whisker (theta_deg)"),
            Self::Nu => (["nu"; 2], [""; 2], [0.0, 0.5], "shear = true in [model]"),
            Self::Mu => (["mu"; 2], [""; 2], [0.0, 2.0], "contact = { coulomb = … } in [model]"),
            Self::Ratio => (["C01/C10"; 2], [""; 2], [-0.9, 1e2], ratio),
            Self::Clamp => (["c0"; 2], [""; 2], [-1.0, 0.2], clamp),
            Self::Root => (["k_theta"; 2], ["N mm/rad"; 2], [1e-6, 1e12], root),
            Self::Zero => (["zero"; 2], [""; 2], any, ""),
        }
    }

    pub fn name(self, kind: Drive) -> &'static str {
        self.facts().0[kind as usize]
    }

    pub fn named(name: &str, kind: Drive) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name(kind).eq_ignore_ascii_case(name))
    }

    pub fn unit(self, kind: Drive) -> &'static str {
        self.facts().1[kind as usize]
    }

    pub fn domain(self) -> [f64; 2] {
        self.facts().2
    }

    /// True if the model must be solved again for another value.
    pub fn is_physical(self) -> bool {
        matches!(self, Self::Hub | Self::Nu | Self::Mu | Self::Ratio | Self::Clamp | Self::Root)
    }

    pub fn step(self, value: f64) -> f64 {
        match self {
            Self::Hub => 0.02,
            Self::Root => 0.02 * value,
            _ => 2e-3,
        }
    }
}

/// Values of all parameters, indexed by [`Parameter`].
pub type Values = [f64; 10];

/// Values of the spec, with an ideal gauge and without offsets; NaN for parameters that the model lacks.
pub fn spec_values(setup: &Setup) -> Values {
    let mu = match setup.model.contact {
        Contact::Coulomb(mu) => mu,
        Contact::Frictionless | Contact::Stick => f64::NAN,
    };
    let ratio = match setup.model.material {
        Material::NeoHookean(_) => 0.0,
        Material::MooneyRivlin([c10, c01]) => c01 / c10,
        Material::Hooke(_) | Material::Yeoh(_) => f64::NAN,
    };
    let hub = if setup.drive == Drive::Angle { setup.hub } else { f64::NAN };
    let nu = if setup.model.shear { setup.model.nu } else { f64::NAN };
    let c0 = if let Clamp::At(c0) = setup.model.clamp { c0 } else { f64::NAN };
    let turns = setup.built.as_ref().map(|built| built.root.k_theta).filter(|k| k.is_finite());
    [1.0, 0.0, 0.0, hub, nu, mu, ratio, c0, turns.unwrap_or(f64::NAN), 0.0]
}

/// `setup` with the physical parameters of `values`.
pub fn scene_with(setup: &Setup, values: &Values) -> Setup {
    let [_, _, _, hub, nu, mu, ratio, c0, turns, _] = *values;
    let mut setup = setup.clone();
    if hub.is_finite() {
        setup.hub = hub;
    }
    if nu.is_finite() {
        setup.model.nu = nu;
    }
    if mu.is_finite() {
        setup.model.contact = Contact::Coulomb(mu);
    }
    if c0.is_finite() {
        setup.model.clamp = Clamp::At(c0);
    }
    if let Some(built) = setup.built.as_mut().filter(|_| turns.is_finite()) {
        Arc::make_mut(built).root.k_theta = turns;
    }
    // An unchanged ratio keeps the material bit for bit.
    if ratio.is_finite() && ratio != spec_values(&setup)[6] {
        let c10 = setup.model.material.e0() / (6.0 * (1.0 + ratio));
        setup.model.material = Material::MooneyRivlin([c10, ratio * c10]);
    }
    setup
}

/// Refuses parameters that the model of `rig` lacks.
pub fn check(rig: &Rig, asked: &[Parameter]) -> Result<(), InputError> {
    let values = spec_values(&rig.setup);
    for p in asked {
        if values[*p as usize].is_nan() {
            let message = "the model of this spec has no such parameter, so that it cannot be fitted";
            let name = p.name(rig.setup.drive);
            return Err(InputError::new(message).key("--fit").value(name).allowed(p.facts().3));
        }
    }
    Ok(())
}

pub fn width(p: Parameter, values: &Values, drives: [f64; 2], [size, before]: [f64; 2]) -> f64 {
    match p {
        Parameter::Factor => values[0].abs(),
        Parameter::DriveOffset => (0.1 * drives[1]).max(before),
        Parameter::DistanceOffset => 2.0,
        Parameter::Hub => 5.0,
        Parameter::Nu | Parameter::Mu => 0.5,
        Parameter::Ratio => 1.0,
        Parameter::Clamp => 0.2,
        Parameter::Root => values[p as usize],
        Parameter::Zero => 0.2 * size,
    }
}
