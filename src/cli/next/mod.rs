//! `vibrissa next CAL.toml [READINGS.csv]`.

mod shown;

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

use serde_json::json;
use vibrissa::error::{Error, InputError};
use vibrissa::figure::{self, Format, Style};
use vibrissa::locate::next::{May, next};
use vibrissa::locate::object::{By, NAME, UnlocatedTap};
use vibrissa::locate::sequence::{SHIFT, shift_column};
use vibrissa::locate::stream::Ask;
use vibrissa::locate::table::Readings;
use vibrissa::locate::{Calibration, Locator, SaidZero, locator::opener};
use vibrissa::measure::{Data, Names};
use vibrissa::scene::RunOptions;
use vibrissa::sink::folder::{Folder, Question, hash};
use vibrissa::sink::run_json;

use super::args;
use super::reply::Reply;
use super::say;
use shown::{answer, drawn, result, table};

/// Reads the taps so far and says which drive the next one should have.
pub fn run(args: &args::Next) -> Result<Reply, Error> {
    let start = Instant::now();
    let options = args.common.over(&RunOptions::default());
    let calibration = Calibration::read(&args.calibration, args.common.force)?;
    let label = args.calibration.display().to_string();
    let locator = Locator::new(&calibration, &label, None, &opener(&options))?;
    let drive = locator.rig.setup.drive;
    let within =
        ends("--within", "drives", args.within.as_deref())?.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    let shifts = ends("--shift", "places of the base", args.shift.as_deref())?;
    let may = May { within, shifts, same_run: args.same_run };
    let stem = super::stem(args.readings.as_deref().unwrap_or(&args.calibration), "taps");
    let out = super::folder(args.common.out.as_ref(), &stem, "next");
    if options.plan == Some(true) {
        return Ok(Reply::planned(out, |to| format!("would say the next tap in {to}")));
    }
    let told = say::Told::new(args.common.quiet);
    let warn = |text: &str| told.warn(text);
    let bytes = args.readings.as_deref().map(Data::load).transpose()?;
    let (taps, lines) = match (&bytes, args.readings.as_deref()) {
        (Some(bytes), Some(path)) => read(args, &locator, bytes, path, &warn)?,
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
    let data = bytes.as_ref().map(|bytes| hash(&String::from_utf8_lossy(bytes)));
    let asked = json!({ "calibration": calibration.checksum, "readings": data, "object": args.object, "only": args.only, "within": args.within, "shift": args.shift, "same_run": args.same_run, "zero": SaidZero::json(args.zero.as_ref()), "columns": args.columns });
    let inputs = std::iter::once(args.calibration.clone()).chain(args.readings.clone()).collect();
    let question = Question { inputs, ..Question::new("next", &stem, asked) };
    let mut folder = Folder::open(&out, question, &["next.csv", "next.svg"], args.common.force)?;
    let drawn = figure::files(&drawn(&found, drive), &Style::default(), &[Format::Svg])?;
    folder.put("next.csv", table(&found, drive).as_bytes())?;
    drawn.iter().try_for_each(|(_, bytes)| folder.put("next.svg", bytes))?;
    let mut result = result(&found, drive, &lines);
    result["warnings"] = told.texts().into();
    let counts = json!({ "taps": found.taps, "rows": found.tried.len() });
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let identity = hash(&format!("{}\n{data:?}\n{may:?}", calibration.checksum));
    let told = json!({ "calibration": { "file": label, "checksum": calibration.checksum }, "counts": counts, "seconds": seconds, "warnings": told.texts(), "result": result });
    let document = run_json::document("next", json!({ "name": stem, "hash": identity }), told);
    let answer = answer(&found, drive, &lines);
    Reply { answer, counts, seconds, result, ..Reply::default() }.filed(folder, &document, (out, start))
}

/// The taps of one object in a file.
fn read(
    args: &args::Next,
    locator: &Locator,
    bytes: &[u8],
    path: &Path,
    warn: &dyn Fn(&str),
) -> Result<(Vec<UnlocatedTap>, Vec<usize>), Error> {
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let zero = SaidZero::of(args.zero.as_ref(), [locator])?;
    let label = path.display().to_string();
    let ask = Ask {
        columns: &columns,
        zero,
        label: Some(&label),
        keep: true,
        by: By::Unsaid,
        interval: false,
        warn,
    };
    let readings = Readings::of(locator, bytes, &ask, &["zero"])?;
    let place = match &args.object {
        Some(column) => Some(readings.column(column).ok_or_else(|| {
            let error = InputError::new("there is no such column").at(label.clone(), Some(1));
            error.key("--object").value(column).allowed(readings.names.join(", "))
        })?),
        None => readings.column(NAME),
    };
    let word = |fields: &[String]| {
        place.and_then(|k| fields.get(k)).map(|f| f.trim().to_owned()).unwrap_or_default()
    };
    shift_column(&readings.names)?;
    let shifts = readings.numbers(SHIFT)?;
    let mut zeros = 0;
    let mut all = Vec::new();
    for (k, row) in readings.rows.iter().enumerate() {
        zeros += u64::from(row.rests);
        // A row without an object is of none, where others have one.
        let named = place.is_none() || !word(&row.fields).is_empty();
        if !row.rests && row.drive.is_finite() && row.signal.is_finite() && named {
            let shift = shifts.as_ref().map_or(0.0, |all| all[k]);
            let (drive, signal, share, line) = (row.drive, row.signal, row.share, row.line);
            let tap = UnlocatedTap { line, drive, signal, share, zero: zeros, shift };
            all.push((tap, line, word(&row.fields)));
        }
    }
    let taps = || all.iter();
    let objects: BTreeSet<String> = taps().map(|tap| tap.2.clone()).collect();
    let only = match &args.only {
        Some(only) if !objects.contains(only) => {
            let error = InputError::new("no tap is of this object").at(label.clone(), None).key("--only");
            return Err(error.value(only).allowed(shown(&objects)).into());
        }
        None if objects.len() > 1 => {
            let error = InputError::new("these are taps of several objects").at(label.clone(), None);
            let error = error.key(args.object.as_deref().unwrap_or(NAME)).value(shown(&objects));
            return Err(error.allowed("--only WORD: one of them").into());
        }
        only => only.clone(),
    };
    let own = taps().filter(|tap| only.as_ref().is_none_or(|only| tap.2 == *only));
    let (taps, lines): (Vec<UnlocatedTap>, Vec<usize>) = own.map(|tap| (tap.0, tap.1)).unzip();
    if taps.is_empty() {
        warn(&format!("{label}: no row is a tap; this is about the first one"));
    }
    Ok((taps, lines))
}

fn shown(objects: &BTreeSet<String>) -> String {
    let first: Vec<&str> = objects.iter().take(8).map(String::as_str).collect();
    first.join(", ") + if objects.len() > 8 { ", …" } else { "" }
}

/// The two ends of what a flag says.
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
