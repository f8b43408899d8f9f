//! Rows made ready: sorted, tared, grouped; sides told apart, suspects set aside.

use super::suspects::{self, Scatter};
use super::{Options, Reason, constant, drift, noise};
use crate::error::{Error, InputError, SolveError};
use crate::estimator::fit::{Taring, Task};
use crate::estimator::model::exact::{Exact, Extent, HARD, Opener, spec_values};
use crate::estimator::taps::{Said, Sorted, Tap, ZeroReading};
use crate::locate::ModelError;
use crate::measure::group::Groups;
use crate::measure::zero::{Tared, TaredBy, Zero};
use crate::measure::{Data, Rig};
use crate::scene::{Drive, Side, Theory};

/// A signal of the other sign is a side of its own where it has at least this share of the taps.
const MINORITY: f64 = 0.1;
/// Strains above this are no strains.
const ABSURD: f64 = 0.5;

/// Rows that are ready to be calibrated from.
pub struct Prepared {
    /// Every row with a drive.
    pub taps: Vec<Tap>,
    /// Every row without contact.
    pub zeros: Vec<ZeroReading>,
    /// The zero that was subtracted.
    pub zero: Zero,
    /// How it was found.
    pub tared: Tared,
    /// Distances and drives that are one.
    pub groups: [Groups; 2],
    /// The drift that was subtracted for want of zero readings.
    pub drift: Option<drift::Drift>,
    /// Sign, side of the gauge and scatter of each side.
    pub sides: Vec<(f64, Side, Scatter)>,
    /// Whether the data say what the zero is.
    pub sure: bool,
    /// Whether the drive of the taps is known.
    pub recorded: bool,
}

/// Sorts, tares and judges the rows of `data`; what `rig` learns of its drive is put there.
///
/// # Errors
/// As of [`super::calibrate`].
pub fn prepare(
    data: &Data,
    rig: &mut Rig,
    options: &Options,
    open: Opener<'_>,
    warnings: &mut Vec<String>,
) -> Result<Prepared, Error> {
    let said = Said { drive: options.drive, group: options.group };
    let Sorted { mut taps, zeros, zero, mut tared, groups, before } =
        crate::estimator::taps::taps(data, rig, &said);
    rig.before = before;
    let rig = &*rig;
    warnings.extend(joined(&groups, rig.setup.drive));
    if tared.wraps {
        warnings.push(format!("{}: counts of 16 bits begin anew; they were joined", data.file));
    }
    absurd(data, &taps)?;
    let recorded = data.drive.is_some() || options.drive.is_some();
    let read = zero.count > 0;
    if !read && data.drive.is_some() {
        let usable: Vec<&Tap> = taps.iter().filter(|t| t.reason.is_none()).collect();
        // Without theory first, for signs and suspects; the model of a whisker that is known then says the rest.
        let turned = constant::reference(&usable);
        if let Some(found) = constant::without_theory(&usable) {
            tare(&mut taps, &mut tared, TaredBy::Fitted, [found.value, found.error]);
        } else if let Some(value) = turned.filter(|_| !data.unit.is_strain()) {
            tare(&mut taps, &mut tared, TaredBy::Reference, [value, 0.0]);
        }
    }
    let signs = signs(data, &mut taps)?;
    let drift = if !read { drift::of_all(rig, &taps, &signs) } else { None };
    if let Some(d) = &drift {
        drift::remove(&mut taps, d);
        let carried = d.slope * data.rows.len() as f64;
        warnings.push(format!(
            "{}: no zero was read, and repeats show that it drifts by {:.3e} ± {:.1e} a row, {carried:.3e} over the file; a straight \
             drift from the first row on was subtracted. Read the zero now and then (rows with {} = 0)",
            data.file,
            d.slope,
            d.error,
            rig.setup.drive.column()
        ));
    }
    let modelled = recorded && rig.known;
    let unflagged = taps.clone();
    let mut sides = flagged(data, rig, &mut taps, &signs, modelled, open)?;
    let mut sure = read || tared.from == TaredBy::Fitted;
    if !read && modelled && tared.from != TaredBy::Reference {
        let (sign, gauge, scatter) = &sides[0];
        let cells = noise::of_side(rig, &taps, *sign);
        let found = match super::extent(rig, &taps, *sign, *gauge) {
            Some(at) => {
                let task = Task { rig, at, cells: &cells, noise: scatter.signal, zero: Taring::Sought, open };
                constant::of_fit(&task.fit(&options.fit)?, &cells, *sign)
            }
            None => None,
        };
        sure |= found.is_some();
        let begun = tared.from == TaredBy::Fitted;
        if let Some(found) = found.filter(|c| c.is_there() || (begun && c.determined())) {
            taps = unflagged;
            tare(&mut taps, &mut tared, TaredBy::Fitted, [found.value, found.error]);
            sides = flagged(data, rig, &mut taps, &signs, modelled, open)?;
        }
    }
    warnings.extend(untared(data, rig, &tared, sure));
    for a in sides.iter().flat_map(|s| &s.2.positions) {
        warnings.push(format!(
            "{}: nearly all rows at a = {a} mm contradict the other positions: is this label right? They are used",
            data.file
        ));
    }
    Ok(Prepared { taps, zeros, zero, tared, groups, drift, sides, sure, recorded })
}

/// Sets suspects aside, side by side.
fn flagged(
    data: &Data,
    rig: &Rig,
    taps: &mut [Tap],
    signs: &[f64],
    modelled: bool,
    open: Opener<'_>,
) -> Result<Vec<(f64, Side, Scatter)>, Error> {
    let kind = rig.setup.drive;
    let mut sides = Vec::new();
    for &sign in signs {
        let gauge = gauge_side(data, rig, sign, signs[0]);
        let closed = [Theory::EulerBernoulli, Theory::Timoshenko].map(|t| rig.curve(t, rig.setup.hub));
        let [plain, sheared] =
            closed.map(|c| move |a: f64, d: f64| crate::design::amount(kind, d) * c.value(a));
        let model = if modelled { spec_model(data, rig, taps, sign, gauge, open)? } else { None };
        let exact = model.as_ref().map(|m| |a: f64, d: f64| m.expected(a, d));
        let mut models: Vec<&suspects::Expected<'_>> = vec![&plain];
        if rig.known {
            models.push(&sheared);
        }
        if let Some(exact) = &exact {
            models.insert(0, exact);
        }
        let scatter = suspects::flag(taps, rig, sign, &models);
        sides.push((sign, gauge, scatter));
    }
    Ok(sides)
}

/// Takes a constant off every tap.
fn tare(taps: &mut [Tap], tared: &mut Tared, from: TaredBy, [value, error]: [f64; 2]) {
    for tap in taps {
        tap.zero += value;
        tap.signal -= value;
    }
    *tared = Tared { from, value: tared.value + value, error, ..tared.clone() };
}

/// What to say of a zero that nobody read; `sure`: the data say what it is, or that there is none.
fn untared(data: &Data, rig: &Rig, tared: &Tared, sure: bool) -> Option<String> {
    let (kind, unit) = (rig.setup.drive.column(), data.unit.common());
    match tared.from {
        TaredBy::Fitted => Some(format!(
            "{}: no zero was read; the data say that the signal has a constant offset of {:.4e} ± {:.1e} {unit}, which was subtracted, \
             as it will be from readings without a zero of their own",
            data.file, tared.value, tared.error
        )),
        TaredBy::Reference => Some(format!(
            "{}: no zero was read, and the signal changes its sign with the drive: its zero is not known. {:.4e} {unit} stands in for it, \
             so that only estimators of the data mean anything; readings must be in the same state",
            data.file, tared.value
        )),
        TaredBy::None if !sure => Some(format!(
            "{}: no zero was read, and these data cannot tell a constant offset of the signal from a tap: it is taken as tared. Rows \
             with {kind} = 0 say what the sensor shows without contact",
            data.file
        )),
        _ => None,
    }
}

/// What was taken as one.
fn joined([distances, drives]: &[Groups; 2], kind: Drive) -> Vec<String> {
    let say = |g: &Groups, what: &str, unit: &str| {
        g.joined().then(|| {
            format!(
                "{} values of {what} lie within {:.3} {unit} of each other and are taken as {}: --group sets the width, 0 takes each \
                 as its own",
                g.distinct,
                g.width,
                g.centres.len()
            )
        })
    };
    let unit = if kind == Drive::Angle { "degrees" } else { "mm" };
    [say(distances, "a_mm", "mm"), say(drives, kind.column(), unit)].into_iter().flatten().collect()
}

/// Refuses a column whose unit cannot be what its name says.
fn absurd(data: &Data, taps: &[Tap]) -> Result<(), InputError> {
    let mut sizes: Vec<f64> = taps.iter().map(|t| t.signal.abs()).filter(|s| s.is_finite()).collect();
    if sizes.is_empty() {
        let message = "no row has a distance, a drive other than zero and a signal";
        return Err(InputError::new(message).at(&data.file, None));
    }
    let middle = crate::reduce::median(&mut sizes);
    if data.unit.is_strain() && middle > ABSURD {
        let message = format!("half of all strains are above {middle:.3e}: this is another unit");
        return Err(InputError::new(message).at(&data.file, None).key(data.unit.column()).allowed(
            "strain (0.001 is 0.1 %), microstrain, bridge_mV_per_V, or reading for any other unit",
        ));
    }
    Ok(())
}

/// Signs of the sides to calibrate, that of most taps first; taps of a stray sign are set aside.
fn signs(data: &Data, taps: &mut [Tap]) -> Result<Vec<f64>, InputError> {
    let of = |sign: f64| move |t: &&Tap| t.reason.is_none() && t.signal.signum() == sign;
    let count = |sign: f64| taps.iter().filter(of(sign)).count();
    let distances = |sign: f64| {
        crate::estimator::cells::Levels::of(taps.iter().filter(of(sign)).map(|t| t.group[0])).len()
    };
    let (plus, minus) = (count(1.0), count(-1.0));
    let (most, least) = if plus >= minus { (1.0, -1.0) } else { (-1.0, 1.0) };
    if plus + minus == 0 {
        let reasons: std::collections::BTreeSet<String> =
            taps.iter().filter_map(|t| t.reason.as_ref()).map(|r| r.word().to_owned()).collect();
        let message = "no row can be used";
        let why = reasons.into_iter().collect::<Vec<_>>().join(", ");
        return Err(InputError::new(message).at(&data.file, None).value(why).allowed(
            "rows with a_mm beyond the gauge and within the whisker, a drive > 0 and a signal that is not zero",
        ));
    }
    if distances(most) < 2 {
        let a = taps.iter().find(of(most)).map_or(f64::NAN, |t| t.a);
        let message = "all usable taps are at one distance: a calibration needs two or more";
        return Err(InputError::new(message)
            .at(&data.file, None)
            .key("a_mm")
            .value(a)
            .allowed("two distances or more"));
    }
    let both = count(least) as f64 >= MINORITY * count(most) as f64 && distances(least) >= 2;
    if both {
        return Ok(vec![most, least]);
    }
    taps.iter_mut().filter(|t| of(least)(&&**t)).for_each(|t| t.reason = Some(Reason::OtherSide));
    Ok(vec![most])
}

/// Side of the gauge that `sign` means: tension is the contact side. A reading of unknown unit says nothing about it: most of its
/// taps are on the side that the spec names.
fn gauge_side(data: &Data, rig: &Rig, sign: f64, most: f64) -> Side {
    if data.unit.is_strain() {
        return if sign > 0.0 { Side::Contact } else { Side::Far };
    }
    match (rig.setup.gauge.side, sign == most) {
        (side, true) => side,
        (Side::Contact, false) => Side::Far,
        (Side::Far, false) => Side::Contact,
    }
}

/// The model of the spec where the data are; an error that names the row of the largest drive where the rod has no such taps.
fn spec_model(
    data: &Data,
    rig: &Rig,
    taps: &[Tap],
    sign: f64,
    gauge: Side,
    open: Opener<'_>,
) -> Result<Option<Exact>, Error> {
    let Some(at) = super::extent(rig, taps, sign, gauge) else { return Ok(None) };
    let at = Extent { hard: HARD, ..at };
    let model = Exact::new(rig, spec_values(&rig.setup), Vec::new(), Vec::new(), at, open);
    let usable = taps.iter().filter(|t| t.reason.is_none() && t.signal.signum() == sign);
    match (model, usable.max_by(|s, t| s.drive.total_cmp(&t.drive))) {
        (Err(why @ ModelError::Solve(SolveError::TooHard)), Some(last)) => Err(InputError::new(format!(
            "{why} at distances of {} … {} mm and drives up to this one: is it what was measured?",
            at.reach[0], at.reach[1]
        ))
        .at(&data.file, Some(last.line))
        .key(rig.setup.drive.column())
        .value(last.drive)
        .allowed("drives that the whisker of the spec can follow; another row's decimal comma makes two fields of one number")
        .into()),
        (model, _) => Ok(Some(model?)),
    }
}
