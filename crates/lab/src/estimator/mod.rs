//! The ways to a distance, by the names users know: how each is calibrated, judged, written and opened.
//!
//! An estimator is one file that implements [`Estimator`] and one line of [`registry`]. What it makes of a calibration
//! [`Answers`] readings.

pub mod cells;
pub mod curve;
pub mod exact;
pub mod fit;
pub mod fitted;
pub mod held_out;
pub mod learned;
pub mod learnt;
pub mod model;
pub mod paper;
pub mod reason;
pub mod registry;
pub mod taps;

use std::fmt;
use std::ops::Range;

use crate::error::Error;
use crate::estimator::fitted::Fit;
use crate::estimator::held_out::Side as Measured;
use crate::measure::Rig;
use crate::scene::Side;
use crate::status::Status;
pub use fitted::{Forward, Shape};
use model::Found;
use model::exact::Opener;
pub use registry::{ALL, SideRecord};
pub use vibrissa_learned::algebra::least;

/// Distances of which those between the first and the last are enough to judge by.
const BETWEEN: usize = 5;

/// The paper's own: its K̄ and its errors stand in the tables of every calibration.
pub const PAPER: &dyn Estimator = &paper::PAPER;
/// The configured model, whose fit every calibration reports.
pub const EXACT: &dyn Estimator = &exact::EXACT;
/// A smooth curve through the data.
pub const CURVE: &dyn Estimator = &curve::CURVE;
/// One statistical model: the default.
pub const LEARNED: &dyn Estimator = &learned::LEARNED;

/// The estimator of this name.
pub fn named(name: &str) -> Option<&'static dyn Estimator> {
    ALL.into_iter().find(|e| e.name() == name)
}

/// What is known of a reading beside what it says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    /// Variance of its own zero in units of that of one reading; 0 where it has none.
    pub share: f64,
    /// Whether it is of a run of the calibration.
    pub same_run: bool,
}

/// What answers the readings of one side of a calibrated whisker.
pub trait Answers: Send + Sync {
    /// Distance at which `reading` > 0 (strain, or the unit of the reading) comes of a tap by `drive` (degrees or mm). `of` says what else is
    /// known of it.
    fn find(&self, drive: f64, reading: f64, of: Known) -> Result<Found, Status>;

    /// Reading expected of a tap at a (mm) by `drive`; NaN where none is.
    fn expected(&self, a: f64, drive: f64) -> f64;

    /// What it is made of.
    fn shape(&self) -> Shape<'_>;
}

/// What answers readings of taps that are left out: by place of the cell, drive and |signal|.
pub type Unseen<'a> = Box<dyn Fn(usize, f64, f64) -> Option<Found> + 'a>;

/// Leaves distances out, by their numbers: what answers them, calibrated on the others alone; `None` where that is not possible.
pub type LeaveOut<'a> = Box<dyn Fn(&Range<usize>) -> Option<Unseen<'a>> + Sync + 'a>;

/// What an estimator is worth on distances it has not seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Root mean square error, mm; `None` where it answers nothing.
    pub rms_mm: Option<f64>,
    /// Error beyond what noise explains, per drive, mm.
    pub bias_mm: Vec<f64>,
}

/// What is opened.
#[derive(Clone, Copy)]
pub struct Opening<'a> {
    /// The whisker.
    pub rig: &'a Rig,
    /// The calibration.
    pub record: &'a SideRecord,
    /// Side of the gauge that is to be answered.
    pub side: Side,
    /// Solves models.
    pub open: Opener<'a>,
}

/// A section of a calibration that contradicts itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Fault {
    /// What is wrong.
    pub message: &'static str,
    /// What is allowed.
    pub allowed: &'static str,
}

/// A way to a distance.
pub trait Estimator: Send + Sync {
    /// Name in files and on the command line.
    fn name(&self) -> &'static str;

    /// What it is, in a few words.
    fn help(&self) -> &'static str;

    /// Whether it means anything only where the drive of each tap is known.
    fn needs_drive(&self) -> bool {
        false
    }

    /// Whether it can be calibrated on a whisker of which nothing is known, with one drive or with several.
    fn needs_whisker(&self, several_drives: bool) -> bool {
        let _ = several_drives;
        false
    }

    /// Whether it is extrapolated where the first or the last distance is left out: errors there say nothing of the others.
    fn extrapolates(&self) -> bool {
        false
    }

    /// Whether it also answers the side of the gauge that was not calibrated.
    fn answers_both_sides(&self) -> bool {
        false
    }

    /// What leaves the distances of `side` out, each in turn; what is the same for all of them is done here, once. `fit` is that of the
    /// model to all distances.
    fn leave_out<'a>(&'a self, side: &'a Measured<'a>, fit: Option<&'a Fit>) -> LeaveOut<'a>;

    /// Calibrates it on all of `side` and puts its section into `record`, where the data allow it. `fit` as in
    /// [`Self::leave_out`].
    fn calibrate(&self, side: &Measured<'_>, fit: Option<&Fit>, judged: Judged, record: &mut SideRecord);

    /// Bias per drive of its section, mm; `None` where `record` has no such section.
    fn bias_mm<'a>(&self, record: &'a SideRecord) -> Option<&'a [f64]>;

    /// Whether `record` has its section.
    fn is_in(&self, record: &SideRecord) -> bool {
        self.bias_mm(record).is_some()
    }

    /// Refuses a section whose values contradict each other or the rest of `record`.
    fn check(&self, record: &SideRecord) -> Result<(), Fault>;

    /// What answers as its section says; `None` where there is no such section.
    ///
    /// # Errors
    /// A backend that fails; a model without taps.
    fn open(&self, of: &Opening<'_>) -> Result<Option<Box<dyn Answers>>, Error>;
}

impl fmt::Debug for dyn Estimator + '_ {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl PartialEq for dyn Estimator + '_ {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

/// Distances at which `estimator` is judged by what it makes of them unseen: all of so many, or those between the first and the last.
pub fn judged(estimator: &dyn Estimator, distances: usize) -> std::ops::Range<usize> {
    let inner = estimator.extrapolates() && distances >= BETWEEN;
    if inner { 1..distances - 1 } else { 0..distances }
}

/// Whether all are finite and > 0.
fn positive(values: &[f64]) -> bool {
    values.iter().all(|x| *x > 0.0 && x.is_finite())
}

/// Whether all are finite and ≥ 0.
fn known(values: &[f64]) -> bool {
    values.iter().all(|x| *x >= 0.0 && x.is_finite())
}

/// Whether each is larger than the one before.
fn ascending(values: &[f64]) -> bool {
    values.windows(2).all(|w| w[0] < w[1])
}
