//! `vibrissa taps RAW.csv`: rests and taps of a raw record.

mod output;

use std::path::PathBuf;

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Common, Context, Reply, folder, meant, named, number, stem};
use crate::error::Error;
use crate::measure::Names;
use crate::record::{Kind, Record, Take, find};
use crate::scene::Drive;
use crate::sink::folder::Question;
use crate::sink::run_json;
use output::{FILES, Labels};

/// What of a contact is read, in words.
const TAKES: [(&str, Take, &str); 3] = [
    ("auto", Take::Auto, "A plateau where there is one, else the peak"),
    ("plateau", Take::Plateau, "Plateaus alone"),
    ("peak", Take::Peak, "Peaks alone"),
];

/// Taps out of a raw signal.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa taps raw.csv --columns t=Zeit,reading=Kanal --theta 4 --a 25")]
pub struct TapsRequest {
    /// CSV with t_s and the signal (strain, microstrain, bridge_mV_per_V, reading …) of each sample; perhaps theta_deg or delta_mm, a_mm, run
    pub raw: PathBuf,
    /// What of a contact is read
    #[arg(long, value_parser = named(TAKES), value_name = "WHAT", default_value = "auto")]
    pub take: String,
    /// Distance of all taps, or of each in the order of time, mm
    #[arg(long, value_name = "MM,…", value_delimiter = ',', value_parser = number)]
    pub a: Option<Vec<f64>>,
    /// Drive of all taps, or of each, degrees, where the record has none
    #[arg(long, value_name = "DEG,…", value_delimiter = ',', value_parser = number, conflicts_with = "delta")]
    pub theta: Option<Vec<f64>>,
    /// The same, mm
    #[arg(long, value_name = "MM,…", value_delimiter = ',', value_parser = number)]
    pub delta: Option<Vec<f64>>,
    /// Columns under other names: t=Zeit,reading=ch3 (t, theta, delta, strain, microstrain, bridge, reading, a, run, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
    /// Flags of every command
    #[command(flatten)]
    #[serde(flatten)]
    pub common: Common,
}

/// Finds taps in a raw record.
pub fn run(asked: &TapsRequest, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&asked.common, None)?;
    let label = asked.raw.display().to_string();
    let stem = stem(&asked.raw, "taps");
    let out = folder(options.out.as_ref(), &stem, "taps");
    let columns = asked.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let measured = context.data(&asked.raw)?;
    let record = Record::parse(&label, measured.rows(), &columns)?;
    let digest = measured.rows().hash()?;
    let samples = record.time.len();
    if options.plan == Some(true) {
        return Ok(Reply::planned(out, |_| format!("would look for taps in {samples} samples of {label}")));
    }
    let ignored = || format!("columns that are not used: {}", record.ignored.join(", "));
    context.warn_all((!record.ignored.is_empty()).then(ignored));
    let empty = || format!("lines without a signal are left out: {}", record.empty);
    context.warn_all((record.empty > 0).then(empty));
    let angles = asked.theta.clone().map(|values| (Drive::Angle, values));
    let drive = angles.or_else(|| Some((Drive::Displacement, asked.delta.clone()?)));
    let labels = Labels { a: asked.a.clone().unwrap_or_default(), drive };
    let take = meant(("word", "--take"), Some(&asked.take), &TAKES)?.unwrap_or(Take::Auto);
    let (readings, rest) = find(&record, take)?;
    labels.check(&record, &readings)?;
    let of = json!({ "raw": digest, "columns": asked.columns, "take": format!("{take:?}"), "a": asked.a, "theta": asked.theta, "delta": asked.delta });
    let question = Question::new("taps", &stem, of);
    let mut destination = context.open(&out, question, &FILES, options.force)?;
    let [.., figure_file] = FILES;
    destination.table(output::taps(&record, &readings, &labels)?)?;
    destination.table(output::readings(&record, &readings)?)?;
    destination.draw(figure_file, || Ok(output::figure(&record, &rest, &readings)))?;
    let count = |kind: Kind| readings.iter().filter(|r| r.kind == kind).count();
    let [rests, plateaus, peaks] = [Kind::Rest, Kind::Plateau, Kind::Peak].map(count);
    let (taps, noise) = (plateaus + peaks, rest.noise);
    let counts = json!({ "samples": samples, "rests": rests, "plateaus": plateaus, "peaks": peaks });
    let (seconds, result) = (context.seconds(), json!({ "noise": noise, "taps": taps }));
    let told = json!({ "raw": { "file": label, "hash": digest }, "counts": counts, "seconds": seconds, "result": result });
    let document = run_json::document("taps", json!({ "name": stem, "hash": digest }), told);
    let answer = format!(
        "{taps} taps in {samples} samples ({plateaus} stand still, {peaks} are peaks), rests: {rests}; noise of a sample {noise:.3e}. Look at taps.svg before you use them."
    );
    Reply { answer, counts, seconds, result, ..Reply::default() }.filed(destination, document, out, context)
}
