//! `vibrissa shape SPEC.toml`.

use std::time::Instant;

use serde_json::json;
use vibrissa::error::Error;
use vibrissa::progress::{NEVER, Progress, Silent};
use vibrissa::sink::folder::{Folder, Question};
use vibrissa::sink::run_json;
use vibrissa::{shape, spec};

use super::args::Shape;
use super::interrupt::begun;
use super::reply::Reply;

/// Writes the shapes of a spec's taps: few, so by the reference unless something else is asked for.
pub fn run(args: &Shape) -> Result<Reply, Error> {
    let start = Instant::now();
    let spec = spec::read(&args.spec)?;
    spec.one_rig()?;
    let (options, quiet) = begun(&args.common, &spec)?;
    let file = || args.spec.display().to_string();
    let setup = &spec.study.setup;
    shape::check(setup).map_err(|e| e.at(file(), None))?;
    let out = super::folder(options.out.as_ref(), &spec.name, "shape");
    if options.plan == Some(true) {
        let planned =
            Reply::planned(out, |to| format!("{}: shapes with {} sections to {to}", spec.name, args.nodes));
        return Ok(Reply { result: json!({ "in_force": run_json::in_force(&spec) }), ..planned });
    }
    let (method, by) = shape::method(&options, &setup.model)?;
    let question = Question::of_scene("shape", &spec, json!({ "nodes": args.nodes, "solved_by": by }));
    let mut folder = Folder::open(&out, question, &shape::FILES, options.force == Some(true))?;
    let steered = (&NEVER, &mut Silent as &mut dyn Progress);
    let made = shape::tables(&spec, method, args.nodes as usize, steered).map_err(|e| match e {
        Error::Input(e) => e.at(file(), None).into(),
        other => other,
    });
    let (counts, tables) = made?;
    for (name, bytes) in tables {
        folder.put(name, &bytes)?;
    }
    let counted = counts.described();
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let document = shape::document(&spec, by, &counted, &seconds);
    let without = match counts.taps - counts.shapes {
        0 => String::new(),
        n => format!("; {n} taps have none, contacts.csv says why"),
    };
    let (shapes, nodes) = (counts.shapes, args.nodes);
    let text = format!("{shapes} shapes of {nodes} sections from clamp to contact{without}\n");
    let reply = Reply { text, counts: counted, seconds, quiet, ..Reply::default() };
    Ok(reply.filed(folder, &document, (out, start))?.answered())
}
