//! `table`: interpolation of the data.

use serde::{Deserialize, Serialize};

use super::{
    Answers, Estimator, Fault, Forward, Judged, Known, LeaveOut, Opening, Shape, SideRecord, ascending, known,
    positive,
};
use crate::error::Error;
use crate::estimator::cells::Cell;
use crate::estimator::fit::Fit;
use crate::estimator::held_out::Side as Measured;
use crate::estimator::model::Found;
use crate::estimator::model::table::{Curve, Knot, Table};
use crate::status::Status;

/// Curves of the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableRecord {
    /// Root mean square error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// Error on distances left out beyond what noise explains, per drive.
    pub bias_mm: Vec<f64>,
    /// One per drive.
    pub curves: Vec<CurveRecord>,
}

/// Knots of one drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurveRecord {
    /// The drive.
    pub drive: f64,
    /// Distances.
    pub a_mm: Vec<f64>,
    /// Signal per unit of drive.
    pub signal: Vec<f64>,
    /// Variance of ln signal.
    pub variance: Vec<f64>,
}

impl CurveRecord {
    /// Of a curve.
    pub fn new(drive: f64, curve: &Curve) -> Self {
        let column = |f: fn(&Knot) -> f64| curve.knots().iter().map(f).collect();
        Self { drive, a_mm: column(|k| k.a), signal: column(|k| k.signal), variance: column(|k| k.variance) }
    }

    /// The knots.
    pub fn knots(&self) -> Vec<Knot> {
        let rest = self.signal.iter().zip(&self.variance);
        self.a_mm.iter().zip(rest).map(|(a, (s, v))| Knot { a: *a, signal: *s, variance: *v }).collect()
    }

    fn is_curve(&self) -> bool {
        let n = self.a_mm.len();
        n >= 2
            && n == self.signal.len()
            && n == self.variance.len()
            && positive(&self.a_mm)
            && ascending(&self.a_mm)
            && positive(&self.signal)
            && known(&self.variance)
    }
}

/// Interpolation of the data.
pub struct Interpolated;

/// Interpolation of the data.
pub const TABLE: Interpolated = Interpolated;

/// Curves of the data through the cells that `wanted` keeps; `None` where a drive has fewer than two distances.
fn through(side: &Measured<'_>, wanted: impl Fn(&Cell) -> bool) -> Option<Table> {
    let mut knots: Vec<Vec<Knot>> = vec![Vec::new(); side.drives.len()];
    for c in side.cells.iter().filter(|c| wanted(c)) {
        let variance = side.noise * side.noise * c.share / (c.signal * c.signal);
        knots[c.j].push(Knot { a: c.a, signal: c.signal / c.drive, variance });
    }
    let curves: Option<Vec<Curve>> = knots.iter().map(|k| Curve::new(k)).collect();
    Table::new(side.drives.to_vec(), curves?)
}

impl Estimator for Interpolated {
    fn name(&self) -> &'static str {
        "table"
    }

    fn help(&self) -> &'static str {
        "Interpolation of the data"
    }

    fn preference(&self) -> u8 {
        40
    }

    /// Where a distance is left out, the knots are twice as far apart; the error of the interpolation falls with the square of
    /// their distance or faster.
    fn share_of_bias(&self) -> f64 {
        0.25
    }

    fn extrapolates(&self) -> bool {
        true
    }

    fn leave_out<'a>(&'a self, side: &'a Measured<'a>, _: Option<&'a Fit>) -> LeaveOut<'a> {
        Box::new(move |distance| {
            // The one that is left out may be the last: it is then extrapolated to.
            let table = through(side, |c| c.i != distance)?.reaching(4.0);
            Some(Box::new(move |_, drive, signal| table.find(drive, signal)))
        })
    }

    fn calibrate(&self, side: &Measured<'_>, _: Option<&Fit>, judged: Judged, record: &mut SideRecord) {
        record.table = through(side, |_| true).map(|t| TableRecord {
            held_out_rms_mm: judged.rms_mm,
            bias_mm: judged.bias_mm,
            curves: t.curves().map(|(drive, c)| CurveRecord::new(drive, c)).collect(),
        });
    }

    fn bias_mm<'a>(&self, record: &'a SideRecord) -> Option<&'a [f64]> {
        record.table.as_ref().map(|r| r.bias_mm.as_slice())
    }

    fn check(&self, record: &SideRecord) -> Result<(), Fault> {
        match record.table.iter().flat_map(|t| &t.curves).all(CurveRecord::is_curve) {
            true => Ok(()),
            false => Err(Fault {
                message: "this curve is no curve",
                allowed: "ascending a_mm, signal > 0, variance ≥ 0, two knots or more",
            }),
        }
    }

    fn open(&self, of: &Opening<'_>) -> Result<Option<Box<dyn Answers>>, Error> {
        let Some(r) = &of.record.table else { return Ok(None) };
        let curves: Option<Vec<Curve>> = r.curves.iter().map(|c| Curve::new(&c.knots())).collect();
        let drives = r.curves.iter().map(|c| c.drive).collect();
        let table = curves.and_then(|c| Table::new(drives, c));
        Ok(table.map(|t| -> Box<dyn Answers> { Box::new(t) }))
    }
}

impl Answers for Table {
    fn find(&self, drive: f64, reading: f64, _: Known) -> Result<Found, Status> {
        self.find(drive, reading).ok_or(Status::OUTSIDE_CALIBRATION)
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        self.expected(a, drive)
    }

    fn shape(&self) -> Shape<'_> {
        Shape::Inverted(self)
    }
}

impl Forward for Table {
    fn knots(&self, drive: f64) -> Vec<f64> {
        self.knots(drive)
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        self.expected(a, drive)
    }

    fn variance(&self, a: f64, drive: f64) -> f64 {
        self.variance(a, drive)
    }
}
