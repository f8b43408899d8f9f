//! Learned model of a side, and its inversion.

use std::sync::{Arc, OnceLock};

use vibrissa_learned::base::{Base, Whisker};
use vibrissa_learned::curve::{Curve, Expected, Weights};
use vibrissa_learned::fit::{Fit, From, Task, fit};
use vibrissa_learned::invert::Inverse;
use vibrissa_learned::joint::{Joint, Object, Told};

use super::Known;
use super::model::Found;
use super::model::exact::Exact;
use crate::status::Status;

/// Curve of a known whisker, and the range of distances with value and slope, mm.
pub fn whisker(exact: Exact) -> (Whisker, [f64; 2]) {
    let [near, far] = exact.reach();
    (Arc::new(move |a, u| exact.expected(a, u)), [near * 1.002, far * 0.998])
}

/// Range of distances of a power law, mm.
pub const EVERYWHERE: [f64; 2] = [0.0, f64::INFINITY];

/// Learned model of a side with its data.
#[derive(Clone)]
pub struct Learnt {
    /// Rows of taps and zero readings in the sign of the side; the whisker if known; the standard error of a zero from taps of both sides.
    pub task: Task,
    /// Range of distances of the whisker or the power law, mm.
    pub reach: [f64; 2],
    /// Index of the tap of each row.
    pub taps: Vec<Option<usize>>,
    /// Index in the file of each row.
    pub lines: Vec<usize>,
    /// Sign of the side.
    pub sign: f64,
    /// Indices of the used rows.
    pub places: Vec<usize>,
    /// Fit of the used rows.
    pub fit: Arc<Fit>,
    /// Number of runs.
    pub runs: usize,
    /// True if zeros were read.
    pub zero_read: bool,
    /// True if the zero is known.
    pub zero_known: bool,
    /// Zero subtracted from the taps after the fit, in the sign of the side.
    pub subtracted: f64,
}

impl std::fmt::Debug for Learnt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {} rows", self.places.len(), self.task.rows.len())
    }
}

impl Learnt {
    /// Standard deviation of a typical reading.
    pub fn noise(&self) -> f64 {
        let curve = &self.fit.curve;
        curve.unit * (curve.spread.floor + curve.spread.relative).sqrt()
    }

    /// Model for readings at `drives`, from the rows at `places` only; the learned numbers are kept.
    pub fn without(&self, places: &[usize], drives: &[f64]) -> Option<LearnedCurve> {
        let fit = fit(&self.task, places, From::Held(&self.fit), true).ok()?;
        let curve = Curve { zero: fit.curve.zero - self.subtracted, ..fit.curve };
        let zero = [self.zero_read, self.zero_known];
        Some(LearnedCurve::new(curve, (fit.base, self.reach), zero, Some(drives)))
    }

    /// Expected tap at a (mm) and drive u, above its zero.
    pub fn expected(&self, a: f64, u: f64) -> Expected {
        self.fit.curve.expected(&self.fit.base, a, u, true)
    }
}

/// Inverted learned curve.
pub struct LearnedCurve {
    curve: Curve,
    base: Base,
    /// Inverses for readings above the zero of the calibration, and above their own.
    inverse: [Option<Inverse>; 2],
    zero_read: bool,
    /// Models of several taps, and of strokes, made on first use.
    joints: [[OnceLock<Joint>; 2]; 2],
}

impl LearnedCurve {
    /// For any drive, or for these alone; the base is known within `reach`.
    pub(super) fn new(
        curve: Curve,
        (base, reach): (Base, [f64; 2]),
        [zero_read, zero_known]: [bool; 2],
        drives: Option<&[f64]>,
    ) -> Self {
        let new = |tared: bool| match drives {
            Some(drives) => Inverse::of_drives(&curve, &base, (tared, reach), drives),
            None => Inverse::new(&curve, &base, tared, reach),
        };
        let inverse = [(!zero_read).then(|| new(false)), (zero_read || zero_known).then(|| new(true))];
        Self { inverse, curve, base, zero_read, joints: Default::default() }
    }

    /// For a reading whose zero has this `share`: true if it counts above its own zero; the signal that counts; variance of the zero.
    pub fn read(&self, reading: f64, share: f64) -> (bool, f64, f64) {
        let tared = self.inverse[1].is_some() && (self.zero_read || share > 0.0);
        let of_zero = share * self.curve.spread.floor * self.curve.unit.powi(2);
        (tared, if tared || self.zero_read { reading } else { reading - self.curve.zero }, of_zero)
    }

    fn of(&self, tared: bool) -> &Inverse {
        let made = self.inverse[usize::from(tared)].as_ref();
        made.unwrap_or_else(|| self.plain().0)
    }

    /// Model of several taps of one object.
    pub fn joint(&self, tared: bool) -> &Joint {
        let new = || Joint::new(&self.curve, &self.base, tared, self.of(tared));
        self.joints[0][usize::from(tared)].get_or_init(new)
    }

    /// Model of strokes.
    pub fn joint_of_strokes(&self, tared: bool) -> &Joint {
        let new = || Joint::of_strokes(&self.curve, &self.base, tared, self.of(tared));
        self.joints[1][usize::from(tared)].get_or_init(new)
    }

    /// 95 % interval of the distance of an object, mm.
    pub fn ends(&self, object: &Object, told: &Told, tared: bool, same_run: bool) -> [f64; 2] {
        let joint = self.joint(tared);
        let variance = (told.sigma / (told.a - object.frame())).powi(2);
        let longer = object.weights(joint, told.a, same_run);
        let longer = longer.map_or(1.0, |weights| self.curve.longer(weights, variance, tared, same_run));
        stretched(told.a, told.ends, longer)
    }

    /// Inverse for readings without their own zero, and the zero of the calibration.
    pub fn plain(&self) -> (&Inverse, f64) {
        let inverse = self.inverse[usize::from(self.zero_read)].as_ref().expect("it was made");
        (inverse, if self.zero_read { 0.0 } else { self.curve.zero })
    }

    /// Distance for a reading, as [`Answers::find`](super::Answers::find).
    pub fn find(&self, drive: f64, reading: f64, Known { share, same_run }: Known) -> Result<Found, Status> {
        let (tared, y, of_zero) = self.read(reading, share);
        let inverse = self.of(tared);
        let found = inverse.at(drive, same_run).find(y, of_zero)?;
        let mut weights = Weights::default();
        weights.add(1.0, [y, found.slope * found.a], share);
        let longer = self.curve.longer(weights, (found.sigma * found.slope).powi(2), tared, same_run);
        Ok(Found { ends: stretched(found.a, found.ends, longer), ..found })
    }

    pub(super) fn expected(&self, a: f64, drive: f64) -> f64 {
        let (inverse, zero) = self.plain();
        let [near, far] = inverse.reach();
        if !(near..=far).contains(&a) {
            return f64::NAN;
        }
        self.curve.expected(&self.base, a, drive, self.zero_read).signal + zero
    }

    pub(super) fn variance(&self, a: f64, drive: f64, same_run: bool) -> f64 {
        self.plain().0.at(drive, same_run).at(a.ln())[2]
    }
}

fn stretched(a: f64, ends: [f64; 2], longer: f64) -> [f64; 2] {
    ends.map(|end| a + longer * (end - a))
}
