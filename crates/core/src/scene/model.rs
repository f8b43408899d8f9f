//! Model switches. An effect that is off costs nothing: kernels are specialised on these.

/// Linear beam theory (closed forms) or the geometrically exact rod.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Geometry {
    /// Closed forms of the paper, corrected.
    Linear,
    /// Geometrically exact planar rod.
    #[default]
    Exact,
}

/// Side of the whisker that carries the gauge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Side {
    #[default]
    /// Towards the object: strain is positive (tension).
    Contact,
    /// Away from the object: strain is negative.
    Far,
}

/// What moves: the base (active whisker) or the object (passive whisker).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Drive {
    #[default]
    /// The base turns by θ, degrees.
    Angle,
    /// The object moves by δ across the whisker, mm.
    Displacement,
}

impl Drive {
    /// Column name in every table.
    pub fn column(self) -> &'static str {
        match self {
            Self::Angle => "theta_deg",
            Self::Displacement => "delta_mm",
        }
    }
}

/// Tangential behaviour of the contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Contact {
    #[default]
    /// No tangential force; the contact slides along the whisker.
    Frictionless,
    /// The contact point stays at its arc length.
    Stick,
    /// Coulomb friction with coefficient μ ≥ 0, monotone loading.
    Coulomb(f64),
}

/// Constitutive law of an incompressible rubber; moduli in MPa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Material {
    /// Linear in the section strain; Young's modulus E.
    Hooke(f64),
    /// Initial modulus E; C10 = E/6.
    NeoHookean(f64),
    /// C10, C01.
    MooneyRivlin([f64; 2]),
    /// C10, C20, C30.
    Yeoh([f64; 3]),
}

impl Default for Material {
    /// Smooth-Sil 960.
    fn default() -> Self {
        Self::Hooke(3.2)
    }
}

impl Material {
    /// Initial Young's modulus E₀, MPa: E, or 6 (C10 + C01).
    pub fn e0(&self) -> f64 {
        match self {
            Self::Hooke(e) | Self::NeoHookean(e) => *e,
            Self::MooneyRivlin([c10, c01]) => 6.0 * (c10 + c01),
            Self::Yeoh([c10, ..]) => 6.0 * c10,
        }
    }
}

/// Yeoh's law fitted to a measured stress–strain curve.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialFit {
    /// The curve file.
    pub file: String,
    /// Points of different strain.
    pub points: usize,
    /// C10, C20, C30, MPa: those of the material in force.
    pub coefficients: [f64; 3],
    /// Root mean square of law − data, MPa.
    pub rms: f64,
    /// Smallest and largest measured strain.
    pub range: [f64; 2],
}

impl MaterialFit {
    /// Whether the data cover a whisker whose fibres are strained by ±`strain`. A curve without compression is judged
    /// by its tension alone.
    pub fn covers(&self, strain: f64) -> bool {
        let [min, max] = self.range;
        strain <= max && (min >= 0.0 || -strain >= min)
    }
}

/// Which effects are computed.
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
    /// Poisson's ratio ν, 0…0.5; enters shear only.
    pub nu: f64,
    /// Friction.
    pub contact: Contact,
    /// Constitutive law.
    pub material: Material,
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
    };
}

impl Model {
    /// Why there is no model of taps at poles that tilt, or lean; `None` where there is one (model §6).
    pub fn forbids(&self, [tilt, lean]: [bool; 2]) -> Option<&'static str> {
        match self.contact {
            Contact::Coulomb(_) if tilt || lean => Some(
                "with contact = { coulomb = … } the object's edge must be upright: the contact slides along the whisker and along the edge, \
                 and friction depends on the path",
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
#[derive(Debug, Clone, Copy, PartialEq)]
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
}

impl Default for Gauge {
    /// On the contact side, up to 5 %, gauge factor 2.21, its noise not said.
    fn default() -> Self {
        Self { side: Side::Contact, noise_strain: None, strain_limit: 0.05, factor: 2.21, second: false }
    }
}

/// What turns a strain into a distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Theory {
    #[default]
    /// f, the paper.
    EulerBernoulli,
    /// f_T = f/(1 + S/a²), with shear.
    Timoshenko,
    /// The model of the spec, inverted; K stays that of f.
    Exact,
}

impl Theory {
    /// All, by the words of a spec.
    pub const WORDS: [(&'static str, Self); 3] =
        [("euler-bernoulli", Self::EulerBernoulli), ("timoshenko", Self::Timoshenko), ("exact", Self::Exact)];

    /// The word of a spec.
    pub fn word(self) -> &'static str {
        Self::WORDS[self as usize].0
    }

    /// The estimator of `locate` that turns strains into distances this way.
    pub fn estimator(self) -> &'static str {
        match self {
            Self::EulerBernoulli => "paper",
            Self::Timoshenko => "timoshenko",
            Self::Exact => "exact",
        }
    }

    /// What it is compared with: a formula with the model itself, the model with the paper's formula.
    pub fn compared(self) -> Self {
        if self == Self::Exact { Self::EulerBernoulli } else { Self::Exact }
    }
}

/// What f is per radian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Convention {
    #[default]
    /// Mean strain over the grid.
    Mean,
    /// Elongation of the grid, mm, as the paper prints it: f (x2 − x1).
    Elongation,
}

/// How distance is estimated from strain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Estimate {
    /// f, f_T, or the model itself.
    pub theory: Theory,
    /// Mean strain or elongation.
    pub convention: Convention,
    /// Distances of interest [a_min, a_max], mm, for `ambiguous`; else those of the design.
    pub range: Option<[f64; 2]>,
    /// Fixed K̄ instead of the in-sample mean.
    pub k: Option<f64>,
}
