//! What was learned of a side of the whisker, and a learned curve read backwards.

use std::sync::OnceLock;

use vibrissa_learned::base::{Base, Power};
use vibrissa_learned::curve::{Curve, Weights};
use vibrissa_learned::fit::{Fit, From, Task, fit};
use vibrissa_learned::invert::{Answer, Inverse, Nothing};
use vibrissa_learned::joint::{Joint, Object, Told};
use vibrissa_learned::rows::Row;

use super::model::Found;
use super::model::exact::{Exact, Extent, HARD};
use super::{Answers, Known, Shape, SideRecord};
use crate::status::Status;

/// What a learned curve corrects.
pub(super) enum Whisker {
    Power(Power),
    Known(Box<Exact>, f64),
}

impl Whisker {
    /// Hands it to `then`.
    fn base<T>(&self, then: impl FnOnce(&Base<'_>) -> T) -> T {
        match self {
            Self::Power(power) => then(&Base::Power(*power)),
            Self::Known(exact, offset) => {
                let whisker = |a: f64, u: f64| exact.expected(a, u);
                then(&Base::Known(&whisker, *offset))
            }
        }
    }

    /// Distances at which it and its slope are known, mm.
    fn reach(&self) -> [f64; 2] {
        match self {
            Self::Power(_) => [0.0, f64::INFINITY],
            Self::Known(exact, _) => {
                let [near, far] = exact.reach();
                [near * 1.002, far * 0.998]
            }
        }
    }
}

/// Where the whisker of `rig` is solved for what was learned of it.
pub(super) fn extent(rig: &crate::measure::Rig, record: &SideRecord) -> Extent {
    let at = Extent::around(rig, record.gauge(), record.distances_mm, record.ends(), rig.before);
    Extent { hard: HARD, ..at }
}

/// What was learned of a side, and from what.
#[derive(Clone)]
pub struct Learnt {
    /// Rows, taps and zero readings; signals have the sign of the side.
    pub rows: Vec<Row>,
    /// Of each row the place of its tap.
    pub taps: Vec<Option<usize>>,
    /// Of each row its place in the file.
    pub lines: Vec<usize>,
    /// The sign of the side.
    pub sign: f64,
    /// Rows that were used.
    pub places: Vec<usize>,
    /// The fit.
    pub fit: std::sync::Arc<Fit>,
    /// The whisker, where it is known.
    pub exact: Option<Exact>,
    /// Step of the readings.
    pub step: f64,
    /// Whether a drift was fitted.
    pub drift: bool,
    /// Runs.
    pub runs: usize,
    /// Whether zeros were read.
    pub zero_read: bool,
    /// Whether the zero is known.
    pub zero_known: bool,
    /// Its standard error, where taps of both sides told it; else infinite.
    pub zero_error: f64,
    /// What was subtracted from the signals of the taps since, of the sign of the side.
    pub subtracted: f64,
}

impl std::fmt::Debug for Learnt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {} rows", self.places.len(), self.rows.len())
    }
}

impl Learnt {
    /// Hands what is fitted to `then`.
    pub fn task<T>(&self, then: impl FnOnce(&Task<'_>) -> T) -> T {
        let (rows, step, zero, drift) = (self.rows.as_slice(), self.step, self.zero_error, self.drift);
        match &self.exact {
            Some(exact) => {
                let whisker = |a: f64, u: f64| exact.expected(a, u);
                then(&Task { rows, known: Some(&whisker), step, zero, drift })
            }
            None => then(&Task { rows, known: None, step, zero, drift }),
        }
    }

    /// Standard deviation of a usual reading.
    pub fn noise(&self) -> f64 {
        let curve = &self.fit.curve;
        curve.unit * (curve.spread.floor + curve.spread.relative).sqrt()
    }

    /// What answers readings by these `drives` if only the rows at `places` are known; the learned numbers stay.
    pub fn without(&self, places: &[usize], drives: &[f64]) -> Option<Inverted> {
        let fit = self.task(|task| fit(task, places, From::Held(&self.fit), true)).ok()?;
        Some(self.inverted(&fit, drives))
    }

    /// What is expected of a tap at a (mm) by the drive u, above its zero.
    pub fn expected(&self, a: f64, u: f64) -> vibrissa_learned::curve::Expected {
        self.whisker(&self.fit).base(|base| self.fit.curve.expected(base, a, u, true))
    }

    fn whisker(&self, fit: &Fit) -> Whisker {
        match (&self.exact, fit.power) {
            (_, Some(fitted)) => Whisker::Power(fitted.power),
            (Some(exact), None) => Whisker::Known(Box::new(exact.clone()), fit.offset),
            (None, None) => unreachable!("a fit has a base"),
        }
    }

    /// What answers readings by these drives as `fit` says, of the same whisker.
    fn inverted(&self, fit: &Fit, drives: &[f64]) -> Inverted {
        let curve = Curve { zero: fit.curve.zero - self.subtracted, ..fit.curve.clone() };
        Inverted::new(curve, self.whisker(fit), [self.zero_read, self.zero_known], Some(drives))
    }
}

/// A learned curve, read backwards.
pub struct Inverted {
    curve: Curve,
    whisker: Whisker,
    /// For readings above the zero of the calibration, and for such above their own.
    inverse: [Option<Inverse>; 2],
    /// Whether zeros were read with the taps.
    zero_read: bool,
    /// What answers several taps, and strokes, made where it is asked for.
    joints: [[OnceLock<Joint>; 2]; 2],
}

impl Inverted {
    /// Of any drive, or of these alone.
    pub(super) fn new(
        curve: Curve,
        whisker: Whisker,
        [zero_read, zero_known]: [bool; 2],
        drives: Option<&[f64]>,
    ) -> Self {
        let reach = whisker.reach();
        let of = |base: &Base<'_>| {
            let needed = [!zero_read, zero_read || zero_known].into_iter().zip([false, true]);
            let new = |tared: bool| match drives {
                Some(drives) => Inverse::of_drives(&curve, base, (tared, reach), drives),
                None => Inverse::new(&curve, base, tared, reach),
            };
            let all = needed.map(|(needed, tared)| needed.then(|| new(tared)));
            all.collect::<Vec<_>>().try_into().expect("there are two")
        };
        Self { inverse: whisker.base(of), curve, whisker, zero_read, joints: Default::default() }
    }

    /// Whether a reading above a zero of this `share` is told above its own zero, the signal that counts, and the variance that its zero brings.
    pub fn read(&self, reading: f64, share: f64) -> (bool, f64, f64) {
        let tared = self.inverse[1].is_some() && (self.zero_read || share > 0.0);
        let of_zero = share * self.curve.spread.floor * self.curve.unit.powi(2);
        (tared, if tared || self.zero_read { reading } else { reading - self.curve.zero }, of_zero)
    }

    fn of(&self, tared: bool) -> &Inverse {
        let made = self.inverse[usize::from(tared)].as_ref();
        made.unwrap_or_else(|| self.plain().0)
    }

    /// What answers several taps of one object.
    pub fn joint(&self, tared: bool) -> &Joint {
        let new = |base: &Base<'_>| Joint::new(&self.curve, base, tared, self.of(tared));
        self.joints[0][usize::from(tared)].get_or_init(|| self.whisker.base(new))
    }

    /// What answers strokes.
    pub fn joint_of_strokes(&self, tared: bool) -> &Joint {
        let new = |base: &Base<'_>| Joint::of_strokes(&self.curve, base, tared, self.of(tared));
        self.joints[1][usize::from(tared)].get_or_init(|| self.whisker.base(new))
    }

    /// The interval that holds the distance of an object with 95 %, mm.
    pub fn ends(&self, object: &Object, told: &Told, tared: bool, same_run: bool) -> [f64; 2] {
        let joint = self.joint(tared);
        let variance = (told.sigma / (told.a - object.frame())).powi(2);
        let longer = object.weights(joint, told.a, same_run);
        let longer = longer.map_or(1.0, |weights| self.curve.longer(weights, variance, tared, same_run));
        stretched(told.a, told.ends, longer)
    }

    /// What answers readings that have no zero beside that of the calibration, and that zero.
    pub fn plain(&self) -> (&Inverse, f64) {
        let inverse = self.inverse[usize::from(self.zero_read)].as_ref().expect("it was made");
        (inverse, if self.zero_read { 0.0 } else { self.curve.zero })
    }
}

/// These ends `longer` times as far from the distance `a`.
fn stretched(a: f64, ends: [f64; 2], longer: f64) -> [f64; 2] {
    ends.map(|end| a + longer * (end - a))
}

/// Why there is no distance, in the words of a table.
pub fn why(nothing: Nothing) -> Status {
    match nothing {
        Nothing::Weak => Status::OUTSIDE_CALIBRATION,
        Nothing::Strong => Status::NO_ROOT,
    }
}

impl Answers for Inverted {
    fn find(&self, drive: f64, reading: f64, Known { share, same_run }: Known) -> Result<Found, Status> {
        let (tared, y, of_zero) = self.read(reading, share);
        let inverse = self.of(tared);
        let found = inverse.at(drive, same_run).find(y, of_zero).map_err(why)?;
        let Answer { a, near, slope, variance, sigma, ends, wide } = found;
        let mut weights = Weights::default();
        weights.add(1.0, [y, slope * a], share);
        let longer = self.curve.longer(weights, (sigma * slope).powi(2), tared, same_run);
        Ok(Found { a, near, slope, variance, sigma, ends: stretched(a, ends, longer), wide })
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        let (inverse, zero) = self.plain();
        let [near, far] = inverse.reach();
        if !(near..=far).contains(&a) {
            return f64::NAN;
        }
        self.whisker.base(|base| self.curve.expected(base, a, drive, self.zero_read)).signal + zero
    }

    fn shape(&self) -> Shape<'_> {
        Shape::Learned(self)
    }
}
