//! What is searched for: `[optimise]`.

use super::model::Drive;
use super::property::Property;
use super::space::{COLUMNS, Column};

words! {
    /// What is made small.
    Objective {
        /// K_sd.
        Sd = "sd",
        /// total_rms_mm.
        Distance = "distance",
        /// w_sd·K_sd/K_mean + w_distance·total_rms_mm/L_a.
        Weighted = "weighted",
        /// The front of (K_sd, total_rms_mm).
        Pareto = "pareto",
    }
}

impl Objective {
    /// Whether K_sd enters.
    pub fn needs_sd(self) -> bool {
        self != Self::Distance
    }

    /// Whether the distance error, and with it the noise, enters.
    pub fn needs_distance(self) -> bool {
        self != Self::Sd
    }
}

/// What a search can vary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// D, d, L_a, x_ss, l or the drive.
    Column(Column),
    /// A property of the rig.
    Property(Property),
}

impl Quantity {
    /// Its name in a spec.
    pub fn name(self, drive: Drive) -> &'static str {
        match self {
            Self::Column(column) => column.name(drive).trim_end_matches("_mm").trim_end_matches("_deg"),
            Self::Property(property) => property.name(),
        }
    }

    /// Its unit, for people.
    pub fn unit(self, drive: Drive) -> &'static str {
        match self {
            Self::Column(column) if column.name(drive).ends_with("_deg") => "°",
            Self::Column(_) => " mm",
            Self::Property(property) => property.about().unit,
        }
    }
}

/// A quantity that is searched over.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Which.
    pub quantity: Quantity,
    /// Lower bound, in its unit.
    pub min: f64,
    /// Upper bound.
    pub max: f64,
    /// First start, where its own section has a number.
    pub start: Option<f64>,
}

/// What a search may spend; whichever ends first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Budget {
    /// Evaluations: a (design, drive) over all distances and robust samples each.
    pub evaluations: Option<u64>,
    /// Wall time, s.
    pub seconds: Option<f64>,
}

/// What a design must keep. Complete rows, no slip-off and a gauge on the whisker are asked for always.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest |gauge strain|.
    pub strain: f64,
    /// The key that says it.
    pub strain_key: &'static str,
    /// Largest contact force, N.
    pub force: Option<f64>,
    /// The peak of the theory's curve lies below the range of distances.
    pub unambiguous: bool,
    /// d ≤ D.
    pub tip_not_wider: bool,
}

words! {
    /// How the objective of many whiskers becomes one number.
    Measure {
        /// Their mean.
        Mean = "mean",
        /// The mean of their worst tenth.
        Cvar90 = "cvar90",
    }
}

words! {
    /// On which whisker K̄ and f are calibrated.
    Calibrated {
        /// On each.
        Each = "each",
        /// On the nominal one only.
        Nominal = "nominal",
    }
}

/// Tolerances of manufacture and bonding.
#[derive(Debug, Clone, PartialEq)]
pub struct Robust {
    /// Standard deviations of D, d, L_a, x_ss, l, a (0), tilt, lean and the drive, by [`Column`].
    pub sd: [f64; COLUMNS],
    /// Those of properties of the rig, where they are not 0.
    pub properties: Vec<(Property, f64)>,
    /// Whiskers sampled for each candidate; the same deviations for all.
    pub samples: u32,
    /// Mean or worst tenth.
    pub measure: Measure,
    /// K̄ of each whisker or of the nominal one.
    pub calibrated: Calibrated,
}

impl Robust {
    /// Whether poles are not upright, which no calibration knows.
    pub fn tilts(&self) -> bool {
        [Column::Tilt, Column::Lean].into_iter().any(|column| self.sd[column as usize] != 0.0)
    }
}

/// `[optimise]`.
#[derive(Debug, Clone)]
pub struct Search {
    /// What is made small.
    pub objective: Objective,
    /// w_sd, w_distance.
    pub weights: [f64; 2],
    /// Seed of swarms and samples.
    pub seed: u64,
    /// What may be spent.
    pub budget: Budget,
    /// What is searched over, in row order.
    pub variables: Vec<Variable>,
    /// What must be kept.
    pub limits: Limits,
    /// Tolerances, if any.
    pub robust: Option<Robust>,
}
