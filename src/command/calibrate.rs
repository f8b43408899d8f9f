//! `vibrissa calibrate DATA.csv --whisker SPEC.toml`.

use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Asked, Context, Destination, Reply, estimator, folder, named, number, of_one_signal, stem};
use crate::calibrate::{self, Options, coverage, output, report, several};
use crate::error::{Error, InputError};
use crate::estimator::Estimator;
use crate::export::{Export, FILE};
use crate::locate::{Locator, locator::opener};
use crate::measure::{Data, Names, Rig};
use crate::scene::Drive;
use crate::sink::{Question, hash, run_json};

/// Calibrate a whisker from measured strains.
#[derive(Debug, Flags, Deserialize)]
#[command(
    after_help = "Example: vibrissa calibrate examples/prototype-d10.csv --whisker examples/prototype-d10.toml"
)]
pub struct CalibrateRequest {
    /// CSV (comma, semicolon or tab; decimal point or comma) with a_mm, theta_deg (or delta_mm) and one of strain, microstrain,
    /// bridge_mV_per_V, reading, moment_Nmm, force_N; rows with theta (delta) = 0 are zero readings, repeats are welcome, other columns are ignored
    pub data: PathBuf,
    /// Spec of the whisker: D, d, L_a, x_ss, l as one number each, and [model]; [tap] need not be there. Without it: the estimators
    /// learned and, with one drive, paper (with f falling as 1/a)
    #[arg(long, value_name = "SPEC")]
    pub whisker: Option<PathBuf>,
    /// Tap angle of every row, degrees, where no column says
    #[arg(long, value_name = "X", conflicts_with = "delta", value_parser = number)]
    pub theta: Option<f64>,
    /// Displacement of every row, mm, where no column says
    #[arg(long, value_name = "X", value_parser = number)]
    pub delta: Option<f64>,
    /// Column that names the run of each row: rows between which the rig was not set up anew have one zero and one gain
    /// [default: run, session, date or pass]
    #[arg(long, value_name = "COLUMN")]
    pub run: Option<String>,
    /// Columns under other names: a=dist,theta=ang_deg,reading=ch3 (a, theta, delta, strain, microstrain, bridge, reading, run, t, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    /// Distances (mm) and drives within this of each other are one: one width, or two with a comma between; 0: only equal ones
    /// [default: from the gaps of the data]
    #[arg(long, value_name = "WIDTH", value_delimiter = ',', allow_negative_numbers = true, value_parser = number)]
    #[serde(default)]
    pub group: Vec<f64>,
    /// Fit these too, comma between: a_offset, hub, nu, mu, C01/C10, c0, k_theta
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    #[serde(default)]
    pub fit: Vec<String>,
    /// Write what answers readings as a program for a robot too: locate.c, C99 in float and double, needs <math.h> only
    #[arg(long, value_name = "LANGUAGE", value_parser = ["c"])]
    pub export: Option<String>,
    /// Estimator that is exported [default: learned]
    #[arg(long, value_parser = named(Estimator::WORDS), value_name = "NAME", requires = "export")]
    pub estimator: Option<String>,
}

pub fn run(asked: &Asked<CalibrateRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let measured = context.data(&asked.data)?;
    let table = measured.rows();
    let columns = asked.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let columns = asked.run.iter().fold(columns, |names, run| names.with_run(run));
    let label = asked.data.display().to_string();
    let drive = asked.theta.map(|_| Drive::Angle).or(asked.delta.map(|_| Drive::Displacement));
    let read = |path: &Path, drive: Option<Drive>| {
        context.read(path, "spec", |label, text, base| Rig::parse_with(label, text, base, drive))
    };
    let channels =
        |path: &PathBuf| several::whisker(|drive| read(path, drive), (&label, table, &columns), drive);
    let channels = asked.whisker.as_ref().map(channels).transpose()?.flatten();
    if channels.is_some() {
        let best = "nothing: each channel is answered by the best of its own";
        let export = "nothing: `vibrissa locate`, or `import vibrissa` in Python, answers several channels";
        of_one_signal(&[
            ("--estimator", asked.estimator.is_some(), best),
            ("--export", asked.export.is_some(), export),
        ])?;
    }
    let data = channels.is_none().then(|| Data::parse_named(&label, table, &columns)).transpose()?;
    let likely = data.as_ref().and_then(|data| data.drive).or(drive);
    let (rig, mut spec) = match (channels, &asked.whisker, &data) {
        (Some(found), ..) => found,
        (None, Some(path), _) => read(path, likely)?,
        (None, None, Some(data)) if asked.fit.is_empty() => Rig::of_data(data, likely)?,
        _ => {
            let error = InputError::new("there is no model to fit without a whisker").key("--fit");
            return Err(error.value(asked.fit.join(",")).allowed("--whisker SPEC.toml").into());
        }
    };
    let run = context.prepared(&asked.common, Some(&mut spec))?;
    let kind = rig.setup.drive;
    calibrate::same_drive(kind, drive)?;
    let fit = report::named_parameters(&asked.fit, kind)?;
    let digest = table.hash()?;
    let CalibrateRequest { theta, delta, .. } = &**asked;
    let identity = hash(&format!("{digest}\n{}\n{theta:?}{delta:?}{:?}", spec.text, asked.fit));
    let stem = stem(&asked.data, "calibration");
    let out = folder(run.out.as_ref(), &stem, "calibrate");
    let of = json!({ "data": digest, "theta": format!("{theta:?}"), "delta": format!("{delta:?}"), "fit": asked.fit, "columns": asked.columns, "run": asked.run, "group": asked.group, "export": asked.export, "estimator": asked.estimator });
    let question = Question { name: stem, ..Question::of_scene("calibrate", &spec, of) };
    let group = calibrate::widths(&asked.group)?;
    let options = Options { drive: theta.or(*delta), group, fit, run, hash: digest };
    if options.run.plan == Some(true) {
        let Some(data) = &data else {
            let what = format!("would calibrate the channels of {label} and write to");
            return Ok(Reply::planned(out, |to| format!("{what} {to}")));
        };
        let (file, rows, signal, name) = (&data.file, data.rows.len(), data.unit.column(), &spec.name);
        let drive = data.drive.map_or("no drive column", Drive::column);
        let what = format!("{file}: {rows} rows, {drive}, {signal}; whisker {name}; would write to");
        let (counts, in_force) = (json!({ "rows": rows }), run_json::in_force(&spec));
        let result = json!({ "in_force": in_force, "signal": signal });
        return Ok(Reply { counts, result, ..Reply::planned(out, |to| format!("{what} {to}")) });
    }
    context.warn_all(&spec.warnings);
    let names = if data.is_some() { &output::FILES[..] } else { &["calibration.toml", "channels.csv"] };
    let mut destination = context.open(&out, question, names, options.run.force)?;
    let reply = match &data {
        Some(data) => of_signal(asked, (data, &rig), &options, &mut destination)?,
        None => {
            let found = several::several((&label, table, &columns), &rig, &options)?;
            context.warn_all(found.warnings());
            found.sensor.check(&opener(&options.run))?;
            destination.put(names[0], found.sensor.to_text().into_bytes())?;
            destination.table(found.table()?)?;
            let (text, counts, result) = (found.text(), found.counts(), found.result());
            Reply { text, counts, result, ..Reply::default() }
        }
    };
    let of = json!({ "name": spec.name, "hash": identity, "text": spec.text });
    let body = json!({
        "data": { "file": label, "hash": options.hash }, "in_force": run_json::in_force(&spec),
        "material_fit": run_json::material_fit(&spec, None), "warnings": spec.warnings, "result": reply.result,
    });
    Ok(reply.filed(destination, of, body)?.answered())
}

fn of_signal(
    asked: &CalibrateRequest,
    (data, rig): (&Data, &Rig),
    options: &Options,
    destination: &mut Destination<'_>,
) -> Result<Reply, Error> {
    let found = calibrate::calibrate(data, rig, options)?;
    destination.context.warn_all(&found.warnings);
    let locator = found.calibration.opened(&opener(&options.run))?;
    let calibration = asked.export.as_ref().map(|_| found.calibration.clone().sealed());
    let exported = calibration.map_or(Ok(()), |calibration| {
        let of = |e| Locator::new(&calibration, "calibration.toml", Some(e), &opener(&options.run));
        let other = estimator(asked.estimator.as_deref())?.map(of).transpose()?;
        let export = Export::new(other.as_ref().unwrap_or(&locator), &calibration)?;
        destination.put(FILE, export.text().into_bytes())
    });
    let refused = match exported {
        // The calibration is written even if the export fails.
        Err(Error::Input(e)) => {
            Some(InputError { message: format!("{} (the calibration is written)", e.message), ..e })
        }
        other => other.map(|()| None)?,
    };
    let covered = coverage::coverage(&found);
    let result = report::result(&found, rig, &covered);
    destination.put("calibration.toml", found.calibration.to_text().into_bytes())?;
    output::tables(&found, data, &locator)?.into_iter().try_for_each(|table| destination.table(table))?;
    let (text, counts) = (report::text(&found, data, rig, &covered), report::counts(&found, data));
    Ok(Reply { text, counts, result, refused, ..Reply::default() })
}
