//! Second gauge: its transfer factor and misalignment, from rows with both signals (model §6).

use std::f64::consts::FRAC_PI_2;

use super::{Calibrated, Reason};
use crate::curve::both;
use crate::error::{Error, InputError};
use crate::estimator::least::{FREE, by_values};
use crate::estimator::model::ModelError;
use crate::estimator::model::exact::{Extent, Opener, Values};
use crate::estimator::model::pair::{Pair, Transfer};
use crate::estimator::taps::{Tap, ZeroReading};
use crate::evaluate::Task;
use crate::locate::calibration::Second;
use crate::measure::Data;
use crate::measure::zero::Zero;

/// Relative change of squares below which the fit ends.
const SETTLED: f64 = 1e-14;
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
        let error =
            InputError::new("this is not a number").at(&data.file, Some(*line)).key(name).value(field);
        return Err(error.allowed("a number without unit; empty or NaN where it is missing"));
    }
    let tilts = data.rows.iter().zip(&beside.values).map(|(row, values)| (row.line, values[1]));
    match tilts.into_iter().find(|(_, tilt)| tilt.abs() >= 90.0) {
        Some((line, tilt)) => {
            let error = InputError::new("no pole is tilted so far").at(&data.file, Some(line));
            Err(error
                .key(beside.tilt.as_deref().unwrap_or_default())
                .value(tilt)
                .allowed("-90 < tilt < 90 degrees"))
        }
        None => Ok(()),
    }
}

/// Strains of the centreline, of the first gauge and 90° further, and the second signal.
struct Row {
    strains: [f64; 3],
    signal: f64,
}

/// Second gauge from rows on the side of the gauge in the spec; `None` with a warning if it cannot be determined.
pub(super) fn second(data: &Data, of: &mut Calibrated, open: Opener<'_>) -> Result<Option<Second>, Error> {
    let (label, rig, warnings) = (&data.file, &of.calibration.rig, &mut of.warnings);
    let Some(side) = of.sides.iter().find(|s| s.record.gauge() == rig.setup.gauge.side) else {
        warnings.push(format!(
            "{label}: the second gauge is not calibrated: no row is on the side of the gauge that the spec says"
        ));
        return Ok(None);
    };
    let Some((_, column)) = &data.beside.second else {
        warnings.push(format!(
            "{label}: the whisker has a second gauge, but there is no column {}: it is not calibrated, and every pole counts as upright",
            data.unit.second()
        ));
        return Ok(None);
    };
    let lean_deg = rig.design.tuple.lean;
    let fitted = |values: &Values| -> Result<Result<Second, String>, Error> {
        let at = Extent::around(rig, side.record.gauge(), side.record.distances_mm, side.record.ends(), 0.0);
        let model = match Pair::new(rig, values, at, lean_deg) {
            Ok(model) => model,
            Err(why) => return Ok(Err(why.to_string())),
        };
        let rows = rows(data, (&of.taps, &of.zeros), side.learnt.sign, rig.setup.gauge.factor, &model, open)?;
        Ok(fit(&rows, values[0], of.calibration.noise)
            .ok_or_else(|| format!("no usable row has a number in {column}")))
    };
    let found = match (&side.record.exact, both::forbids(rig.setup.model.contact)) {
        (None, _) => Err("it is told from the model of the spec, which could not be fitted".to_owned()),
        (_, Some(why)) => Err(why.to_owned()),
        (Some(exact), None) => fitted(&exact.values(rig))?,
    };
    match &found {
        Err(why) => warnings.push(format!("{label}: the second gauge is not calibrated: {why}")),
        Ok(found) if found.fitted.len() < 2 => warnings.push(format!(
            "{label}: all rows with {column} are of upright poles, whose strain the second gauge hardly sees: its factor is taken to be that of \
             the first. Rows with a known tilt (tilt_deg) tell it"
        )),
        Ok(_) => {}
    }
    Ok(found.ok().map(|found| Second { lean_deg, ..found }))
}

fn rows(
    data: &Data,
    (taps, zeros): (&[Tap], &[ZeroReading]),
    sign: f64,
    factor: f64,
    model: &Pair,
    open: Opener<'_>,
) -> Result<Vec<Row>, Error> {
    let recorded = |place: usize| data.unit.strain(data.beside.values[place][0], factor);
    let usable = |z: &&ZeroReading| z.reason.is_none() && recorded(z.place).is_finite();
    let zeros: Vec<(usize, f64)> =
        zeros.iter().filter(usable).map(|z| (z.place, recorded(z.place))).collect();
    let zero = Zero::new(&zeros);
    let taps: Vec<&Tap> = taps
        .iter()
        .filter(|t| matches!(t.reason, None | Some(Reason::Tilted)) && t.signal.signum() == sign)
        .filter(|t| recorded(t.place).is_finite())
        .collect();
    let tilt = |t: &Tap| if data.beside.tilt.is_some() { data.beside.values[t.place][1] } else { 0.0 };
    let places: Vec<Task> = taps.iter().map(|t| model.tap(t.a, tilt(t), t.drive)).collect();
    let mut evaluator = model.evaluator(open(&model.setup().model)?);
    let strains = model.strains(&mut evaluator, &places).map_err(ModelError::Solve)?;
    let row = |(t, strains): (&&Tap, Option<[f64; 3]>)| {
        let signal = sign * data.unit.above(recorded(t.place), zero.at(t.place), factor);
        strains.map(|strains| Row { strains, signal })
    };
    Ok(taps.iter().zip(strains).filter_map(row).collect())
}

/// Least squares for s₂ and δ of [`Transfer::readings`]; upright rows alone give δ with s₂ = s₁.
fn fit(rows: &[Row], factor: f64, noise: f64) -> Option<Second> {
    let tilted = |Row { strains: [axial, first, second], .. }: &Row| {
        (second - axial).abs() > TILTED * (axial - first).abs()
    };
    let m = if rows.iter().any(tilted) { 2 } else { 1 };
    let factor_of = |x: &[f64]| x.get(1).copied().unwrap_or(factor);
    let left = |x: &[f64]| {
        let transfer = Transfer { factors: [factor, factor_of(x)], misalignment: x[0] };
        Some(rows.iter().map(|r| r.signal - transfer.readings(r.strains)[1]).collect())
    };
    let (steps, bounds) = ([1e-5, 1e-5 * factor], [[-FRAC_PI_2, FRAC_PI_2], FREE]);
    let found = by_values(&left, &[0.0, factor][..m], &steps[..m], &bounds[..m], SETTLED)?;
    let s2 = factor_of(&found.at);
    let noise = match rows.len() >= ENOUGH {
        true => (found.chi2() / (rows.len() - m) as f64).sqrt(),
        false => noise * (s2 / factor).abs(),
    };
    let error = |k: usize| if k < m { noise * found.covariance[(k, k)].max(0.0).sqrt() } else { 0.0 };
    let second = Second {
        factor: s2,
        misalignment_deg: found.at[0].to_degrees(),
        noise,
        fitted: ["factor", "misalignment"][2 - m..].iter().map(|name| (*name).to_owned()).collect(),
        sigma_factor: error(1),
        sigma_misalignment_deg: error(0).to_degrees(),
        lean_deg: 0.0,
        rows: rows.len(),
    };
    second.is_sound().then_some(second)
}
