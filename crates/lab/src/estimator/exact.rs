//! `exact`: the configured model with fitted parameters, inverted for a.
//! reading = s · |ε|(a + a₀, θ + θ₀; r₀, ν, μ, C01/C10), plus z₀ while that is fitted. Strain does not depend on E.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use super::parameter::{Parameter, Values, spec_values};
use super::{Answers, Found, Known, ModelError, SideRecord, surface::Surface};
use crate::error::{Error, InputError, SolveError};
use crate::scene::{Contact, Drive, Model, Side};
use crate::{curve::Curve, evaluate::Method, measure::Rig, status::Status};

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
        let values = Parameter::ALL.into_iter().filter(known).map(value).collect();
        let fitted = exact.fitted.iter().map(|p| p.name(kind).to_owned()).collect();
        Self { held_out_rms_mm, bias_mm, fitted, values, covariance: exact.covariance.clone() }
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

    pub(super) fn open(&self, of: Solver<'_>, record: &SideRecord, side: Side) -> Result<Inverted, Error> {
        let rig = of.0;
        let (values, kind) = (self.values(rig), rig.setup.drive);
        let fitted = self.fitted.iter().filter_map(|name| Parameter::named(name, kind)).collect();
        // Room for the offset's uncertainty, and for readings a little beyond the calibrated drives.
        let ahead = 1.5 * values[Parameter::DriveOffset as usize].max(0.0);
        let at = Extent::around(of, side, record.ranges(), ahead);
        let exact = Exact::new(values, fitted, at).map_err(|why| unsolved(rig, record, why))?;
        let exact = Exact { covariance: self.covariance.clone(), ..exact };
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
    let (hub, pole, modulus) = (setup.hub, setup.model.pole_radius, setup.model.material.e0());
    let written = format!(
        "D = {}, d = {}, L_a = {}, hub = {hub}, pole_radius = {pole}; initial modulus {modulus}, contact {contact}",
        t.D, t.d, t.L_a
    );
    let ([lo, hi], [first, last]) = (record.distances_mm, record.ends());
    let ends = format!("distances of {lo} … {hi} mm and drives of {first} … {last}");
    let error = InputError::new(format!("{why} at {ends}: this whisker has no such taps"));
    let error = error.key("spec.whisker, spec.model").value(written);
    error.allowed("values of the rig that was calibrated; or another estimator (--estimator paper)").into()
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
        // A reading smaller than all beyond the peak is beyond the range.
        let weakest = || self.exact.values[0] * curve.weakest(self.exact.surface.reach[1]);
        let why = || if reading < weakest() { Status::OUTSIDE_CALIBRATION } else { Status::NO_ROOT };
        self.exact.find(&curve, drive, reading).ok_or_else(why)
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        let [near, far] = self.exact.reach();
        if (near..=far).contains(&a) { self.exact.expected(a, drive) } else { f64::NAN }
    }

    fn variance(&self, a: f64, drive: f64, _: bool) -> f64 {
        self.exact.variance(a, drive)
    }
}

pub type Opener<'a> = &'a dyn Fn(&Model) -> Result<Method, Error>;
/// A rig, and what opens the backend for its model.
pub type Solver<'a> = (&'a Rig, Opener<'a>);

/// Limits that allow a surface within seconds: taps left to the reference, taps without solution.
const HARD: [usize; 2] = [48, 1024];

/// A rig, its backend, and the taps over which its model is solved.
#[derive(Clone, Copy)]
pub struct Extent<'a> {
    pub rig: &'a Rig,
    pub open: Opener<'a>,
    pub side: Side,
    pub reach: [f64; 2],
    /// Range of drives, degrees or mm, with offsets.
    pub drives: [f64; 2],
    /// Maximum of taps left to the reference, and of taps without solution: both are slow.
    pub hard: [usize; 2],
}

impl<'a> Extent<'a> {
    /// Domain around the `ends` of calibrated distances and drives: a little beyond the tip for noise; several drives with room for an offset, or for `ahead`.
    pub fn around((rig, open): Solver<'a>, side: Side, ends: [[f64; 2]; 2], ahead: f64) -> Self {
        let [[lo, hi], drives] = ends;
        let margin = 0.15 * (hi - lo) + 0.02 * hi;
        let (length, tau) = (rig.design.tuple.L_a, rig.shared().taper.tau);
        // Taps next to a real tip slip off.
        let room = if rig.setup.built.is_some() {
            0.97 * length
        } else if tau > 0.0 {
            length + 0.4 * (1.0 / tau - length).max(0.0)
        } else {
            f64::INFINITY
        };
        let reach = [lo - margin, (hi + margin).max(1.1 * length).min(room.max(hi))];
        let [first, last] = drives;
        let wide = [0.02 * first, last + first.max(0.1 * last).max(ahead)];
        let drives = if first < last || ahead > 0.0 { wide } else { drives };
        Self { rig, open, side, reach, drives, hard: HARD }
    }
}

/// The model with fitted parameters, solved over the range of interest.
#[derive(Debug, Clone)]
pub struct Exact {
    pub values: Values,
    pub fitted: Vec<Parameter>,
    pub covariance: Vec<Vec<f64>>,
    pub(crate) surface: Surface,
    /// For each fitted physical parameter, surfaces on both sides of its value, and their distance.
    pub(in crate::estimator) sides: Vec<Option<(Surface, Surface, f64)>>,
}

impl Exact {
    /// Model without a covariance.
    pub fn new(values: Values, fitted: Vec<Parameter>, at: Extent<'_>) -> Result<Self, ModelError> {
        let (surface, covariance) = (Surface::build(&values, at)?, Vec::new());
        let mut exact = Self { values, fitted, covariance, surface, sides: Vec::new() };
        exact.look_beside(at)?;
        Ok(exact)
    }

    /// Model with other values; without neighbouring surfaces if a physical parameter changed.
    pub fn with(&self, values: Values, at: Extent<'_>) -> Result<Self, ModelError> {
        let same = |p: &Parameter| values[*p as usize].to_bits() == self.values[*p as usize].to_bits();
        if Parameter::ALL.iter().filter(|p| p.is_physical()).all(same) {
            return Ok(Self { values, ..self.clone() });
        }
        Ok(Self { values, surface: Surface::build(&values, at)?, sides: Vec::new(), ..self.clone() })
    }

    /// Solves the neighbouring whiskers for [`Self::gradient`].
    pub fn look_beside(&mut self, at: Extent<'_>) -> Result<(), ModelError> {
        if self.sides.len() == self.fitted.len() {
            return Ok(());
        }
        let values = self.values;
        let beside = |p: &Parameter| -> Result<_, ModelError> {
            if !p.is_physical() {
                return Ok(None);
            }
            let i = *p as usize;
            let [lo, hi] = p.domain();
            let [lo, hi] = [(values[i] - p.step(values[i])).max(lo), (values[i] + p.step(values[i])).min(hi)];
            let moved = |x: f64| {
                let mut values = values;
                values[i] = x;
                Surface::build(&values, at)
            };
            Ok(Some((moved(lo)?, moved(hi)?, hi - lo)))
        };
        self.sides = self.fitted.iter().map(beside).collect::<Result<_, _>>()?;
        Ok(())
    }

    pub fn at(&self, drive: f64) -> Curve {
        self.surface.at(drive + self.values[1])
    }

    /// Expected reading at a (mm).
    pub fn expected(&self, a: f64, drive: f64) -> f64 {
        let (a, drive) = (a + self.values[2], drive + self.values[1]);
        self.values[0] * self.surface.value(a, drive) + self.values[Parameter::Zero as usize]
    }

    /// d reading/dp for the fitted parameters.
    pub fn gradient(&self, a: f64, drive: f64) -> Vec<f64> {
        let factor = self.values[0];
        let (a, drive) = (a + self.values[2], drive + self.values[1]);
        let [by_a, by_drive] = self.surface.slopes(a, drive);
        let entry = |(p, beside): (&Parameter, &Option<(Surface, Surface, f64)>)| match (p, beside) {
            (Parameter::Factor, _) => self.surface.value(a, drive),
            (Parameter::DriveOffset, _) => factor * by_drive,
            (Parameter::DistanceOffset, _) => factor * by_a,
            (Parameter::Zero, _) => 1.0,
            (_, Some((lo, hi, width))) => factor * (hi.value(a, drive) - lo.value(a, drive)) / width,
            (_, None) => 0.0,
        };
        self.fitted.iter().zip(&self.sides).map(entry).collect()
    }

    /// Variance of the expected reading from the fit.
    pub fn variance(&self, a: f64, drive: f64) -> f64 {
        let g = self.gradient(a, drive);
        let row = |(gi, row): (&f64, &Vec<f64>)| gi * row.iter().zip(&g).map(|(c, gj)| c * gj).sum::<f64>();
        g.iter().zip(&self.covariance).map(row).sum::<f64>().max(0.0)
    }

    /// Distance for a `reading` > 0 at `drive`; `curve` is [`Self::at`] of `drive`.
    pub fn find(&self, curve: &Curve, drive: f64, reading: f64) -> Option<Found> {
        let (far, near) = curve.roots(reading / self.values[0])?;
        let a = far - self.values[2];
        let slope = self.values[0] * curve.slope(far);
        let near = near.map(|n| n - self.values[2]);
        Some(Found::root(a, near, slope, self.variance(a, drive)))
    }

    /// Labelled distances covered, mm.
    pub fn reach(&self) -> [f64; 2] {
        self.surface.reach.map(|a| a - self.values[2])
    }
}
