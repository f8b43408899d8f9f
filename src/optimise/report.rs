//! What a finished search tells.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::best::Other;
use super::front::Front;
use super::score::{Limit, Score};
use super::sensitivity::Sensitivity;
use super::session::{Ended, Step};
use crate::backend::Backend;
use crate::scene::search::Quantity;
use crate::scene::{Setup, Tuple};
use crate::sink::table::AtDrive;
use crate::statistics::DriveRow;

#[derive(Debug, Clone, Copy)]
pub struct Design {
    pub point: Tuple,
    /// Its row of designs.csv, of the nominal whisker.
    pub row: DriveRow,
    pub score: Score,
    /// Unit of K in the tables.
    pub unit: f64,
}

impl Design {
    pub fn at_drive(&self) -> AtDrive<'_> {
        AtDrive {
            design: &self.point,
            direction: self.point.direction(),
            drive: self.point.drive,
            row: self.row.figures(),
            unit: self.unit,
        }
    }
}

#[derive(Debug)]
pub struct Report {
    /// The best design; of a front, the one that tells distance best.
    pub best: Design,
    pub value: f64,
    pub ended: Ended,
    /// Starts made, each a swarm.
    pub starts: u32,
    pub evaluations: u64,
    pub taps_each: usize,
    /// Seconds: all, and of the search alone.
    pub seconds: [f64; 2],
    /// Seconds of making charts; `None` where none was tried.
    pub chart: Option<f64>,
    /// `model_error` of `run.json`, where effects could be left off, and the same in a few lines.
    pub model_error: Option<(Value, String)>,
    pub at_bounds: Vec<(Quantity, &'static str)>,
    pub binding: Vec<Limit>,
    /// What the other estimator would make of the best design; `None` where no distance is told, or by two gauges, or the search was asked to stop.
    pub other: Option<Other>,
    pub sensitivity: Sensitivity,
    pub front: Option<Front>,
    /// Backend of the swarm, and of the polish and the figures.
    pub backends: [Backend; 2],
    pub history: Vec<Step>,
}

/// Unit of K of a design in the tables.
pub(crate) fn unit(setup: &Setup, point: &Tuple) -> f64 {
    crate::design::Design::new(setup, *point).elongation(setup).unwrap_or(1.0)
}

const EVERY: Duration = Duration::from_millis(20);

/// Rings once a search is to end.
#[derive(Debug, Default)]
pub struct Alarm {
    pub rings: AtomicBool,
    /// Whether anything has been scored: however slow the machine, there is an answer.
    pub scored: AtomicBool,
}

/// Does `f` beside a thread that rings once `stop` is set, or `seconds` have passed and something has been scored.
pub fn watched<R>(stop: &AtomicBool, seconds: Option<f64>, f: impl FnOnce(&Alarm) -> R) -> R {
    let (alarm, begun) = (&Alarm::default(), Instant::now());
    // The thread ends when the sender is dropped, also where `f` panics.
    let (done, wait) = channel::<()>();
    let look = move || {
        while wait.recv_timeout(EVERY) == Err(RecvTimeoutError::Timeout) {
            let late = seconds.is_some_and(|s| begun.elapsed().as_secs_f64() >= s);
            if stop.load(Ordering::Relaxed) || late && alarm.scored.load(Ordering::Relaxed) {
                alarm.rings.store(true, Ordering::Relaxed);
            }
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(look);
        let _done = done;
        f(alarm)
    })
}
