//! `calibrate` of a sensor with several channels.

use std::time::Instant;

use serde_json::json;
use vibrissa::calibrate::report;
use vibrissa::calibrate::several::several;
use vibrissa::error::{Error, InputError};
use vibrissa::locate::locator::opener;
use vibrissa::measure::{Names, Rig};
use vibrissa::scene::{Drive, Spec};
use vibrissa::sink::folder::Folder;

use super::args::Calibrate;
use super::calibrate::{Begun, begin};
use super::reply::Reply;
use super::say;

/// Files of a calibration.
const FILES: [&str; 2] = ["calibration.toml", "channels.csv"];

/// Calibrates the channels of `rig`, the whisker of `spec`, from `bytes`.
pub fn calibrate(
    args: &Calibrate,
    (bytes, names): (&[u8], &Names),
    (rig, spec): (&Rig, &Spec),
    (said, start): (Option<Drive>, Instant),
) -> Result<Reply, Error> {
    let label = args.data.display().to_string();
    let best = "nothing: each channel is answered by the best of its own";
    let export = "nothing: `vibrissa locate`, or `import vibrissa` in Python, answers several channels";
    let one = [("--estimator", args.estimator.is_some(), best), ("--export", args.export.is_some(), export)];
    of_one_signal(&one)?;
    let Begun { asked, identity, out, question } = begin(args, bytes, (rig, spec), said)?;
    let quiet = asked.run.quiet == Some(true);
    if asked.run.plan == Some(true) {
        return Ok(Reply::planned(out, |to| {
            format!("would calibrate the channels of {label} and write to {to}")
        }));
    }
    let mut folder = Folder::open(&out, question, &FILES, asked.run.force == Some(true))?;
    let found = several((&label, bytes, names), rig, &asked)?;
    say::warnings(quiet, spec.warnings.iter().chain(&found.warnings()));
    found.sensor.check(&opener(&asked.run))?;
    folder.put("calibration.toml", found.sensor.to_text().as_bytes())?;
    folder.put("channels.csv", &found.table()?)?;
    let (text, result, counts) = (found.text(), found.result(), found.counts());
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let document =
        report::document(spec, &identity, (&found.data[0], &asked.hash), [&counts, &seconds, &result]);
    let reply = Reply { text, counts, seconds, result, quiet, ..Reply::default() };
    Ok(reply.filed(folder, &document, (out, start))?.answered())
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
