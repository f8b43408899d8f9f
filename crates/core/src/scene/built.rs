//! A whisker as it is built, beyond its diameters and its length (model §7). Everything here is off by default.

/// What a built whisker has that a cone clamped at its base has not.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// D(s).
    pub profile: Profile,
    /// What is inside.
    pub inner: Option<Inner>,
    /// Rest curvature κ₀(s) = κ_base + κ_slope s: 1/mm, 1/mm²; positive where the resting whisker bends away from the object.
    pub curvature: [f64; 2],
    /// What holds the base.
    pub root: Root,
}

/// Diameter along the whisker.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// D(s) = d + (D − d)(1 − s/L_a)ⁿ; n = 1 is the cone.
    Power(f64),
    /// (s, D) in mm, s rising from 0 to L_a; linear between.
    Table(Vec<[f64; 2]>),
}

/// A concentric bore or core.
#[derive(Debug, Clone, PartialEq)]
pub struct Inner {
    /// Modulus, MPa; 0 of a bore.
    pub modulus: f64,
    /// (s, diameter) in mm, s rising; linear between, nothing outside.
    pub diameter: Vec<[f64; 2]>,
}

/// Springs between the motor and the base section, unloaded at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// N·mm/rad.
    pub k_theta: f64,
    /// Across the whisker, N/mm.
    pub k_y: f64,
    /// Along the whisker, N/mm.
    pub k_x: f64,
}

impl Root {
    /// No springs: the base does not give way.
    pub const RIGID: Self = Self { k_theta: f64::INFINITY, k_y: f64::INFINITY, k_x: f64::INFINITY };
}

impl Built {
    /// The cone clamped at its base.
    pub const CONE: Self =
        Self { profile: Profile::Power(1.0), inner: None, curvature: [0.0; 2], root: Root::RIGID };

    /// Whether the whisker is straight at rest.
    pub fn is_straight(&self) -> bool {
        self.curvature == [0.0; 2]
    }

    /// Why there are no taps at poles that tilt, or lean; `None` where there are.
    pub fn upright(&self, surface: bool) -> Option<&'static str> {
        match () {
            () if !self.is_straight() => Some("a curved whisker leaves the plane and twists at such edges"),
            () if self.root != Root::RIGID => {
                Some("a root that gives way has been computed for upright edges only")
            }
            () if surface && self.profile != Profile::Power(1.0) => {
                Some("contact on the surface of a profile has been computed for upright edges only")
            }
            () => None,
        }
    }
}
