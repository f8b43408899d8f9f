//! What answers readings.

use super::{Calibration, Opened, pair::Twofold};
use crate::error::{Error, InputError, Result};
use crate::estimator::{Estimator, Found, Known, Opener, SAME};
use crate::measure::{TaredBy, Unit, counts::wrapped, group::rounding};
use crate::scene::{BackendChoice, Model, Precision, RunOptions, Side, Signal};
use crate::{backend::Choice, evaluate::Method, status::Status};
use vibrissa_learned::curve::OF_95;

/// Step of difference quotients of a distance, relative.
const QUOTIENT: f64 = 1e-4;

/// A distance, what it is worth, and why not.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Located {
    /// Contact distance, mm; NaN where there is none.
    pub distance: f64,
    /// One standard deviation, mm: noise of one reading, noise of the calibration, bias on held-out distances. NaN without a distance.
    pub sigma: f64,
    /// The interval that holds it with 95 %, mm.
    pub interval: [f64; 2],
    pub status: Status,
}

impl Located {
    pub const fn nothing(status: Status) -> Self {
        Self { distance: f64::NAN, sigma: f64::NAN, interval: [f64::NAN; 2], status }
    }

    /// A distance with a normal error.
    pub fn normal(distance: f64, sigma: f64, status: Status) -> Self {
        let interval = [-OF_95, OF_95].map(|z| distance + z * sigma);
        Self { distance, sigma, interval, status }
    }
}

/// Solves models at full precision unless `options` say otherwise: a calibration needs few taps, but good ones.
pub fn opener(options: &RunOptions) -> impl Fn(&Model) -> Result<Method> + use<> {
    let mut options = options.clone();
    if options.backend.is_none() && options.precision.is_none() && options.adapter.is_none() {
        options.backend = Some(BackendChoice::Cpu);
        options.precision = Some(Precision::F64);
        options.tolerance = options.tolerance.or(Some(1e-8));
    }
    move |model| Choice::new(&options)?.open(model)
}

pub(crate) struct SideTap {
    /// Its place among the sides.
    pub(crate) side: usize,
    /// The drive from its origin.
    pub(crate) drive: f64,
    /// |signal|.
    pub(crate) signal: f64,
    pub(crate) status: Status,
}

/// Answers readings of one calibrated whisker.
pub struct Locator {
    /// The calibration that it was opened from; `estimator` and `sides` below replace those of the calibration.
    calibration: Calibration,
    pub unit: Unit,
    pub estimator: Estimator,
    /// True if readings are of a run of the calibration: its zero and gain are known. They are of another one unless that is said.
    pub same_run: bool,
    /// Variance of the zero of the calibration: it moves all of it.
    pub(crate) of_zero: f64,
    pub(crate) sides: Vec<Opened>,
    pub(crate) twofold: Option<Twofold>,
}

impl std::ops::Deref for Locator {
    type Target = Calibration;

    fn deref(&self) -> &Calibration {
        &self.calibration
    }
}

impl Locator {
    /// From a calibration; `label` names its file, `asked` overrules the winner, `open` solves models.
    /// Errors: an estimator that the calibration does not hold; a backend that fails.
    pub fn new(c: &Calibration, label: &str, asked: Option<Estimator>, open: Opener<'_>) -> Result<Self> {
        let rig = &c.rig;
        let unit =
            Unit::of_column(&c.signal).ok_or_else(|| InputError::new("unknown signal").key("signal"))?;
        let estimator = asked.or(Estimator::named(&c.estimator)).unwrap_or(Estimator::Paper);
        let at = |e: Error| match e {
            Error::Input(e) if e.file.is_none() => e.at(label, None).into(),
            other => other,
        };
        let mut sides = Vec::new();
        for record in &c.sides {
            let side = Opened::new(estimator, rig, (record, record.gauge()), open).map_err(at)?;
            sides.push(side.ok_or_else(|| {
                let held =
                    Estimator::ALL.into_iter().filter(|e| e.bias_mm(record).is_some()).map(|e| e.word());
                let error = InputError::new("this calibration does not hold this estimator").at(label, None);
                let error = error.key("--estimator").value(estimator.word());
                error.allowed(held.collect::<Vec<_>>().join(", "))
            })?);
        }
        // The side that was not calibrated is answered by the model, which knows both.
        if let [record] = c.sides.as_slice()
            && asked.is_none_or(|asked| asked == Estimator::Exact)
        {
            let other = if record.gauge() == Side::Far { Side::Contact } else { Side::Far };
            sides.extend(Opened::new(Estimator::Exact, rig, (record, other), open).map_err(at)?);
        }
        let twofold = Twofold::new(c, estimator, open).map_err(at)?;
        let of_zero = match c.zero.from {
            TaredBy::Fitted => c.zero.error * c.zero.error,
            TaredBy::Rows | TaredBy::Plateau if c.data.zeros > 0 => c.noise * c.noise / c.data.zeros as f64,
            _ => 0.0,
        };
        Ok(Self { calibration: c.clone(), unit, estimator, same_run: false, of_zero, sides, twofold })
    }

    /// The only calibrated drive, if there is one: it need not be said with a reading.
    pub fn only_drive(&self) -> Option<f64> {
        let first = self.sides.first()?.only?;
        self.sides.iter().all(|s| s.only == Some(first)).then_some(first + self.drive_origin)
    }

    pub(crate) fn side_of(&self, sign: f64) -> Option<&Opened> {
        self.sides.iter().find(|side| side.sign == sign)
    }

    /// The largest calibrated drive of any side, counted from the origin of the drive; 0 where none is positive.
    pub(super) fn largest_drive(&self) -> f64 {
        self.sides.iter().map(|side| side.ends()[1]).fold(0.0, f64::max)
    }

    /// True if a reading of this drive is one of the zero, but for rounding.
    pub fn rests(&self, drive: f64) -> bool {
        let largest = self.drive_origin.abs().max(self.largest_drive());
        let known = [Some(0.0), self.zero.until];
        let same = |x: &f64| (drive - x).abs() <= rounding(largest);
        let drive = known.into_iter().flatten().find(same).unwrap_or(drive);
        let contact = self.drive_origin != 0.0 && drive > self.drive_origin;
        !contact && self.zero.rests(drive)
    }

    /// A zero reading where `zero` is another one: counts that begin anew are joined.
    pub(crate) fn beside(&self, zero: f64, value: f64) -> f64 {
        if self.zero.wraps { zero + wrapped(value - zero, 0.0) } else { value }
    }

    /// The answer to a tap in the middle of the calibration.
    pub(crate) fn size(&self) -> f64 {
        let of = |s: &Opened| {
            let [first, last] = s.distances;
            s.answers.expected((first * last).sqrt(), s.drives[s.drives.len() / 2])
        };
        self.sides.first().map_or(f64::NAN, of)
    }

    /// Distance of a tap by `drive` (degrees or mm) with this tared signal (strain, or the unit of the reading).
    pub fn locate(&self, drive: f64, signal: f64) -> Located {
        self.locate_above(drive, signal, 0.0, 0.0)
    }

    /// As [`Self::locate`], of a signal above `zero`, both as [`Unit::strain`] gives them; `share`: variance of the zero over that of one reading.
    pub fn locate_above(&self, drive: f64, signal: f64, zero: f64, share: f64) -> Located {
        let signal = self.unit.above(signal, zero, self.rig.setup.gauge.factor);
        let found = || -> Result<Located, Status> {
            let SideTap { side, drive, signal, status } = self.asked(drive, signal)?;
            let (side, known) = (&self.sides[side], Known { share, same_run: self.same_run });
            let (found, sigma) = self.on_side(side, drive, signal, known).map_err(|why| status | why)?;
            let status = status | side.doubts(found.a, found.near, sigma);
            let normal = Located::normal(found.a, sigma, status);
            let told = found.ends[0].is_finite();
            Ok(Located { interval: if told { found.ends } else { normal.interval }, ..normal })
        };
        found().unwrap_or_else(Located::nothing)
    }

    /// What `side` makes of a tap by this drive, from its origin, with this |signal|; with the standard deviation of the distance, mm.
    pub(crate) fn on_side(
        &self,
        side: &Opened,
        drive: f64,
        signal: f64,
        known: Known,
    ) -> Result<(Found, f64), Status> {
        let found = side.answers.find(drive, signal, known)?;
        let bias = side.bias_at(drive);
        let of_reading = (self.noise * self.noise * (1.0 + known.share) + self.of_zero + found.variance)
            / (found.slope * found.slope);
        let sigma = if found.sigma.is_finite() { found.sigma } else { (of_reading + bias * bias).sqrt() };
        if sigma.is_finite() && found.a.is_finite() { Ok((found, sigma)) } else { Err(Status::NO_ROOT) }
    }

    /// What is asked by a tap of this drive, as it is recorded, with this tared signal.
    pub(crate) fn asked(&self, drive: f64, signal: f64) -> Result<SideTap, Status> {
        let signal = self.as_calibrated(drive, signal).1;
        let drive = self.beyond_origin(drive);
        if !drive.is_finite() || !signal.is_finite() {
            return Err(Status::BAD_INPUT);
        }
        if signal == 0.0 {
            return Err(Status::NO_STRAIN);
        }
        let status = self.limit_of(signal);
        let side = self.sides.iter().position(|s| s.sign == signal.signum());
        let side = side.ok_or(status | Status::OUTSIDE_CALIBRATION)?;
        let known = &self.sides[side];
        if !known.admits(drive) {
            return Err(status | Status::OUTSIDE_CALIBRATION);
        }
        if signal.abs() >= known.end_stop * (1.0 - SAME) {
            return Err(status | Status::STRAIN_LIMIT);
        }
        Ok(SideTap { side, drive, signal: signal.abs(), status })
    }

    /// A drive from its origin; where both sides are calibrated, its size.
    pub(crate) fn beyond_origin(&self, drive: f64) -> f64 {
        let drive = drive - self.drive_origin;
        if self.drive_origin == 0.0 && self.sides.len() > 1 { drive.abs() } else { drive }
    }

    /// A drive from its origin, and a tared signal of a counter that did not begin anew.
    pub(crate) fn as_calibrated(&self, drive: f64, signal: f64) -> (f64, f64) {
        let lean = if let [one] = self.sides.as_slice() { one.sign } else { 0.0 };
        (drive - self.drive_origin, if self.zero.wraps { wrapped(signal, lean) } else { signal })
    }

    /// Signal that the estimator expects of a tap at a (mm) by `drive`, on the side of `sign`; NaN where it expects nothing.
    pub fn expected(&self, a: f64, drive: f64, sign: f64) -> f64 {
        let drive = self.beyond_origin(drive);
        let Some(side) = self.side_of(sign) else { return f64::NAN };
        if !side.admits(drive) || !a.is_finite() {
            return f64::NAN;
        }
        sign * side.answers.expected(a, drive)
    }

    /// Variance of what is expected there, beyond the noise of one reading; NaN where nothing is known of it.
    pub(crate) fn left(&self, a: f64, drive: f64, sign: f64) -> f64 {
        let drive = self.beyond_origin(drive);
        let Some(side) = self.side_of(sign) else { return f64::NAN };
        let expected = |a: f64| side.answers.expected(a, drive);
        let slope = (expected(a * (1.0 + QUOTIENT)) - expected(a * (1.0 - QUOTIENT))) / (2.0 * QUOTIENT * a);
        let variance = side.answers.variance(a, drive, self.same_run);
        if side.learned().is_some() {
            return variance;
        }
        variance + (side.bias_at(drive) * slope).powi(2) + self.of_zero
    }

    /// True if the strain of a tared signal is beyond the limit.
    pub(crate) fn limit_of(&self, signal: f64) -> Status {
        if self.rig.setup.signal != Signal::Strain {
            return Status::OK;
        }
        let factor = self.side_of(signal.signum()).map_or(f64::NAN, |side| side.factor);
        let strain = if self.unit.is_absolute() { signal } else { signal / factor };
        if strain.abs() > self.rig.strain_limit() { Status::STRAIN_LIMIT } else { Status::OK }
    }
}
