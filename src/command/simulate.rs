//! `vibrissa simulate SPEC.toml`: synthetic measurements, of taps or of strokes over an object.

use std::path::PathBuf;

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Asked, Context, Reply, folder, number, of_one_signal, whole};
use crate::error::Error;
use crate::locate::locator::opener;
use crate::measure::Rig;
use crate::scene::Column;
use crate::simulate::strokes::{self, Strokes};
use crate::simulate::{self, Settings};
use crate::sink::{Frame, Question, heading, run_json};
use crate::spec;

/// Bytes per row while its table is in memory: text in a buffer of up to twice its size, fields, columns.
const BYTES_OF_ROW: u64 = 512;

/// Synthetic measurements from the exact model.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa simulate examples/prototype-d10.toml --repeats 3 --zero-every 11")]
pub struct SimulateRequest {
    /// The spec: one whisker, its distances and drives, its model
    pub spec: PathBuf,
    /// Taps of each distance and drive
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>(1..=u64::MAX))]
    pub repeats: u64,
    /// Standard deviation of one reading, in strain [default: gauge.noise_strain of the spec, else 0]
    #[arg(long, value_name = "E", value_parser = number)]
    pub noise: Option<f64>,
    /// Seed of everything random
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    pub seed: u64,
    /// A zero reading before every N taps, and one at the end
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=u64::MAX))]
    pub zero_every: Option<u64>,
    /// Drift of the zero per row, in strain
    #[arg(long, value_name = "E", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number)]
    pub drift: f64,
    /// Share of taps that are wrong: another distance label, or a signal off by 20 to 100 %
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = number)]
    pub outliers: f64,
    /// |strain| at which the sensor stops
    #[arg(long, value_name = "E", value_parser = number)]
    pub saturate: Option<f64>,
    /// Share of the last tap's strain that is still there
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = number)]
    pub hysteresis: f64,
    /// Signal per strain
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true, value_parser = number)]
    pub factor: f64,
    /// Tap by this much more than the label says, degrees or mm
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number)]
    pub drive_offset: f64,
    /// Tap this much farther out than the label says, mm
    #[arg(long, value_name = "X", default_value_t = 0.0, allow_negative_numbers = true, value_parser = number)]
    pub a_offset: f64,
    /// Strokes over the object of this file, from its starts, in place of taps at labelled distances; the drives of the spec are the angles
    /// after first touch at which they are read -> strokes.csv (docs/contour.md)
    #[arg(long, value_name = "OBJECT")]
    pub object: Option<PathBuf>,
    /// What is recorded: strain, microstrain, bridge_mV_per_V, reading, moment_Nmm or force_N [default: the signal of the spec]
    #[arg(long, value_name = "NAME")]
    pub signal: Option<String>,
}

pub fn run(asked: &Asked<SimulateRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let mut spec = context.read(&asked.spec, "spec", spec::parse)?;
    let rig = Rig::of_spec(&spec, &asked.spec.display().to_string())?;
    let options = context.prepared(&asked.common, Some(&mut spec))?;
    if rig.setup.channels.is_some() {
        let allowed = "noise or covariance in [sensor] of the spec; the rest with one signal only";
        of_one_signal(&[
            ("--noise", asked.noise.is_some(), allowed),
            ("--signal", asked.signal.is_some(), allowed),
            ("--drift", asked.drift != 0.0, allowed),
            ("--saturate", asked.saturate.is_some(), allowed),
            ("--hysteresis", asked.hysteresis != 0.0, allowed),
            ("--object", asked.object.is_some(), allowed),
        ])?;
    }
    let settings = Settings {
        repeats: asked.repeats,
        noise: asked.noise.or(rig.setup.gauge.noise_strain).unwrap_or(0.0),
        seed: asked.seed,
        zero_every: asked.zero_every,
        drift: asked.drift,
        outliers: asked.outliers,
        saturate: asked.saturate,
        hysteresis: asked.hysteresis,
        factor: asked.factor,
        drive_offset: asked.drive_offset,
        a_offset: asked.a_offset,
        unit: simulate::recorded(&rig, asked.signal.as_deref(), "--signal")?,
    };
    settings.check()?;
    let read = |object: &PathBuf| -> Result<Strokes, Error> {
        strokes::check(&rig, &settings)?;
        Ok(context.read(object, "object", Strokes::parse)?)
    };
    let course = asked.object.as_ref().map(read).transpose()?;
    let layout = spec.study.space.layout().expect("a rig has axes");
    let drives = spec.study.space.axis(Column::Drive).expect("a rig has axes");
    let mut described = settings.described(rig.setup.drive);
    let (mut of, mut counts, mut inputs) = (json!({}), Value::Null, Vec::new());
    let (file, what) = match &course {
        Some(course) => {
            described = course.described(described);
            of["course"] = format!("{:?}", (&course.object, &course.starts, course.touch_noise)).into();
            inputs.clone_from(&course.files);
            (strokes::FILE, format!("{} strokes of {} readings", course.starts.len(), drives.len()))
        }
        None => {
            settings.rows(layout.len(), simulate::MOST_ROWS.min(context.room(BYTES_OF_ROW)))?;
            let taps = layout.len() * settings.repeats;
            counts = json!({ "taps": taps });
            ("measurements.csv", format!("{taps} synthetic taps"))
        }
    };
    let out = folder(options.out.as_ref(), &spec.name, "simulate");
    context.warn_all(&spec.warnings);
    if options.plan == Some(true) {
        let planned = Reply::planned(out, |to| format!("{}: {what} to {to}", spec.name));
        let result = json!({ "settings": described, "in_force": run_json::in_force(&spec) });
        return Ok(Reply { counts, result, ..planned });
    }
    of["settings"] = described.to_string().into();
    let mut question = Question::of_scene("simulate", &spec, of);
    question.inputs.extend(inputs);
    let mut destination = context.open(&out, question, &[file], options.force)?;
    let directions = spec.study.setup.directions;
    let empty = match &course {
        Some(_) => heading("strokes").frame(&[settings.unit.column()]),
        None => simulate::empty(&rig, directions, settings.unit),
    };
    let mut missed = 0;
    let counts = destination.rows(empty, |write| {
        let mut write = |some: &Frame| context.go_on().and_then(|()| write(some));
        let Some(course) = &course else {
            let method = opener(&options)(&rig.setup.model)?;
            return simulate::simulate(&rig, (&layout, directions), &settings, method, &mut write);
        };
        let mut miss = |number: usize, why| {
            missed += 1;
            context.warn(&format!("start {number} makes no stroke: {why}"));
        };
        strokes::simulate(&rig, course, drives, &settings, &mut miss, &mut write)
    })?;
    let (taps, zeros, strokes) = (counts.taps, counts.zeros, course.map(|c| c.starts.len() - missed));
    let (what, without) = match strokes {
        Some(n) => (format!("readings of {n} strokes"), "after the whisker has left the object"),
        None => ("taps".to_owned(), "without a solution and empty"),
    };
    let without = match counts.unsolved {
        0 => String::new(),
        n => format!(", {n} of them {without}"),
    };
    let text = format!("{taps} synthetic {what}{without}, {zeros} zero readings\n");
    let body = json!({ "source": simulate::SOURCE, "settings": described });
    let (counts, result) = (json!(counts), json!({ "settings": described }));
    Reply { text, counts, result, ..Reply::default() }.filed_of(&spec, destination, body)
}
