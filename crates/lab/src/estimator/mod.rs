//! Estimators of the distance: how each is calibrated, judged, written and opened.
//! An estimator is a variant of [`Estimator`], a section of [`SideRecord`], and a file that calibrates, checks and opens its section as [`Answers`].

pub mod cells;
pub mod curve;
pub mod exact;
pub mod fit;
pub mod held_out;
pub mod learned;
pub mod learnt;
pub mod model;
pub mod paper;
pub mod reason;
pub mod record;
pub mod taps;

use crate::error::Error;
use crate::measure::Rig;
use crate::scene::Side;
use crate::status::Status;
use exact::Inverted;
use learnt::LearnedCurve;
use model::Found;
use model::exact::Opener;
use model::polynomial::Polynomial;
use paper::Paper;
pub use record::SideRecord;
pub use vibrissa_learned::least;

/// Estimator of the distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// Closed form with K̄ per drive; its K̄ and errors are in every calibration.
    Paper,
    /// Configured model; every calibration reports its fit.
    Exact,
    /// Smooth curve through the data.
    Curve,
    /// Statistical model, the default.
    Learned,
}

impl Estimator {
    /// All estimators, simplest first; the first of equals is taken.
    pub const ALL: [Self; 4] = [Self::Paper, Self::Exact, Self::Curve, Self::Learned];

    /// Name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Exact => "exact",
            Self::Curve => "curve",
            Self::Learned => "learned",
        }
    }

    /// Short description.
    pub fn help(self) -> &'static str {
        match self {
            Self::Paper => "The closed form f and one K̄ per drive",
            Self::Exact => "The configured model, inverted",
            Self::Curve => "A smooth monotone fit of the data, no theory",
            Self::Learned => "One statistical model of curve, rig and runs",
        }
    }

    /// Estimator with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name)
    }

    /// Bias per drive in its section, mm; `None` without a section in `record`.
    pub fn bias_mm(self, record: &SideRecord) -> Option<&[f64]> {
        match self {
            Self::Paper => record.paper.as_ref().map(|r| &r.bias_mm[..]),
            Self::Exact => record.exact.as_ref().map(|r| &r.bias_mm[..]),
            Self::Curve => record.curve.as_ref().map(|r| &r.bias_mm[..]),
            Self::Learned => record.learned.as_ref().map(|r| &r.bias_mm[..]),
        }
    }

    /// True if `record` has its section.
    pub fn is_in(self, record: &SideRecord) -> bool {
        self.bias_mm(record).is_some()
    }

    /// Opens its section of `record`; `None` if that section is missing or for the other side of the gauge.
    ///
    /// # Errors
    /// A backend that fails; a model without taps.
    pub fn open(
        self,
        rig: &Rig,
        record: &SideRecord,
        side: Side,
        open: Opener<'_>,
    ) -> Result<Option<Answers>, Error> {
        Ok(match self {
            Self::Paper => {
                let paper = |r: &paper::FactorRecord| Paper::new(rig, &record.drives, &r.K, &r.K_variance);
                record.paper.as_ref().map(|r| Answers::Paper(paper(r)))
            }
            Self::Exact => {
                let open = |r: &exact::ExactRecord| r.open(rig, record, side, open);
                record.exact.as_ref().map(open).transpose()?.map(Answers::Exact)
            }
            Self::Curve => record.curve.as_ref().map(|r| Answers::Curve(r.fit.clone())),
            Self::Learned => {
                let learned = record.learned.as_ref().filter(|_| side == record.gauge());
                let learned = learned.map(|r| r.open(rig, record, open)).transpose()?.flatten();
                learned.map(|curve| Answers::Learned(Box::new(curve)))
            }
        })
    }
}

/// Conditions of a reading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    /// Variance of its zero reading in units of that of one reading; 0 without one.
    pub share: f64,
    /// True for a run of the calibration.
    pub same_run: bool,
}

/// Opened estimator for one side of a whisker.
pub enum Answers {
    /// Closed form with K̄.
    Paper(Paper),
    /// Model, inverted.
    Exact(Inverted),
    /// Distance as a polynomial of signal and drive.
    Curve(Polynomial),
    /// Posterior of a learned curve.
    Learned(Box<LearnedCurve>),
}

impl Answers {
    /// Distance for a `reading` > 0 (strain, or the unit of the reading) of a tap at `drive` (degrees or mm) under the conditions `of`.
    pub fn find(&self, drive: f64, reading: f64, of: Known) -> Result<Found, Status> {
        match self {
            Self::Paper(paper) => paper.find(drive, reading).ok_or(Status::NO_ROOT),
            Self::Exact(model) => model.find(drive, reading),
            Self::Curve(curve) => curve.find(drive, reading).ok_or(Status::OUTSIDE_CALIBRATION),
            Self::Learned(curve) => curve.find(drive, reading, of),
        }
    }

    /// Expected reading of a tap at a (mm) and `drive`; NaN without one.
    pub fn expected(&self, a: f64, drive: f64) -> f64 {
        match self {
            Self::Paper(paper) => paper.expected(a, drive),
            Self::Exact(model) => model.expected(a, drive),
            Self::Curve(curve) => curve.expected(a, drive),
            Self::Learned(curve) => curve.expected(a, drive),
        }
    }

    /// Variance of the expected reading from the calibration; for `learned` with position and, unless `same_run`, a new run. NaN if unknown.
    pub fn variance(&self, a: f64, drive: f64, same_run: bool) -> f64 {
        match self {
            Self::Paper(paper) => paper.variance(a, drive),
            Self::Exact(model) => model.exact.variance(a, drive),
            Self::Curve(curve) => {
                curve.find(drive, curve.expected(a, drive)).map_or(f64::NAN, |f| f.variance)
            }
            Self::Learned(curve) => curve.variance(a, drive, same_run),
        }
    }

    /// Learned curve, if it is one.
    pub fn learned(&self) -> Option<&LearnedCurve> {
        if let Self::Learned(curve) = self { Some(curve) } else { None }
    }
}
