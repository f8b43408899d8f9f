//! A built whisker beyond its diameters and its length (model §7); everything is off by default.

/// Properties of a built whisker that a cone clamped at its base has not.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// D(s).
    pub profile: Profile,
    /// Core or bore.
    pub inner: Option<Inner>,
    /// Rest curvature κ₀(s) = κ_base + κ_slope s: 1/mm, 1/mm²; positive where the resting whisker bends away from the object.
    pub curvature: [f64; 2],
    /// Springs of the base.
    pub root: Root,
}

/// Diameter along the whisker.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// D(s) = d + (D − d)(1 − s/L_a)ⁿ; n = 1 is the cone.
    Power(f64),
    /// (s, D) in mm, s ascending from 0 to L_a; linear between.
    Table(Vec<[f64; 2]>),
}

/// A concentric bore or core.
#[derive(Debug, Clone, PartialEq)]
pub struct Inner {
    /// Modulus, MPa; 0 for a bore.
    pub modulus: f64,
    /// (s, diameter) in mm, s ascending; linear between, nothing outside.
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
    /// A base without springs.
    pub const RIGID: Self = Self { k_theta: f64::INFINITY, k_y: f64::INFINITY, k_x: f64::INFINITY };

    /// The wrench [M₀, F_x, F_y] on the base, moved by its springs, with its moment about where the base rests: M₀ + u F_y − v F_x.
    pub fn about_rest(&self, [moment, along, across]: [f64; 3]) -> [f64; 3] {
        let moved = [along / self.k_x, across / self.k_y];
        [moment + moved[0] * across - moved[1] * along, along, across]
    }
}

impl Built {
    /// The cone clamped at its base.
    pub const CONE: Self =
        Self { profile: Profile::Power(1.0), inner: None, curvature: [0.0; 2], root: Root::RIGID };

    /// True if the whisker is straight at rest.
    pub fn is_straight(&self) -> bool {
        self.curvature == [0.0; 2]
    }

    /// True with a core or a bore.
    pub fn is_hollow_or_cored(&self) -> bool {
        self.inner.as_ref().is_some_and(|inner| inner.diameter.iter().any(|knot| knot[1] > 0.0))
    }

    /// The reason why poles must not tilt or lean; `None` if they may.
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
