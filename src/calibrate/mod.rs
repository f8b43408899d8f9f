//! From measured strains to a calibration: the K table of the paper, four estimators, and which of them to believe.
//!
//! [`taps`](crate::estimator::taps) sorts the rows, [`suspects`] sets aside what should not be believed,
//! [`fit`](crate::estimator::fit) fits the model, [`held_out`](crate::estimator::held_out) judges every estimator on distances it has
//! not seen, and [`side`] puts a side together.
//!
//! ```no_run
//! use vibrissa::{calibrate::{calibrate, Options}, measure::{Data, Rig}};
//! let data = Data::read("rig.csv".as_ref())?;
//! let found = calibrate(&data, &Rig::read("whisker.toml".as_ref(), data.drive)?, &Options::default())?;
//! println!("{} wins; noise {:e}", found.calibration.estimator, found.calibration.noise);
//! # Ok::<(), vibrissa::error::Error>(())
//! ```

pub mod constant;
pub mod drift;
pub mod noise;
pub mod output;
pub mod report;
pub mod side;
pub mod suspects;
pub mod winner;

pub use crate::estimator::reason::Reason;
pub use side::SideResult;

use crate::error::{Error, InputError, SolveError};
use crate::estimator::model::exact::{Exact, Extent, HARD, Opener, spec_values};
use crate::estimator::taps::{Said, Sorted, Tap, ZeroReading};
use crate::estimator::{EXACT, Estimator};
use crate::locate::calibration::{Calibration, FORMAT, Source};
use crate::locate::locator::opener;
use crate::locate::{ModelError, Parameter};
use crate::measure::group::Groups;
use crate::measure::zero::{Tared, TaredBy};
use crate::measure::{Data, Rig, zero::Zero};
use crate::scene::{Drive, RunOptions, Side, Theory};

/// A signal of the other sign is a side of its own where it has at least this share of the taps.
const MINORITY: f64 = 0.1;
/// Strains above this are no strains.
const ABSURD: f64 = 0.5;

/// What a user may say about a calibration.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Drive of every tap where no column says: degrees, or mm.
    pub drive: Option<f64>,
    /// Widths within which distances, and drives, are one; by default from the data.
    pub group: [Option<f64>; 2],
    /// Parameters of the model to fit beside factor and drive offset.
    pub fit: Vec<Parameter>,
    /// Where models are solved.
    pub run: RunOptions,
    /// SHA-256 of the data file, for the record.
    pub hash: String,
}

/// A calibration and everything it was judged by.
#[derive(Debug, Clone)]
pub struct Calibrated {
    /// What `locate` needs.
    pub calibration: Calibration,
    /// Every row with a drive.
    pub taps: Vec<Tap>,
    /// Every zero reading.
    pub zeros: Vec<ZeroReading>,
    /// The zero that was subtracted.
    pub zero: Zero,
    /// Distances and drives that are one.
    pub groups: [Groups; 2],
    /// The drift that was subtracted for want of zero readings.
    pub drift: Option<drift::Drift>,
    /// One for each side.
    pub sides: Vec<SideResult>,
    /// The estimator that won.
    pub winner: &'static dyn Estimator,
    /// Things worth telling.
    pub warnings: Vec<String>,
}

/// Calibrates the whisker of `rig` from `data`.
///
/// # Errors
/// Data that no calibration can come from: no usable row, one distance only, units that cannot be; a backend that fails.
pub fn calibrate(data: &Data, rig: &Rig, options: &Options) -> Result<Calibrated, Error> {
    let mut rig = rig.clone();
    let mut warnings = Vec::new();
    check(data, &rig, options)?;
    if let Some(k) = rig.setup.estimate.k.take() {
        warnings.push(format!("estimate.K = {k} of the spec has no meaning here: K̄ comes from the data"));
    }
    if !data.ignored.is_empty() {
        warnings.push(format!("{}: ignored columns {}", data.file, data.ignored.join(", ")));
    }
    let said = Said { drive: options.drive, group: options.group };
    let Sorted { mut taps, zeros, zero, mut tared, groups } = crate::estimator::taps::taps(data, &rig, &said);
    warnings.extend(joined(&groups, rig.setup.drive));
    if tared.wraps {
        warnings.push(format!("{}: counts of 16 bits begin anew; they were joined", data.file));
    }
    absurd(data, &taps)?;
    let recorded = data.drive.is_some() || options.drive.is_some();
    let read = zero.count > 0;
    if !read && data.drive.is_some() {
        let usable: Vec<&Tap> = taps.iter().filter(|t| t.reason.is_none()).collect();
        if let Some(found) = constant::without_theory(&usable) {
            tare(&mut taps, &mut tared, TaredBy::Fitted, [found.value, found.error]);
        } else if let Some(value) = constant::reference(&usable).filter(|_| !data.unit.is_strain()) {
            tare(&mut taps, &mut tared, TaredBy::Reference, [value, 0.0]);
        }
    }
    let signs = signs(data, &mut taps)?;
    let drift = if !read { drift::of_all(&rig, &taps, &signs) } else { None };
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
    let open = opener(&options.run);
    let modelled = recorded && rig.known;
    let unflagged = taps.clone();
    let mut sides = flagged(data, &rig, &mut taps, &signs, modelled, &open)?;
    let mut sure = read || tared.from == TaredBy::Fitted;
    if !read && modelled && tared.from != TaredBy::Reference {
        let Flagged { sign, scatter, model, .. } = &sides[0];
        let cells = noise::of_side(&rig, &taps, *sign);
        let found = model.as_ref().and_then(|m| constant::with_model(m, &cells, *sign, scatter.signal));
        sure |= found.is_some_and(|c| c.determined());
        if let Some(found) = found.filter(|c| c.is_there()) {
            taps = unflagged;
            tare(&mut taps, &mut tared, TaredBy::Fitted, [found.value, found.error]);
            sides = flagged(data, &rig, &mut taps, &signs, modelled, &open)?;
        }
    }
    warnings.extend(untared(data, &rig, &tared, sure));
    let sides: Vec<_> = sides.into_iter().map(|s| (s.sign, s.gauge, s.scatter)).collect();
    let found = noise::stated(&rig, data.unit.is_strain(), &taps, &sides);
    let (noise, noise_from) = match found {
        Some(found) => found,
        None => noise::scatter(&rig, &taps, &sides, modelled, &options.fit, &open)?,
    };
    rig.setup.gauge.noise_strain = Some(noise);
    let hold = !sure;
    let mut results = Vec::new();
    for (sign, gauge, _) in sides {
        let asked =
            side::Ask { data, rig: &rig, taps: &taps, sign, gauge, noise, recorded, hold, fit: &options.fit };
        results.push(side::calibrate(&asked, &open)?);
    }
    let winner = winner::winner(&results);
    warnings.extend(remarks(data, &taps, &results, winner, rig.known));
    let used = results.iter().map(|s| s.used).sum();
    let calibration = Calibration {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        checksum: String::new(),
        estimator: winner.name().to_owned(),
        signal: data.unit.column().to_owned(),
        drive_recorded: recorded,
        noise,
        noise_from,
        zero: Some(tared),
        data: Source {
            file: data.file.clone(),
            hash: options.hash.clone(),
            rows: taps.len(),
            used,
            zeros: zeros.len(),
        },
        rig,
        sides: results.iter().map(|s| s.record.clone()).collect(),
    };
    Ok(Calibrated { calibration, taps, zeros, zero, groups, drift, sides: results, winner, warnings })
}

/// A side after its suspects were set aside.
struct Flagged {
    sign: f64,
    gauge: Side,
    scatter: suspects::Scatter,
    /// The model of the spec, where there is one.
    model: Option<Exact>,
}

/// Sets suspects aside, side by side.
fn flagged(
    data: &Data,
    rig: &Rig,
    taps: &mut [Tap],
    signs: &[f64],
    modelled: bool,
    open: Opener<'_>,
) -> Result<Vec<Flagged>, Error> {
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
        sides.push(Flagged { sign, gauge, scatter, model });
    }
    Ok(sides)
}

/// Takes a constant off every tap.
fn tare(taps: &mut [Tap], tared: &mut Tared, from: TaredBy, [value, error]: [f64; 2]) {
    for tap in taps {
        tap.zero += value;
        tap.signal -= value;
    }
    *tared = Tared { from, value: tared.value + value, error, wraps: tared.wraps };
}

/// What to say of a zero that nobody read; `sure`: the data say what it is, or that there is none.
fn untared(data: &Data, rig: &Rig, tared: &Tared, sure: bool) -> Option<String> {
    let (kind, unit) = (rig.setup.drive.column(), data.unit.common());
    match tared.from {
        TaredBy::Fitted => Some(format!(
            "{}: no zero was read; the data say that the signal has a constant offset of {:.4e} ± {:.1e} {unit}, which was subtracted \
             and is from readings without a zero of their own",
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

/// Refuses data and options that do not belong together.
fn check(data: &Data, rig: &Rig, options: &Options) -> Result<(), InputError> {
    let kind = rig.setup.drive;
    let flag = if kind == Drive::Angle { "--theta" } else { "--delta" };
    if let Some(found) = data.drive
        && found != kind
    {
        let message = "the data are driven one way, the whisker of the spec another";
        let allowed = format!("{}, or another drive in [tap] of the spec", kind.column());
        return Err(InputError::new(message).at(&data.file, Some(1)).key(found.column()).allowed(allowed));
    }
    if let (Some(_), Some(x)) = (data.drive, options.drive) {
        let message = format!("the data have a column {}", kind.column());
        return Err(InputError::new(message).key(flag).value(x).allowed("nothing: the column says it"));
    }
    if let Some(x) = options.drive {
        let (good, allowed) = match kind {
            Drive::Angle => (x > 0.0 && x < 90.0, "0 < theta < 90 degrees"),
            Drive::Displacement => (x > 0.0 && x.is_finite(), "> 0 mm"),
        };
        if !good {
            return Err(InputError::new("this is no drive").key(flag).value(x).allowed(allowed));
        }
    }
    if data.drive.is_none() && options.drive.is_none() && !options.fit.is_empty() {
        let message = "without the drive the model cannot be fitted; only table and paper are calibrated";
        return Err(InputError::new(message)
            .key("--fit")
            .allowed(format!("a column {} or {flag}", kind.column())));
    }
    crate::estimator::fit::check(rig, &options.fit)
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

/// Distances and drives of the taps of one side that can be used.
fn extent(rig: &Rig, taps: &[Tap], sign: f64, gauge: Side) -> Option<Extent> {
    let here = || taps.iter().filter(|t| t.reason.is_none() && t.signal.signum() == sign);
    let range = |f: fn(&Tap) -> f64| {
        let values = here().map(f);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
    };
    here().next()?;
    Some(Extent::around(rig, gauge, range(|t| t.a), range(|t| t.drive)))
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
    let Some(at) = extent(rig, taps, sign, gauge) else { return Ok(None) };
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

/// What a user should know before trusting the result.
fn remarks(
    data: &Data,
    taps: &[Tap],
    sides: &[SideResult],
    winner: &dyn Estimator,
    known: bool,
) -> Vec<String> {
    let mut all = Vec::new();
    let lines = |wanted: &dyn Fn(&Tap) -> bool| {
        let found: Vec<String> = taps.iter().filter(|t| wanted(t)).map(|t| t.line.to_string()).collect();
        let shown = found[..found.len().min(8)].join(", ");
        (found.len(), if found.len() > 8 { format!("{shown}, …") } else { shown })
    };
    let (n, shown) = lines(&|t| t.twin.is_some());
    if n > 0 {
        all.push(format!(
            "{}: {n} rows are equal to earlier ones in every field and are used as repeats; if they are copies, the noise \
             is understated (lines {shown})",
            data.file
        ));
    }
    let (n, shown) = lines(&|t| t.reason.is_some());
    if n > 0 {
        all.push(format!(
            "{}: {n} of {} rows are suspect and not used (lines {shown}); rows.csv says why",
            data.file,
            taps.len()
        ));
    }
    for s in sides {
        if let Some(k) =
            s.mean_k().filter(|k| data.unit.is_strain() && s.recorded && known && !(0.33..3.0).contains(k))
        {
            all.push(format!(
                "K is {k:.3e} where theory expects about 1: check the unit of {} and the drive",
                data.unit.column()
            ));
        }
        if let Some(Fitted { chi2, misfit }) = s.fitted()
            && misfit > 0.01
            && winner == EXACT
        {
            all.push(format!(
                "the model of the spec leaves {:.1} % of the strain unexplained (χ² per degree of freedom {chi2:.3}): \
                 another material, contact or --fit may do better",
                100.0 * misfit
            ));
        }
    }
    all
}

/// What to say of a fit.
pub struct Fitted {
    /// χ² per degree of freedom with noise alone.
    pub chi2: f64,
    /// Misfit beyond noise, relative.
    pub misfit: f64,
}
