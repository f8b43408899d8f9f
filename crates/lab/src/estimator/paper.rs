//! `paper`: the closed form f and one K̄ per drive.

use serde::{Deserialize, Serialize};

use super::{
    Answers, Estimator, Fault, Forward, Judged, Known, LeaveOut, Opening, Shape, SideRecord, known, positive,
};
use crate::design::amount;
use crate::error::Error;
use crate::estimator::cells::Cell;
use crate::estimator::fitted::Fit;
use crate::estimator::held_out::Side as Measured;
use crate::estimator::model::Found;
use crate::estimator::model::paper::{Factors, Paper};
use crate::scene::Theory;
use crate::status::Status;

/// One K per drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct FactorRecord {
    /// Root mean square error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// K̄ per drive.
    pub K: Vec<f64>,
    /// Variance of ln K̄.
    pub K_variance: Vec<f64>,
    /// Error on distances left out beyond what noise explains, per drive.
    pub bias_mm: Vec<f64>,
}

/// The closed form f.
pub struct Closed;

/// The closed form f.
pub const PAPER: Closed = Closed;

impl Closed {
    /// K̄ and its variance per drive from the cells that `wanted` keeps; `None` where a drive has none of them.
    fn factors(&self, side: &Measured<'_>, wanted: impl Fn(&Cell) -> bool) -> Option<Factors> {
        let curve = side.rig.curve(Theory::EulerBernoulli, side.rig.setup.hub);
        let kind = side.rig.setup.drive;
        let spec = side.rig.shared().theory.curve();
        let mut sums = vec![(0.0, 0.0, 0usize); side.drives.len()];
        for c in side.cells.iter().filter(|c| wanted(c)) {
            // Within a level the mean of θ f counts; it is known for the theory of the spec.
            let linear = if *spec == curve { c.linear } else { amount(kind, c.drive) * curve.value(c.a) };
            let sum = &mut sums[c.j];
            sum.0 += linear / c.signal;
            sum.1 += side.noise * side.noise * c.share / (c.signal * c.signal);
            sum.2 += 1;
        }
        if sums.iter().any(|s| s.2 == 0) {
            return None;
        }
        Some(Factors {
            k: sums.iter().map(|s| s.0 / s.2 as f64).collect(),
            variance: sums.iter().map(|s| s.1 / (s.2 * s.2) as f64).collect(),
        })
    }
}

impl Estimator for Closed {
    fn name(&self) -> &'static str {
        "paper"
    }

    fn help(&self) -> &'static str {
        "The closed form f and one K̄ per drive"
    }

    /// With one drive f need only have the right shape, 1/a: K takes up the rest.
    fn needs_whisker(&self, several_drives: bool) -> bool {
        several_drives
    }

    fn leave_out<'a>(&'a self, side: &'a Measured<'a>, _: Option<&'a Fit>) -> LeaveOut<'a> {
        Box::new(move |gone| {
            let factors = self.factors(side, |c| !gone.contains(&c.i))?;
            let paper = Paper::new(side.rig, Theory::EulerBernoulli, side.drives, factors);
            Some(Box::new(move |_, drive, signal| paper.find(drive, signal)))
        })
    }

    fn calibrate(&self, side: &Measured<'_>, _: Option<&Fit>, judged: Judged, record: &mut SideRecord) {
        let Some(Factors { k, variance }) = self.factors(side, |_| true) else { return };
        record.paper = Some(FactorRecord {
            held_out_rms_mm: judged.rms_mm,
            K: k,
            K_variance: variance,
            bias_mm: judged.bias_mm,
        });
    }

    fn bias_mm<'a>(&self, record: &'a SideRecord) -> Option<&'a [f64]> {
        record.paper.as_ref().map(|r| r.bias_mm.as_slice())
    }

    fn check(&self, record: &SideRecord) -> Result<(), Fault> {
        let Some(r) = &record.paper else { return Ok(()) };
        let n = record.drives.len();
        match r.K.len() == n && r.K_variance.len() == n && positive(&r.K) && known(&r.K_variance) {
            true => Ok(()),
            false => Err(Fault {
                message: "one K > 0 and one variance is needed for each drive",
                allowed: "as many as drives",
            }),
        }
    }

    fn open(&self, of: &Opening<'_>) -> Result<Option<Box<dyn Answers>>, Error> {
        let Some(r) = &of.record.paper else { return Ok(None) };
        let factors = Factors { k: r.K.clone(), variance: r.K_variance.clone() };
        Ok(Some(Box::new(Paper::new(of.rig, Theory::EulerBernoulli, &of.record.drives, factors))))
    }
}

impl Answers for Paper {
    fn find(&self, drive: f64, reading: f64, _: Known) -> Result<Found, Status> {
        self.find(drive, reading).ok_or(Status::NO_ROOT)
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        self.expected(a, drive)
    }

    fn shape(&self) -> Shape<'_> {
        Shape::Inverted(self)
    }
}

impl Forward for Paper {
    fn variance(&self, a: f64, drive: f64) -> f64 {
        self.variance(a, drive)
    }
}
