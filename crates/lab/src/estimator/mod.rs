//! Estimators of the distance: how each is calibrated, judged, written and opened.
//! An estimator is a variant of [`Estimator`], a section of [`SideRecord`], and a file that calibrates, checks and opens its section as [`Answers`].

pub(crate) mod exact;
pub(crate) mod fit;
pub(crate) mod held_out;
pub(crate) mod learned;
pub(crate) mod parameter;
pub(crate) mod polynomial;
pub(crate) mod simple;
pub(crate) mod surface;
pub mod taps;

use serde::{Deserialize, Serialize};

use crate::error::{Error, SolveError};
pub(crate) use crate::measure::group::ROUNDING as SAME;
use crate::{scene::Side, status::Status};
use exact::ExactRecord;
pub use exact::{Exact, Extent, Opener, Solver};
use learned::{LearnedCurve, LearnedRecord};
pub use parameter::{Parameter, Values};
use simple::{FactorRecord, Paper, SmoothRecord};
pub use vibrissa_learned::invert::Found;
pub use vibrissa_learned::least;

vibrissa_core::choices! {
    /// Estimator of the distance, by its name in files and flags. The simplest come first: the first of equals is taken. K̄ and errors of `paper` are in
    /// every calibration, with a report of the fit of `exact`; `learned` is the default.
    Estimator {
        Paper = "paper", "The closed form f and one K̄ per drive";
        Exact = "exact", "The configured model, inverted";
        Curve = "curve", "A smooth monotone fit of the data, no theory";
        Learned = "learned", "One statistical model of curve, rig and runs";
    }
}

impl Estimator {
    pub const ALL: [Self; 4] = [Self::Paper, Self::Exact, Self::Curve, Self::Learned];

    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.word() == name)
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

    /// Opens its section of `record`; `None` if that section is missing or for the other side of the gauge.
    /// Errors: a backend that fails; a model without taps.
    pub fn open(
        self,
        of: Solver<'_>,
        record: &SideRecord,
        side: Side,
    ) -> Result<Option<Box<dyn Answers>>, Error> {
        fn boxed(answers: impl Answers + 'static) -> Box<dyn Answers> {
            Box::new(answers)
        }
        let paper = |r: &FactorRecord| boxed(Paper::new(of.0, &record.drives, r.clone()));
        let learned = record.learned.as_ref().filter(|_| side == record.gauge());
        Ok(match self {
            Self::Paper => record.paper.as_ref().map(paper),
            Self::Exact => record.exact.as_ref().map(|r| r.open(of, record, side)).transpose()?.map(boxed),
            Self::Curve => record.curve.as_ref().map(|r| boxed(r.fit.clone())),
            Self::Learned => learned.map(|r| r.open(of, record)).transpose()?.flatten().map(boxed),
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    /// Variance of its zero reading in units of that of one reading; 0 without one.
    pub share: f64,
    /// True for a run of the calibration.
    pub same_run: bool,
}

/// An opened estimator of one side of a whisker.
pub trait Answers: Send + Sync {
    /// Distance for a `reading` > 0 (strain, or the unit of the reading) of a tap at `drive` (degrees or mm) under the conditions `of`.
    fn find(&self, drive: f64, reading: f64, of: Known) -> Result<Found, Status>;

    /// Expected reading of a tap at a (mm) and `drive`; NaN without one.
    fn expected(&self, a: f64, drive: f64) -> f64;

    /// Variance of the expected reading from the calibration; for `learned` with position and, unless `same_run`, a new run. NaN if unknown.
    fn variance(&self, a: f64, drive: f64, same_run: bool) -> f64;

    fn learned(&self) -> Option<&LearnedCurve> {
        None
    }
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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
    pub drive_ends: Option<[f64; 2]>,
    /// |signal| at the sensor's end stop, if the data show it.
    pub end_stop: Option<f64>,
    /// Reason why `exact` is missing, if whisker and drives are known.
    pub no_exact: Option<String>,
    pub paper: Option<FactorRecord>,
    pub exact: Option<ExactRecord>,
    pub curve: Option<SmoothRecord>,
    pub learned: Option<LearnedRecord>,
}

impl SideRecord {
    pub fn gauge(&self) -> Side {
        if self.gauge_side == "far" { Side::Far } else { Side::Contact }
    }

    /// Smallest and largest calibrated drive.
    pub fn ends(&self) -> [f64; 2] {
        let [first, last] = [self.drives[0], self.drives[self.drives.len() - 1]];
        self.drive_ends.map_or([first, last], |[lo, hi]| [lo.min(first), hi.max(last)])
    }

    /// Smallest and largest calibrated distance (mm) and drive.
    pub fn ranges(&self) -> [[f64; 2]; 2] {
        [self.distances_mm, self.ends()]
    }

    /// Errors: the first key at fault, what is wrong with its value, and allowed values.
    pub fn check(&self) -> Result<(), [&'static str; 3]> {
        let [lo, hi] = self.distances_mm;
        let n = self.drives.len();
        let drives = n > 0 && positive(&self.drives) && self.drives.is_sorted_by(|p, q| p < q);
        let ends = self.drive_ends.is_none_or(|ends| positive(&ends));
        let range = positive(&[lo, hi]) && lo < hi;
        let side = self.sign.abs() == 1 && ["contact", "far"].contains(&self.gauge_side.as_str());
        let paper = self.paper.as_ref().is_none_or(|r| r.is_sound(n));
        let factors = "one K > 0 and one variance is needed for each drive";
        let exact = self.exact.as_ref().is_none_or(ExactRecord::is_sound);
        let fitted = "fitted parameters and their covariance do not belong together";
        let names = "known names, one row and one column of the covariance for each";
        let curve = self.curve.as_ref().is_none_or(|r| r.fit.is_sound());
        let terms =
            "one coefficient for each term and their covariance, half widths > 0, a reach that ascends";
        let learned = self.learned.as_ref().is_none_or(LearnedRecord::is_sound);
        let law = "a power law or a whisker; known terms, one coefficient for each; variances ≥ 0";
        let biased = |e: Estimator| e.bias_mm(self).is_none_or(|bias| bias.len() == n && known(bias));
        let biased = Estimator::ALL.into_iter().all(biased);
        let checked = [
            (drives, ["drives", "these are no drives", "ascending, > 0"]),
            (ends, ["drive_ends", "these are no drives", "> 0"]),
            (range, ["distances_mm", "this is no range of distances", "0 < smallest < largest, mm"]),
            (side, ["sign", "this is no side", "1 or -1, with contact or far"]),
            (paper, ["paper", factors, "as many as drives"]),
            (exact, ["exact", fitted, names]),
            (curve, ["curve", "this polynomial does not belong together", terms]),
            (learned, ["learned", "this curve does not belong together", law]),
            (biased, ["bias_mm", "one bias ≥ 0 is needed for each drive", "as many as drives, mm"]),
        ];
        checked.into_iter().find(|(sound, _)| !sound).map_or(Ok(()), |(_, fault)| Err(fault))
    }
}

fn positive(values: &[f64]) -> bool {
    values.iter().all(|x| *x > 0.0 && x.is_finite())
}

fn known(values: &[f64]) -> bool {
    values.iter().all(|x| *x >= 0.0 && x.is_finite())
}

/// Linear interpolation of `ys` over ascending `xs`, held at both ends.
pub(crate) fn between(xs: &[f64], ys: &[f64], x: f64) -> f64 {
    let x = x.clamp(xs[0], xs[xs.len() - 1]);
    let j = xs.partition_point(|v| *v <= x).saturating_sub(1).min(xs.len().saturating_sub(2));
    match xs.get(j + 1) {
        Some(next) => ys[j] + (x - xs[j]) / (next - xs[j]) * (ys[j + 1] - ys[j]),
        None => ys[j],
    }
}

/// Failure to solve a model over the distances and drives of a side.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    #[error("all distances lie at or inside the gauge")]
    InsideGauge,
    #[error("the whisker cannot be continued so far")]
    TooFar,
    #[error("the model of the spec has solutions for {found} of {of} measured distances and drives")]
    FewTaps { found: usize, of: usize },
    #[error(transparent)]
    Solve(#[from] SolveError),
    #[error(transparent)]
    NotOpened(#[from] Error),
}

impl ModelError {
    /// True if the whisker has no such taps; false if the computation failed.
    pub fn is_of_whisker(&self) -> bool {
        !matches!(self, Self::NotOpened(_))
            && !matches!(self, Self::Solve(why) if *why != SolveError::TooHard)
    }
}

impl From<ModelError> for Error {
    fn from(e: ModelError) -> Self {
        match e {
            ModelError::NotOpened(e) => e,
            ModelError::Solve(e) => e.into(),
            other => Self::Run(other.to_string()),
        }
    }
}
