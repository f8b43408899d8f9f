//! Progress on stderr: a bar on a terminal, a plain line now and then elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use vibrissa::progress::Progress;

use super::say;

/// Time between plain lines.
const EVERY: Duration = Duration::from_secs(5);

/// Shows taps done, rate and remaining time.
pub enum Shown {
    /// A terminal.
    Bar(ProgressBar),
    /// A log.
    Lines { start: Instant, last: Instant },
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
            return Self::Lines { start: Instant::now(), last: Instant::now() };
        }
        let template = "{bar:32} {percent:>3} %  {human_pos} of {human_len} taps  {per_sec}  {eta} left";
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self::Bar(bar)
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
            Self::Bar(bar) => bar.set_position(done.min(total)),
            Self::Lines { start, last } if last.elapsed() >= EVERY => {
                *last = Instant::now();
                let rate = done as f64 / start.elapsed().as_secs_f64();
                let left = total.saturating_sub(done) as f64 / rate;
                say::line(format_args!("{done} of {total} taps, {rate:.3e} taps/s, {left:.0} s left"));
            }
            _ => {}
        }
    }
}
