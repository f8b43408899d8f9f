//! The command line: arguments, commands of the program alone, and output of results and errors.

mod about;
mod args;
mod interrupt;
mod locate;
mod new;
#[doc(hidden)]
pub mod progress;
mod reply;

use clap::{CommandFactory, FromArgMatches};

use args::{Args, Command};
use vibrissa::command::{Context, folder, stem};
use vibrissa::error::{Error, SolveError};
use vibrissa::sink::folder::end_all;
use vibrissa::{backend, kernel::gpu};

/// The argument for a child process that tests the GPU drivers; the number of the first adapter follows.
pub const ASK_DRIVERS: &str = "--ask-drivers";

/// Silences a stderr message of Mesa's device selection without a desktop session, where it is not needed.
pub fn quiet_driver() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: first thing in `main`, before any other thread exists.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

/// Runs the command line; returns the exit code.
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
            quiet = matches!(flags.try_get_one("quiet"), Ok(Some(true)));
        }
        Args::from_arg_matches(&typed)
    });
    let args = match typed {
        Ok(args) => args,
        Err(e) => return reply::usage(&e),
    };
    if !quiet {
        gpu::tell(|words| reply::line(format_args!("warning: {words}")));
    }
    let context = &Context::new(&reply::Terminal, quiet);
    let result = match &args.command {
        Command::Help { topic, part } => return about::help(topic.as_deref(), part.as_deref()),
        command => command.run(context),
    };
    let code = match result {
        Ok(reply) => reply::print(reply, quiet),
        Err(Error::Solve(SolveError::Stopped)) => reply::interrupted(&end_all()),
        Err(e) => reply::failure(&e),
    };
    interrupt::end_after_a_signal(code);
    code
}
