//! Model switches. Kernels are specialised on them: an effect that is off costs nothing. [`TERMS`] describes those of a key of `[model]`; keys,
//! defaults, checks, files, explanations and censuses follow from it.

pub use super::material::Material;
use super::term::{Amount, Term, flag};

words! {
    /// Linear beam theory (closed forms) or the geometrically exact rod.
    #[derive(Default)]
    Geometry {
        /// Closed forms of the paper, corrected.
        Linear = "linear",
        /// Geometrically exact planar rod.
        #[default]
        Exact = "exact",
    }
}

words! {
    /// Side of the whisker that carries the gauge.
    #[derive(Default)]
    Side {
        #[default]
        /// Towards the object: strain is positive (tension).
        Contact = "contact",
        /// Away from the object: strain is negative.
        Far = "far",
    }
}

words! {
    /// The moving part: the base (active whisker) or the object (passive whisker).
    #[derive(Default)]
    Drive {
        #[default]
        /// The base turns by θ, degrees.
        Angle = "angle",
        /// The object moves by δ across the whisker, mm.
        Displacement = "displacement",
    }
}

impl Drive {
    /// Column name in every table.
    pub fn column(self) -> &'static str {
        if self == Self::Angle { "theta_deg" } else { "delta_mm" }
    }
}

/// Tangential behaviour of the contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Contact {
    #[default]
    /// No tangential force; the contact slides along the whisker.
    Frictionless,
    /// The contact does not slip: it stays at its arc length on an edge, and rolls on a pole.
    Stick,
    /// Coulomb friction with coefficient μ ≥ 0, monotone loading.
    Coulomb(f64),
}

/// The limit of the contact force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// T = μP, sign included; 0 is frictionless.
    Slide(f64),
    /// The contact does not slip: it stays at its arc length on an edge, and rolls on a pole.
    Stick,
}

/// Clamp of the base (model §8).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Clamp {
    /// At its face, as in rod theory.
    #[default]
    Rigid,
    /// Its face is bonded to a rigid body.
    Bonded,
    /// Glued into a socket.
    Glued,
    /// In a smooth socket, not glued.
    Socket,
    /// This many base diameters outside of its face, or behind it if negative.
    At(f64),
}

impl Clamp {
    /// The named clamps.
    pub const WORDS: [(&'static str, Self); 4] =
        [("rigid", Self::Rigid), ("bonded", Self::Bonded), ("glued", Self::Glued), ("socket", Self::Socket)];

    /// Its name, or its number.
    pub fn amount(self) -> Amount {
        match (self, Self::WORDS.iter().find(|(_, clamp)| *clamp == self)) {
            (Self::At(c0), _) => Amount::Number(c0),
            (_, word) => Amount::Word(word.map_or("rigid", |(word, _)| word)),
        }
    }
}

/// Effects of the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// Linear theory or exact rod.
    pub geometry: Geometry,
    /// Timoshenko shear deformation.
    pub shear: bool,
    /// Stretch of the centreline.
    pub extension: bool,
    /// Contact on the whisker's surface instead of its centreline.
    pub surface: bool,
    /// Radius ρ ≥ 0 of the object, mm.
    pub pole_radius: f64,
    /// Poisson's ratio ν, 0…0.5; enters shear, clamps and indentation.
    pub nu: f64,
    /// Friction of the contact.
    pub contact: Contact,
    /// Constitutive law.
    pub material: Material,
    /// Clamp of the base.
    pub clamp: Clamp,
    /// The skin gives way under the contact (Hertz); needs a pole radius.
    pub indentation: bool,
    /// Sections distort, which changes the strain of the skin, most of all next to the clamp.
    pub distorting: bool,
}

impl Model {
    /// The exact frictionless Hooke rod with every effect off.
    pub const PLAIN: Self = Self {
        geometry: Geometry::Exact,
        shear: false,
        extension: false,
        surface: false,
        pole_radius: 0.0,
        nu: 0.5,
        contact: Contact::Frictionless,
        material: Material::Hooke(3.2),
        clamp: Clamp::Rigid,
        indentation: false,
        distorting: false,
    };
}

/// The effects that a key of `[model]` switches, in the order of the keys.
pub const TERMS: [Term; 7] = [
    Term {
        linear: true,
        ..flag(["shear", "shear"], |m| Amount::Flag(m.shear), |m, to| m.shear = to.is_on())
    },
    flag(["extension", "extension"], |m| Amount::Flag(m.extension), |m, to| m.extension = to.is_on()),
    flag(["surface", "surface"], |m| Amount::Flag(m.surface), |m, to| m.surface = to.is_on()),
    Term {
        trial: Amount::Number(2.0),
        ..flag(
            ["pole_radius", "pole radius"],
            |m| Amount::Number(m.pole_radius),
            |m, to| m.pole_radius = if let Amount::Number(radius) = to { radius } else { 0.0 },
        )
    },
    Term {
        trial: Amount::Word("bonded"),
        ..flag(
            ["clamp", "clamp"],
            |m| m.clamp.amount(),
            |m, to| {
                let named = |word| Clamp::WORDS.iter().find(|(name, _)| *name == word);
                m.clamp = match to {
                    Amount::Number(c0) => Clamp::At(c0),
                    Amount::Word(word) => named(word).map_or(Clamp::Rigid, |(_, clamp)| *clamp),
                    Amount::Flag(_) => Clamp::Rigid,
                };
            },
        )
    },
    Term {
        frictionless: Some("how a skin that gives way rubs is not known"),
        upright: Some("a skin that gives way has been computed for an upright edge and one gauge only"),
        needs: Some(("pole_radius", "an edge (pole_radius = 0) sinks into the skin without bound")),
        ..flag(
            ["indentation", "indentation"],
            |m| Amount::Flag(m.indentation),
            |m, to| m.indentation = to.is_on(),
        )
    },
    Term {
        trial: Amount::Word("distorting"),
        frictionless: Some("strains next to a clamp have been computed without friction only"),
        upright: Some("sections that distort have been computed for an upright edge and one gauge only"),
        ..flag(
            ["section", "distorting sections"],
            |m| Amount::Word(if m.distorting { "distorting" } else { "rigid" }),
            |m, to| m.distorting = to.is_on(),
        )
    },
];

impl Model {
    /// The model with the effect of `key` at its trial value, and with the effect that it needs.
    pub fn with(mut self, key: &str) -> Self {
        for term in TERMS.iter().filter(|term| term.key == key) {
            if let Some((other, _)) = term.needs {
                self = self.with(other);
            }
            (term.set)(&mut self, term.trial);
        }
        self
    }

    /// The reason why poles must not tilt or lean (model §6); `None` if they may.
    pub fn forbids(&self, [tilt, lean]: [bool; 2]) -> Option<&'static str> {
        if tilt || lean {
            let on = |term: &&Term| (term.get)(self).is_on();
            if let Some(why) = TERMS.iter().filter(on).find_map(|term| term.upright) {
                return Some(why);
            }
        }
        match self.contact {
            Contact::Coulomb(_) if tilt || lean => Some(
                "with contact = { coulomb = … } the object's edge must be upright: the contact slides along the whisker and along the edge, \
                 and friction depends on the path",
            ),
            Contact::Stick if self.pole_radius > 0.0 && (tilt || lean) => Some(
                "with contact = \"stick\" and a pole_radius the pole must be upright: the whisker would roll along it too",
            ),
            Contact::Stick if self.surface && tilt => Some(
                "with contact = \"stick\" and surface = true the object's edge must not tilt: the point that sticks lies off the plane of \
                 rotation, and twists the whisker",
            ),
            _ => None,
        }
    }
}

impl Default for Model {
    fn default() -> Self {
        Self::PLAIN
    }
}

/// The strain gauge, apart from its place.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
pub struct Gauge {
    /// Side of the whisker.
    pub side: Side,
    /// One-sigma strain noise σ_ε ≥ 0; `None` when not written (then 0).
    pub noise_strain: Option<f64>,
    /// Largest |strain| the gauge bears.
    pub strain_limit: f64,
    /// Gauge factor.
    pub factor: f64,
    /// A second, equal gauge 90° round the whisker.
    pub second: bool,
    /// A stiff foil that carries the grid.
    #[serde(skip)]
    pub foil: Option<Foil>,
}

/// A foil that is stiffer than the skin it is bonded to (model §8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foil {
    /// Modulus times thickness, N/mm.
    pub stiffness: f64,
    /// Length of the base along the whisker, mm, centred on the grid.
    pub length: f64,
    /// Width of the base, mm.
    pub width: f64,
    /// Largest |strain| of its reading that it bears.
    pub strain_limit: Option<f64>,
}

impl Default for Gauge {
    fn default() -> Self {
        let side = Side::Contact;
        Self { side, noise_strain: None, strain_limit: 0.05, factor: 2.21, second: false, foil: None }
    }
}

words! {
    /// The theory that turns a strain into a distance.
    #[derive(Default)]
    Theory {
        #[default]
        /// f, the paper.
        EulerBernoulli = "euler-bernoulli",
        /// f_T = f/(1 + S/a²), with shear.
        Timoshenko = "timoshenko",
        /// The model of the spec, inverted; K stays that of f.
        Exact = "exact",
    }
}

impl Theory {
    /// The estimator of `locate` with this theory.
    pub fn estimator(self) -> &'static str {
        match self {
            Self::EulerBernoulli => "paper",
            Self::Timoshenko => "timoshenko",
            Self::Exact => "exact",
        }
    }

    /// The theory to compare with: the model for a formula, the paper's formula for the model.
    pub fn compared(self) -> Self {
        if self == Self::Exact { Self::EulerBernoulli } else { Self::Exact }
    }
}

words! {
    /// The quantity that f gives per radian.
    #[derive(Default)]
    Convention {
        #[default]
        /// Mean strain over the grid.
        Mean = "mean",
        /// Elongation of the grid, mm, as the paper prints it: f (x2 − x1).
        Elongation = "elongation",
    }
}

/// Estimate of the distance from strain.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Deserialize)]
pub struct Estimate {
    /// f, f_T, or the model itself.
    pub theory: Theory,
    /// Mean strain or elongation.
    pub convention: Convention,
    /// Distances of interest [a_min, a_max], mm, for `ambiguous`; else those of the design.
    pub range: Option<[f64; 2]>,
    /// Fixed K̄ instead of the in-sample mean.
    #[serde(rename = "K")]
    pub k: Option<f64>,
}
