//! Inputs of a tap: everything that its outcome depends on, with their names, scales and changes.

use crate::scene::built::Profile;
use crate::scene::{Built, Clamp, Contact, Drive, Material, Property, Setup, Tuple};

/// An input of derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// A number of the tap, in the order of [`Tuple::to_array`].
    Tuple(usize),
    /// A property of whisker, rig or object.
    Property(Property),
    /// A modulus of a hyperelastic law, in the order of its key.
    Modulus(usize),
    /// c₀ of a clamp given as a number.
    Clamp,
    /// Length of a foil, mm.
    FoilLength,
    /// Width of a foil, mm.
    FoilWidth,
}

const NAMES: [&str; 9] = ["D", "d", "L_a", "x_ss", "l", "a", "tilt", "lean", ""];

impl Input {
    /// The input of this name in `setup`.
    /// Errors: why the taps of `setup` have no derivative by it.
    pub fn new(setup: &Setup, name: &str) -> Result<Self, String> {
        let drive = if setup.drive == Drive::Angle { "theta" } else { "delta" };
        let input = match name {
            _ if name == drive => Self::Tuple(8),
            "C10" => Self::Modulus(0),
            "C01" | "C20" => Self::Modulus(1),
            "C30" => Self::Modulus(2),
            "clamp" => Self::Clamp,
            "foil.length" => Self::FoilLength,
            "foil.width" => Self::FoilWidth,
            _ => match NAMES.iter().position(|known| *known == name && !name.is_empty()) {
                Some(k) => Self::Tuple(k),
                None => {
                    let named = |p: &&Property| p.name() == name && **p != Property::Noise;
                    let property = Property::ALL.iter().find(named).ok_or("this is no input of a tap")?;
                    Self::Property(*property)
                }
            },
        };
        let tabled = setup.built.as_ref().is_some_and(|built| matches!(built.profile, Profile::Table(_)));
        let fits = match name {
            "C10" => matches!(setup.model.material, Material::MooneyRivlin(_) | Material::Yeoh(_)),
            "C01" => matches!(setup.model.material, Material::MooneyRivlin(_)),
            "C20" | "C30" => matches!(setup.model.material, Material::Yeoh(_)),
            "clamp" => matches!(setup.model.clamp, Clamp::At(_)),
            "tilt" | "lean" => setup.forbids([true; 2]).is_none(),
            "foil.length" | "foil.width" => setup.gauge.foil.is_some(),
            _ => match input {
                Self::Property(Property::Modulus) => {
                    matches!(setup.model.material, Material::Hooke(_) | Material::NeoHookean(_))
                }
                Self::Property(Property::Scale) => tabled,
                Self::Property(Property::Bore | Property::Core | Property::CoreModulus) => {
                    let hollow = input == Self::Property(Property::Bore);
                    let inner = setup.built.as_ref().and_then(|built| built.inner.as_ref());
                    inner.is_some_and(|inner| (inner.modulus == 0.0) == hollow)
                }
                // The direction of sliding is known only with friction.
                Self::Property(p @ Property::Friction) => p.get(setup) > 0.0,
                // Next to the tip of a cone no step that its radius needs resolves v ln v.
                Self::Property(p @ Property::Exponent) => !tabled && p.get(setup) != 1.0,
                // A curved whisker has none of model §8.
                Self::Property(Property::Curvature | Property::CurvatureSlope) => {
                    let model = &setup.model;
                    let rod = !(model.indentation || model.distorting || setup.gauge.foil.is_some());
                    rod && model.clamp == Clamp::Rigid
                }
                // A contact with friction on an edge does not roll: there the pole radius is 0.
                Self::Property(Property::PoleRadius) => {
                    let slips = matches!(setup.model.contact, Contact::Frictionless | Contact::Coulomb(0.0));
                    slips || setup.model.pole_radius > 0.0
                }
                Self::Property(p) => p.get(setup).is_finite(),
                // A profile has fixed diameters and length.
                Self::Tuple(..=2) => !tabled,
                _ => true,
            },
        };
        if fits { Ok(input) } else { Err("the model has no such input".to_owned()) }
    }

    /// A change of this input that changes taps by their order: of the tap `t`, at a mm.
    pub(super) fn scale(self, setup: &Setup, t: &Tuple, a: f64) -> f64 {
        match self {
            // Towards the apex of a cone its radius changes faster.
            Self::Tuple(k @ (2 | 5)) => {
                let slope = (t.D - t.d).abs() / t.L_a;
                let apex = (t.D - (t.D - t.d) * a / t.L_a) / slope;
                if k == 5 { a.min(apex) } else { t.L_a.min(apex * t.L_a / a) }
            }
            // The strain of the skin changes over a seventh of D from its clamp.
            Self::Tuple(3) if setup.model.distorting => a.min(t.D / 7.0),
            Self::Tuple(3) => a,
            Self::Tuple(6 | 7) => 1_f64.to_degrees(),
            Self::Tuple(i) => t.to_array()[i],
            Self::Modulus(i) => {
                let mut material = setup.model.material;
                let e0 = material.e0();
                material.moduli()[i].abs().max(0.1 * e0)
            }
            Self::Clamp | Self::Property(Property::Scale) => 1.0,
            Self::FoilLength => setup.gauge.foil.map_or(1.0, |foil| foil.length),
            Self::FoilWidth => setup.gauge.foil.map_or(1.0, |foil| foil.width),
            // A contact that gives way, or rolls, does so on a radius above 0.
            Self::Property(Property::PoleRadius) if setup.model.pole_radius > 0.0 => {
                a.min(4.0 * setup.model.pole_radius)
            }
            Self::Property(Property::Hub | Property::PoleRadius) => a,
            // Three times what bends a whisker by a radian: linear theory of a curved whisker has more rounding than that of a straight one.
            Self::Property(Property::Curvature) => 3.0 / a.max(0.01 * t.L_a),
            Self::Property(Property::CurvatureSlope) => 3.0 / a.max(0.01 * t.L_a).powi(2),
            Self::Property(p @ (Property::Bore | Property::Core)) => match p.get(setup) {
                0.0 => 0.1 * t.D,
                inner => inner.min((t.D - inner).abs()),
            },
            Self::Property(Property::Nu) => 0.5,
            Self::Property(p) => p.get(setup).abs(),
        }
    }

    /// `t` with this number of the tap moved by `step`.
    pub(super) fn tuple(self, t: Tuple, step: f64) -> Tuple {
        let mut t = t;
        let Tuple { D, d, L_a, x_ss, l, a, tilt, lean, drive, .. } = &mut t;
        if let Self::Tuple(k) = self {
            *[D, d, L_a, x_ss, l, a, tilt, lean, drive][k] += step;
        }
        t
    }

    /// `setup` with this input moved by `step`; `None` if it is a number of the tap.
    pub(super) fn moved(self, setup: &Setup, step: f64) -> Option<Setup> {
        if let Self::Tuple(_) = self {
            return None;
        }
        let mut setup = setup.clone();
        let foil = setup.gauge.foil.as_mut();
        match self {
            Self::Tuple(_) => {}
            Self::Modulus(i) => setup.model.material.moduli()[i] += step,
            Self::Clamp => {
                if let Clamp::At(c0) = &mut setup.model.clamp {
                    *c0 += step;
                }
            }
            Self::FoilLength => foil.into_iter().for_each(|foil| foil.length += step),
            Self::FoilWidth => foil.into_iter().for_each(|foil| foil.width += step),
            Self::Property(property) => {
                // Only these make a built whisker of a cone.
                let curved = matches!(property, Property::Curvature | Property::CurvatureSlope);
                let mut built = setup.built.as_deref().cloned().or(curved.then_some(Built::CONE));
                let scaled = property == Property::Scale;
                property.each(&mut setup, built.as_mut(), |x| *x += if scaled { *x * step } else { step });
                setup.built = built.map(Into::into);
            }
        }
        Some(setup)
    }
}
