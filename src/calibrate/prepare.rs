//! Rows made ready: sorted, tared, grouped; sides told apart, suspects set aside.

use super::surface::Expected;
use super::suspects::{self, Scatter};
use super::{Options, Reason, constant, drift, noise};
use crate::error::{Error, InputError};
use crate::estimator::fit::{Taring, Task};
use crate::estimator::model::exact::{Exact, Extent, HARD, Opener, spec_values};
use crate::estimator::taps::{Said, Sorted, Tap, ZeroReading};
use crate::locate::ModelError;
use crate::measure::group::Groups;
use crate::measure::text::plain;
use crate::measure::zero::{Tared, TaredBy, Zero};
use crate::measure::{Data, Rig};
use crate::scene::{Drive, Side, Signal, Theory};

/// A signal of the other sign is a side of its own where it has at least this share of the taps.
const MINORITY: f64 = 0.1;
/// Strains above this are no strains.
const ABSURD: f64 = 0.5;

/// An offset that is uncertain by this share of it may be something else.
const UNCERTAIN: f64 = 0.2;

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
    /// The drive that counts as 0.
    pub origin: f64,
    /// Standard error of a zero that nobody read, which may have drifted.
    pub unread: f64,
    /// Why the model of the spec cannot be fitted, where whisker and drives are known.
    pub no_exact: Option<String>,
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
    let Sorted { mut taps, zeros, zero, mut tared, groups, before, origin } =
        crate::estimator::taps::taps(data, rig, &said);
    rig.before = before;
    let rig = &*rig;
    warnings.extend(joined(&groups, rig.setup.drive));
    if tared.wraps {
        warnings.push(format!("{}: counts of 16 bits begin anew; they were joined", data.file));
    }
    if origin != 0.0 {
        warnings.push(format!(
            "{}: there is contact at drives ≤ 0, and none up to {}: drives are counted from there, those of readings too",
            data.file,
            plain(origin)
        ));
    }
    absurd(data, &taps)?;
    let recorded = data.drive.is_some() || options.drive.is_some();
    let read = zero.count > 0;
    if !read && data.drive.is_some() {
        let usable: Vec<&Tap> = taps.iter().filter(|t| t.reason.is_none()).collect();
        // Without theory first, for signs and suspects; the model of a whisker that is known then says the rest.
        let turned = constant::reference(&usable);
        if let Some(found) = constant::without_theory(&usable) {
            tare((data, rig), &mut taps, &mut tared, TaredBy::Fitted, [found.value, found.error]);
        } else if let Some(value) = turned.filter(|_| !data.unit.is_absolute()) {
            tare((data, rig), &mut taps, &mut tared, TaredBy::Reference, [value, 0.0]);
        }
    }
    let signs = signs(data, &mut taps)?;
    let drift = if !read { drift::of_all(rig, &taps, &signs) } else { None };
    if let Some(d) = &drift {
        drift::remove(&mut taps, d, |signal, drift| data.unit.above(signal, drift, rig.setup.gauge.factor));
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
    let mut no_exact = None;
    let modelled = recorded && rig.known;
    let unflagged = taps.clone();
    let mut sides = flagged(data, rig, &mut taps, &signs, modelled, open, &mut no_exact)?;
    let mut sure = read || tared.from == TaredBy::Fitted;
    let mut unread = if tared.from == TaredBy::Fitted { tared.error } else { 0.0 };
    if !read && modelled && no_exact.is_none() && tared.from != TaredBy::Reference {
        let (sign, gauge, scatter) = &sides[0];
        let cells = noise::of_side(rig, &taps, *sign);
        let found = match super::extent(rig, &taps, *sign, *gauge) {
            Some(at) => {
                let task = Task { rig, at, cells: &cells, noise: scatter.signal, zero: Taring::Sought, open };
                ModelError::of_run(task.fit(&options.fit))?.and_then(|fit| {
                    let trend = drift::Trend::of(&fit, &cells, &taps, data.rows.len());
                    warnings.extend(trend.filter(drift::Trend::is_there).map(|t| trending(data, rig, &t)));
                    constant::of_fit(&fit, &cells, *sign, trend)
                })
            }
            None => None,
        };
        sure |= found.is_some();
        if let Some(found) = found {
            unread = found.error;
            tared.error = found.steady;
        }
        let begun = tared.from == TaredBy::Fitted;
        if let Some(found) = found.filter(|c| c.is_there() || (begun && c.determined())) {
            taps = unflagged;
            tare((data, rig), &mut taps, &mut tared, TaredBy::Fitted, [found.value, found.steady]);
            sides = flagged(data, rig, &mut taps, &signs, modelled, open, &mut no_exact)?;
        }
    }
    warnings.extend(untared(data, rig, &tared, sure, unread));
    for a in sides.iter().flat_map(|s| &s.2.positions) {
        warnings.push(format!(
            "{}: nearly all rows at a = {a} mm contradict the other positions: is this label right? They are used",
            data.file
        ));
    }
    Ok(Prepared { taps, zeros, zero, tared, groups, drift, sides, sure, recorded, origin, unread, no_exact })
}

/// Sets suspects aside, side by side; `no_exact` is told why there is no model to compare with.
fn flagged(
    data: &Data,
    rig: &Rig,
    taps: &mut [Tap],
    signs: &[f64],
    modelled: bool,
    open: Opener<'_>,
    no_exact: &mut Option<String>,
) -> Result<Vec<(f64, Side, Scatter)>, Error> {
    let kind = rig.setup.drive;
    let mut sides = Vec::new();
    for &sign in signs {
        let gauge = gauge_side(data, rig, sign, signs[0]);
        let closed = [Theory::EulerBernoulli, Theory::Timoshenko].map(|t| rig.curve(t, rig.setup.hub));
        let [plain, sheared] =
            closed.map(|c| move |a: f64, d: f64| crate::design::amount(kind, d) * c.value(a));
        let model = match modelled && no_exact.is_none() {
            true => spec_model(data, rig, taps, sign, gauge, open)?.map_err(|why| *no_exact = Some(why)).ok(),
            false => None,
        };
        let exact = model.as_ref().map(|m| |a: f64, d: f64| m.expected(a, d));
        let mut models: Vec<&Expected<'_>> = vec![&plain];
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
fn tare(
    (data, rig): (&Data, &Rig),
    taps: &mut [Tap],
    tared: &mut Tared,
    from: TaredBy,
    [value, error]: [f64; 2],
) {
    for tap in taps {
        tap.zero += value;
        tap.signal = data.unit.above(tap.signal, value, rig.setup.gauge.factor);
    }
    *tared = Tared { from, value: tared.value + value, error, ..tared.clone() };
}

/// What to say of a drift that only the residuals of the model show.
fn trending(data: &Data, rig: &Rig, trend: &drift::Trend) -> String {
    format!(
        "{}: no zero was read, and what the model leaves goes with the order of the lines, as if the zero drifted by {:.2e} ± {:.1e} {} over \
         the file. Neither can be told from the other here, so nothing was subtracted for it: read the zero now and then (rows with {} = 0)",
        data.file,
        trend.carried,
        trend.error,
        data.unit.common(),
        rig.setup.drive.column()
    )
}

/// What to say of a zero that nobody read; `sure`: the data say what it is, or that there is none.
fn untared(data: &Data, rig: &Rig, tared: &Tared, sure: bool, unread: f64) -> Option<String> {
    let (kind, unit) = (rig.setup.drive.column(), data.unit.common());
    match tared.from {
        TaredBy::Fitted => Some(format!(
            "{}: no zero was read; the data say that the signal has a constant offset of {:.4e} ± {:.1e} {unit}, which was subtracted, \
             as it will be from readings without a zero of their own{}",
            data.file,
            tared.value,
            unread,
            match unread > UNCERTAIN * tared.value.abs() {
                true => format!(
                    ". A drift of the zero would do much of that: rows with {kind} = 0 now and then would tell"
                ),
                false => String::new(),
            }
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
    if data.unit.signal() == Some(Signal::Strain) && middle > ABSURD {
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
            .value(plain(a))
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
    if data.unit.signal() == Some(Signal::Strain) {
        return if sign > 0.0 { Side::Contact } else { Side::Far };
    }
    match (rig.setup.gauge.side, sign == most) {
        (side, true) => side,
        (Side::Contact, false) => Side::Far,
        (Side::Far, false) => Side::Contact,
    }
}

/// The model of the spec where the data are; else why there is none: of the row of the largest drive where the rod has no such taps.
fn spec_model(
    data: &Data,
    rig: &Rig,
    taps: &[Tap],
    sign: f64,
    gauge: Side,
    open: Opener<'_>,
) -> Result<Result<Exact, String>, Error> {
    let Some(at) = super::extent(rig, taps, sign, gauge) else {
        return Ok(Err("no tap is usable".to_owned()));
    };
    let at = Extent { hard: HARD, ..at };
    let usable = taps.iter().filter(|t| t.reason.is_none() && t.signal.signum() == sign);
    let last = usable.max_by(|s, t| s.drive.total_cmp(&t.drive));
    match Exact::new(rig, spec_values(&rig.setup), Vec::new(), Vec::new(), at, open) {
        Ok(model) => Ok(Ok(model)),
        Err(why) if why.is_of_whisker() => Ok(Err(format!(
            "{why} at distances of {:.4} … {:.4} mm and drives up to {} = {} (line {})",
            at.reach[0],
            at.reach[1],
            rig.setup.drive.column(),
            plain(last.map_or(f64::NAN, |t| t.recorded(data))),
            last.map_or(0, |t| t.line),
        ))),
        Err(why) => Err(why.into()),
    }
}
