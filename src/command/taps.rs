//! `vibrissa taps RAW.csv`: rests and taps of a raw record.

use std::path::PathBuf;

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::plan::rounded;
use super::reply::framed;
use super::{Asked, Context, Reply, folder, meant, named, number, stem};
use crate::error::{Error, InputError};
use crate::figure::{Axis, Figure, Mark, Marker, Panel, Path};
use crate::measure::{Names, names::DISTANCE};
use crate::record::{Kind, Reading, Record, Take, find, rest::Rest};
use crate::scene::Drive;
use crate::sink::{Field, Frame, Question, Values, heading};

/// Choices of `--take`: word, value, help.
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
}

pub fn run(asked: &Asked<TapsRequest>, context: &Context<'_>) -> Result<Reply, Error> {
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
    let angles = asked.theta.as_deref().map(|values| (Drive::Angle, values));
    let drive = angles.or_else(|| Some((Drive::Displacement, asked.delta.as_deref()?)));
    let labels = (asked.a.as_deref().unwrap_or_default(), drive);
    let take = meant(("word", "--take"), Some(&asked.take), &TAKES)?.unwrap_or(Take::Auto);
    let (readings, rest) = find(&record, take)?;
    check(labels, &record, &readings)?;
    let of = json!({ "raw": digest, "columns": asked.columns, "take": format!("{take:?}"), "a": asked.a, "theta": asked.theta, "delta": asked.delta });
    let question = Question::new("taps", &stem, of);
    let mut destination = context.open(&out, question, &FILES, options.force)?;
    let [.., figure_file] = FILES;
    destination.table(taps_table(&record, &readings, labels)?)?;
    destination.table(readings_table(&record, &readings)?)?;
    destination.draw(figure_file, || Ok(drawn(&record, &rest, &readings)))?;
    let count = |kind: Kind| readings.iter().filter(|r| r.kind == kind).count();
    let [rests, plateaus, peaks] = [Kind::Rest, Kind::Plateau, Kind::Peak].map(count);
    let (taps, noise) = (plateaus + peaks, rest.noise);
    let counts = json!({ "samples": samples, "rests": rests, "plateaus": plateaus, "peaks": peaks });
    let result = json!({ "noise": noise, "taps": taps });
    let body = json!({ "raw": { "file": label, "hash": digest }, "result": result });
    let answer = format!(
        "{taps} taps in {samples} samples ({plateaus} stand still, {peaks} are peaks), rests: {rests}; noise of a sample {noise:.3e}. Look at taps.svg before you use them."
    );
    let reply = Reply { answer, counts, result, ..Reply::default() };
    reply.filed(destination, json!({ "name": stem, "hash": digest }), body)
}

const FILES: [&str; 3] = ["taps.csv", "readings.csv", "taps.svg"];
const DRAWN: usize = 4000;

/// Labels from the user: distances in mm, and drives if the record has none; one for all taps, or one each.
type Labels<'a> = (&'a [f64], Option<(Drive, &'a [f64])>);

fn check((a, drive): Labels<'_>, record: &Record, readings: &[Reading]) -> Result<(), InputError> {
    let taps = readings.iter().filter(|r| r.kind != Kind::Rest).count();
    let fits = |key: &str, values: &[f64]| match values.len() {
        _ if values.iter().any(|x| !x.is_finite() || *x == 0.0 || key == "--a" && *x < 0.0) => {
            let said: Vec<String> = values.iter().map(f64::to_string).collect();
            let error = InputError::new("this labels no tap").key(key).value(said.join(","));
            Err(error.allowed(if key == "--a" { "distances > 0 in mm" } else { "drives that are not 0" }))
        }
        n if n <= 1 || n == taps => Ok(()),
        n => {
            let error = InputError::new("these are not as many as the taps that were found").key(key);
            Err(error.value(n).allowed(format!("one value for all taps, or {taps}: taps.svg shows them")))
        }
    };
    fits("--a", a)?;
    if let Some((kind, values)) = drive {
        let key = if kind == Drive::Angle { "--theta" } else { "--delta" };
        if record.drive.is_some() {
            let error = InputError::new("this record has a drive of its own").key(key);
            return Err(error.allowed("a record without the column, or no drive on the command line"));
        }
        fits(key, values)?;
    }
    Ok(())
}

fn own(values: &[f64], k: usize) -> Option<f64> {
    if values.len() == 1 { values.first().copied() } else { values.get(k).copied() }
}

/// taps.csv, as calibrate and locate read it. Without drives in the record the rest is subtracted; with drives, rests are rows of drive 0.
fn taps_table(record: &Record, readings: &[Reading], (a, said): Labels<'_>) -> Result<Frame, Error> {
    let drive = record.drive.as_ref().map(|(kind, _)| *kind).or(said.map(|(kind, _)| kind));
    let own_distance = record.labels.iter().position(|(name, _)| name == DISTANCE);
    let with_distance = own_distance.is_some() || !a.is_empty();
    let others: Vec<usize> = (0..record.labels.len()).filter(|k| record.labels[*k].0 != DISTANCE).collect();
    let known = with_distance.then_some(DISTANCE).into_iter().chain(drive.map(Drive::column));
    let mut table = Frame::of("taps.csv", known.chain([record.unit.column(), "t_s"]));
    for k in &others {
        table.add(record.labels[*k].0.clone(), Values::new(heading::Kind::Word));
    }
    if own_distance.is_some() {
        table.columns[0] = Values::new(heading::Kind::Word);
    }
    let mut tap = 0;
    for reading in readings.iter().filter(|r| r.kind != Kind::Rest || drive.is_some()) {
        let rests = reading.kind == Kind::Rest;
        let mut row: Vec<Field> = Vec::new();
        let shown = record.labels(reading.mean[0], reading.mean[1]);
        if with_distance {
            let said = own(a, tap).filter(|_| !rests);
            row.push(match own_distance {
                Some(k) => said.map_or_else(|| shown[k].to_owned(), |a| a.to_string()).into(),
                None => said.into(),
            });
        }
        if drive.is_some() {
            let said = said.and_then(|(_, values)| own(values, tap));
            row.push(if rests { Some(0.0) } else { reading.drive.or(said).map(rounded) }.into());
        }
        row.push(if drive.is_some() { reading.signal } else { reading.signal - reading.rest }.into());
        row.push(rounded(middle(record, reading)).into());
        row.extend(others.iter().map(|k| Field::from(shown[*k].to_owned())));
        table.row(row)?;
        tap += usize::from(!rests);
    }
    Ok(table)
}

fn middle(record: &Record, reading: &Reading) -> f64 {
    0.5 * (record.time[reading.mean[0]] + record.time[reading.mean[1]])
}

/// readings.csv: kind, time of contact, time of the mean, and scatter of each reading.
fn readings_table(record: &Record, readings: &[Reading]) -> Result<Frame, Error> {
    let row = |r: &Reading| {
        let [[begins, ends], [from, to]] = [r.contact, r.mean].map(|ends| ends.map(|k| record.time[k]));
        let times = [begins, ends, from, to].map(Field::Number);
        let samples = Field::from(r.mean[1] - r.mean[0] + 1);
        let of = [r.signal, r.rest, r.sd].map(Field::Number);
        std::iter::once(r.kind.word().into()).chain(times).chain([samples]).chain(of)
    };
    framed("readings", &[], readings.iter().map(row))
}

fn drawn(record: &Record, rest: &Rest, readings: &[Reading]) -> Figure {
    let every = record.time.len().div_ceil(DRAWN).max(1);
    let line = |name: &str, colour, values: &[f64], dash| {
        let sampled = (0..record.time.len()).step_by(every).map(|k| (record.time[k], values[k]));
        Mark::line(Path::new(name, colour, sampled), dash)
    };
    let points = |name: &str, colour, kind: Kind, marker| {
        let own = readings.iter().filter(|r| r.kind == kind);
        let path = Path::new(name, colour, own.clone().map(|r| (middle(record, r), r.signal)));
        Mark::barred(path, marker, own.map(|r| r.sd).collect())
    };
    let panel = Panel::new("", Axis::new("time t", "s"), Axis::new(record.unit.column(), ""))
        .with(line("signal", 0, &record.signal, 0))
        .with(line("rest", 2, &rest.level, 1))
        .with(points("plateau", 1, Kind::Plateau, Marker::Square))
        .with(points("peak", 3, Kind::Peak, Marker::Triangle));
    let left = if every > 1 { format!("; one sample in {every} is shown") } else { String::new() };
    let caption = format!("What was read of {} (readings.csv){left}.", record.file);
    Figure::new("taps", "Taps", caption, vec![panel])
}
