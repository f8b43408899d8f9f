//! The `vibrissa` program: parse, run, exit code.

// A printing macro panics where nobody reads: `cli::say` and `cli::reply` do not.
#![deny(clippy::print_stderr, clippy::print_stdout)]

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::quiet_driver();
    cli::run()
}
