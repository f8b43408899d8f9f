//! Commands of the program, one file each; what was typed, and how a result or an error reaches the user.

mod apart;
mod args;
mod array;
mod bench;
mod best;
mod calibrate;
mod chart;
mod cite;
mod cluster;
mod contour;
mod devices;
mod explain;
mod explore;
mod help;
mod interrupt;
mod locate;
mod merge;
mod new;
mod next;
mod optimise;
mod patient;
mod plan;
mod progress;
mod reply;
mod report;
mod say;
mod several;
mod shape;
mod simulate;
mod strokes;
mod sweep;
mod tap;
mod taps;
mod verify;

use std::path::{Path, PathBuf};

use clap::{CommandFactory, FromArgMatches};

use args::{Args, Command};
use serde_json::Value;
use vibrissa::scene::Spec;
use vibrissa::{backend, kernel::gpu};

/// The one argument of the process that asks the GPU drivers, before the number of the first adapter to open.
pub const ASK_DRIVERS: &str = "--ask-drivers";

/// Mesa's device-selection layer complains on stderr where there is no desktop session; it is not needed there.
pub fn quiet_driver() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: first thing in `main`, before any other thread exists.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

/// Names of files in one line.
fn listed(files: &[PathBuf]) -> String {
    files.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// Name of the file at `path` without its ending; `usual` where it has none.
fn stem(path: &Path, usual: &str) -> String {
    path.file_stem().map_or_else(|| usual.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// The values in force of `spec`, a line each.
fn in_force(spec: &Spec) -> String {
    let line = |(key, value, written): &(String, String, bool)| {
        format!("  {key} = {value}{}\n", if *written { "" } else { "    (default)" })
    };
    spec.in_force.iter().map(line).collect()
}

/// `result` with what was left off in it, where that was asked for.
fn with_model_error(mut result: Value, model_error: Option<&(Value, String)>) -> Value {
    if let Some((told, _)) = model_error {
        result["model_error"] = told.clone();
    }
    result
}

/// Where a command writes: what was typed or stands in the spec, else `results/<name>` for a sweep and
/// `results/<name>-<command>` for the others.
fn folder(out: Option<&PathBuf>, name: &str, command: &str) -> PathBuf {
    let folder = if command == "sweep" { name.to_owned() } else { format!("{name}-{command}") };
    out.cloned().unwrap_or_else(|| Path::new("results").join(folder))
}

/// Runs the command line; the exit code.
pub fn run() -> u8 {
    interrupt::listen();
    backend::ask_by(|| {
        let mut own = std::process::Command::new(std::env::current_exe().ok()?);
        own.arg(ASK_DRIVERS);
        Some(own)
    });
    reply::in_json(std::env::args_os().any(|a| a == "--json"));
    let mut quiet = false;
    let typed = Args::command().try_get_matches().and_then(|typed| {
        if let Some((name, flags)) = typed.subcommand() {
            reply::to(name);
            // A report sees to that itself: what it plans is told in any case.
            quiet = name != "report" && matches!(flags.try_get_one("quiet"), Ok(Some(true)));
        }
        Args::from_arg_matches(&typed)
    });
    let args = match typed {
        Ok(args) => args,
        Err(e) => return reply::usage(&e),
    };
    if !quiet {
        gpu::tell(|words| say::warning(words));
    }
    let result = match &args.command {
        Command::Sweep(sweep) => sweep::run(sweep),
        Command::Calibrate(calibrate) => calibrate::run(calibrate),
        Command::Locate(locate) => locate::run(locate),
        Command::Taps(taps) => taps::run(taps),
        Command::Next(next) => next::run(next),
        Command::Plan(plan) => plan::run(plan),
        Command::Contour(contour) => contour::run(contour),
        Command::Simulate(simulate) => simulate::run(simulate),
        Command::Optimise(optimise) => optimise::run(optimise),
        Command::Tap(tap) => tap::run(tap),
        Command::Chart(chart) => chart::run(chart),
        Command::Merge(merge) => merge::run(merge),
        Command::Cluster(cluster) => cluster::run(cluster),
        Command::Explore(explore) => explore::run(explore),
        Command::Verify(verify) => verify::run(verify),
        Command::Bench(bench) => bench::run(bench),
        Command::Shape(shape) => shape::run(shape),
        Command::Report(report) => report::run(report),
        Command::Devices(common) => devices::run(common),
        Command::New(new) => new::run(new),
        Command::Cite(cite) => cite::run(cite),
        Command::Schema(_) => {
            Ok(reply::Reply { text: vibrissa::reference::schema::text(), ..Default::default() })
        }
        Command::Help(asked) => return help::run(asked),
        Command::Completions(asked) => help::completions(asked),
        Command::Man(asked) => help::man(asked),
    };
    let code = match result {
        Ok(reply) => reply.print(quiet),
        Err(e) => reply::failure(&e),
    };
    interrupt::end_without_those_behind(code);
    code
}
