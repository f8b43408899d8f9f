//! The program as the host of commands: signals, progress and lines on stderr.

use std::io::IsTerminal;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use vibrissa::command::{Host, grouped, rough};
use vibrissa::error::Error;
use vibrissa::optimise::{Step, Watch};
use vibrissa::progress::Progress;
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

    fn progress(&self, quiet: bool) -> Box<dyn Progress + '_> {
        Box::new(Shown::new(quiet))
    }

    fn watch(&self, quiet: bool) -> Box<dyn Watch + '_> {
        Box::new(Searching::new(quiet))
    }

    fn stop(&self, keeps: bool) -> &AtomicBool {
        if keeps { interrupt::stop_and_keep() } else { interrupt::stop() }
    }
}

/// Best, evaluations and rate on stderr: one line that is rewritten on a terminal, a line now and then elsewhere.
struct Searching {
    quiet: bool,
    terminal: bool,
    begun: Instant,
    last: Instant,
}

impl Searching {
    fn new(quiet: bool) -> Self {
        let now = Instant::now();
        Self { quiet, terminal: std::io::stderr().is_terminal(), begun: now, last: now }
    }
}

impl Watch for Searching {
    fn step(&mut self, step: &Step, value: f64, feasible: bool, left: Option<u64>) {
        let every = Duration::from_millis(if self.terminal { 200 } else { 5000 });
        if self.quiet || self.last.elapsed() < every {
            return;
        }
        self.last = Instant::now();
        let rate = step.evaluations as f64 / self.begun.elapsed().as_secs_f64();
        let best =
            if feasible { format!("best {value:.6e}") } else { "no design keeps the limits yet".to_owned() };
        let left = left.map_or(String::new(), |n| format!(", {n} left"));
        let (evaluations, rate) = (grouped(step.evaluations), rough(rate));
        let (start, stage) = (step.start + 1, step.stage.word());
        let line = format!("{best}; {evaluations} evaluations{left}, {rate}/s, start {start}, {stage}");
        if self.terminal {
            say::part(format_args!("\r\x1b[2K{line}"));
        } else {
            say::line(line);
        }
    }
}

impl Drop for Searching {
    fn drop(&mut self) {
        if self.terminal && !self.quiet {
            say::part("\r\x1b[2K");
        }
    }
}
