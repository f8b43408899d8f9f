//! The `vibrissa` program: parse, run, exit code.

// A printing macro panics where nobody reads: `cli::say` and `cli::reply` do not.
#![deny(clippy::print_stderr, clippy::print_stdout)]

mod cli;

use std::process::ExitCode;

/// Keeps memory that is free for what comes next: every chunk of a sweep asks for as much as the one before it, and to give it back to the system and
/// to get it again took a quarter of the time of a sweep that solves its taps (two threads; more of them wait for it).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_memory() {
    // SAFETY: only numbers are set, before there is another thread. Where they are refused nothing changes.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, i32::MAX);
        libc::mallopt(libc::M_TRIM_THRESHOLD, i32::MAX);
        libc::mallopt(libc::M_TOP_PAD, 64 << 20);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn keep_memory() {}

fn main() -> ExitCode {
    keep_memory();
    cli::quiet_driver();
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_some_and(|word| word == cli::ASK_DRIVERS) {
        let from = arguments.next().and_then(|n| n.to_str()?.parse().ok());
        vibrissa::backend::answer(from.unwrap_or(0));
        return ExitCode::SUCCESS;
    }
    cli::run().into()
}
