//! Second gauge: its transfer factor and misalignment, from rows with both signals (model §6).

use nalgebra::{DMatrix, DVector};

use super::{Calibrated, Reason};
use crate::curve::both;
use crate::error::{Error, InputError};
use crate::estimator::taps::{Tap, ZeroReading};
use crate::estimator::{Extent, ModelError, Opener, Values, least};
use crate::evaluate::{Evaluator, Task};
use crate::locate::{calibration::Second, pair::Pair};
use crate::measure::{Data, Zero};

/// Iterations for the strain of the centreline, which depends on the factor.
const ROUNDS: usize = 8;
const ENOUGH: usize = 10;
/// Smallest share of a tilted row's strain in the second signal that determines its factor: a tilt of 1°.
const TILTED: f64 = 0.017;

/// Refuses invalid columns of a second gauge.
pub fn check(data: &Data) -> Result<(), InputError> {
    let beside = &data.beside;
    if let Some((unit, name)) = beside.second.as_ref().filter(|(unit, _)| *unit != data.unit) {
        let message = "the two gauges must be recorded as the same kind of signal";
        let error = InputError::new(message).at(&data.file, Some(1)).key(name).value(unit.second());
        return Err(error.allowed(data.unit.second()));
    }
    if let Some((line, name, field)) = &beside.fault {
        let error = InputError::new("this is not a number").at(&data.file, Some(*line)).key(name);
        return Err(error.value(field).allowed("a number without unit; empty or NaN where it is missing"));
    }
    let mut tilts = data.rows.iter().zip(&beside.values).map(|(row, values)| (row.line, values[1]));
    let Some((line, tilt)) = tilts.find(|(_, tilt)| tilt.abs() >= 90.0) else { return Ok(()) };
    let error = InputError::new("no pole is tilted so far").at(&data.file, Some(line));
    let error = error.key(beside.tilt.as_deref().unwrap_or_default()).value(tilt);
    Err(error.allowed("-90 < tilt < 90 degrees"))
}

/// Strains of the centreline, of the first gauge and 90° further, and the second signal.
struct Row {
    strains: [f64; 3],
    signal: f64,
}

/// Second gauge from rows on the side of the gauge in the spec; `None` with a warning if it cannot be determined.
pub(super) fn second(data: &Data, of: &mut Calibrated, open: Opener<'_>) -> Result<Option<Second>, Error> {
    let (label, rig) = (&data.file, &of.calibration.rig);
    let Some(side) = of.sides.iter().find(|s| s.record.gauge() == rig.setup.gauge.side) else {
        of.warnings.push(format!(
            "{label}: the second gauge is not calibrated: no row is on the side of the gauge that the spec says"
        ));
        return Ok(None);
    };
    let Some((_, column)) = &data.beside.second else {
        of.warnings.push(format!(
            "{label}: the whisker has a second gauge, but there is no column {}: it is not calibrated, and every pole counts as upright",
            data.unit.second()
        ));
        return Ok(None);
    };
    let lean_deg = rig.design.tuple.lean;
    let fitted = |values: &Values| -> Result<Result<Second, String>, Error> {
        let at = Extent::around((rig, open), side.record.gauge(), side.record.ranges(), 0.0);
        let model = match Pair::new(values, at, lean_deg) {
            Ok(model) => model,
            Err(why) => return Ok(Err(why.to_string())),
        };
        let rows = rows(data, of, side.learnt.sign, &model, open)?;
        Ok(fit(&rows, values[0], of.calibration.noise)
            .ok_or_else(|| format!("no usable row has a number in {column}")))
    };
    let found = match (&side.record.exact, both::forbids(rig.setup.model.contact)) {
        (None, _) => Err("it is told from the model of the spec, which could not be fitted".to_owned()),
        (_, Some(why)) => Err(why.to_owned()),
        (Some(exact), None) => fitted(&exact.values(rig))?,
    };
    match &found {
        Err(why) => of.warnings.push(format!("{label}: the second gauge is not calibrated: {why}")),
        Ok(found) if found.fitted.len() < 2 => of.warnings.push(format!(
            "{label}: all rows with {column} are of upright poles, whose strain the second gauge hardly sees: its factor is taken to be that of \
             the first. Rows with a known tilt (tilt_deg) tell it"
        )),
        Ok(_) => {}
    }
    Ok(found.ok().map(|found| Second { lean_deg, ..found }))
}

fn rows(data: &Data, of: &Calibrated, sign: f64, model: &Pair, open: Opener<'_>) -> Result<Vec<Row>, Error> {
    let factor = of.calibration.rig.setup.gauge.factor;
    let recorded = |place: usize| data.unit.strain(data.beside.values[place][0], factor);
    let usable = |z: &&ZeroReading| z.reason.is_none() && recorded(z.place).is_finite();
    let zeros: Vec<_> = of.zeros.iter().filter(usable).map(|z| (z.place, recorded(z.place))).collect();
    let zero = Zero::new(&zeros);
    let sound = |t: &&Tap| matches!(t.reason, None | Some(Reason::Tilted)) && t.signal.signum() == sign;
    let taps: Vec<&Tap> = of.taps.iter().filter(|t| sound(t) && recorded(t.place).is_finite()).collect();
    let tilt = |t: &Tap| if data.beside.tilt.is_some() { data.beside.values[t.place][1] } else { 0.0 };
    let places: Vec<Task> = taps.iter().map(|t| model.tap(t.a, tilt(t), t.drive)).collect();
    let mut evaluator = Evaluator::new(&model.setup, open(&model.setup.model)?);
    let strains = model.strains(&mut evaluator, &places).map_err(ModelError::Solve)?;
    let row = |(t, strains): (&&Tap, Option<[f64; 3]>)| {
        let signal = sign * data.unit.above(recorded(t.place), zero.at(t.place), factor);
        strains.map(|strains| Row { strains, signal })
    };
    Ok(taps.iter().zip(strains).filter_map(row).collect())
}

/// Least squares for s₂ and δ: r₂ = s₂ e₀ + s₂ cos δ (ε₂ − e₀) − s₂ sin δ (ε₁ − e₀); upright rows alone give δ with s₂ = s₁.
fn fit(rows: &[Row], factor: f64, noise: f64) -> Option<Second> {
    let across = |r: &Row| r.strains[2] - r.strains[0];
    let along = |r: &Row| r.strains[0] - r.strains[1];
    let tilted = rows.iter().any(|r| across(r).abs() > TILTED * along(r).abs());
    let terms = |r: &Row| if tilted { vec![along(r), across(r)] } else { vec![along(r)] };
    let m = if tilted { 2 } else { 1 };
    let mut n = DMatrix::zeros(m, m);
    for r in rows {
        let x = DVector::from_vec(terms(r));
        n += &x * x.transpose();
    }
    let (mut s2, mut angle, mut covariance) = (factor, 0.0, DMatrix::zeros(m, m));
    for _ in 0..ROUNDS {
        let mut b = DVector::zeros(m);
        for r in rows {
            // For upright rows, the strain across equals that of the centreline, to the accuracy of the model.
            let known = if tilted { 0.0 } else { s2 * f64::cos(angle) * across(r) };
            b += DVector::from_vec(terms(r)) * (r.signal - s2 * r.strains[0] - known);
        }
        let (x, inverse) = least::solve(&n, &b)?;
        covariance = inverse;
        (s2, angle) = match tilted {
            true => (x[0].hypot(x[1]).copysign(x[1]), (x[0] / x[1]).atan()),
            false => (factor, (x[0] / factor).clamp(-1.0, 1.0).asin()),
        };
    }
    let (sin, cos) = angle.sin_cos();
    let left = |r: &Row| r.signal - s2 * (r.strains[0] + cos * across(r) + sin * along(r));
    let squares: f64 = rows.iter().map(|r| left(r).powi(2)).sum();
    let noise = match rows.len() >= ENOUGH {
        true => (squares / (rows.len() - m) as f64).sqrt(),
        false => noise * (s2 / factor).abs(),
    };
    // x = (s₂ sin δ, s₂ cos δ).
    let variance = |by: [f64; 2]| match tilted {
        true => {
            let by = DVector::from_row_slice(&by);
            noise * noise * (by.transpose() * &covariance * by)[(0, 0)]
        }
        false => noise * noise * covariance[(0, 0)] * by[0] * by[0],
    };
    let of_angle = variance(if tilted { [cos / s2, -sin / s2] } else { [1.0 / (s2 * cos), 0.0] });
    let of_factor = if tilted { variance([sin, cos]) } else { 0.0 };
    let named: &[&str] = if tilted { &["factor", "misalignment"] } else { &["misalignment"] };
    let found = Second {
        factor: s2,
        misalignment_deg: angle.to_degrees(),
        noise,
        fitted: named.iter().map(|n| (*n).to_owned()).collect(),
        sigma_factor: of_factor.max(0.0).sqrt(),
        sigma_misalignment_deg: of_angle.max(0.0).sqrt().to_degrees(),
        lean_deg: 0.0,
        rows: rows.len(),
    };
    found.is_sound().then_some(found)
}
