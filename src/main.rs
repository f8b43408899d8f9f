//! The `vibrissa` program: parse, run, exit code.

// A printing macro panics where nobody reads: `cli::say` and `cli::reply` do not.
#![deny(clippy::print_stderr, clippy::print_stdout)]

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::quiet_driver();
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_some_and(|word| word == cli::ASK_DRIVERS) {
        let from = arguments.next().and_then(|n| n.to_str()?.parse().ok());
        vibrissa::backend::answer(from.unwrap_or(0));
        return ExitCode::SUCCESS;
    }
    cli::run().into()
}
