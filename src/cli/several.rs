//! `calibrate` and `locate` of a sensor with several channels.

use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};
use vibrissa::calibrate::report;
use vibrissa::calibrate::several::{Calibration, several};
use vibrissa::error::{Error, InputError};
use vibrissa::locate::object::By;
use vibrissa::locate::stream::Ask;
use vibrissa::locate::table::field;
use vibrissa::locate::{Located, SaidZero, Sensor, Several, locator::opener};
use vibrissa::measure::{Data, Names, Rig};
use vibrissa::scene::{Drive, RunOptions, Spec};
use vibrissa::sink::folder::{Folder, Question, hash, hash_all};
use vibrissa::sink::run_json;

use super::args::{Calibrate, Locate};
use super::calibrate::{Begun, begin};
use super::reply::Reply;
use super::say;

/// Files of a calibration.
const FILES: [&str; 2] = ["calibration.toml", "channels.csv"];
/// Columns that answers add.
const ADDED: [&str; 4] = ["zero", "distance_mm", "sigma_mm", "status"];

/// Calibrates the channels of `rig`, the whisker of `spec`, from `bytes`.
pub fn calibrate(
    args: &Calibrate,
    (bytes, names): (&[u8], &Names),
    (rig, spec): (&Rig, &Spec),
    (said, start): (Option<Drive>, Instant),
) -> Result<Reply, Error> {
    let label = args.data.display().to_string();
    let one = [
        ("--export", !args.export.is_empty(), "a spec of one signal in [sensor]"),
        ("--estimator", args.estimator.is_some(), "nothing: each channel is answered by the best of its own"),
    ];
    of_one_signal(&one)?;
    let Begun { asked, identity, out, question } = begin(args, bytes, (rig, spec), said)?;
    let quiet = asked.run.quiet == Some(true);
    if asked.run.plan == Some(true) {
        let text = format!(
            "would calibrate the channels of {label} and write to {}; nothing was run\n",
            out.display()
        );
        return Ok(Reply { text, out: Some(out), ..Reply::default() });
    }
    let mut folder = Folder::open(&out, question, &FILES, asked.run.force == Some(true))?;
    let found = several((&label, bytes, names), rig, &asked)?;
    if !quiet {
        spec.warnings.iter().for_each(say::warning);
        for (of, (name, _)) in found.each.iter().zip(&found.sensor.channels) {
            of.warnings.iter().for_each(|text| say::warning(format_args!("{name}: {text}")));
        }
    }
    for (name, bytes) in
        [("calibration.toml", found.sensor.to_text().into_bytes()), ("channels.csv", found.table()?)]
    {
        folder.put(name, &bytes)?;
    }
    let (text, result) = told(&found);
    let counts = json!({ "rows": found.data[0].rows.len(), "taps": found.taps.len(), "used": found.taps.iter().filter(|t| t.used).count() });
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let document =
        report::document(spec, &identity, (&found.data[0], &asked.hash), [&counts, &seconds, &result]);
    folder.run_json(&document)?;
    let written = folder.finish()?;
    let text = text
        + &format!("wrote {} in {:.2} s\n", super::listed(&written.files), start.elapsed().as_secs_f64());
    let reply = Reply {
        text,
        out: Some(out),
        files: written.files,
        counts,
        seconds,
        result,
        quiet,
        ..Reply::default()
    };
    Ok(reply.removing(&written.removed))
}

/// Refuses options that are said of one signal: each with whether it was said, and what is allowed.
pub(super) fn of_one_signal(options: &[(&str, bool, &str)]) -> Result<(), InputError> {
    match options.iter().find(|(_, said, _)| *said) {
        Some((key, _, allowed)) => {
            let error = InputError::new("this is said of one signal, and the sensor has several channels");
            Err(error.key(*key).allowed(*allowed))
        }
        None => Ok(()),
    }
}

/// Errors of each channel and of all together, for people and for programs.
fn told(found: &Calibration) -> (String, Value) {
    let mut text = String::new();
    let (rms, within, n) = found.errors();
    let mut channels = Vec::new();
    for (k, (name, c)) in found.sensor.channels.iter().enumerate() {
        let side = &found.each[k].sides[0];
        let held = side.held_out(found.each[k].winner).and_then(|h| h.rms(|_| true).0);
        let held_words = held.map_or("unknown".to_owned(), |rms| format!("{rms:.3} mm"));
        text += &format!(
            "{name}: {} taps, noise {:.3e}; alone it tells left-out distances to {held_words}\n",
            side.used, c.noise
        );
        channels.push(json!({ "name": name, "used": side.used, "noise": c.noise, "held_out_rms_mm": held }));
    }
    text += &format!(
        "all channels together tell {n} calibrated taps to {rms:.3} mm (root mean square); {:.0} % lie within one sigma\n",
        100.0 * within
    );
    let result = json!({ "channels": channels, "covariance": found.sensor.covariance, "rms_mm": rms, "within_sigma": within, "taps": n });
    (text, result)
}

/// Answers a file of readings by the calibration of several channels in `text` of the file at `path`.
pub fn locate(
    args: &Locate,
    (path, text): (&Path, &str),
    options: &RunOptions,
    start: Instant,
) -> Result<Reply, Error> {
    let label = path.display().to_string();
    let sensor = Sensor::parse(&label, text, args.common.force)?;
    let readings = args.readings.as_deref().filter(|p| *p != Path::new("-"));
    let Some(from) = readings else {
        let error = InputError::new("several channels are read from a file").key("READINGS");
        return Err(error.allowed("a CSV of readings").into());
    };
    let one = [
        ("--zero", args.zero.is_some(), "rows without contact, which tell the zero of each channel"),
        ("--estimator", args.estimator.is_some(), "nothing: each channel is answered by the best of its own"),
    ];
    of_one_signal(&one)?;
    let mut answers = Several::new(&sensor, &label, &opener(options))?;
    answers.locators.iter_mut().for_each(|l| l.same_run = args.same_run);
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let bytes = Data::load(from)?;
    let digest = hash_all(&mut bytes.as_slice()).map_err(|e| Error::Run(e.to_string()))?;
    let (quiet, shown) = (args.common.quiet, from.display().to_string());
    let warn = |text: &str| {
        if !quiet {
            say::warning(text.replace(", or --zero", ""))
        }
    };
    let zero = SaidZero::of(None, [&answers.locators[0]])?;
    let ask = Ask { columns: &columns, zero, label: Some(&shown), keep: true, by: By::Unsaid, warn: &warn };
    if options.plan == Some(true) {
        let text = format!(
            "would locate readings of {shown} by {} channels; nothing was run\n",
            sensor.channels.len()
        );
        return Ok(Reply { text, ..Reply::default() });
    }
    let (header, rows) = answers.read(&bytes, &ask, &ADDED)?;
    let stem = from.file_stem().map_or_else(|| "readings".into(), |s| s.to_string_lossy().into_owned());
    let out = super::folder(args.common.out.as_ref(), &stem, "locate");
    let identity = hash(&format!("{digest}\n{text}"));
    let asked = json!({ "readings": digest, "calibration": hash(text), "columns": args.columns, "same_run": args.same_run });
    let inputs = vec![path.to_owned(), from.to_owned()];
    let question = Question { inputs, ..Question::new("locate", &stem, asked) };
    let mut folder = Folder::open(&out, question, &["located.csv"], args.common.force)?;
    let mut table = header;
    let mut status = std::collections::BTreeMap::<String, u64>::new();
    for row in &rows {
        table.extend_from_slice(&row.each[0].kept);
        let Located { distance, sigma, status: words } = row.located;
        [distance, sigma].into_iter().for_each(|x| field(&mut table, x));
        table.extend(format!("{words}\n").bytes());
        for word in words.to_string().split('+') {
            *status.entry(word.to_owned()).or_default() += 1;
        }
    }
    folder.put("located.csv", &table)?;
    let counts = json!({ "readings": rows.len(), "zero_readings": rows.iter().filter(|r| r.each[0].rests).count(), "status": status });
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    folder.run_json(&run_json::document(
        "locate",
        json!({ "name": stem, "hash": identity }),
        json!({
            "calibration": { "file": label, "channels": sensor.channels.iter().map(|c| &c.0).collect::<Vec<_>>() },
            "readings": { "file": shown, "hash": digest },
            "counts": counts,
            "seconds": seconds,
        }),
    ))?;
    let written = folder.finish()?;
    let words: Vec<String> = status.iter().map(|(w, n)| format!("{n} {w}")).collect();
    let text = format!(
        "{} readings located by {} channels together: {}\nwrote {} in {:.2} s\n",
        rows.len(),
        sensor.channels.len(),
        words.join(", "),
        super::listed(&written.files),
        start.elapsed().as_secs_f64()
    );
    let reply = Reply { text, out: Some(out), files: written.files, counts, seconds, ..Reply::default() };
    Ok(reply.removing(&written.removed))
}
