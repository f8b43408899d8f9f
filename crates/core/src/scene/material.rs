//! The material of a whisker.

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
        match *self {
            Self::Hooke(e) | Self::NeoHookean(e) => e,
            Self::MooneyRivlin([c10, c01]) => (c10 + c01) * 6.0,
            Self::Yeoh([c10, ..]) => c10 * 6.0,
        }
    }

    /// Its moduli, in order.
    pub fn moduli(&mut self) -> &mut [f64] {
        match self {
            Self::Hooke(e) | Self::NeoHookean(e) => std::slice::from_mut(e),
            Self::MooneyRivlin(c) => c,
            Self::Yeoh(c) => c,
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
    /// True if the data cover fibre strains of ±`strain`. A curve without compression is judged by its tension alone.
    pub fn covers(&self, strain: f64) -> bool {
        let [min, max] = self.range;
        strain <= max && (min >= 0.0 || -strain >= min)
    }
}
