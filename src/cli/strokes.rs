//! `vibrissa simulate SPEC.toml --object OBJECT.toml`.

use std::path::Path;
use std::time::Instant;

use serde_json::json;
use vibrissa::error::Error;
use vibrissa::measure::Rig;
use vibrissa::scene::{Column, RunOptions, Spec};
use vibrissa::simulate::strokes::{self, Strokes};
use vibrissa::simulate::{self, Settings};
use vibrissa::sink::folder::{Folder, Question};
use vibrissa::sink::run_json;

use super::reply::Reply;
use super::say;

/// Strokes over the object of the file at `object` into `strokes.csv`.
pub fn run(
    object: &Path,
    spec: &Spec,
    rig: &Rig,
    settings: &Settings,
    options: &RunOptions,
    start: Instant,
) -> Result<Reply, Error> {
    let quiet = options.quiet == Some(true);
    strokes::check(rig, settings)?;
    let course = Strokes::read(object)?;
    let drives = spec.study.space.axis(Column::Drive).expect("a rig has axes");
    let out = super::folder(options.out.as_ref(), &spec.name, "simulate");
    let result = course.described(settings.described(rig.setup.drive));
    if options.plan == Some(true) {
        let (starts, readings) = (course.starts.len(), drives.len());
        let planned = Reply::planned(out, |to| {
            format!("{}: {starts} strokes of {readings} readings to {to}", spec.name)
        });
        let result = json!({ "settings": result, "in_force": run_json::in_force(spec) });
        return Ok(Reply { result, ..planned });
    }
    let asked = json!({ "settings": result.to_string(), "course": format!("{:?}", (&course.object, &course.starts, course.touch_noise)) });
    let mut question = Question::of_scene("simulate", spec, asked);
    question.inputs.extend(course.files.iter().cloned());
    let mut folder = Folder::open(&out, question, &[strokes::FILE], options.force == Some(true))?;
    let mut file = folder.file(strokes::FILE)?;
    let mut missed = 0;
    let mut miss = |number: usize, why| {
        missed += 1;
        say::warnings(quiet, [format_args!("start {number} makes no stroke: {why}")]);
    };
    let mut write = |bytes: &[u8]| file.write(bytes);
    let counts = strokes::simulate(rig, &course, drives, settings, &mut miss, &mut write)?;
    file.close()?;
    let counted = counts.described();
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let document = simulate::document(spec, [&result, &counted, &seconds]);
    let without = match counts.unsolved {
        0 => String::new(),
        n => format!(", {n} of them after the whisker has left the object"),
    };
    let (taps, strokes, zeros) = (counts.taps, course.starts.len() - missed, counts.zeros);
    let text = format!("{taps} synthetic readings of {strokes} strokes{without}, {zeros} zero readings\n");
    let result = json!({ "settings": result });
    Reply { text, counts: counted, seconds, result, quiet, ..Reply::default() }.filed(
        folder,
        &document,
        (out, start),
    )
}
