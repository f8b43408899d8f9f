//! The program as host of commands: signals, progress, and lines on stderr.

use std::sync::atomic::AtomicBool;

use vibrissa::command::{Host, Show};
use vibrissa::error::Error;
use vibrissa::scene::RunOptions;

use super::progress::Shown;
use super::{interrupt, reply, say};

pub struct Terminal;

impl Host for Terminal {
    fn begin(&self, options: &RunOptions) -> Result<(), Error> {
        reply::in_json(options.json == Some(true));
        interrupt::threads(options)
    }

    fn line(&self, text: &str) {
        say::line(text);
    }

    fn progress(&self, quiet: bool) -> Box<dyn Show + '_> {
        Box::new(Shown::new(quiet))
    }

    fn stop(&self, keeps: bool) -> &AtomicBool {
        if keeps { interrupt::stop_and_keep() } else { interrupt::stop() }
    }
}
