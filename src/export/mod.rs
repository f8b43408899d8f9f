//! A calibration as a program for a robot: one file without dependencies, in C or Python, that answers as `locate` does.
//!
//! What the file holds is made by asking the estimator ([`Shape`]): a polynomial as it is, a signal over distance and drive as Chebyshev
//! series on rectangles, read backwards by the file itself. It knows distances up to somewhat beyond the range and the whisker.

mod c;
mod pieces;
mod python;
mod signal;
mod taps;
mod text;
pub mod together;

use crate::error::{Error, InputError};
use crate::estimator::model::exact::Opener;
use crate::estimator::model::polynomial::Polynomial;
use crate::estimator::{ALL, Estimator, Known, Shape};
use crate::locate::opened::Opened;
use crate::locate::{Calibration, Locator};
use crate::status::Status;
use pieces::{Hole, Pieces};
use signal::Signal;
use vibrissa_learned::invert::Inverse;

/// Largest error that an export may have, mm.
const LARGEST: f64 = 5e-5;

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// C99, for float and double.
    C,
    /// Python 3, its standard library only.
    Python,
}

impl Language {
    /// All, by the word users know.
    pub const ALL: [(&'static str, Self, &'static str); 2] = [
        ("c", Self::C, "locate.c: C99, float and double, needs <math.h> only"),
        ("python", Self::Python, "locate.py: needs its standard library only"),
    ];

    /// Name of the file.
    pub fn file(self) -> &'static str {
        match self {
            Self::C => "locate.c",
            Self::Python => "locate.py",
        }
    }
}

/// What answers one side.
enum Form<'a> {
    Direct(&'a Polynomial),
    Learned {
        inverse: &'a Inverse,
        zero: f64,
    },
    Inverted {
        pieces: Pieces,
        /// Whether there is more beyond the farthest distance.
        cut: bool,
        /// Logarithm of the signal at the farthest distance over one below which the near distance is the only one; infinite where it never is.
        alone: f64,
        /// What is said where there is no distance: below the signal of the farthest one, and otherwise.
        without: [Status; 2],
    },
}

/// One side of the whisker.
struct Side<'a> {
    of: &'a Opened,
    form: Form<'a>,
}

/// A calibration, ready to be written.
pub struct Export<'a> {
    locator: &'a Locator,
    calibration: &'a Calibration,
    sides: Vec<Side<'a>>,
    /// What is told together, if anything.
    taps: Option<taps::Taps>,
}

impl<'a> Export<'a> {
    /// Of what `locator` answers, which was made of `calibration`.
    ///
    /// # Errors
    /// A calibration of two signals; an estimator that is not smooth enough, or has no numbers somewhere within its reach.
    pub fn new(locator: &'a Locator, calibration: &'a Calibration) -> Result<Self, Error> {
        if locator.is_twofold() {
            let error = InputError::new(
                "the file answers one signal, and this calibration is of two: distance and tilt take the model itself",
            );
            let error = error.key("--export").value("a calibration with [second]");
            return Err(error.allowed("a calibration of one gauge (no second = true in [gauge])").into());
        }
        let length = if locator.rig.known { locator.rig.design.tuple.L_a } else { 0.0 };
        let side = |of: &'a Opened| -> Result<Side<'a>, Error> {
            let inverted = match of.answers.shape() {
                Shape::Direct(polynomial) => return Ok(Side { of, form: Form::Direct(polynomial) }),
                Shape::Learned(learned) => {
                    let (inverse, zero) = learned.plain();
                    return Ok(Side { of, form: Form::Learned { inverse, zero } });
                }
                Shape::Inverted(forward) => forward,
            };
            // The side that was not calibrated is answered by the model.
            let calibrated = calibration.sides.iter().any(|record| f64::from(record.sign) == of.sign);
            let who = if calibrated {
                locator.estimator.name()
            } else {
                "exact, for the side that was not calibrated,"
            };
            let signal = Signal::new(inverted, of, locator.spread(), length);
            let pieces = Pieces::new(&signal).map_err(|Hole(a, drive)| {
                refused(
                    locator,
                    who,
                    format!("it expects no signal at a = {a} mm, {} = {drive}", column(locator)),
                )
            })?;
            if pieces.error > LARGEST {
                return Err(refused(
                    locator,
                    who,
                    format!("it would be wrong by up to {:.1e} mm", pieces.error),
                )
                .into());
            }
            let middle = of.drives[of.drives.len() / 2];
            let why = |signal: f64, otherwise| {
                of.answers.find(middle, signal, Known::default()).err().unwrap_or(otherwise)
            };
            let form = Form::Inverted {
                pieces,
                cut: signal.cut.is_finite(),
                alone: inverted.alone().recip().ln(),
                without: [why(1e-150, Status::OUTSIDE_CALIBRATION), why(1e150, Status::NO_ROOT)],
            };
            Ok(Side { of, form })
        };
        let sides = locator.sides().iter().map(side).collect::<Result<_, _>>()?;
        Ok(Self { locator, calibration, sides, taps: None })
    }

    /// Whether there is a side that is inverted, one that is a polynomial, and one that was learned.
    fn kinds(&self) -> [bool; 3] {
        let any = |f: fn(&Form<'_>) -> bool| self.sides.iter().any(|s| f(&s.form));
        [
            any(|f| matches!(f, Form::Inverted { .. })),
            any(|f| matches!(f, Form::Direct(_))),
            any(|f| matches!(f, Form::Learned { .. })),
        ]
    }

    /// The file in `language`.
    pub fn text(&self, language: Language) -> String {
        match language {
            Language::C => self.c(),
            Language::Python => self.python(),
        }
    }

    /// Largest difference to `locate` at double precision among the calibrated distances, on the far side of the peak, mm; 0 where the
    /// file holds the estimator's own polynomial or table.
    pub fn error(&self) -> f64 {
        let of = |side: &Side<'_>| match &side.form {
            Form::Direct(_) | Form::Learned { .. } => 0.0,
            Form::Inverted { pieces, .. } => pieces.error,
        };
        self.sides.iter().map(of).fold(0.0, f64::max)
    }
}

/// An error of [`Export::new`] that names the estimators of `calibration` that can be written; `open` solves models.
pub fn proposing(error: Error, calibration: &Calibration, open: Opener<'_>) -> Error {
    let Error::Input(error) = error else { return error };
    let written = |e: &&'static dyn Estimator| {
        let locator = Locator::new(calibration, "", Some(*e), open);
        locator.is_ok_and(|l| Export::new(&l, calibration).is_ok())
    };
    let mut names: Vec<&str> = ALL.into_iter().filter(written).map(|e| e.name()).collect();
    names.sort_by_key(|name| *name != calibration.estimator);
    match names.is_empty() {
        true => error.into(),
        false => {
            error.allowed(format!("--estimator with one of those that can be: {}", names.join(", "))).into()
        }
    }
}

fn column(locator: &Locator) -> &'static str {
    if locator.drive_recorded { locator.rig.setup.drive.column() } else { "drive" }
}

fn refused(locator: &Locator, who: &str, why: String) -> InputError {
    InputError::new(format!("{who} cannot be written as a table: {why}"))
        .key("--export")
        .value(locator.estimator.name())
        .allowed("another estimator (--estimator)")
}
