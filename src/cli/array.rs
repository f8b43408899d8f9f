//! `vibrissa locate --array ARRAY.toml READINGS.csv`.

use std::path::Path;

use serde_json::{Value, json};
use vibrissa::command::Context;
use vibrissa::contour::array::{Mounted, answer};
use vibrissa::error::{Error, InputError};
use vibrissa::files::Array;
use vibrissa::locate::stream::Ask;
use vibrissa::locate::{Calibration, SaidZero};
use vibrissa::measure::{Data, Names};
use vibrissa::sink::folder::{Question, hash};
use vibrissa::sink::lab::LabTable;
use vibrissa::sink::run_json;

use super::args::Locate;
use super::reply::Reply;

/// Answers readings of several whiskers into one `located.csv`.
pub fn run(args: &Locate, array: &Path, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&args.common, None)?;
    let warn = |text: &str| context.warn(text);
    // The first of the two files is the readings where the array names the calibrations.
    let readings = match (&args.calibration, &args.readings) {
        (Some(readings), None) => readings,
        (None, _) => return Err(misused("nothing", "the readings are missing").into()),
        (Some(_), Some(other)) => {
            return Err(misused(&other.display().to_string(), "the array names the calibrations").into());
        }
    };
    let described = Array::read(array)?;
    let bytes = Data::load(readings)?;
    let table = LabTable::Text(&bytes[..]);
    let stem = super::stem(readings, "readings");
    let out = super::folder(args.common.out.as_ref(), &stem, "locate");
    let names: Vec<&str> = described.mounts.iter().map(|m| m.name.as_str()).collect();
    if options.plan == Some(true) {
        let (file, by) = (readings.display(), names.join(", "));
        return Ok(Reply::planned(out, |_| format!("would locate readings of {file} by {by}")));
    }
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let (mut whiskers, mut sums, mut inputs) =
        (Vec::new(), Vec::new(), vec![array.to_owned(), readings.clone()]);
    for mount in &described.mounts {
        let calibration = Calibration::read(&mount.calibration, args.common.force)?;
        let mut mounted = mount.open(&calibration, args.estimator, &options)?;
        mounted.locator.same_run = args.same_run;
        whiskers.push(mounted);
        calibration.rig.warnings.iter().for_each(|w| warn(w));
        sums.push(calibration.checksum);
        inputs.push(mount.calibration.clone());
    }
    let file = readings.display().to_string();
    let zero = SaidZero::of(args.zero.as_ref(), whiskers.iter().map(|w| &w.locator))?;
    let ask = Ask { zero, by: super::locate::by(args), ..Ask::of_file(&file, &columns, &warn) };
    let answered = answer(&whiskers, table, &ask, &described.noise)?;
    super::locate::some(&file, answered.rows as u64)?;
    let digest = table.hash()?;
    let asked = json!({
        "readings": digest, "array": format!("{described:?}"), "calibrations": sums, "columns": args.columns, "zero": SaidZero::json(args.zero.as_ref()),
        "estimator": args.estimator.map(|e| e.name()), "same": args.same, "object": args.object, "same_run": args.same_run,
    });
    let identity = hash(&asked.to_string());
    let question = Question { inputs, ..Question::new("locate", &stem, asked) };
    let mut destination = context.open(&out, question, &["located.csv"], Some(args.common.force))?;
    destination.table(answered.table.clone())?;
    let counts = json!({
        "readings": answered.rows, "zero_readings": answered.zeros, "status": answered.status, "combinations": answered.combinations.named(),
    });
    let seconds = context.seconds();
    let by = |w: &Mounted| json!({ "name": w.name, "estimator": w.locator.estimator.name() });
    let body = json!({
        "array": { "file": array.display().to_string(), "whiskers": whiskers.iter().map(by).collect::<Vec<Value>>() },
        "readings": { "file": file, "hash": digest },
        "counts": counts, "seconds": seconds, "warnings": context.told(),
    });
    let document = run_json::document("locate", json!({ "name": stem, "hash": identity }), body);
    let words = answered.combinations.told(|n| n.to_string());
    let text = format!("{} readings of {} whiskers located: {words}\n", answered.rows, whiskers.len());
    let result = json!({ "whiskers": names, "warnings": context.told() });
    Reply { text, counts, seconds, result, ..Reply::default() }.filed(destination, document, out, context)
}

fn misused(value: &str, message: &str) -> InputError {
    let allowed = "vibrissa locate --array ARRAY.toml READINGS.csv";
    InputError::new(message).key("--array").value(value).allowed(allowed)
}
