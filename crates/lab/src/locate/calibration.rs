//! What `calibrate` found, for `locate` to use; `files` writes and reads it as `calibration.toml`.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::estimator::SideRecord;
use crate::measure::{Lag, Rig, Tared};
use crate::scene::Setup;

pub const FORMAT: u32 = 1;

/// A calibration. Lengths in mm, drives in degrees or mm, signals in strain or in the unit of the reading.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    pub format: u32,
    pub version: String,
    /// SHA-256 of everything else: a value changed by hand shows.
    pub checksum: String,
    /// Estimator that won on held-out distances.
    pub estimator: String,
    /// Column of the signal that was measured.
    pub signal: String,
    /// Whether the drive was recorded; where it was not it counts as 1.
    pub drive_recorded: bool,
    /// The drive, as it is recorded, that counts as 0; drives below are counted from there.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub drive_origin: f64,
    pub noise: f64,
    pub noise_from: String,
    pub zero: Tared,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lag: Option<Lag>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second: Option<Second>,
    pub data: Source,
    /// The whisker and its model; in the file as a spec, which is read with the places of its values when all else is.
    #[serde(rename = "spec", serialize_with = "as_spec", deserialize_with = "not_read_yet")]
    pub rig: Rig,
    pub sides: Vec<SideRecord>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    pub file: String,
    pub hash: String,
    pub rows: usize,
    pub used: usize,
    pub zeros: usize,
}

/// What a second gauge, 90° round the whisker, shows beside the first. Its readings are positive as those of the first are on its side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Second {
    /// Reading per strain.
    pub factor: f64,
    /// How much further than 90° from the first it is, degrees.
    pub misalignment_deg: f64,
    pub noise: f64,
    /// What was fitted: misalignment, and factor where poles were tilted; else it is that of the first gauge.
    pub fitted: Vec<String>,
    /// Standard error of the factor; 0 where it was not fitted.
    pub sigma_factor: f64,
    /// Standard error of the misalignment, degrees.
    pub sigma_misalignment_deg: f64,
    /// Lean of the poles along the whisker, degrees.
    pub lean_deg: f64,
    pub rows: usize,
}

impl Second {
    /// Whether its values are those of a gauge.
    pub fn is_sound(&self) -> bool {
        let sizes = [self.noise, self.sigma_factor, self.sigma_misalignment_deg];
        self.factor.is_finite()
            && self.factor != 0.0
            && self.misalignment_deg.abs() < 90.0
            && self.lean_deg.abs() < 90.0
            && sizes.iter().all(|x| *x >= 0.0 && x.is_finite())
    }
}

fn as_spec<S: Serializer>(rig: &Rig, serializer: S) -> Result<S::Ok, S::Error> {
    rig.to_table().serialize(serializer)
}

/// Any whisker in place of one that is a table.
fn not_read_yet<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Rig, D::Error> {
    toml::Table::deserialize(deserializer)?;
    Ok(Rig::unknown(Setup::default(), 1.0).expect("1 mm is a distance"))
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}
