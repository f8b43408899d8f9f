//! The search of `[optimise]`.

use super::model::Drive;
use super::property::Property;
use super::space::{COLUMNS, Column};

words! {
    /// The quantity that is minimised.
    Objective {
        /// Spread K_sd.
        Sd = "sd",
        /// Distance error total_rms_mm.
        Distance = "distance",
        /// w_sd·K_sd/K_mean + w_distance·total_rms_mm/L_a.
        Weighted = "weighted",
        /// The front of (K_sd, total_rms_mm).
        Pareto = "pareto",
    }
}

impl Objective {
    /// True if K_sd enters.
    pub fn needs_sd(self) -> bool {
        self != Self::Distance
    }

    /// True if the distance error enters, and with it the noise.
    pub fn needs_distance(self) -> bool {
        self != Self::Sd
    }
}

/// A quantity that a search can vary.
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
            Self::Column(column) => column.key(drive),
            Self::Property(property) => property.name(),
        }
    }

    /// Its unit, as printed.
    pub fn unit(self, drive: Drive) -> &'static str {
        match self {
            Self::Column(column) if column.name(drive).ends_with("_deg") => "°",
            Self::Column(_) => " mm",
            Self::Property(property) => property.about().unit,
        }
    }
}

/// A variable of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// The quantity.
    pub quantity: Quantity,
    /// Lower bound, in its unit.
    pub min: f64,
    /// Upper bound.
    pub max: f64,
    /// First start, if the section of the quantity has a number.
    pub start: Option<f64>,
}

/// Limits of the cost of a search; the first one reached ends it.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Deserialize)]
pub struct Budget {
    /// Evaluations, each of a (design, drive) over all distances and robust samples.
    pub evaluations: Option<u64>,
    /// Wall time, s.
    pub seconds: Option<f64>,
}

/// Limits of a design, in addition to complete rows, no slip-off and a gauge on the whisker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest |gauge strain|.
    pub strain: f64,
    /// The key of the strain limit.
    pub strain_key: &'static str,
    /// Largest contact force, N.
    pub force: Option<f64>,
    /// The peak of the theory's curve must lie below the range of distances.
    pub unambiguous: bool,
    /// d ≤ D is required.
    pub tip_not_wider: bool,
}

words! {
    /// Reduction of the objective of many whiskers to one number.
    Measure {
        /// Their mean.
        Mean = "mean",
        /// The mean of their worst tenth.
        Cvar90 = "cvar90",
    }
}

words! {
    /// The whisker on which K̄ and f are calibrated.
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
    /// Those of properties of the rig that are not 0.
    pub properties: Vec<(Property, f64)>,
    /// Whiskers sampled for each candidate, with the same deviations for all.
    pub samples: u32,
    /// Mean or worst tenth.
    pub measure: Measure,
    /// K̄ of each whisker or of the nominal one.
    pub calibrated: Calibrated,
}

impl Robust {
    /// True if poles are not upright, which no calibration includes.
    pub fn tilts(&self) -> bool {
        [Column::Tilt, Column::Lean].into_iter().any(|column| self.sd[column as usize] != 0.0)
    }
}

/// `[optimise]`.
#[derive(Debug, Clone)]
pub struct Search {
    /// The quantity that is minimised.
    pub objective: Objective,
    /// w_sd, w_distance.
    pub weights: [f64; 2],
    /// Seed of swarms and samples.
    pub seed: u64,
    /// Limits of its cost.
    pub budget: Budget,
    /// The variables, in row order.
    pub variables: Vec<Variable>,
    /// Limits of its designs.
    pub limits: Limits,
    /// Tolerances, if any.
    pub robust: Option<Robust>,
}
