//! `exact`: the configured model with fitted parameters, inverted.

use std::collections::{HashMap, VecDeque};
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use indexmap::IndexMap;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::fit::Fit;
use super::held_out::Side;
use super::model::exact::{Exact, Extent, Opener, Parameter, Values, spec_values};
use super::model::{Found, ModelError};
use super::{Answers, Known, SideRecord, least};
use crate::curve::Curve;
use crate::error::{Error, InputError, SolveError};
use crate::measure::Rig;
use crate::scene::{self, Contact, Drive};
use crate::status::Status;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExactRecord {
    /// RMS error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// Error on distances left out beyond the noise, per drive.
    pub bias_mm: Vec<f64>,
    /// Names of the fitted parameters, in the order of the covariance.
    pub fitted: Vec<String>,
    pub values: IndexMap<String, f64>,
    pub covariance: Vec<Vec<f64>>,
}

impl ExactRecord {
    pub fn calibrated(rig: &Rig, exact: &Exact, held_out_rms_mm: Option<f64>, bias_mm: Vec<f64>) -> Self {
        let kind = rig.setup.drive;
        let spec = spec_values(&rig.setup);
        let known = |p: &Parameter| spec[*p as usize].is_finite();
        let value = |p: Parameter| (p.name(kind).to_owned(), exact.values[p as usize]);
        Self {
            held_out_rms_mm,
            bias_mm,
            fitted: exact.fitted.iter().map(|p| p.name(kind).to_owned()).collect(),
            values: Parameter::ALL.into_iter().filter(known).map(value).collect(),
            covariance: exact.covariance.clone(),
        }
    }

    /// True if each fitted parameter has a known name, and a row and column of the covariance.
    pub fn is_sound(&self) -> bool {
        let m = self.fitted.len();
        let kinds = [Drive::Angle, Drive::Displacement];
        let named = |n: &String| kinds.iter().any(|kind| Parameter::named(n, *kind).is_some());
        self.covariance.len() == m
            && self.covariance.iter().all(|row| row.len() == m && row.iter().all(|x| x.is_finite()))
            && self.fitted.iter().all(named)
    }

    pub(super) fn open(
        &self,
        rig: &Rig,
        record: &SideRecord,
        side: scene::Side,
        open: Opener<'_>,
    ) -> Result<Inverted, Error> {
        let (values, kind) = (self.values(rig), rig.setup.drive);
        let fitted = self.fitted.iter().filter_map(|name| Parameter::named(name, kind)).collect();
        // Room for the offset's uncertainty, and for readings a little beyond the calibrated drives.
        let ahead = 1.5 * values[Parameter::DriveOffset as usize].max(0.0);
        let at = Extent::around(rig, side, record.distances_mm, record.ends(), ahead);
        let exact = Exact::new(rig, values, fitted, self.covariance.clone(), at, open);
        let exact = exact.map_err(|why| unsolved(rig, record, why))?;
        Ok(Inverted { exact, last: Mutex::default() })
    }

    pub fn factor(&self, kind: Drive) -> Option<f64> {
        self.values.get(Parameter::Factor.name(kind)).copied()
    }

    pub(crate) fn values(&self, rig: &Rig) -> Values {
        let mut values = spec_values(&rig.setup);
        for p in Parameter::ALL {
            if let Some(x) = self.values.get(p.name(rig.setup.drive)) {
                values[p as usize] = *x;
            }
        }
        values
    }
}

/// Error of a model that cannot be solved; if hardly any tap has a solution, the values are impossible.
pub fn unsolved(rig: &Rig, record: &SideRecord, why: ModelError) -> Error {
    if !matches!(why, ModelError::Solve(SolveError::TooHard)) {
        return why.into();
    }
    let (setup, t) = (&rig.setup, &rig.design.tuple);
    let contact = match setup.model.contact {
        Contact::Frictionless => "frictionless".to_owned(),
        Contact::Stick => "stick".to_owned(),
        Contact::Coulomb(mu) => format!("coulomb {mu}"),
    };
    let written = format!(
        "D = {}, d = {}, L_a = {}, hub = {}, pole_radius = {}; initial modulus {}, contact {contact}",
        t.D,
        t.d,
        t.L_a,
        setup.hub,
        setup.model.pole_radius,
        setup.model.material.e0(),
    );
    let ([lo, hi], [first, last]) = (record.distances_mm, record.ends());
    let ends = format!("distances of {lo} … {hi} mm and drives of {first} … {last}");
    let error = InputError::new(format!("{why} at {ends}: this whisker has no such taps"));
    let error = error.key("spec.whisker, spec.model").value(written);
    error.allowed("values of the rig that was calibrated; or another estimator (--estimator paper)").into()
}

/// Change of the expected readings of the fitted cells without the distances `gone`, by one Gauss-Newton step of the parameters.
pub fn shifts(side: &Side<'_>, fit: &Fit, gone: &Range<usize>) -> Option<HashMap<usize, f64>> {
    let m = fit.slopes.ncols();
    let (mut n, mut b) = (DMatrix::<f64>::zeros(m, m), DVector::<f64>::zeros(m));
    for (k, _) in fit.cells.iter().enumerate().filter(|(_, cell)| !gone.contains(&side.cells[**cell].i)) {
        let row = fit.slopes.row(k) / fit.deviations[k];
        n += row.transpose() * &row;
        b += row.transpose() * (fit.residuals[k] / fit.deviations[k]);
    }
    let step = least::solve(&n, &b)?.0;
    Some(fit.cells.iter().copied().zip((&fit.slopes * step).iter().copied()).collect())
}

const KEPT: usize = 16;

/// Model with its curves at the last drives: a rig has few.
pub struct Inverted {
    exact: Exact,
    last: Mutex<VecDeque<(f64, Arc<Curve>)>>,
}

impl Inverted {
    fn curve(&self, drive: f64) -> Arc<Curve> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, curve)) = last.iter().find(|(at, _)| *at == drive) {
            return curve.clone();
        }
        let curve = Arc::new(self.exact.at(drive));
        last.truncate(KEPT - 1);
        last.push_front((drive, curve.clone()));
        curve
    }
}

impl Answers for Inverted {
    fn find(&self, drive: f64, reading: f64, _: Known) -> Result<Found, Status> {
        let curve = self.curve(drive);
        let beyond = || reading < self.exact.weakest(&curve);
        self.exact
            .find(&curve, drive, reading)
            .ok_or_else(|| if beyond() { Status::OUTSIDE_CALIBRATION } else { Status::NO_ROOT })
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        let [near, far] = self.exact.reach();
        if (near..=far).contains(&a) { self.exact.expected(a, drive) } else { f64::NAN }
    }

    fn variance(&self, a: f64, drive: f64, _: bool) -> f64 {
        self.exact.variance(a, drive)
    }
}
