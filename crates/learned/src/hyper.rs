//! Learned numbers of the rig: standard deviations and length scales, each with a log-normal prior in units of the signal.
//! No prior was fitted to data. A spread of 1.5 in ln allows a factor of 20 either way within two standard deviations.

/// Prior of the logarithm of a learned number: normal, with different spreads below and above its median.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Median, in ln.
    pub median: f64,
    pub below: f64,
    pub above: f64,
}

impl Prior {
    pub fn new([median, spread]: [f64; 2]) -> Self {
        Self { median, below: spread, above: spread }
    }

    fn spread(&self, x: f64) -> f64 {
        if x < self.median { self.below } else { self.above }
    }

    /// −2 ln(density at `x` / density at the median).
    pub fn twice(&self, x: f64) -> f64 {
        ((x - self.median) / self.spread(x)).powi(2)
    }

    /// Half of the derivative of [`Self::twice`].
    pub fn slope(&self, x: f64) -> f64 {
        (x - self.median) / self.spread(x).powi(2)
    }

    pub fn width(&self) -> f64 {
        0.5 * (self.below + self.above)
    }
}

/// A learned number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Hyper {
    /// Noise of every reading, independent of the signal.
    Floor,
    /// Noise in proportion to the signal.
    Relative,
    /// Size of a quadratic in ln a.
    Bend,
    /// Size of the terms of the quadratic that contain ln u.
    Twist,
    /// Size of the smooth deviation beyond the quadratic.
    Deviation,
    /// Length of the deviation in ln a, in ranges of the data.
    LengthA,
    /// Length of the deviation in ln u, in ranges of the data.
    LengthU,
    /// Error of a position: of its label, or of the setup of the object.
    Position,
    /// Error of a position in one run only.
    Visit,
    RunZero,
    RunGain,
    /// Zero of the signal where no row is without contact.
    Zero,
    /// Drift of the zero from the first row to the last.
    Drift,
}

impl Hyper {
    /// Median (ln) and spread of the prior; `known` is true for the curve of a known whisker.
    pub fn prior(self, known: bool) -> [f64; 2] {
        let (median, spread) = match self {
            // A strain gauge on a rig: a few 1e-3 of a tap; 1e-5 with an averaging bridge, a few 1e-2 with a magnetometer.
            Self::Floor => (2e-3, 2.0),
            Self::Relative => (3e-3, 2.0),
            // A spec is right to a few per cent; a power law is wrong by as much as the true curve bends over the range.
            Self::Bend | Self::Twist | Self::Deviation if known => (0.02, 1.5),
            Self::Bend => (0.1, 1.5),
            // The signal follows the drive more closely than the distance.
            Self::Twist => (0.03, 1.5),
            Self::Deviation => (0.07, 1.5),
            // A whisker's curve has no feature shorter than the range of the data unless the data show one.
            Self::LengthA | Self::LengthU => (2.5, 0.7),
            // A stage repeats 30 mm to 0.05 mm; a hand, or a wrong label, to a few mm.
            Self::Position => (1.5e-3, 2.0),
            Self::Visit | Self::RunGain | Self::RunZero => (3e-3, 1.5),
            Self::Zero => (3e-2, 3.0),
            Self::Drift => (3e-3, 1.5),
        };
        [f64::ln(median), spread]
    }
}
