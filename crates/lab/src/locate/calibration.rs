//! The result of `calibrate`, for `locate` to use; `files` writes and reads it as `calibration.toml`. And one side of it, opened.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::estimator::{Answers, Estimator, Opener, SAME, SideRecord, between, learned::LearnedCurve};
use crate::measure::{Lag, Rig, Tared};
use crate::scene::{Setup, Side};
use crate::{error::Error, estimate::WIDENING, status::Status};

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
    /// True if the drive was recorded; where it was not it counts as 1.
    pub drive_recorded: bool,
    /// The drive, as it is recorded, that counts as 0; drives below are counted from there.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub drive_origin: f64,
    pub noise: f64,
    pub noise_from: String,
    pub zero: Tared,
    pub lag: Option<Lag>,
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
    /// Its angle from the first gauge, less 90°, degrees.
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
    /// True if its values are those of a gauge.
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

/// A distance beyond the calibrated ones by so many of its standard deviations is said to be.
pub(crate) const BEYOND: f64 = 3.0;

pub(crate) struct Opened {
    pub(crate) sign: f64,
    /// Side of the whisker on which a gauge would read this sign.
    pub(crate) gauge: Side,
    pub(crate) distances: [f64; 2],
    /// Distances within which a second one is ambiguous.
    pub(crate) interest: [f64; 2],
    /// Calibrated drives, and beyond the means of the first and the last how far jitter led.
    pub(crate) drives: Vec<f64>,
    /// The one calibrated drive, where there are no others.
    pub(super) only: Option<f64>,
    pub(crate) answers: Box<dyn Answers>,
    /// Per drive, mm.
    pub(crate) bias: Vec<f64>,
    /// Reading per strain, where it is known.
    pub(crate) factor: f64,
    /// |signal| at which the sensor stands still.
    pub(crate) end_stop: f64,
}

impl Opened {
    /// Least and largest calibrated drive.
    pub(crate) fn ends(&self) -> [f64; 2] {
        [self.drives[0], self.drives[self.drives.len() - 1]]
    }

    pub(crate) fn admits(&self, drive: f64) -> bool {
        let [least, largest] = self.ends();
        drive >= least * (1.0 - SAME) && drive <= largest * (1.0 + SAME)
    }

    /// Bias of distances on held-out ones by this drive, mm.
    pub(crate) fn bias_at(&self, drive: f64) -> f64 {
        between(&self.drives, &self.bias, drive)
    }

    pub(crate) fn learned(&self) -> Option<&LearnedCurve> {
        self.answers.learned()
    }

    /// Words of warning of a distance, mm, with `near` the next one of the same reading.
    pub(crate) fn doubts(&self, a: f64, near: Option<f64>, sigma: f64) -> Status {
        let mut status = Status::OK;
        let [lo, hi] = self.interest;
        if near.is_some_and(|a| a >= lo * (1.0 - WIDENING) && a <= hi * (1.0 + WIDENING)) {
            status |= Status::AMBIGUOUS;
        }
        // A distance half the range away is outside, however uncertain.
        let [first, last] = self.distances;
        let slack = (BEYOND * sigma).min(0.5 * (last - first)) + WIDENING * last;
        if a < first - slack || a > last + slack {
            status |= Status::OUTSIDE_CALIBRATION;
        }
        status
    }

    /// A side of the gauge of `rig`, answered by `estimator`; `None` where the `record` does not hold it.
    pub(super) fn new(
        estimator: Estimator,
        rig: &Rig,
        (record, side): (&SideRecord, Side),
        open: Opener<'_>,
    ) -> Result<Option<Self>, Error> {
        let answers = estimator.open((rig, open), record, side)?;
        let (Some(answers), Some(bias)) = (answers, estimator.bias_mm(record)) else {
            return Ok(None);
        };
        let (mut drives, mut bias) = (record.drives.clone(), bias.to_vec());
        let [first, last] = record.ends();
        if first < drives[0] {
            drives.insert(0, first);
            bias.insert(0, bias[0]);
        }
        if last > drives[drives.len() - 1] {
            drives.push(last);
            bias.push(bias[bias.len() - 1]);
        }
        let calibrated = side == record.gauge();
        let sign = f64::from(record.sign);
        Ok(Some(Self {
            sign: if calibrated { sign } else { -sign },
            gauge: side,
            distances: record.distances_mm,
            interest: rig.setup.estimate.range.unwrap_or(record.distances_mm),
            drives,
            only: Some(record.drives[0]).filter(|_| record.drives.len() == 1),
            answers,
            bias,
            factor: record.exact.as_ref().and_then(|r| r.factor(rig.setup.drive)).unwrap_or(f64::NAN),
            end_stop: record.end_stop.filter(|_| calibrated).unwrap_or(f64::INFINITY),
        }))
    }
}
