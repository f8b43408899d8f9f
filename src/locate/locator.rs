//! What answers readings.

use std::cell::RefCell;
use std::path::Path;

use super::calibration::{Calibration, SideRecord};
use super::exact::{Exact, Extent, HARD, Opener, Parameter, Values, spec_values};
use super::paper::{Factors, Paper};
use super::surface::Slice;
use super::table::{Curve, Table};
use super::{Estimator, Found, SAME, between, bracket};
use crate::backend::Choice;
use crate::error::{Error, InputError};
use crate::estimate::WIDENING;
use crate::evaluate::{Method, TOO_HARD};
use crate::measure::{Rig, Unit};
use crate::scene::{BackendChoice, Model, Precision, RunOptions, Side, Theory};
use crate::status::Status;

/// A distance beyond the calibrated ones by so many of its standard deviations is said to be.
const BEYOND: f64 = 3.0;

/// A distance, what it is worth, and why not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// Contact distance, mm; NaN where there is none.
    pub distance: f64,
    /// One standard deviation, mm: noise of one reading, noise of the calibration, bias on held-out distances. NaN without a distance.
    pub sigma: f64,
    /// Words of warning.
    pub status: Status,
}

impl Located {
    /// No distance, and why.
    pub const fn nothing(status: Status) -> Self {
        Self { distance: f64::NAN, sigma: f64::NAN, status }
    }
}

/// Solves models at full precision unless `options` say otherwise: a calibration needs few taps, but good ones.
pub fn opener(options: &RunOptions) -> impl Fn(&Model) -> Result<Method, Error> + use<> {
    let mut options = options.clone();
    if options.backend.is_none() && options.precision.is_none() && options.adapter.is_none() {
        options.backend = Some(BackendChoice::Cpu);
        options.precision = Some(Precision::F64);
        options.tolerance = options.tolerance.or(Some(1e-8));
    }
    move |model| Choice::new(&options)?.open(model)
}

/// One side of the whisker.
struct Opened {
    sign: f64,
    distances: [f64; 2],
    /// Distances within which a second one is ambiguous.
    interest: [f64; 2],
    drives: Vec<f64>,
    method: Answering,
    bias: Vec<f64>,
    /// Reading per strain, where it is known.
    factor: f64,
    /// |signal| at which the sensor stands still.
    end_stop: f64,
}

enum Answering {
    Paper(Box<Paper>),
    Table(Table),
    Exact(Box<Exact>),
}

/// Answers readings of one calibrated whisker.
pub struct Locator {
    /// The whisker.
    pub rig: Rig,
    /// What was measured.
    pub unit: Unit,
    /// Whether drives mean something.
    pub drive_recorded: bool,
    /// Estimator in use.
    pub estimator: Estimator,
    noise: f64,
    sides: Vec<Opened>,
    slice: RefCell<Option<(usize, f64, Slice)>>,
}

impl Locator {
    /// Opens the calibration file at `path` with the estimator that won.
    ///
    /// # Errors
    /// A file that cannot be used; a backend that fails.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let calibration = Calibration::read(path, false)?;
        Self::new(&calibration, &path.display().to_string(), None, &opener(&RunOptions::default()))
    }

    /// From a calibration; `label` names its file, `asked` overrules the winner, `open` solves models.
    ///
    /// # Errors
    /// An estimator that the calibration does not hold; a backend that fails.
    pub fn new(
        calibration: &Calibration,
        label: &str,
        asked: Option<Estimator>,
        open: Opener<'_>,
    ) -> Result<Self, Error> {
        let c = calibration;
        let rig = Rig::from_table(label, &c.spec)?;
        let named = |name: &str| Estimator::ALL.into_iter().find(|e| e.name() == name);
        let unit =
            Unit::of_column(&c.signal).ok_or_else(|| InputError::new("unknown signal").key("signal"))?;
        let estimator = asked.or(named(&c.estimator)).unwrap_or(Estimator::Paper);
        let at = |e: Error| match e {
            Error::Input(e) if e.file.is_none() => e.at(label, None).into(),
            other => other,
        };
        let mut sides = Vec::new();
        for record in &c.sides {
            match opened(&rig, record, estimator, open).map_err(at)? {
                Some(side) => sides.push(side),
                None => {
                    let held = Estimator::ALL.into_iter().filter(|e| holds(record, *e)).map(Estimator::name);
                    return Err(InputError::new("this calibration does not hold this estimator")
                        .at(label, None)
                        .key("--estimator")
                        .value(estimator.name())
                        .allowed(held.collect::<Vec<_>>().join(", "))
                        .into());
                }
            }
        }
        if let ([record], true) = (c.sides.as_slice(), asked.is_none_or(|e| e == Estimator::Exact)) {
            sides.extend(other_side(&rig, record, open).map_err(at)?);
        }
        Ok(Self {
            rig,
            unit,
            drive_recorded: c.drive_recorded,
            estimator,
            noise: c.noise,
            sides,
            slice: RefCell::new(None),
        })
    }

    /// The only calibrated drive, if there is one: it need not be said with a reading.
    pub fn only_drive(&self) -> Option<f64> {
        let mut drives = self.sides.iter().flat_map(|s| &s.drives).copied();
        let first = drives.next()?;
        drives.all(|d| d == first).then_some(first)
    }

    /// Distance of a tap by `drive` (degrees, or mm of displacement) with this signal (strain, or the unit of the reading).
    pub fn locate(&self, drive: f64, signal: f64) -> Located {
        if !drive.is_finite() || !signal.is_finite() {
            return Located::nothing(Status::BAD_INPUT);
        }
        if signal == 0.0 {
            return Located::nothing(Status::NO_STRAIN);
        }
        let Some(i) = self.sides.iter().position(|s| s.sign == signal.signum()) else {
            return Located::nothing(Status::OUTSIDE_CALIBRATION | self.limit(signal, f64::NAN));
        };
        let side = &self.sides[i];
        let mut status = self.limit(signal, side.factor);
        if bracket(&side.drives, drive).is_none() {
            return Located::nothing(status | Status::OUTSIDE_CALIBRATION);
        }
        if signal.abs() >= side.end_stop * (1.0 - SAME) {
            return Located::nothing(status | Status::STRAIN_LIMIT);
        }
        let found = match self.find(i, drive, signal.abs()) {
            Ok(found) => found,
            Err(why) => return Located::nothing(status | why),
        };
        let bias = between(&side.drives, &side.bias, drive);
        let of_reading = (self.noise * self.noise + found.variance) / (found.slope * found.slope);
        let sigma = (of_reading + bias * bias).sqrt();
        if !sigma.is_finite() || !found.a.is_finite() {
            return Located::nothing(status | Status::NO_ROOT);
        }
        let [lo, hi] = side.interest;
        if found.near.is_some_and(|a| a >= lo * (1.0 - WIDENING) && a <= hi * (1.0 + WIDENING)) {
            status |= Status::AMBIGUOUS;
        }
        // However uncertain, a distance that is half the range away is not of it.
        let [first, last] = side.distances;
        let slack = (BEYOND * sigma).min(0.5 * (last - first)) + WIDENING * last;
        if found.a < first - slack || found.a > last + slack {
            status |= Status::OUTSIDE_CALIBRATION;
        }
        Located { distance: found.a, sigma, status }
    }

    /// Signal that the estimator expects of a tap at a (mm) by `drive`, on the side of `sign`; NaN where it expects nothing.
    pub fn expected(&self, a: f64, drive: f64, sign: f64) -> f64 {
        let Some(side) = self.sides.iter().find(|s| s.sign == sign) else { return f64::NAN };
        if bracket(&side.drives, drive).is_none() || !a.is_finite() {
            return f64::NAN;
        }
        sign * match &side.method {
            Answering::Paper(paper) => paper.expected(a, drive),
            Answering::Table(table) => table.expected(a, drive),
            Answering::Exact(exact) if (exact.reach()[0]..=exact.reach()[1]).contains(&a) => {
                exact.expected(a, drive)
            }
            Answering::Exact(_) => f64::NAN,
        }
    }

    fn limit(&self, signal: f64, factor: f64) -> Status {
        let strain = if self.unit.is_strain() { signal } else { signal / factor };
        if strain.abs() > self.rig.setup.gauge.strain_limit { Status::STRAIN_LIMIT } else { Status::OK }
    }

    fn find(&self, side: usize, drive: f64, reading: f64) -> Result<Found, Status> {
        match &self.sides[side].method {
            Answering::Paper(paper) => paper.find(drive, reading).ok_or(Status::NO_ROOT),
            Answering::Table(table) => table.find(drive, reading).ok_or(Status::OUTSIDE_CALIBRATION),
            Answering::Exact(exact) => {
                let mut kept = self.slice.borrow_mut();
                if kept.as_ref().is_none_or(|(s, d, _)| (*s, *d) != (side, drive)) {
                    *kept = Some((side, drive, exact.slice(drive)));
                }
                let Some((.., slice)) = kept.as_ref() else { return Err(Status::NOT_CONVERGED) };
                exact.find_in(slice, drive, reading).ok_or_else(|| {
                    if reading < exact.weakest(slice) { Status::OUTSIDE_CALIBRATION } else { Status::NO_ROOT }
                })
            }
        }
    }
}

fn holds(record: &SideRecord, estimator: Estimator) -> bool {
    match estimator {
        Estimator::Paper => record.paper.is_some(),
        Estimator::Timoshenko => record.timoshenko.is_some(),
        Estimator::Exact => record.exact.is_some(),
        Estimator::Table => record.table.is_some(),
    }
}

fn opened(
    rig: &Rig,
    record: &SideRecord,
    estimator: Estimator,
    open: Opener<'_>,
) -> Result<Option<Opened>, Error> {
    let theory = |theory, factors: &super::calibration::FactorRecord| {
        let factors_kept = Factors { k: factors.K.clone(), variance: factors.K_variance.clone() };
        let paper = Paper::new(rig, theory, &record.drives, factors_kept);
        (Answering::Paper(Box::new(paper)), factors.bias_mm.clone())
    };
    let (method, bias) = match estimator {
        Estimator::Paper => match &record.paper {
            Some(r) => theory(Theory::EulerBernoulli, r),
            None => return Ok(None),
        },
        Estimator::Timoshenko => match &record.timoshenko {
            Some(r) => theory(Theory::Timoshenko, r),
            None => return Ok(None),
        },
        Estimator::Table => {
            let Some(r) = &record.table else { return Ok(None) };
            let curves: Option<Vec<Curve>> = r.curves.iter().map(|c| Curve::new(&c.knots())).collect();
            let drives = r.curves.iter().map(|c| c.drive).collect();
            let Some(table) = curves.and_then(|c| Table::new(drives, c)) else { return Ok(None) };
            (Answering::Table(table), r.bias_mm.clone())
        }
        Estimator::Exact => {
            let side = if record.gauge_side == "far" { Side::Far } else { Side::Contact };
            match exact(rig, record, side, open)? {
                Some((exact, bias)) => (Answering::Exact(Box::new(exact)), bias),
                None => return Ok(None),
            }
        }
    };
    Ok(Some(side_of(rig, record, f64::from(record.sign), method, bias)))
}

fn side_of(rig: &Rig, record: &SideRecord, sign: f64, method: Answering, bias: Vec<f64>) -> Opened {
    let named = record.exact.as_ref().and_then(|e| e.values.get(Parameter::Factor.name(rig.setup.drive)));
    Opened {
        sign,
        distances: record.distances_mm,
        interest: rig.setup.estimate.range.unwrap_or(record.distances_mm),
        drives: record.drives.clone(),
        method,
        bias,
        end_stop: record.end_stop.filter(|_| f64::from(record.sign) == sign).unwrap_or(f64::INFINITY),
        factor: named.and_then(toml::Value::as_float).unwrap_or(f64::NAN),
    }
}

/// The side that was not calibrated, answered by the model with the parameters of the other.
fn other_side(rig: &Rig, record: &SideRecord, open: Opener<'_>) -> Result<Option<Opened>, Error> {
    let side = if record.gauge_side == "far" { Side::Contact } else { Side::Far };
    let found = exact(rig, record, side, open)?;
    Ok(found.map(|(exact, bias)| {
        side_of(rig, record, -f64::from(record.sign), Answering::Exact(Box::new(exact)), bias)
    }))
}

/// A calibrated model that the kernels hardly solve anywhere: values that no rig has.
fn unsolvable(rig: &Rig, record: &SideRecord) -> InputError {
    let spec = rig.to_table();
    let written =
        |section: &str| spec.get(section).map_or_else(String::new, |t| t.to_string().replace('\n', ", "));
    let ([lo, hi], [first, last]) =
        (record.distances_mm, [record.drives[0], record.drives[record.drives.len() - 1]]);
    InputError::new(format!(
        "{TOO_HARD} at distances of {lo} … {hi} mm and drives of {first} … {last}: this whisker has no such taps"
    ))
    .key("spec.whisker, spec.model")
    .value(format!("{}; {}", written("whisker"), written("model")))
    .allowed("values of the rig that was calibrated; or another estimator (--estimator table)")
}

fn exact(
    rig: &Rig,
    record: &SideRecord,
    side: Side,
    open: Opener<'_>,
) -> Result<Option<(Exact, Vec<f64>)>, Error> {
    let Some(r) = &record.exact else { return Ok(None) };
    let kind = rig.setup.drive;
    let mut values: Values = spec_values(&rig.setup);
    for p in Parameter::ALL {
        if let Some(x) = r.values.get(p.name(kind)).and_then(toml::Value::as_float) {
            values[p as usize] = x;
        }
    }
    let fitted =
        r.fitted.iter().filter_map(|n| Parameter::ALL.into_iter().find(|p| p.name(kind) == n)).collect();
    let drives = [record.drives[0], record.drives[record.drives.len() - 1]];
    let at = Extent { hard: HARD, ..Extent::around(rig, side, record.distances_mm, drives) };
    let exact = Exact::new(rig, values, fitted, r.covariance.clone(), at, open).map_err(|e| match e {
        Error::Run(why) if why == TOO_HARD => unsolvable(rig, record).into(),
        other => other,
    })?;
    Ok(Some((exact, r.bias_mm.clone())))
}
