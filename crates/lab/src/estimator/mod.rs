//! The ways to a distance, by the names users know: how each is calibrated, judged, written and opened.
//!
//! An estimator is a variant of [`Estimator`], a section of [`SideRecord`], and one file: how its section is calibrated and checked, and
//! what [`Answers`] readings as it says.

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

/// A way to a distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// The paper's own: its K̄ and its errors stand in the tables of every calibration.
    Paper,
    /// The configured model, whose fit every calibration reports.
    Exact,
    /// A smooth curve through the data.
    Curve,
    /// One statistical model: the default.
    Learned,
}

impl Estimator {
    /// All, simplest first: of equals the first is taken.
    pub const ALL: [Self; 4] = [Self::Paper, Self::Exact, Self::Curve, Self::Learned];

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Exact => "exact",
            Self::Curve => "curve",
            Self::Learned => "learned",
        }
    }

    /// What it is, in a few words.
    pub fn help(self) -> &'static str {
        match self {
            Self::Paper => "The closed form f and one K̄ per drive",
            Self::Exact => "The configured model, inverted",
            Self::Curve => "A smooth monotone fit of the data, no theory",
            Self::Learned => "One statistical model of curve, rig and runs",
        }
    }

    /// The estimator of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name)
    }

    /// Bias per drive of its section, mm; `None` where `record` has no such section.
    pub fn bias_mm(self, record: &SideRecord) -> Option<&[f64]> {
        match self {
            Self::Paper => record.paper.as_ref().map(|r| &r.bias_mm[..]),
            Self::Exact => record.exact.as_ref().map(|r| &r.bias_mm[..]),
            Self::Curve => record.curve.as_ref().map(|r| &r.bias_mm[..]),
            Self::Learned => record.learned.as_ref().map(|r| &r.bias_mm[..]),
        }
    }

    /// Whether `record` has its section.
    pub fn is_in(self, record: &SideRecord) -> bool {
        self.bias_mm(record).is_some()
    }

    /// What answers readings of one side of the gauge as its section of `record` says; `None` where there is no such section, or it is of
    /// the other side.
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

/// What is known of a reading beside what it says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    /// Variance of its own zero in units of that of one reading; 0 where it has none.
    pub share: f64,
    /// Whether it is of a run of the calibration.
    pub same_run: bool,
}

/// What answers the readings of one side of a calibrated whisker.
pub enum Answers {
    /// The closed form with its K̄.
    Paper(Paper),
    /// The model, inverted.
    Exact(Inverted),
    /// Distance as a polynomial of signal and drive.
    Curve(Polynomial),
    /// The posterior of a learned curve.
    Learned(Box<LearnedCurve>),
}

impl Answers {
    /// Distance at which `reading` > 0 (strain, or the unit of the reading) comes of a tap by `drive` (degrees or mm). `of` says what else is
    /// known of it.
    pub fn find(&self, drive: f64, reading: f64, of: Known) -> Result<Found, Status> {
        match self {
            Self::Paper(paper) => paper.find(drive, reading).ok_or(Status::NO_ROOT),
            Self::Exact(model) => model.find(drive, reading),
            Self::Curve(curve) => curve.find(drive, reading).ok_or(Status::OUTSIDE_CALIBRATION),
            Self::Learned(curve) => curve.find(drive, reading, of),
        }
    }

    /// Reading expected of a tap at a (mm) by `drive`; NaN where none is.
    pub fn expected(&self, a: f64, drive: f64) -> f64 {
        match self {
            Self::Paper(paper) => paper.expected(a, drive),
            Self::Exact(model) => model.expected(a, drive),
            Self::Curve(curve) => curve.expected(a, drive),
            Self::Learned(curve) => curve.expected(a, drive),
        }
    }

    /// Variance of that reading from the noise of the calibration, and of `learned` from the position and, unless `same_run`, from a new run;
    /// NaN where it is not known.
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

    /// The learned curve, if it is one.
    pub fn learned(&self) -> Option<&LearnedCurve> {
        if let Self::Learned(curve) = self { Some(curve) } else { None }
    }
}

/// What an estimator is worth on distances it has not seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Root mean square error, mm; `None` where it answers nothing.
    pub rms_mm: Option<f64>,
    /// Error beyond what noise explains, per drive, mm.
    pub bias_mm: Vec<f64>,
}
