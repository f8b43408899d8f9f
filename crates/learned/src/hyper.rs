//! What is learned of the rig beside its curve: standard deviations and rates, each with a log-normal prior.
//!
//! All are in units of the signal: of that of the tap where the effect goes with it, of half of all taps where it does not. A prior's
//! spread of 1.5 in ln means: a factor of 20 either way is within two standard deviations. No prior was fitted to data; each says what an
//! engineer expects of a rig before seeing it.

/// Prior of the logarithm of a learned number: normal, of another spread above its median than below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Median.
    pub median: f64,
    /// Standard deviation below it.
    pub below: f64,
    /// And above.
    pub above: f64,
}

impl Prior {
    /// Normal.
    pub fn new([median, spread]: [f64; 2]) -> Self {
        Self { median, below: spread, above: spread }
    }

    /// Standard deviation on the side of `x`.
    fn spread(&self, x: f64) -> f64 {
        if x < self.median { self.below } else { self.above }
    }

    /// −2 ln of its density at `x`, less that at the median.
    pub fn twice(&self, x: f64) -> f64 {
        ((x - self.median) / self.spread(x)).powi(2)
    }

    /// Half of the slope of that.
    pub fn slope(&self, x: f64) -> f64 {
        (x - self.median) / self.spread(x).powi(2)
    }

    /// Mean standard deviation.
    pub fn width(&self) -> f64 {
        0.5 * (self.below + self.above)
    }
}

/// A learned number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Hyper {
    /// Noise that all readings have.
    Floor,
    /// Noise that goes with the signal.
    Relative,
    /// Sizes of a quadratic in ln a.
    Bend,
    /// Sizes of what in a quadratic goes with ln u.
    Twist,
    /// Size of what the curve deviates beyond that.
    Deviation,
    /// Length of it in ln a, in ranges of the data.
    LengthA,
    /// The same in ln u.
    LengthU,
    /// Effect of a position: its label, how the object was set up.
    Position,
    /// Effect of a position in one run only.
    Visit,
    /// Zero of a run.
    RunZero,
    /// Gain of a run.
    RunGain,
    /// A zero that nobody read.
    Zero,
    /// Drift of the zero from the first row to the last.
    Drift,
}

impl Hyper {
    /// Median and spread in ln of the prior, of a base that is `known` or not.
    pub fn prior(self, known: bool) -> [f64; 2] {
        let (median, spread) = match self {
            // A strain gauge on a rig: a few 1e-3 of a tap; 1e-5 with an averaging bridge, a few 1e-2 with a magnetometer.
            Self::Floor => (2e-3, 2.0),
            Self::Relative => (3e-3, 2.0),
            // A spec is right to some per cent; a power law is wrong by as much as it bends over the range.
            Self::Bend | Self::Twist | Self::Deviation if known => (0.02, 1.5),
            Self::Bend => (0.1, 1.5),
            // A signal goes with the drive more nearly than with the distance.
            Self::Twist => (0.03, 1.5),
            // What no quadratic takes up is less.
            Self::Deviation => (0.07, 1.5),
            // A whisker's curve has no feature shorter than the range of the data, unless these say so.
            Self::LengthA | Self::LengthU => (2.5, 0.7),
            // A stage finds 30 mm again to 0.05 mm; a hand, and a wrong label, to some mm.
            Self::Position => (1.5e-3, 2.0),
            Self::Visit | Self::RunGain | Self::RunZero => (3e-3, 1.5),
            Self::Zero => (3e-2, 3.0),
            Self::Drift => (3e-3, 1.5),
        };
        [f64::ln(median), spread]
    }
}
