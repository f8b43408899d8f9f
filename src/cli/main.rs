//! The `vibrissa` program: parse, run, exit code.

// A printing macro panics where nobody reads: `say` and `reply` of the library beside do not.
#![deny(clippy::print_stderr, clippy::print_stdout)]

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
    vibrissa_cli::quiet_driver();
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_some_and(|word| word == vibrissa_cli::ASK_DRIVERS) {
        let from = arguments.next().and_then(|n| n.to_str()?.parse().ok());
        vibrissa::backend::answer(from.unwrap_or(0));
        return ExitCode::SUCCESS;
    }
    vibrissa_cli::run().into()
}
