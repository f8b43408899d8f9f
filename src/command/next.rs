//! `vibrissa next CAL.toml [READINGS.csv]`: the next tap of an object.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::reply::framed;
use super::{Asked, Context, Reply, estimator, folder, named, number, stem};
use crate::digits::short;
use crate::error::{Error, InputError};
use crate::estimator::Estimator;
use crate::figure::{Axis, Figure, Mark, Marker, Panel, Path as Drawn};
use crate::locate::next::{May, Next, Tried, next};
use crate::locate::object::{NAME, SHIFT, shift_column};
use crate::locate::{Locator, Reading, SaidZero, locator::opener, stream::Ask, tared::Readings};
use crate::measure::Names;
use crate::scene::Drive;
use crate::sink::{Field, LabTable, Question, drive_unit, hash, heading};
use crate::status::Status;

/// The next tap of an object.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa next calibration.toml taps.csv")]
pub struct NextRequest {
    /// calibration.toml as calibrate wrote it
    pub calibration: PathBuf,
    /// Taps of the object so far, as for locate; none: of its first tap
    pub readings: Option<PathBuf>,
    /// Answer by this instead of the estimator that won on distances left out; `learned` alone says what another tap brings
    #[arg(long, value_parser = named(Estimator::WORDS), value_name = "NAME")]
    pub estimator: Option<String>,
    /// The column that names the object [default: object, where the file has it]
    #[arg(long, value_name = "COLUMN", requires = "readings")]
    pub object: Option<String>,
    /// Of several objects this one
    #[arg(long, value_name = "WORD", requires = "readings")]
    pub only: Option<String>,
    /// Least and largest drive that the motor may do, degrees or mm [default: the calibrated ones]
    #[arg(long, value_name = "LO,HI", value_delimiter = ',', value_parser = number, allow_hyphen_values = true)]
    pub within: Option<Vec<f64>>,
    /// The base may move along the whisker: by how much nearer to the object than where its distance is told from, mm [default: it stays]
    #[arg(long, value_name = "LO,HI", value_delimiter = ',', value_parser = number, allow_hyphen_values = true)]
    pub shift: Option<Vec<f64>>,
    /// The taps are of a run of the calibration, whose zero and gain are known
    #[arg(long)]
    pub same_run: bool,
    /// What the sensor shows without contact, where no row with theta (delta) = 0 says it: where neither does, and the signal of the
    /// calibration was tared, there is a warning
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub zero: Option<SaidZero>,
    /// Columns under other names: theta=ang_deg,reading=ch3 (theta, delta, strain, microstrain, bridge, reading, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
}

pub fn run(asked: &Asked<NextRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&asked.common, None)?;
    let calibration = context.calibration(&asked.calibration, options.force == Some(true))?;
    let label = asked.calibration.display().to_string();
    let by = estimator(asked.estimator.as_deref())?;
    let locator = Locator::new(&calibration, &label, by, &opener(&options))?;
    let drive = locator.rig.setup.drive;
    let within =
        ends("--within", "drives", asked.within.as_deref())?.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    let shifts = ends("--shift", "places of the base", asked.shift.as_deref())?;
    let may = May { within, shifts, same_run: asked.same_run };
    let stem = stem(asked.readings.as_deref().unwrap_or(&asked.calibration), "taps");
    let out = folder(options.out.as_ref(), &stem, "next");
    if options.plan == Some(true) {
        return Ok(Reply::planned(out, |to| format!("would say the next tap in {to}")));
    }
    let warn = |text: &str| context.warn(text);
    let measured = asked.readings.as_deref().map(|path| context.data(path)).transpose()?;
    let rows = measured.as_ref().map(|measured| measured.rows());
    let (taps, lines) = match (rows, asked.readings.as_deref()) {
        (Some(rows), Some(path)) => read(asked, &locator, rows, path, &warn)?,
        _ => Default::default(),
    };
    let found = next(&locator, &taps, may).map_err(|why| {
        let error = InputError::new(why).at(label.clone(), None).key("next");
        error.allowed("a calibration by learned, taps of one object, and drives that were calibrated")
    })?;
    if !found.left.is_empty() {
        let first: Vec<String> = found.left.iter().take(8).map(|k| lines[*k].to_string()).collect();
        let (left, taps, first) = (found.left.len(), taps.len(), first.join(", "));
        warn(&format!(
            "{left} of {taps} taps tell nothing here: of the other side, of a drive that was not calibrated, or without a distance or a number in {SHIFT} (lines {first})"
        ));
    }
    if shifts.is_some() && found.taps == 0 {
        warn("--shift is not looked at before the first tap, which tells where the object is");
    }
    let data = rows.map(LabTable::hash).transpose()?;
    let of = json!({ "calibration": calibration.checksum, "readings": data, "estimator": asked.estimator, "object": asked.object, "only": asked.only, "within": asked.within, "shift": asked.shift, "same_run": asked.same_run, "zero": asked.zero, "columns": asked.columns });
    let question = Question::new("next", &stem, of);
    let mut destination = context.open(&out, question, &["next.csv", "next.svg"], options.force)?;
    let row = |t: &Tried| {
        let numbers = [t.drive, t.shift, t.signal, t.sigma].map(Field::Number);
        numbers.into_iter().chain([t.status.into()])
    };
    destination.table(framed("next", &[drive.column()], found.tried.iter().map(row))?)?;
    destination.draw("next.svg", || Ok(drawn(&found, drive)))?;
    let mut result = result(&found, drive, &lines);
    result["warnings"] = context.told().into();
    let counts = json!({ "taps": found.taps, "rows": found.tried.len() });
    let identity = hash(&format!("{}\n{data:?}\n{may:?}", calibration.checksum));
    let of = json!({ "name": stem, "hash": identity });
    let body = json!({ "calibration": { "file": label, "checksum": calibration.checksum }, "warnings": context.told(), "result": result });
    let answer = answer(&found, drive, &lines);
    Reply { answer, counts, result, ..Reply::default() }.filed(destination, of, body)
}

fn read(
    asked: &NextRequest,
    locator: &Locator,
    table: LabTable<'_>,
    path: &Path,
    warn: &dyn Fn(&str),
) -> Result<(Vec<Reading>, Vec<usize>), Error> {
    let columns = asked.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let zero = SaidZero::of(asked.zero.as_ref(), [locator])?;
    let label = path.display().to_string();
    let ask = Ask { zero, ..Ask::of_file(&label, &columns, warn) };
    let readings = Readings::of(locator, table, &ask, heading("located"))?;
    let place = match &asked.object {
        Some(column) => Some(readings.column(column).ok_or_else(|| {
            let error = InputError::new("there is no such column").at(label.clone(), Some(1));
            error.key("--object").value(column).allowed(readings.names.join(", "))
        })?),
        None => readings.column(NAME),
    };
    shift_column(&readings.names)?;
    let shifts = readings.numbers(SHIFT)?;
    let mut all = Vec::new();
    for (k, row) in readings.rows.iter().enumerate() {
        let object = place.and_then(|k| row.fields.get(k)).map(|c| c.text().into_owned()).unwrap_or_default();
        let named = place.is_none() || !object.is_empty();
        if let Some(tap) = row.tap.as_ref().filter(|_| named) {
            let shift = shifts.as_ref().map_or(0.0, |all| all[k]);
            all.push((Reading { shift, ..tap.clone() }, object));
        }
    }
    let objects: BTreeSet<String> = all.iter().map(|tap| tap.1.clone()).collect();
    let only = match &asked.only {
        Some(only) if !objects.contains(only) => {
            let error = InputError::new("no tap is of this object").at(label.clone(), None).key("--only");
            return Err(error.value(only).allowed(shown(&objects)).into());
        }
        None if objects.len() > 1 => {
            let error = InputError::new("these are taps of several objects").at(label.clone(), None);
            let error = error.key(asked.object.as_deref().unwrap_or(NAME)).value(shown(&objects));
            return Err(error.allowed("--only WORD: one of them").into());
        }
        only => only.clone(),
    };
    let own = all.iter().filter(|tap| only.as_ref().is_none_or(|only| tap.1 == *only));
    let (taps, lines): (Vec<Reading>, Vec<usize>) = own.map(|(tap, _)| (tap.clone(), tap.line)).unzip();
    if taps.is_empty() {
        warn(&format!("{label}: no row is a tap; this is about the first one"));
    }
    Ok((taps, lines))
}

fn shown(objects: &BTreeSet<String>) -> String {
    let first: Vec<&str> = objects.iter().take(8).map(String::as_str).collect();
    first.join(", ") + if objects.len() > 8 { ", …" } else { "" }
}

fn ends(key: &str, what: &str, said: Option<&[f64]>) -> Result<Option<[f64; 2]>, InputError> {
    match said {
        None => Ok(None),
        Some(&[lo, hi]) if lo <= hi => Ok(Some([lo, hi])),
        Some(other) => {
            let said: Vec<String> = other.iter().map(f64::to_string).collect();
            let error = InputError::new(format!("these are no ends of {what}")).key(key);
            Err(error.value(said.join(",")).allowed("LO,HI with LO ≤ HI"))
        }
    }
}

/// The next tap as JSON; `lines` are the file's lines of the taps so far.
pub fn result(next: &Next, drive: Drive, lines: &[usize]) -> serde_json::Value {
    let best = next.best.map(|k| next.tried[k]);
    let known = next.taps > 0;
    json!({
        "taps": next.taps,
        "distance_mm": known.then_some(next.now[0]),
        "sigma_mm": next.now[1],
        "near_mm": next.near,
        "status": next.status.to_string(),
        "apart_line": next.apart.map(|(k, _)| lines[k]),
        "apart_sigmas": next.apart.map(|(_, by)| by),
        "left_out": next.left.len(),
        drive.column(): best.map(|b| b.drive),
        SHIFT: best.map(|b| b.shift),
        "expected_signal": best.map(|b| b.signal),
        "expected_sigma_mm": best.map(|b| b.sigma),
        "after_taps": next.more.iter().map(|(n, sigma)| json!({ "taps": n, "sigma_mm": sigma })).collect::<Vec<_>>(),
        "least_sigma_mm": next.floor,
        "enough": next.is_enough(),
    })
}

fn answer(next: &Next, drive: Drive, lines: &[usize]) -> String {
    let (symbol, unit) = drive_unit(drive);
    let [a, sigma] = next.now;
    let mut text = match next.taps {
        0 => format!("Nothing is known yet but the calibrated distances (σ {} mm). ", short(sigma)),
        n => format!("{n} tap{} so far: {a:.3} ± {} mm. ", if n == 1 { "" } else { "s" }, short(sigma)),
    };
    if let Some(near) = next.near {
        let _ = write!(text, "{near:.2} mm fits as well. ");
    }
    if let Some((k, by)) = next.apart.filter(|_| next.status.has(Status::INCONSISTENT)) {
        let (line, by) = (lines[k], by.abs());
        text += &format!(
            "They contradict each other: line {line} is {by:.1} standard deviations from what the others say. Mend that first; more taps do not. "
        );
    }
    if next.status.has(Status::OUTSIDE_CALIBRATION) {
        text += "That is outside of the calibrated distances. ";
    }
    let Some((best, floor)) = next.best.map(|k| next.tried[k]).zip(next.floor) else {
        let outside = |t: &Tried| t.status.has(Status::OUTSIDE_CALIBRATION);
        return text
            + if next.tried.iter().all(outside) {
                "From nowhere that the base may stand is the object within the calibrated distances."
            } else {
                "No drive is within the limits of the sensor."
            };
    };
    let floor = short(floor);
    if next.is_enough() {
        return text
            + &format!(
                "More taps bring nothing: what is left, {floor} mm, is the error of the calibration and of the run, which all taps share."
            );
    }
    let moved = if next.moves() {
        format!(" with the base {:.2} mm nearer than where distances are told from", best.shift)
    } else {
        String::new()
    };
    let (drive, sigma, (n, more)) = (best.drive, short(best.sigma), next.more[3]);
    let more = short(more);
    text + &format!(
        "Tap next by {symbol} = {drive:.3}{unit}{moved}: σ is expected to become {sigma} mm. {n} such taps would bring {more} mm, any number of them no less than {floor} mm."
    )
}

fn drawn(next: &Next, drive: Drive) -> Figure {
    let (symbol, unit) = drive_unit(drive);
    // Expected σ over the drive with the base at this shift, within the limits of the sensor or beyond them.
    let curve = |shift: f64, fine: bool| {
        let own = move |t: &&Tried| t.shift == shift && (t.status == Status::OK) == fine;
        next.tried.iter().filter(own).filter(move |t| fine || t.sigma.is_finite()).map(|t| (t.drive, t.sigma))
    };
    let best = next.best.map(|k| (next.tried[k].drive, next.tried[k].sigma));
    let at = next.best.map_or(next.stands, |k| next.tried[k].shift);
    let line = |name: String, colour, shift| Mark::line(Drawn::new(name, colour, curve(shift, true)), 0);
    let ends = [next.tried.first(), next.tried.last()].map(|t| t.map_or(0.0, |t| t.drive));
    let now = Drawn::new("σ so far", 2, ends.map(|x| (x, next.now[1])));
    let x = Axis::new(&format!("drive of the next tap {symbol}"), unit.trim());
    let mut panel = Panel::new("", x, Axis::log("expected σ", "mm"))
        .with(Mark::points(Drawn::new("best", 0, best), Marker::Circle))
        .with(Mark::points(Drawn::new("beyond a limit of the sensor", 1, curve(at, false)), Marker::Cross))
        .with(Mark::line(now, 1));
    if next.moves() {
        let off = |t: &&Tried| (t.shift - next.stands).abs();
        let nearest = next.tried.iter().min_by(|p, q| off(p).total_cmp(&off(q))).map_or(at, |t| t.shift);
        panel = panel.with(line(format!("base {at:.1} mm nearer (best)"), 0, at));
        if nearest != at {
            panel = panel.with(line(format!("base {nearest:.1} mm nearer"), 3, nearest));
        }
    } else {
        panel = panel.with(line("after one tap more".to_owned(), 0, at));
    }
    let caption = "Standard deviation of the distance that is expected after one more tap, against its drive (next.csv).";
    Figure::new("next", "The next tap", caption, vec![panel])
}
