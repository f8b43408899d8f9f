//! The `vibrissa` program: parse, run, exit code.

// A printing macro panics on a closed pipe; `reply` of the library does not.
#![deny(clippy::print_stderr, clippy::print_stdout)]

use std::process::ExitCode;

/// Makes malloc keep free memory: every chunk of a sweep allocates as much as the previous one, and returning it to the system took a quarter
/// of the time of a solved sweep (two threads; more with more threads).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_memory() {
    // SAFETY: sets numbers only, before there is another thread; a refusal has no effect.
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
