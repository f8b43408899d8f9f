//! `curve`: a smooth, monotone fit of distance over signal and drive, from the data alone.

use serde::{Deserialize, Serialize};
use std::ops::Range;

use super::{Answers, Estimator, Fault, Judged, Known, LeaveOut, Opening, Shape, SideRecord, positive};
use crate::error::Error;
use crate::estimator::cells::Cell;
use crate::estimator::fitted::Fit;
use crate::estimator::held_out::Side as Measured;
use crate::estimator::model::Found;
use crate::estimator::model::polynomial::{Point, Polynomial};
use crate::status::Status;

/// Shares of the last step between positions that are answered beyond them: by a calibration, and where a position is left out that may
/// be the last.
const BEYOND: [f64; 2] = [0.5, 4.0];

/// A fitted curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SmoothRecord {
    /// Root mean square error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// Error on distances left out beyond what noise explains, per drive.
    pub bias_mm: Vec<f64>,
    /// The curve.
    pub fit: Polynomial,
}

/// A smooth curve through the data.
pub struct Smooth;

/// A smooth curve through the data.
pub const CURVE: Smooth = Smooth;

/// Taps up to which each counts with its own labels; of more, cells do with their means.
const EACH: usize = 1000;

/// The used taps of `side`, but those of the distances of the numbers `without`.
fn points(side: &Measured<'_>, without: Option<&Range<usize>>) -> Vec<Point> {
    let kept = || side.cells.iter().filter(|c| without.is_none_or(|gone| !gone.contains(&c.i)));
    let point = |position, a, drive, signal, n| Point { a, drive, signal, position, n };
    if kept().map(|c| c.taps.len()).sum::<usize>() > EACH {
        return kept().map(|c| point(c.i, c.a, c.drive, c.signal, c.n())).collect();
    }
    let each = |c| move |k: &usize| (c, &side.taps[*k]);
    let taps = kept().flat_map(|c: &Cell| c.taps.iter().map(each(c.i)));
    taps.map(|(i, t)| point(i, t.a, t.drive, t.signal.abs(), 1.0)).collect()
}

impl Estimator for Smooth {
    fn name(&self) -> &'static str {
        "curve"
    }

    fn help(&self) -> &'static str {
        "A smooth monotone fit of the data, no theory"
    }

    fn extrapolates(&self) -> bool {
        true
    }

    /// The form is that of all positions: what is judged is what will be used.
    fn leave_out<'a>(&'a self, side: &'a Measured<'a>, _: Option<&'a Fit>) -> LeaveOut<'a> {
        let form = Polynomial::choose(&points(side, None));
        Box::new(move |gone| {
            let curve = Polynomial::through(&points(side, Some(gone)), form?, BEYOND[1])?;
            Some(Box::new(move |_, drive, signal| curve.find(drive, signal)))
        })
    }

    fn calibrate(&self, side: &Measured<'_>, _: Option<&Fit>, judged: Judged, record: &mut SideRecord) {
        let all = points(side, None);
        let fit = Polynomial::choose(&all).and_then(|form| Polynomial::through(&all, form, BEYOND[0]));
        record.curve =
            fit.map(|fit| SmoothRecord { held_out_rms_mm: judged.rms_mm, bias_mm: judged.bias_mm, fit });
    }

    fn bias_mm<'a>(&self, record: &'a SideRecord) -> Option<&'a [f64]> {
        record.curve.as_ref().map(|r| r.bias_mm.as_slice())
    }

    fn check(&self, record: &SideRecord) -> Result<(), Fault> {
        let Some(r) = &record.curve else { return Ok(()) };
        let f = &r.fit;
        let n = f.form.terms_in_all();
        let square = f.covariance.len() == n && f.covariance.iter().all(|row| row.len() == n);
        let finite = f.coefficients.iter().chain(f.covariance.iter().flatten()).all(|x| x.is_finite());
        let scaled = f.scale.iter().all(|s| s[0].is_finite() && s[1] > 0.0 && s[1].is_finite());
        let ends = f.reach[0] >= 0.0 && positive(&f.reach[1..]) && f.reach[0] < f.reach[1];
        match f.form.degree <= 8
            && f.coefficients.len() == n
            && square
            && finite
            && scaled
            && ends
            && f.sign.abs() == 1.0
        {
            true => Ok(()),
            false => Err(Fault {
                message: "this polynomial does not belong together",
                allowed: "one coefficient for each term and their covariance, half widths > 0, a reach that ascends",
            }),
        }
    }

    fn open(&self, of: &Opening<'_>) -> Result<Option<Box<dyn Answers>>, Error> {
        Ok(of.record.curve.as_ref().map(|r| -> Box<dyn Answers> { Box::new(r.fit.clone()) }))
    }
}

impl Answers for Polynomial {
    fn find(&self, drive: f64, reading: f64, _: Known) -> Result<Found, Status> {
        self.find(drive, reading).ok_or(Status::OUTSIDE_CALIBRATION)
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        self.expected(a, drive)
    }

    fn shape(&self) -> Shape<'_> {
        Shape::Direct(self)
    }
}
