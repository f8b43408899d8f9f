//! Commands of the program, one file each; what was typed, and how a result or an error reaches the user.

mod args;
mod bench;
mod calibrate;
mod devices;
mod explain;
mod locate;
mod optimise;
mod progress;
mod reply;
mod simulate;
mod sweep;
mod tap;
mod verify;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;

use args::{Args, Command};

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

/// Where a command writes: what was typed or stands in the spec, else `results/<name>` for a sweep and
/// `results/<name>-<command>` for the others.
fn folder(out: Option<&PathBuf>, name: &str, command: &str) -> PathBuf {
    let folder = if command == "sweep" { name.to_owned() } else { format!("{name}-{command}") };
    out.cloned().unwrap_or_else(|| Path::new("results").join(folder))
}

/// Runs the command line.
pub fn run() -> ExitCode {
    let mut json = std::env::args().any(|a| a == "--json");
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(e) => return reply::usage(&e, json),
    };
    let (name, common) = (args.command.name(), args.command.common().clone());
    let result = match &args.command {
        Command::Sweep(sweep) => sweep::run(sweep, &mut json),
        Command::Calibrate(calibrate) => calibrate::run(calibrate, &mut json),
        Command::Locate(locate) => locate::run(locate),
        Command::Simulate(simulate) => simulate::run(simulate, &mut json),
        Command::Optimise(optimise) => optimise::run(optimise, &mut json),
        Command::Tap(tap) => tap::run(tap, &mut json),
        Command::Verify(verify) => match verify::run(verify, &mut json) {
            Ok((reply, Some(broken))) => return reply.print_broken(name, json, common.quiet, &broken),
            Ok((reply, None)) => Ok(reply),
            Err(e) => Err(e),
        },
        Command::Bench(args) => bench::run(args),
        Command::Devices(common) => devices::run(common),
    };
    match result {
        Ok(reply) => reply.print(name, json, common.quiet),
        Err(e) => reply::failure(name, &e, json),
    }
}
