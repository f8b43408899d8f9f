//! Progress on stderr: a bar on a terminal, a plain line now and then elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use vibrissa::progress::Progress;

use super::say;
use super::say::{grouped, rough};

/// Time between plain lines.
const EVERY: Duration = Duration::from_secs(5);

/// Shows taps done, rate and remaining time. Clones show the same.
#[derive(Clone)]
pub enum Shown {
    /// A terminal.
    Bar(ProgressBar),
    /// A log.
    Lines { start: Instant, last: Instant, before: u64 },
    /// Nothing.
    Silent,
}

impl Shown {
    /// For a run of `total` taps.
    pub fn new(total: u64, quiet: bool) -> Self {
        if quiet {
            return Self::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines { start: Instant::now(), last: Instant::now(), before: 0 };
        }
        let template = "{bar:32} {percent:>3} %  {human_pos} of {human_len} taps  {per_sec}  {eta} left";
        Self::Bar(bar(total, template))
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Shown {
    fn at(&mut self, done: u64, total: u64) {
        match self {
            Self::Bar(bar) => {
                bar.set_length(total);
                bar.set_position(done.min(total));
            }
            Self::Lines { start, last, before } if last.elapsed() >= EVERY => {
                *last = Instant::now();
                say::line(line((done, total), done.saturating_sub(*before), start.elapsed()));
            }
            _ => {}
        }
    }

    fn begin(&mut self, done: u64) {
        match self {
            Self::Bar(bar) => {
                bar.set_position(done);
                // Of its rate, from which it tells the time left.
                bar.reset_eta();
            }
            Self::Lines { start, before, .. } => (*start, *before) = (Instant::now(), done),
            Self::Silent => {}
        }
    }

    fn note(&mut self, words: &str) {
        match self {
            Self::Bar(bar) => bar.suspend(|| say::line(words)),
            Self::Lines { .. } => say::line(words),
            Self::Silent => {}
        }
    }
}

/// A bar on stderr of `total` steps that looks as `template` says.
fn bar(total: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
    ProgressStyle::with_template(template).map_or(bar.clone(), |style| bar.with_style(style))
}

/// A plain line: taps done of all, `own` of which took `time`, their rate and the time that the others will take.
pub fn line((done, total): (u64, u64), own: u64, time: Duration) -> String {
    let rate = own as f64 / time.as_secs_f64();
    let left = total.saturating_sub(done) as f64 / rate;
    let times = match own {
        0 => String::new(),
        _ => format!(", {} taps/s, {} s left", rough(rate), rough(left)),
    };
    format!("{} of {} taps{times}", grouped(done), grouped(total))
}

/// Shows the steps of work whose steps differ: which one, and of how many. Clones show the same.
#[derive(Clone)]
pub enum Steps {
    /// A terminal.
    Bar(ProgressBar),
    /// A log: a line for each.
    Lines,
    /// Nothing.
    Silent,
}

impl Steps {
    /// Of a run of `total` steps.
    pub fn new(total: u64, quiet: bool) -> Self {
        match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Self::Silent,
            (_, false) => Self::Lines,
            (_, true) => {
                let bar = bar(total, "{bar:32} {pos} of {len}  {elapsed}  {wide_msg}");
                bar.enable_steady_tick(Duration::from_millis(200));
                Self::Bar(bar)
            }
        }
    }

    /// Step `n`, from 1, begins: `what`.
    pub fn at(&self, n: usize, of: usize, what: &str) {
        match self {
            Self::Bar(bar) => {
                bar.set_position(n as u64 - 1);
                bar.set_message(what.to_owned());
            }
            Self::Lines => say::line(format_args!("[{n:>3} of {of}] {what}")),
            Self::Silent => {}
        }
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
