//! From measured strains to a calibration: the K table of the paper, four estimators, and the choice among them.
//!
//! [`taps`](crate::estimator::taps) sorts the rows, `learn` fits the rig and excludes suspects, `fit` fits the model,
//! `held_out` tests each estimator on distances left out, and `side` combines the results of a side.
//!
//! ```no_run
//! use vibrissa_lab::{calibrate::{calibrate, Options}, measure::{Data, Rig}};
//! let data = Data::read("rig.csv".as_ref())?;
//! let found = calibrate(&data, &Rig::read("whisker.toml".as_ref(), data.drive)?, &Options::default())?;
//! println!("{} wins; noise {:e}", found.calibration.estimator, found.calibration.noise);
//! # Ok::<(), vibrissa_core::error::Error>(())
//! ```

pub mod coverage;
mod doubtful;
mod lag;
mod learn;
pub mod output;
pub mod planned;
mod prepare;
mod remarks;
pub mod report;
mod second;
pub mod several;
mod side;
mod zero;

pub use crate::estimator::taps::Reason;
pub use side::SideResult;

use crate::reduce::range;

use crate::error::{Error, InputError};
use crate::estimator::taps::{Sorted, Tap, ZeroReading};
use crate::estimator::{Estimator, Extent, Solver};
use crate::locate::calibration::{Calibration, FORMAT, Source};
use crate::locate::{Parameter, opener};
use crate::measure::{Data, Groups, Lag, Rig, Zero, columns::may_drive, counts, unit};
use crate::scene::{Drive, RunOptions, Side};
use crate::{fields::plain, simulate};

const ROUNDS: usize = 5;

/// Options of a calibration.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Drive of every tap if no column gives it: degrees or mm.
    pub drive: Option<f64>,
    /// Widths within which distances, and drives, count as equal; by default from the data.
    pub group: [Option<f64>; 2],
    /// Parameters of the model to fit besides factor and drive offset.
    pub fit: Vec<Parameter>,
    /// Backend that solves models.
    pub run: RunOptions,
    /// SHA-256 of the data file, for the record.
    pub hash: String,
}

/// A calibration with its evidence.
#[derive(Debug, Clone)]
pub struct Calibrated {
    /// The calibration that `locate` reads.
    pub calibration: Calibration,
    /// Every row with a drive.
    pub taps: Vec<Tap>,
    /// Every zero reading.
    pub zeros: Vec<ZeroReading>,
    /// The zero that was subtracted.
    pub zero: Zero,
    /// Groups of distances and of drives that count as equal.
    pub groups: [Groups; 2],
    /// Results of each side.
    pub sides: Vec<SideResult>,
    /// The estimator that won.
    pub winner: Estimator,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Calibrates the whisker of `rig` from `data`.
/// Errors: Data without a usable calibration: no usable row, one distance, impossible units, more than a fifth of the rows suspect; a failing backend.
pub fn calibrate(data: &Data, rig: &Rig, options: &Options) -> Result<Calibrated, Error> {
    let plain = doubtful::judged(settled(data, rig, options), (data, rig, options), settled)?;
    let Some(mut lag) = lag::search(data, &plain) else { return Ok(plain) };
    let mut rounds = 0;
    let mut with = loop {
        let data = lag::settled(data, &lag);
        let Ok(found) = settled(&data, rig, options) else { return Ok(plain) };
        let next = lag::again(&data, &found, lag);
        rounds += 1;
        if rounds == ROUNDS || (next.gain - lag.gain).abs() <= 0.3 * next.sigma_gain {
            lag = Lag { gain: lag.gain, tau_s: lag.tau_s, ..next };
            break found;
        }
        lag = next;
    };
    let errors = [&plain, &with].map(|found| lag::errors(found).unwrap_or(f64::NAN));
    if errors[1].partial_cmp(&errors[0]) != Some(std::cmp::Ordering::Less) {
        return Ok(plain);
    }
    with.warnings.push(lag::warning(data, &lag, errors));
    with.calibration.lag = Some(lag);
    Ok(with)
}

fn settled(data: &Data, rig: &Rig, options: &Options) -> Result<Calibrated, Error> {
    let (mut rig, mut warnings, file) = (rig.clone(), Vec::new(), &data.file);
    let data = &data.rounded(options.group.map(|width| width == Some(0.0)));
    let folded = unit::folded(data);
    if folded.is_some() {
        warnings.push(format!(
            "{file}: signals say that drives below 0 are taps to the other side: their size counts, of readings too"
        ));
    }
    let data = folded.as_ref().unwrap_or(data);
    check(data, &rig, options)?;
    let mut missing = std::collections::BTreeMap::<String, Vec<usize>>::new();
    for m in &data.missing {
        missing.entry(format!("{} = {}", m.column, plain(m.value))).or_default().push(m.line);
    }
    warnings.extend(missing.into_iter().map(|(value, lines)| {
        format!("{file}: {value} stands for no value and is not used (lines {})", named(&lines))
    }));
    if let Some(k) = rig.setup.estimate.k.take().map(plain) {
        warnings.push(format!("estimate.K = {k} of the spec has no meaning here: K̄ comes from the data"));
    }
    let mut ignored = data.ignored.clone();
    if rig.setup.gauge.second {
        second::check(data)?;
    } else {
        ignored.extend(data.beside.names());
    }
    if simulate::BESIDE.iter().all(|name| ignored.iter().any(|n| n == name)) {
        ignored.retain(|name| !simulate::BESIDE.contains(&name.as_str()));
    }
    if !ignored.is_empty() {
        let mut text = format!("{file}: ignored columns {}", ignored.join(", "));
        if let Some(name) = ignored.iter().find(|n| data.drive.is_none() && may_drive(n)) {
            text += &format!(
                "; if {name} is the drive, --columns theta={name} (degrees) or delta={name} (mm) takes it as such"
            );
        }
        warnings.push(text);
    }
    let open = opener(&options.run);
    let mut prepared = prepare::prepare(data, &mut rig, options, &open, &mut warnings)?;
    let wrong = prepared.rows.zeros.iter().filter(|z| z.reason == Some(Reason::ZeroOutlier));
    let wrong: Vec<usize> = wrong.map(|z| data.rows[z.place].line).collect();
    if !wrong.is_empty() {
        let (n, of, lines) = (wrong.len(), prepared.rows.zeros.len(), named(&wrong));
        warnings.push(format!("{file}: {n} of {of} zero readings are suspect and not used (lines {lines})"));
    }
    let sides = std::mem::take(&mut prepared.sides);
    let noise = sides[0].1.noise();
    rig.setup.gauge.noise_strain = Some(noise);
    let each = |side| side::calibrate((data, &rig, &prepared), side, noise, &options.fit, &open);
    let results = sides.into_iter().map(each).collect::<Result<Vec<_>, _>>()?;
    let (rows, recorded) = (prepared.rows, prepared.recorded);
    let Sorted { taps, zeros, zero, tared, groups, origin, .. } = rows;
    let knows = |s: &SideResult| Estimator::ALL.iter().filter_map(|e| s.rms(*e).0).any(|rms| rms < s.span());
    if !results.iter().all(knows) {
        return Err(remarks::nothing_known(data, &rig, &results).into());
    }
    if !data.unit.is_absolute() {
        // Noise of such a reading is not in strain; the calibration stores it.
        rig.setup.gauge.noise_strain = None;
    }
    let (file_read, hash, used) = (file.clone(), options.hash.clone(), results.iter().map(|s| s.used).sum());
    let source = Source { file: file_read, hash, rows: taps.len(), used, zeros: zeros.len() };
    let calibration = Calibration {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        checksum: String::new(),
        estimator: String::new(),
        signal: data.unit.column().to_owned(),
        drive_recorded: recorded,
        drive_origin: origin,
        noise,
        noise_from: "the model of all rows".to_owned(),
        zero: tared,
        lag: None,
        second: None,
        data: source,
        rig,
        sides: results.iter().map(|s| s.record.clone()).collect(),
    };
    let winner = Estimator::Learned;
    let mut found = Calibrated { calibration, taps, zeros, zero, groups, sides: results, winner, warnings };
    found.warnings.extend(remarks::remarks(data, &found));
    if found.calibration.rig.setup.gauge.second {
        found.calibration.second = second::second(data, &mut found, &open)?;
    }
    // Only the model with both gauges gives distance and tilt.
    let both = found.calibration.second.is_some() && found.sides.iter().all(|s| s.has(Estimator::Exact));
    found.winner = if both { Estimator::Exact } else { side::winner(&found.sides) };
    let name = found.winner.word();
    if !both && found.winner != Estimator::Learned {
        found.warnings.push(format!(
            "{file}: learned tells distances that it has not seen no better than a guess of the middle, {name} does: it answers by default"
        ));
    }
    found.calibration.estimator = name.to_owned();
    Ok(found)
}

fn named(lines: &[usize]) -> String {
    let more = if lines.len() > 8 { ", …" } else { "" };
    lines.iter().take(8).map(usize::to_string).collect::<Vec<_>>().join(", ") + more
}

/// Widths within which distances and drives count as equal: one for both, or two; `None` if not given.
/// Errors: Numbers that are negative, infinite or more than two.
pub fn widths(said: &[f64]) -> Result<[Option<f64>; 2], InputError> {
    match said {
        all if !all.iter().all(|w| *w >= 0.0 && w.is_finite()) || all.len() > 2 => {
            let said = all.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
            let error = InputError::new("these are no widths").key("--group").value(said);
            Err(error.allowed("one number ≥ 0 (mm, and the unit of the drive), or two with a comma between; 0: equal values only"))
        }
        [] => Ok([None; 2]),
        [both] => Ok([Some(*both); 2]),
        [distance, drive, ..] => Ok([Some(*distance), Some(*drive)]),
    }
}

/// Refuses a drive given for every row if the whisker is driven in the other way.
pub fn same_drive(kind: Drive, said: Option<Drive>) -> Result<(), InputError> {
    let Some(said) = said.filter(|s| *s != kind) else { return Ok(()) };
    let (key, allowed) = if said == Drive::Angle { ("--theta", "--delta") } else { ("--delta", "--theta") };
    Err(InputError::new("the whisker of the spec is driven another way").key(key).allowed(allowed))
}

fn check(data: &Data, rig: &Rig, options: &Options) -> Result<(), InputError> {
    rig.of_one_signal()?;
    if let Some(signal) = data.unit.signal().filter(|signal| rig.known && *signal != rig.setup.signal) {
        let message = format!("the whisker's spec has signal = \"{}\"", rig.setup.signal.word());
        let error = InputError::new(message).at(&data.file, Some(1)).key(data.unit.column());
        return Err(error.allowed(format!("signal = \"{}\" in [sensor] of the spec", signal.word())));
    }
    let kind = rig.setup.drive;
    let flag = if kind == Drive::Angle { "--theta" } else { "--delta" };
    if let Some(found) = data.drive.filter(|found| *found != kind) {
        let message = "the data are driven one way, the whisker of the spec another";
        let allowed = format!("{}, or another drive in [tap] of the spec", kind.column());
        return Err(InputError::new(message).at(&data.file, Some(1)).key(found.column()).allowed(allowed));
    }
    if let (Some(_), Some(x)) = (data.drive, options.drive) {
        let error = InputError::new(format!("the data have a column {}", kind.column())).key(flag);
        return Err(error.value(plain(x)).allowed("nothing: the column says it"));
    }
    let (end, allowed) = match kind {
        Drive::Angle => (90.0, "0 < theta < 90 degrees"),
        Drive::Displacement => (f64::INFINITY, "> 0 mm"),
    };
    if let Some(x) = options.drive.filter(|x| !(*x > 0.0 && *x < end)) {
        return Err(InputError::new("this is no drive").key(flag).value(plain(x)).allowed(allowed));
    }
    if let Some((bits, [last, first])) = counts::of_other_bits(data) {
        let message = format!(
            "these are counts of {bits} bits that begin anew: rows without contact and taps are at the two ends of their range"
        );
        let error = InputError::new(message).at(&data.file, None).key(data.unit.column());
        let [turn, last, first] = [2_f64.powi(bits), last, first].map(plain);
        let allowed =
            format!("counts that go on: {turn} added to those up to {last}, or taken off those from {first}");
        return Err(error.value(format!("{last} … {first}")).allowed(allowed));
    }
    if data.drive.is_none() && options.drive.is_none() && !options.fit.is_empty() {
        let message = "without the drive the model cannot be fitted; only table and paper are calibrated";
        let allowed = format!("a column {} or {flag}", kind.column());
        return Err(InputError::new(message).key("--fit").allowed(allowed));
    }
    crate::estimator::parameter::check(rig, &options.fit)
}

fn extent<'a>(of: Solver<'a>, taps: &[Tap], sign: f64, gauge: Side) -> Option<Extent<'a>> {
    let here = || taps.iter().filter(|t| t.is_of(sign));
    here().next()?;
    let ends = [range(here().map(|t| t.a)), range(here().map(|t| t.drive))];
    Some(Extent::around(of, gauge, ends, of.0.before))
}
