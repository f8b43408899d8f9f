//! `vibrissa simulate SPEC.toml`.

use std::time::Instant;

use serde_json::json;
use vibrissa::error::{Error, InputError};
use vibrissa::locate::locator::opener;
use vibrissa::measure::Rig;
use vibrissa::simulate::{self, Settings, SimulatedTaps};
use vibrissa::sink::folder::{Folder, Question};
use vibrissa::sink::run_json;
use vibrissa::spec;

use super::args::Simulate;
use super::interrupt::prepared;
use super::reply::Reply;
use super::say;
use super::several::of_one_signal;

/// Simulates the taps of a spec into `measurements.csv`.
pub fn run(args: &Simulate) -> Result<Reply, Error> {
    let start = Instant::now();
    let label = args.spec.display().to_string();
    let spec = spec::read(&args.spec)?;
    let rig = Rig::of_spec(&spec, &label)?;
    let options = prepared(&args.common, &spec)?;
    let quiet = options.quiet == Some(true);
    let settings = settings(args, &rig)?;
    if let Some(object) = &args.object {
        say::warnings(quiet, &spec.warnings);
        return super::strokes::run(object, &spec, &rig, &settings, &options, start);
    }
    let layout = spec.study.space.layout().expect("a rig has axes");
    let asked = SimulatedTaps { layout: &layout, directions: spec.study.setup.directions };
    settings.rows(layout.len(), simulate::MOST_ROWS)?;
    let taps = layout.len() * settings.repeats;
    let out = super::folder(options.out.as_ref(), &spec.name, "simulate");
    say::warnings(quiet, &spec.warnings);
    let result = settings.described(rig.setup.drive);
    if options.plan == Some(true) {
        let planned = Reply::planned(out, |to| format!("{}: {taps} synthetic taps to {to}", spec.name));
        let result = json!({ "settings": result, "in_force": run_json::in_force(&spec) });
        return Ok(Reply { counts: json!({ "taps": taps }), result, ..planned });
    }
    let question = Question::of_scene("simulate", &spec, json!({ "settings": result.to_string() }));
    let mut folder = Folder::open(&out, question, &["measurements.csv"], options.force == Some(true))?;
    let method = opener(&options)(&rig.setup.model)?;
    let mut file = folder.file("measurements.csv")?;
    let counts = simulate::simulate(&rig, asked, &settings, method, &mut |bytes| file.write(bytes))?;
    file.close()?;
    let counted = counts.described();
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let document = simulate::document(&spec, [&result, &counted, &seconds]);
    let empty = match counts.unsolved {
        0 => String::new(),
        n => format!(", {n} of them without a solution and empty"),
    };
    let text = format!("{} synthetic taps{empty}, {} zero readings\n", counts.taps, counts.zeros);
    let result = json!({ "settings": result });
    Reply { text, counts: counted, seconds, result, quiet, ..Reply::default() }.filed(
        folder,
        &document,
        (out, start),
    )
}

fn settings(args: &Simulate, rig: &Rig) -> Result<Settings, InputError> {
    if rig.setup.channels.is_some() {
        let allowed = "noise or covariance in [sensor] of the spec; the rest with one signal only";
        of_one_signal(&[
            ("--noise", args.noise.is_some(), allowed),
            ("--signal", args.signal.is_some(), allowed),
            ("--drift", args.drift != 0.0, allowed),
            ("--saturate", args.saturate.is_some(), allowed),
            ("--hysteresis", args.hysteresis != 0.0, allowed),
            ("--object", args.object.is_some(), allowed),
        ])?;
    }
    let unit = simulate::recorded(rig, args.signal.as_deref(), "--signal")?;
    let settings = Settings {
        repeats: args.repeats,
        noise: args.noise.or(rig.setup.gauge.noise_strain).unwrap_or(0.0),
        seed: args.seed,
        zero_every: args.zero_every,
        drift: args.drift,
        outliers: args.outliers,
        saturate: args.saturate,
        hysteresis: args.hysteresis,
        factor: args.factor,
        drive_offset: args.drive_offset,
        a_offset: args.a_offset,
        unit,
    };
    settings.check()?;
    Ok(settings)
}
