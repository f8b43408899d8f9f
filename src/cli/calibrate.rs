//! `vibrissa calibrate DATA.csv --whisker SPEC.toml`.

use std::path::PathBuf;
use std::time::Instant;

use serde_json::json;
use vibrissa::calibrate::{self, Options, coverage, output, report, several};
use vibrissa::error::{Error, InputError};
use vibrissa::export::{Export, FILE};
use vibrissa::locate::{Calibration, Locator, locator::opener};
use vibrissa::measure::{Data, Names, Rig};
use vibrissa::scene::{Drive, RunOptions, Spec};
use vibrissa::sink::folder::{Folder, Question, hash};
use vibrissa::sink::run_json;

use super::args::Calibrate;
use super::interrupt::prepared;
use super::reply::Reply;
use super::say;

/// Reads data and whisker, calibrates, writes the files.
pub fn run(args: &Calibrate) -> Result<Reply, Error> {
    let start = Instant::now();
    let bytes = Data::load(&args.data)?;
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let columns = args.run.iter().fold(columns, |names, run| names.with_run(run));
    let label = args.data.display().to_string();
    let said = args.theta.map(|_| Drive::Angle).or(args.delta.map(|_| Drive::Displacement));
    let channels = |path: &PathBuf| {
        several::whisker(|drive| Rig::read_with(path, drive), (&label, &bytes, &columns), said)
    };
    if let Some((rig, spec)) = args.whisker.as_ref().map(channels).transpose()?.flatten() {
        return super::several::calibrate(args, (&bytes, &columns), (&rig, &spec), (said, start));
    }
    let data = Data::parse_named(&label, &bytes, &columns)?;
    let (rig, spec) = whisker(args, &data, data.drive.or(said))?;
    let Begun { asked, identity, out, question } = begin(args, &bytes, (&rig, &spec), said)?;
    drop(bytes);
    let options = asked.run.clone();
    let quiet = options.quiet == Some(true);
    if options.plan == Some(true) {
        return Ok(planned(&data, &spec, out));
    }
    say::warnings(quiet, &spec.warnings);
    let mut folder = Folder::open(&out, question, &output::FILES, options.force == Some(true))?;
    let found = calibrate::calibrate(&data, &rig, &asked)?;
    say::warnings(quiet, &found.warnings);
    let locator = found.calibration.opened(&opener(&options))?;
    let refused = beside(exported(args, &found.calibration, &locator, &options, &mut folder))?;
    let covered = coverage::coverage(&found);
    let result = report::result(&found, &rig, &covered);
    let counts = report::counts(&found, &data);
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let told = [&counts, &seconds, &result];
    let document = report::document(&spec, &identity, (&data, &asked.hash), told);
    let written = output::write(&found, &data, &locator, &document, folder)?;
    let text = report::text(&found, &data, &rig, &covered);
    let reply = Reply { text, counts, seconds, result, quiet, refused, ..Reply::default() };
    Ok(reply.written(out, written, start).answered())
}

/// What every calibration begins with.
pub(super) struct Begun {
    pub asked: Options,
    /// Hash of data, spec and what changes the answer.
    pub identity: String,
    pub out: PathBuf,
    pub question: Question,
}

/// Options, folder and question of a calibration from `bytes` of the whisker `rig` of `spec`; `said`: what drives it, where the user says a drive.
pub(super) fn begin(
    args: &Calibrate,
    bytes: &[u8],
    (rig, spec): (&Rig, &Spec),
    said: Option<Drive>,
) -> Result<Begun, Error> {
    let run = prepared(&args.common, spec)?;
    let kind = rig.setup.drive;
    calibrate::same_drive(kind, said)?;
    let fit = report::named_parameters(&args.fit, kind)?;
    let digest = hash_bytes(bytes)?;
    let identity = hash(&format!("{digest}\n{}\n{:?}{:?}{:?}", spec.text, args.theta, args.delta, args.fit));
    let stem = super::stem(&args.data, "calibration");
    let out = super::folder(run.out.as_ref(), &stem, "calibrate");
    let of = json!({ "data": digest, "theta": format!("{:?}", args.theta), "delta": format!("{:?}", args.delta), "fit": args.fit, "columns": args.columns, "run": args.run, "group": args.group, "export": args.export, "estimator": args.estimator.map(|e| e.name()) });
    let mut question = Question { name: stem, ..Question::of_scene("calibrate", spec, of) };
    question.inputs.push(args.data.clone());
    let group = calibrate::widths(&args.group)?;
    let asked = Options { drive: args.theta.or(args.delta), group, fit, run, hash: digest };
    Ok(Begun { asked, identity, out, question })
}

/// Why there is no exported program: the calibration is written also where none can be made of it.
fn beside(exported: Result<(), Error>) -> Result<Option<InputError>, Error> {
    match exported {
        Err(Error::Input(e)) => {
            Ok(Some(InputError { message: format!("{} (the calibration is written)", e.message), ..e }))
        }
        other => other.map(|()| None),
    }
}

/// Writes the file of `--export`, if it was asked for: `calibration` as `--estimator` answers, or as `won`, the one that it chose.
fn exported(
    args: &Calibrate,
    calibration: &Calibration,
    won: &Locator,
    options: &RunOptions,
    folder: &mut Folder,
) -> Result<(), Error> {
    if args.export.is_none() {
        return Ok(());
    }
    let calibration = calibration.clone().sealed();
    let asked = |e| Locator::new(&calibration, "calibration.toml", Some(e), &opener(options));
    let asked = args.estimator.map(asked).transpose()?;
    let export = Export::new(asked.as_ref().unwrap_or(won), &calibration)?;
    folder.put(FILE, export.text().as_bytes())
}

/// The whisker of `--whisker`, or one of which nothing is known.
fn whisker(args: &Calibrate, data: &Data, drive: Option<Drive>) -> Result<(Rig, Spec), Error> {
    if let Some(path) = &args.whisker {
        return Ok(Rig::read_with(path, drive)?);
    }
    if !args.fit.is_empty() {
        let error = InputError::new("there is no model to fit without a whisker").key("--fit");
        return Err(error.value(args.fit.join(",")).allowed("--whisker SPEC.toml").into());
    }
    Ok(Rig::of_data(data, drive)?)
}

fn hash_bytes(mut bytes: &[u8]) -> Result<String, Error> {
    vibrissa::sink::folder::hash_all(&mut bytes).map_err(|e| Error::Run(e.to_string()))
}

fn planned(data: &Data, spec: &Spec, out: PathBuf) -> Reply {
    let (file, name, rows, signal) = (&data.file, &spec.name, data.rows.len(), data.unit.column());
    let drive = data.drive.map_or("no drive column", Drive::column);
    Reply {
        counts: json!({ "rows": rows }),
        result: json!({ "in_force": run_json::in_force(spec), "signal": signal }),
        ..Reply::planned(out, |to| {
            format!("{file}: {rows} rows, {drive}, {signal}; whisker {name}; would write to {to}")
        })
    }
}
