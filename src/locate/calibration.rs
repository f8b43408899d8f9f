//! `calibration.toml`: what `calibrate` found, for people to read and for `locate` to use.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::table::{Curve, Knot};
use super::{Estimator, Parameter};
use crate::error::InputError;
use crate::measure::Unit;
use crate::sink::folder::hash;

/// Version of the file.
pub const FORMAT: u32 = 1;

/// A calibration. Lengths in mm, drives in degrees or mm, signals in strain or in the unit of the reading.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Version of the file.
    pub format: u32,
    /// Program that wrote it.
    pub version: String,
    /// SHA-256 of everything else: a value changed by hand shows.
    pub checksum: String,
    /// Estimator that won on held-out distances.
    pub estimator: String,
    /// Column of the signal that was measured.
    pub signal: String,
    /// Whether the drive was recorded; where it was not it counts as 1.
    pub drive_recorded: bool,
    /// Standard deviation of one reading.
    pub noise: f64,
    /// Where that comes from.
    pub noise_from: String,
    /// What was measured.
    pub data: Source,
    /// The whisker and its model, as a spec.
    pub spec: toml::Table,
    /// One for each side that was calibrated.
    pub sides: Vec<SideRecord>,
}

/// Origin of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// File.
    pub file: String,
    /// SHA-256 of the file.
    pub hash: String,
    /// Rows with a drive.
    pub rows: usize,
    /// Of these, used.
    pub used: usize,
    /// Zero readings.
    pub zeros: usize,
}

/// Calibration of one side of the whisker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SideRecord {
    /// Sign of its readings: 1 or −1.
    pub sign: i8,
    /// Side of the gauge that this sign means: contact or far.
    pub gauge_side: String,
    /// Smallest and largest calibrated distance.
    pub distances_mm: [f64; 2],
    /// Calibrated drives, ascending.
    pub drives: Vec<f64>,
    /// |signal| at which the sensor stands still, where the data show one.
    pub end_stop: Option<f64>,
    /// f and K̄ per drive.
    pub paper: Option<FactorRecord>,
    /// f_T and K̄ per drive.
    pub timoshenko: Option<FactorRecord>,
    /// The model.
    pub exact: Option<ExactRecord>,
    /// The data.
    pub table: Option<TableRecord>,
}

/// One K per drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct FactorRecord {
    /// Root mean square error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// K̄ per drive.
    pub K: Vec<f64>,
    /// Variance of ln K̄.
    pub K_variance: Vec<f64>,
    /// Error on distances left out beyond what noise explains, per drive.
    pub bias_mm: Vec<f64>,
}

/// Fitted model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExactRecord {
    /// As in [`FactorRecord`].
    pub held_out_rms_mm: Option<f64>,
    /// As in [`FactorRecord`].
    pub bias_mm: Vec<f64>,
    /// Names of the fitted parameters, in the order of the covariance.
    pub fitted: Vec<String>,
    /// Every parameter that the model has.
    pub values: toml::Table,
    /// Covariance of the fitted ones.
    pub covariance: Vec<Vec<f64>>,
}

/// Curves of the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableRecord {
    /// As in [`FactorRecord`].
    pub held_out_rms_mm: Option<f64>,
    /// As in [`FactorRecord`].
    pub bias_mm: Vec<f64>,
    /// One per drive.
    pub curves: Vec<CurveRecord>,
}

/// Knots of one drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurveRecord {
    /// The drive.
    pub drive: f64,
    /// Distances.
    pub a_mm: Vec<f64>,
    /// Signal per unit of drive.
    pub signal: Vec<f64>,
    /// Variance of ln signal.
    pub variance: Vec<f64>,
}

impl CurveRecord {
    /// Of a curve.
    pub fn new(drive: f64, curve: &Curve) -> Self {
        let column = |f: fn(&Knot) -> f64| curve.knots().iter().map(f).collect();
        Self { drive, a_mm: column(|k| k.a), signal: column(|k| k.signal), variance: column(|k| k.variance) }
    }

    /// The knots.
    pub fn knots(&self) -> Vec<Knot> {
        let rest = self.signal.iter().zip(&self.variance);
        self.a_mm.iter().zip(rest).map(|(a, (s, v))| Knot { a: *a, signal: *s, variance: *v }).collect()
    }
}

impl Calibration {
    /// The file's text, with its checksum.
    pub fn to_text(&self) -> String {
        let body = |checksum: String| {
            toml::to_string(&Self { checksum, ..self.clone() }).expect("plain numbers and words are TOML")
        };
        let sum = hash(&body(String::new()));
        format!(
            "# Calibration of a whisker, written by vibrissa. Lengths in mm, angles in degrees.\n\
             # `vibrissa locate` refuses it where a value was changed by hand; run `vibrissa calibrate` again instead.\n{}",
            body(sum)
        )
    }

    /// Reads the file at `path`; `trust` takes one that was edited by hand.
    ///
    /// # Errors
    /// A file that is missing, of another format, edited, or contradictory.
    pub fn read(path: &Path, trust: bool) -> Result<Self, InputError> {
        let label = path.display().to_string();
        if path.is_dir() {
            let error = InputError::new("this is a folder; the calibration file in it is needed");
            return Err(error.at(&label, None).allowed(path.join("calibration.toml").display().to_string()));
        }
        let text = std::fs::read_to_string(path).map_err(|e| {
            let what = match e.kind() {
                std::io::ErrorKind::NotFound => "there is no such calibration file".to_owned(),
                _ => format!("this calibration file cannot be read: {e}"),
            };
            InputError::new(what).at(&label, None)
        })?;
        Self::parse(&label, &text, trust)
    }

    /// As [`Self::read`], from `text`.
    pub fn parse(label: &str, text: &str, trust: bool) -> Result<Self, InputError> {
        let again = "a calibration.toml as `vibrissa calibrate` wrote it";
        let line =
            |at: usize| 1 + text.as_bytes()[..at.min(text.len())].iter().filter(|b| **b == b'\n').count();
        let broken = |e: &toml::de::Error| {
            let what = e.message().lines().next().unwrap_or_default().to_owned();
            let error = InputError::new(format!("this is no calibration: {what}"));
            error.at(label, e.span().map(|s| line(s.start))).allowed(again)
        };
        let table: toml::Table = toml::from_str(text).map_err(|e| broken(&e))?;
        match table.get("format").map(|f| f.as_integer()) {
            None => {
                let error = InputError::new("this is no calibration: it has no format");
                return Err(error.at(label, None).key("format").allowed(again));
            }
            Some(Some(f)) if f == i64::from(FORMAT) => {}
            Some(other) => {
                let value = other.map_or_else(|| table["format"].to_string(), |f| f.to_string());
                let message = "this calibration was written by another version of the program, in a format it does not know; \
                               run `vibrissa calibrate` again";
                return Err(InputError::new(message)
                    .at(label, None)
                    .key("format")
                    .value(value)
                    .allowed(format!("format = {FORMAT}")));
            }
        }
        let read: Self = toml::from_str(text).map_err(|e| broken(&e))?;
        let sum = {
            let plain = Self { checksum: String::new(), ..read.clone() };
            hash(&toml::to_string(&plain).unwrap_or_default())
        };
        if sum != read.checksum && !trust {
            let message = "this calibration was edited by hand: its checksum does not fit its values";
            return Err(InputError::new(message)
                .at(label, None)
                .key("checksum")
                .value(&read.checksum)
                .allowed("the file as `vibrissa calibrate` wrote it; or --force to use it as it is"));
        }
        read.check(label)?;
        Ok(read)
    }

    /// Refuses values that contradict each other.
    fn check(&self, label: &str) -> Result<(), InputError> {
        let fault = |key: String, message: &str, allowed: &str| {
            Err(InputError::new(message).at(label, None).key(key).allowed(allowed))
        };
        if !Estimator::ALL.iter().any(|e| e.name() == self.estimator) {
            return fault("estimator".into(), "unknown estimator", "paper, timoshenko, exact, table");
        }
        if Unit::of_column(&self.signal).is_none() {
            return fault("signal".into(), "unknown signal", "strain, microstrain, bridge_mV_per_V, reading");
        }
        if !(self.noise >= 0.0 && self.noise.is_finite()) {
            return fault("noise".into(), "this is no standard deviation", "≥ 0");
        }
        let positive = |v: &[f64]| v.iter().all(|x| *x > 0.0 && x.is_finite());
        let known = |v: &[f64]| v.iter().all(|x| *x >= 0.0 && x.is_finite());
        let ascending = |v: &[f64]| v.windows(2).all(|w| w[0] < w[1]);
        if self.sides.is_empty() || self.sides.len() > 2 {
            return fault("sides".into(), "one or two sides are needed", "1 … 2");
        }
        for (i, side) in self.sides.iter().enumerate() {
            let key = |k: &str| format!("sides[{i}].{k}");
            let n = side.drives.len();
            let [lo, hi] = side.distances_mm;
            if n == 0 || !positive(&side.drives) || !ascending(&side.drives) {
                return fault(key("drives"), "these are no drives", "ascending, > 0");
            }
            if !positive(&[lo, hi]) || lo >= hi {
                return fault(
                    key("distances_mm"),
                    "this is no range of distances",
                    "0 < smallest < largest, mm",
                );
            }
            if side.sign.abs() != 1 || !["contact", "far"].contains(&side.gauge_side.as_str()) {
                return fault(key("sign"), "this is no side", "1 or -1, with contact or far");
            }
            for (name, record) in [("paper", &side.paper), ("timoshenko", &side.timoshenko)] {
                let Some(r) = record else { continue };
                if r.K.len() != n || r.K_variance.len() != n || !positive(&r.K) || !known(&r.K_variance) {
                    return fault(
                        key(name),
                        "one K > 0 and one variance is needed for each drive",
                        "as many as drives",
                    );
                }
            }
            let biases = [
                side.paper.as_ref().map(|r| &r.bias_mm),
                side.timoshenko.as_ref().map(|r| &r.bias_mm),
                side.exact.as_ref().map(|r| &r.bias_mm),
                side.table.as_ref().map(|r| &r.bias_mm),
            ];
            if biases.into_iter().flatten().any(|b| b.len() != n || !known(b)) {
                return fault(
                    key("bias_mm"),
                    "one bias ≥ 0 is needed for each drive",
                    "as many as drives, mm",
                );
            }
            if let Some(r) = &side.exact {
                let m = r.fitted.len();
                let square = r.covariance.len() == m && r.covariance.iter().all(|row| row.len() == m);
                let finite = r.covariance.iter().flatten().all(|x| x.is_finite());
                let names = |n: &String| {
                    let kinds = [crate::scene::Drive::Angle, crate::scene::Drive::Displacement];
                    Parameter::ALL.iter().any(|p| kinds.iter().any(|k| p.name(*k) == n))
                };
                if !square || !finite || !r.fitted.iter().all(names) {
                    return fault(
                        key("exact"),
                        "fitted parameters and their covariance do not belong together",
                        again_rows(),
                    );
                }
            }
            for c in side.table.iter().flat_map(|t| &t.curves) {
                let same =
                    c.a_mm.len() >= 2 && c.a_mm.len() == c.signal.len() && c.a_mm.len() == c.variance.len();
                if !same
                    || !positive(&c.a_mm)
                    || !ascending(&c.a_mm)
                    || !positive(&c.signal)
                    || !known(&c.variance)
                {
                    return fault(
                        key("table"),
                        "this curve is no curve",
                        "ascending a_mm, signal > 0, variance ≥ 0, two knots or more",
                    );
                }
            }
        }
        Ok(())
    }
}

fn again_rows() -> &'static str {
    "known names, one row and one column of the covariance for each"
}
