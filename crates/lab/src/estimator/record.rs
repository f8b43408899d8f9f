//! Record of one side of a calibration: a section for each estimator.

use serde::{Deserialize, Serialize};

use super::Estimator;
use super::curve::SmoothRecord;
use super::exact::ExactRecord;
use super::learned::LearnedRecord;
use super::paper::FactorRecord;
use crate::scene::Side;

/// Calibration of one side of the whisker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SideRecord {
    /// Sign of its readings: 1 or −1.
    pub sign: i8,
    /// Side of the gauge that this sign means: contact or far.
    pub gauge_side: String,
    /// Smallest and largest calibrated distance, mm.
    pub distances_mm: [f64; 2],
    /// Calibrated drives, ascending; a drive with jitter as its mean.
    pub drives: Vec<f64>,
    /// Smallest and largest drive of the taps, if they differ from the first and last of `drives`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive_ends: Option<[f64; 2]>,
    /// |signal| at the sensor's end stop, if the data show it.
    pub end_stop: Option<f64>,
    /// Reason why `exact` is missing, if whisker and drives are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_exact: Option<String>,
    /// Section of `paper`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<FactorRecord>,
    /// Section of `exact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact: Option<ExactRecord>,
    /// Section of `curve`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curve: Option<SmoothRecord>,
    /// Section of `learned`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learned: Option<LearnedRecord>,
}

/// Key of a record with a contradictory value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// The key.
    pub key: &'static str,
    /// Description of the fault.
    pub message: &'static str,
    /// Allowed values.
    pub allowed: &'static str,
}

impl SideRecord {
    /// Calibrated side of the gauge.
    pub fn gauge(&self) -> Side {
        if self.gauge_side == "far" { Side::Far } else { Side::Contact }
    }

    /// Other side of the gauge.
    pub fn other_gauge(&self) -> Side {
        if self.gauge() == Side::Far { Side::Contact } else { Side::Far }
    }

    /// Smallest and largest calibrated drive.
    pub fn ends(&self) -> [f64; 2] {
        let [first, last] = [self.drives[0], self.drives[self.drives.len() - 1]];
        self.drive_ends.map_or([first, last], |[lo, hi]| [lo.min(first), hi.max(last)])
    }

    /// Refuses contradictory values.
    ///
    /// # Errors
    /// The first key at fault.
    pub fn check(&self) -> Result<(), Fault> {
        let [lo, hi] = self.distances_mm;
        let n = self.drives.len();
        let must = |sound: bool, key, message, allowed| match sound {
            true => Ok(()),
            false => Err(Fault { key, message, allowed }),
        };
        let drives = n > 0 && positive(&self.drives) && ascending(&self.drives);
        must(drives, "drives", "these are no drives", "ascending, > 0")?;
        let ends = self.drive_ends.is_none_or(|ends| positive(&ends));
        must(ends, "drive_ends", "these are no drives", "> 0")?;
        let range = positive(&[lo, hi]) && lo < hi;
        must(range, "distances_mm", "this is no range of distances", "0 < smallest < largest, mm")?;
        let side = self.sign.abs() == 1 && ["contact", "far"].contains(&self.gauge_side.as_str());
        must(side, "sign", "this is no side", "1 or -1, with contact or far")?;
        let paper = self.paper.as_ref().is_none_or(|r| r.is_sound(n));
        let message = "one K > 0 and one variance is needed for each drive";
        must(paper, "paper", message, "as many as drives")?;
        let message = "fitted parameters and their covariance do not belong together";
        let allowed = "known names, one row and one column of the covariance for each";
        must(self.exact.as_ref().is_none_or(ExactRecord::is_sound), "exact", message, allowed)?;
        let allowed =
            "one coefficient for each term and their covariance, half widths > 0, a reach that ascends";
        let curve = self.curve.as_ref().is_none_or(|r| r.fit.is_sound());
        must(curve, "curve", "this polynomial does not belong together", allowed)?;
        let allowed = "a power law or a whisker; known terms, one coefficient for each; variances ≥ 0";
        let learned = self.learned.as_ref().is_none_or(LearnedRecord::is_sound);
        must(learned, "learned", "this curve does not belong together", allowed)?;
        let biased = |e: Estimator| e.bias_mm(self).is_none_or(|bias| bias.len() == n && known(bias));
        let message = "one bias ≥ 0 is needed for each drive";
        must(Estimator::ALL.into_iter().all(biased), "bias_mm", message, "as many as drives, mm")
    }
}

pub(super) fn positive(values: &[f64]) -> bool {
    values.iter().all(|x| *x > 0.0 && x.is_finite())
}

pub(super) fn known(values: &[f64]) -> bool {
    values.iter().all(|x| *x >= 0.0 && x.is_finite())
}

fn ascending(values: &[f64]) -> bool {
    values.windows(2).all(|w| w[0] < w[1])
}
