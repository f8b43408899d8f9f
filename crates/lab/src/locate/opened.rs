//! One side of a calibrated whisker.

use crate::error::Error;
use crate::estimate::WIDENING;
use crate::estimator::learned::LearnedCurve;
use crate::estimator::{Answers, Estimator, Opener, SAME, SideRecord, between};
use crate::measure::Rig;
use crate::scene::Side;
use crate::status::Status;

/// A distance beyond the calibrated ones by so many of its standard deviations is said to be.
pub(crate) const BEYOND: f64 = 3.0;

pub(crate) struct Opened {
    pub(crate) sign: f64,
    /// Side of the whisker on which a gauge would read this sign.
    pub(crate) gauge: Side,
    pub(crate) distances: [f64; 2],
    /// Distances within which a second one is ambiguous.
    pub(crate) interest: [f64; 2],
    /// Calibrated drives, and beyond the means of the first and the last how far jitter led.
    pub(crate) drives: Vec<f64>,
    /// The one calibrated drive, where there are no others.
    pub(super) only: Option<f64>,
    pub(crate) answers: Box<dyn Answers>,
    /// Per drive, mm.
    pub(crate) bias: Vec<f64>,
    /// Reading per strain, where it is known.
    pub(crate) factor: f64,
    /// |signal| at which the sensor stands still.
    pub(crate) end_stop: f64,
}

impl Opened {
    /// Least and largest calibrated drive.
    pub(crate) fn ends(&self) -> [f64; 2] {
        [self.drives[0], self.drives[self.drives.len() - 1]]
    }

    pub(crate) fn admits(&self, drive: f64) -> bool {
        let [least, largest] = self.ends();
        drive >= least * (1.0 - SAME) && drive <= largest * (1.0 + SAME)
    }

    /// Bias of distances on held-out ones by this drive, mm.
    pub(crate) fn bias_at(&self, drive: f64) -> f64 {
        between(&self.drives, &self.bias, drive)
    }

    pub(crate) fn learned(&self) -> Option<&LearnedCurve> {
        self.answers.learned()
    }

    /// Words of warning of a distance, mm, with `near` the next one of the same reading.
    pub(crate) fn doubts(&self, a: f64, near: Option<f64>, sigma: f64) -> Status {
        let mut status = Status::OK;
        let [lo, hi] = self.interest;
        if near.is_some_and(|a| a >= lo * (1.0 - WIDENING) && a <= hi * (1.0 + WIDENING)) {
            status |= Status::AMBIGUOUS;
        }
        // A distance half the range away is outside, however uncertain.
        let [first, last] = self.distances;
        let slack = (BEYOND * sigma).min(0.5 * (last - first)) + WIDENING * last;
        if a < first - slack || a > last + slack {
            status |= Status::OUTSIDE_CALIBRATION;
        }
        status
    }

    /// A side of the gauge of `rig`, answered by `estimator`; `None` where the `record` does not hold it.
    pub(super) fn new(
        estimator: Estimator,
        rig: &Rig,
        (record, side): (&SideRecord, Side),
        open: Opener<'_>,
    ) -> Result<Option<Self>, Error> {
        let answers = estimator.open(rig, record, side, open)?;
        let (Some(answers), Some(bias)) = (answers, estimator.bias_mm(record)) else {
            return Ok(None);
        };
        let (mut drives, mut bias) = (record.drives.clone(), bias.to_vec());
        let [first, last] = record.ends();
        if first < drives[0] {
            drives.insert(0, first);
            bias.insert(0, bias[0]);
        }
        if last > drives[drives.len() - 1] {
            drives.push(last);
            bias.push(bias[bias.len() - 1]);
        }
        let calibrated = side == record.gauge();
        let sign = f64::from(record.sign);
        Ok(Some(Self {
            sign: if calibrated { sign } else { -sign },
            gauge: side,
            distances: record.distances_mm,
            interest: rig.setup.estimate.range.unwrap_or(record.distances_mm),
            drives,
            only: Some(record.drives[0]).filter(|_| record.drives.len() == 1),
            answers,
            bias,
            factor: record.exact.as_ref().and_then(|r| r.factor(rig.setup.drive)).unwrap_or(f64::NAN),
            end_stop: record.end_stop.filter(|_| calibrated).unwrap_or(f64::INFINITY),
        }))
    }
}
