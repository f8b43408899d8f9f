//! The program as host of commands: signals, progress, and lines on stderr. A closed or full stderr is ignored.

use std::fmt::Display;
use std::io::Write;
use std::sync::atomic::AtomicBool;

use vibrissa::command::{Host, Show};
pub use vibrissa::command::{grouped, rough};
use vibrissa::error::Error;
use vibrissa::excerpt::printable;
use vibrissa::scene::RunOptions;

use super::progress::Shown;
use super::{interrupt, reply};

/// Prints a line; control characters, which may come from a file, are made harmless.
pub fn line(text: impl Display) {
    part(format!("{}\n", printable(&text.to_string())));
}

pub fn warning(text: impl Display) {
    line(format_args!("warning: {text}"));
}

pub fn part(text: impl Display) {
    let _ = std::io::stderr().write_all(text.to_string().as_bytes());
}

pub struct Terminal;

impl Host for Terminal {
    fn begin(&self, options: &RunOptions) -> Result<(), Error> {
        reply::in_json(options.json == Some(true));
        let Some(n) = options.threads else { return Ok(()) };
        rayon::ThreadPoolBuilder::new().num_threads(n).build_global().map_err(|e| Error::Run(e.to_string()))
    }

    fn line(&self, text: &str) {
        line(text);
    }

    fn progress(&self, quiet: bool) -> Box<dyn Show + '_> {
        Box::new(Shown::new(quiet))
    }

    fn stop(&self, keeps: bool) -> &AtomicBool {
        interrupt::stop(keeps)
    }
}
