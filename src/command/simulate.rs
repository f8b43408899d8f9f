//! `vibrissa simulate SPEC.toml`: synthetic measurements, of taps or of strokes over an object.

use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::json;

use super::{Common, Context, Reply, folder, number, of_one_signal, whole};
use crate::error::{Error, InputError};
use crate::locate::locator::opener;
use crate::measure::Rig;
use crate::scene::{Column, RunOptions, Spec};
use crate::simulate::{self, Counts, Settings, SimulatedTaps, strokes};
use crate::sink::folder::Question;
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::run_json;
use crate::spec;

/// Bytes of a row while its table is made in memory: its text, in a buffer that may be twice as large, its fields, its columns.
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
    #[command(flatten)]
    #[serde(flatten)]
    pub common: Common,
}

/// Simulates the taps of a spec into `measurements.csv`, or strokes into `strokes.csv`.
pub fn run(asked: &SimulateRequest, context: &Context<'_>) -> Result<Reply, Error> {
    let mut spec = context.read(&asked.spec, "spec", spec::parse)?;
    let rig = Rig::of_spec(&spec, &asked.spec.display().to_string())?;
    let options = context.prepared(&asked.common, Some(&mut spec))?;
    let settings = settings(asked, &rig)?;
    if let Some(object) = &asked.object {
        return stroke(object, (&spec, &rig), &settings, &options, context);
    }
    let layout = spec.study.space.layout().expect("a rig has axes");
    settings.rows(layout.len(), simulate::MOST_ROWS.min(context.room(BYTES_OF_ROW)))?;
    let taps = layout.len() * settings.repeats;
    let out = folder(options.out.as_ref(), &spec.name, "simulate");
    context.warn_all(&spec.warnings);
    let described = settings.described(rig.setup.drive);
    if options.plan == Some(true) {
        let planned = Reply::planned(out, |to| format!("{}: {taps} synthetic taps to {to}", spec.name));
        let result = json!({ "settings": described, "in_force": run_json::in_force(&spec) });
        return Ok(Reply { counts: json!({ "taps": taps }), result, ..planned });
    }
    let question = Question::of_scene("simulate", &spec, json!({ "settings": described.to_string() }));
    let mut destination = context.open(&out, question, &["measurements.csv"], options.force)?;
    let method = opener(&options)(&rig.setup.model)?;
    let which = SimulatedTaps { layout: &layout, directions: spec.study.setup.directions };
    let empty = simulate::empty(&rig, which.directions, settings.unit);
    let counts = destination.rows(empty, |write| {
        let mut write = |some: &Frame| context.go_on().and_then(|()| write(some));
        simulate::simulate(&rig, which, &settings, method, &mut write)
    })?;
    let empty = match counts.unsolved {
        0 => String::new(),
        n => format!(", {n} of them without a solution and empty"),
    };
    let text = format!("{} synthetic taps{empty}, {} zero readings\n", counts.taps, counts.zeros);
    filed((&spec, text), (described, counts), destination, context)
}

fn stroke(
    object: &Path,
    (spec, rig): (&Spec, &Rig),
    settings: &Settings,
    options: &RunOptions,
    context: &Context<'_>,
) -> Result<Reply, Error> {
    context.warn_all(&spec.warnings);
    strokes::check(rig, settings)?;
    let course = context.read(object, "object", strokes::Strokes::parse)?;
    let drives = spec.study.space.axis(Column::Drive).expect("a rig has axes");
    let out = folder(options.out.as_ref(), &spec.name, "simulate");
    let described = course.described(settings.described(rig.setup.drive));
    if options.plan == Some(true) {
        let (starts, readings) = (course.starts.len(), drives.len());
        let planned = Reply::planned(out, |to| {
            format!("{}: {starts} strokes of {readings} readings to {to}", spec.name)
        });
        let result = json!({ "settings": described, "in_force": run_json::in_force(spec) });
        return Ok(Reply { result, ..planned });
    }
    let asked = json!({ "settings": described.to_string(), "course": format!("{:?}", (&course.object, &course.starts, course.touch_noise)) });
    let mut question = Question::of_scene("simulate", spec, asked);
    question.inputs.extend(course.files.iter().cloned());
    let mut destination = context.open(&out, question, &[strokes::FILE], options.force)?;
    let mut missed = 0;
    let mut miss = |number: usize, why| {
        missed += 1;
        context.warn(&format!("start {number} makes no stroke: {why}"));
    };
    let counts = destination.rows(heading("strokes").frame(&[settings.unit.column()]), |write| {
        let mut write = |some: &Frame| context.go_on().and_then(|()| write(some));
        strokes::simulate(rig, &course, drives, settings, &mut miss, &mut write)
    })?;
    let without = match counts.unsolved {
        0 => String::new(),
        n => format!(", {n} of them after the whisker has left the object"),
    };
    let (taps, strokes, zeros) = (counts.taps, course.starts.len() - missed, counts.zeros);
    let text = format!("{taps} synthetic readings of {strokes} strokes{without}, {zeros} zero readings\n");
    filed((spec, text), (described, counts), destination, context)
}

/// The reply, with the `text` of its summary.
fn filed(
    (spec, text): (&Spec, String),
    (described, counts): (serde_json::Value, Counts),
    destination: super::Destination,
    context: &Context<'_>,
) -> Result<Reply, Error> {
    let body = json!({ "source": simulate::SOURCE, "settings": described });
    let result = json!({ "settings": described });
    let reply = Reply { text, counts: counts.described(), result, ..Reply::default() };
    reply.filed_of(spec, destination, body, context)
}

fn settings(asked: &SimulateRequest, rig: &Rig) -> Result<Settings, InputError> {
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
    let unit = simulate::recorded(rig, asked.signal.as_deref(), "--signal")?;
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
        unit,
    };
    settings.check()?;
    Ok(settings)
}
