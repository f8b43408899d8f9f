//! The `vibrissa` program: parse, run, exit code.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::quiet_driver();
    cli::run()
}
