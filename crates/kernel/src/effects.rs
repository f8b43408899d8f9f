//! The effects that a kernel computes; kernels are specialised on them.

use vibrissa_core::physics::solid::is_solid;
use vibrissa_core::scene::{Contact, Material, Model, Side};

/// Effects of the exact rod.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Effects {
    /// Timoshenko shear.
    pub shear: bool,
    /// Stretch of the centreline.
    pub extension: bool,
    /// The force does not act on the centreline across it: surface contact, pole radius, friction, or a soft contact or clamp.
    pub offset: bool,
    /// The contact does not slip. Such taps are solved on the CPU, in f64.
    pub stick: bool,
    /// It rolls on a pole.
    pub rolls: bool,
    /// A hyperelastic section law, read from a chart.
    pub law: bool,
    /// The gauge is on the far side.
    pub far: bool,
}

impl Effects {
    /// Effects of `model` with a gauge on `side`, for a sliding or a sticking contact.
    pub fn new(model: &Model, side: Side, stick: bool) -> Self {
        let friction = matches!(model.contact, Contact::Coulomb(mu) if mu != 0.0);
        let effects = Self {
            shear: model.shear,
            extension: model.extension,
            offset: model.surface || model.pole_radius > 0.0 || stick || friction || is_solid(model),
            stick,
            rolls: stick && model.pole_radius > 0.0,
            law: !matches!(model.material, Material::Hooke(_)),
            far: false,
        };
        // The sides differ only by the strain of the centreline.
        Self { far: side == Side::Far && (effects.law || effects.extension), ..effects }
    }

    /// Frictionless, on the centreline, Hooke: everything off that changes the rod.
    pub fn plain(&self) -> bool {
        *self == Self::default()
    }
}
