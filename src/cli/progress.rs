//! Progress on stderr: a bar on a terminal, plain lines elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use vibrissa::optimise::{Step, Watch};
use vibrissa::progress::Progress;

use super::reply;
use vibrissa::command::{grouped, rough};

const EVERY: Duration = Duration::from_secs(5);

pub enum Shown {
    Bar(ProgressBar),
    Lines { start: Instant, last: Instant, before: u64 },
    Silent,
}

impl Shown {
    pub fn new(quiet: bool) -> Self {
        if quiet {
            return Self::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines { start: Instant::now(), last: Instant::now(), before: 0 };
        }
        let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
        let template = "{bar:32} {percent:>3} %  {human_pos} of {human_len} taps  {per_sec}  {eta} left";
        let style = ProgressStyle::with_template(template);
        Self::Bar(style.map_or(bar.clone(), |style| bar.with_style(style)))
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
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
                reply::line(line((done, total), done.saturating_sub(*before), start.elapsed()));
            }
            _ => {}
        }
    }

    fn begin(&mut self, done: u64) {
        match self {
            Self::Bar(bar) => {
                bar.set_position(done);
                bar.reset_eta();
            }
            Self::Lines { start, before, .. } => (*start, *before) = (Instant::now(), done),
            Self::Silent => {}
        }
    }

    fn note(&mut self, words: &str) {
        match self {
            Self::Bar(bar) => bar.suspend(|| reply::line(words)),
            Self::Lines { .. } => reply::line(words),
            Self::Silent => {}
        }
    }
}

impl Watch for Shown {
    fn step(&mut self, step: &Step, value: f64, feasible: bool, left: Option<u64>) {
        let time = match self {
            Self::Bar(bar) => bar.elapsed(),
            Self::Lines { start, last, .. } if last.elapsed() >= EVERY => {
                *last = Instant::now();
                start.elapsed()
            }
            _ => return,
        };
        let rate = rough(step.evaluations as f64 / time.as_secs_f64());
        let best =
            if feasible { format!("best {value:.6e}") } else { "no design keeps the limits yet".to_owned() };
        let left = left.map_or(String::new(), |n| format!(", {n} left"));
        let (evaluations, start, stage) = (grouped(step.evaluations), step.start + 1, step.stage.word());
        let line = format!("{best}; {evaluations} evaluations{left}, {rate}/s, start {start}, {stage}");
        match (self, ProgressStyle::with_template("{wide_msg}")) {
            (Self::Bar(bar), Ok(style)) => {
                bar.set_style(style);
                bar.set_message(line);
            }
            _ => reply::line(line),
        }
    }
}

/// A progress line: taps done of all; `own` of them took `time`, which gives the rate and the remaining time.
pub fn line((done, total): (u64, u64), own: u64, time: Duration) -> String {
    let rate = own as f64 / time.as_secs_f64();
    let left = total.saturating_sub(done) as f64 / rate;
    let times = match own {
        0 => String::new(),
        _ => format!(", {} taps/s, {} s left", rough(rate), rough(left)),
    };
    format!("{} of {} taps{times}", grouped(done), grouped(total))
}
