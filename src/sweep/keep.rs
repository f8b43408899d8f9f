//! The state after the last complete chunk of a sweep, saved regularly, so that a stopped sweep continues from there.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::Run;
use super::best::{Best, Highlights};
use super::output::{About, Writers};
use crate::chart::lanes::Found;
use crate::error::Error;
use crate::kernel::gpu::Log;
use crate::sink::folder::{Folder, Left};
use crate::sink::parquet::More;
use crate::sink::run_json::Counts;

pub const EVERY: Duration = Duration::from_secs(2);
/// Saving takes at most 1/`SHARE` of the time.
const SHARE: u32 = 50;

/// State of the complete chunks, besides their rows in the tables.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Reached {
    /// Number of complete designs of the sweep or, once all are ranked, of those with kept rows.
    pub next: u64,
    pub counts: Counts,
    pub shown: Highlights,
    /// Time of solving taps and reading charts, s.
    pub solve: f64,
    /// Taps that the full model solved in earlier runs, instead of the reduced one.
    pub mended: u64,
    pub handed: Handed,
    pub found: Found,
    pub best: Best,
    /// With `top`: design and stroke of the kept rows, in order, once all are ranked and the designs table is written.
    pub kept: Option<Vec<(u64, u32)>>,
}

/// The saved state, and the data that each table file needs to continue.
pub(super) type State = (Reached, Vec<Option<More>>);

#[derive(Debug)]
pub(super) struct Keeper {
    pub folder: Folder,
    every: Duration,
    start: Instant,
    pub before: f64,
    last: Instant,
    pause: Duration,
}

impl Keeper {
    pub fn new(folder: Folder, every: Duration, (start, before): (Instant, f64)) -> Self {
        let last = Instant::now();
        Self { folder, every, start, before, last, pause: every }
    }

    fn keep(&mut self, done: String, reached: &Reached, writers: &mut Writers) -> Result<(), Error> {
        let begun = Instant::now();
        let seconds = self.before + self.start.elapsed().as_secs_f64();
        let (files, more) = writers.marks()?;
        self.folder.keep((done, seconds), files, &(reached, more))?;
        self.last = Instant::now();
        self.pause = self.every.max(begun.elapsed() * SHARE);
        Ok(())
    }
}

impl Run<'_> {
    /// Opens the tables in `folder` and continues what a stopped run left there, which is returned.
    pub fn go_on(&mut self, about: &About, folder: &mut Folder) -> Result<Option<Left>, Error> {
        let (mut left, mut more) = (None, Vec::new());
        if let Some((found, (reached, kept))) = folder.resume::<State>()? {
            self.progress.note(&format!("going on: {} are complete", found.done));
            self.progress.begin(reached.counts.taps);
            (left, self.reached, more) = (Some(found), reached, kept);
        }
        self.writers = Writers::new((self.study, self.plan), about, folder, more)?;
        Ok(left)
    }

    /// Marks the next `designs` of `of` as complete and written; saves if it is time.
    pub fn complete(&mut self, designs: u64, (of, what): (u64, &str)) -> Result<(), Error> {
        let from = self.reached.next;
        self.reached.next += designs;
        self.reached.handed.note(what, [from + 1, self.reached.next, of]);
        let stop = self.stop.load(Ordering::Relaxed);
        // A stopped run saves, unless it has only just begun.
        let is_due = |k: &&mut Keeper| {
            k.last.elapsed() >= k.pause || stop && (k.before > 0.0 || k.start.elapsed() >= k.every)
        };
        if let Some(keeper) = self.keeper.as_mut().filter(is_due) {
            let mended = self.reached.mended;
            self.reached.mended += self.evaluator.mended();
            let done = format!("{} of {of} {what}", self.reached.next);
            let kept = keeper.keep(done, &self.reached, &mut self.writers);
            self.reached.mended = mended;
            kept?;
            self.check_stop()?;
        }
        Ok(())
    }
}

/// Ranges of rows with taps that the CPU answered instead of the device, counted from 1 within the sweep or the part.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Handed {
    /// Kind of the row; first row, last row, number of rows.
    stretches: Vec<(String, [u64; 3])>,
    #[serde(skip)]
    device: Log,
    /// Taps answered by the CPU at the last check.
    #[serde(skip)]
    seen: u64,
}

impl Handed {
    pub fn on(self, device: Log) -> Self {
        Self { seen: device.get().handed_over_taps, device, ..self }
    }

    /// Notes that rows `from` to `to` of `of` are now answered.
    pub fn note(&mut self, what: &str, [from, to, of]: [u64; 3]) {
        let taps = self.device.get().handed_over_taps;
        if taps > self.seen {
            match self.stretches.last_mut() {
                Some((last, [_, end, _])) if last == what && *end + 1 >= from => *end = to,
                _ => self.stretches.push((what.to_owned(), [from, to, of])),
            }
        }
        self.seen = taps;
    }

    /// `handed_over` of `run.json`; `None` if the device answered all.
    pub fn described(&self) -> Option<Value> {
        let one = |(what, [from, to, of]): &(String, [u64; 3])| json!({ "what": what, "from": from, "to": to, "of": of });
        let list: Vec<Value> = self.stretches.iter().map(one).collect();
        (!list.is_empty()).then(|| list.into())
    }
}
