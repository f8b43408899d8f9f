//! What of a sweep is complete is kept now and then, so that a stopped one goes on from there.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;

use super::Run;
use super::about::About;
use super::best::Highlights;
use super::handed::Handed;
use super::writers::Writers;
use crate::error::Error;
use crate::evaluate::Outcome;
use crate::sink::folder::{Folder, Left};
use crate::sink::pack::{Packer, Unpacker};
use crate::sink::run_json::Counts;

/// What is complete is kept so often, unless something else is said.
pub const EVERY: Duration = Duration::from_secs(2);
/// Keeping takes at most this share of the time, while the run waits for it.
const SHARE: u32 = 100;

/// Time that a batch is to take: the shortest, and the longest, within which a state can be kept.
const BATCH: [Duration; 2] = [Duration::from_millis(50), Duration::from_secs(1)];
/// Times by which a batch may be larger or smaller than the one before.
const CHANGE: f64 = 16.0;

/// Words of a run that was asked to stop.
const INTERRUPTED: &str = "interrupted";

/// How many taps (or designs that charts rank) go together: as many as take half of the time after which what is complete is to be kept, whatever one
/// costs.
#[derive(Debug)]
pub(super) struct Pace {
    /// Of the next batch, about.
    pub size: u64,
    most: u64,
    begun: Instant,
}

impl Pace {
    /// Beginning with so many, never more than `most`.
    pub fn new(size: u64, most: u64) -> Self {
        Self { size, most, begun: Instant::now() }
    }

    /// A batch is done, and what is complete is to be kept `every` so often.
    fn note(&mut self, every: Duration) {
        let aim = (every / 2).clamp(BATCH[0], BATCH[1]).as_secs_f64();
        let change = (aim / self.begun.elapsed().as_secs_f64()).clamp(1.0 / CHANGE, CHANGE);
        self.size = ((self.size as f64 * change) as u64).clamp(1, self.most);
    }
}

/// Keeps what is complete in the folder of the result.
#[derive(Debug)]
pub(super) struct Keeper {
    pub folder: Folder,
    identity: String,
    every: Duration,
    start: Instant,
    /// Seconds that earlier runs worked on it.
    pub before: f64,
    last: Instant,
    pause: Duration,
}

impl Keeper {
    pub fn new(folder: Folder, identity: &str, every: Duration, (start, before): (Instant, f64)) -> Self {
        let last = Instant::now();
        Self { folder, identity: identity.to_owned(), every, start, before, last, pause: every }
    }

    /// Whether it is time; a run that is asked to stop keeps what it has unless it has only just begun.
    fn is_due(&self, stop: bool) -> bool {
        self.last.elapsed() >= self.pause || stop && (self.before > 0.0 || self.start.elapsed() >= self.every)
    }

    /// `e`, with what is kept if the run ends with it.
    pub fn explain(mut self, e: Error) -> Error {
        let interrupted = matches!(&e, Error::Run(words) if words == INTERRUPTED);
        match (self.folder.words(), e) {
            (None, _) if interrupted => {
                Error::Run(format!("{INTERRUPTED}; nothing was written, an older result is as it was"))
            }
            (None, e) | (Some(_), e @ Error::Input(_)) => e,
            (Some(words), e) => Error::Run(format!("{e}; {words}")),
        }
    }
}

/// What ends a run that was asked to stop.
pub(super) fn interrupted() -> Error {
    Error::Run(INTERRUPTED.to_owned())
}

/// What every route keeps beside the tables: counts, the best rows, seconds of work, taps of the full model, rows that were handed over, and the taps of
/// a design under way.
pub(super) type Shared = (Counts, Highlights, (f64, u64, Handed), Vec<Outcome>);

impl Run<'_> {
    /// Opens the tables in `folder`, and goes on from what a stopped run left there, which is given; it is not where its files are not whole.
    ///
    /// # Errors
    /// Files that cannot be read or made.
    pub fn go_on(&mut self, about: &About, folder: &mut Folder) -> Result<Option<Left>, Error> {
        let (study, plan) = (self.study, self.plan);
        if let Some(left) = folder.left.take() {
            let mut state = Unpacker(&left.state);
            let shared: Option<Shared> = state.take();
            let writers = match shared {
                Some(_) => Writers::resume(study, plan, about, folder, &mut state)?,
                None => Err("its state".to_owned()),
            };
            match (shared, writers) {
                (Some((counts, best, (solve, mended, handed), under_way)), Ok(writers)) => {
                    (self.counts, self.best, self.mended, self.handed) = (counts, best, mended, handed);
                    (self.writers, self.under_way, self.state) = (writers, under_way, Some(state.0.to_vec()));
                    self.solve = Duration::try_from_secs_f64(solve).unwrap_or_default();
                    self.progress.note(&format!("going on: {} are complete", left.done));
                    return Ok(Some(left));
                }
                (_, writers) => folder.damaged(&writers.err().unwrap_or_default())?,
            }
        }
        self.writers = Writers::new(study, plan, about, folder)?;
        Ok(None)
    }

    /// `done` of the designs (or rows of them, or of a tuple file) are complete and in the tables: they are kept if it is time, with what `route` needs to go on from here.
    ///
    /// # Errors
    /// What cannot be written; a request to stop.
    pub fn complete(
        &mut self,
        (done, of, what): (u64, u64, &str),
        route: impl FnOnce(&mut Packer<'_>),
    ) -> Result<(), Error> {
        self.handed.note((done, of, what));
        self.keep(format!("{done} of {of} {what}"), route)
    }

    /// As [`Self::complete`], of a design under way that has so many `taps`.
    pub fn complete_within(
        &mut self,
        ((done, of), taps): ((u64, u64), u64),
        route: impl FnOnce(&mut Packer<'_>),
    ) -> Result<(), Error> {
        self.handed.note_within((done, of, "designs"));
        let solved = self.under_way.len();
        self.keep(format!("{done} of {of} designs and {solved} of {taps} taps of the next"), route)
    }

    /// Keeps what is complete, `done`, if it is time.
    fn keep(&mut self, done: String, route: impl FnOnce(&mut Packer<'_>)) -> Result<(), Error> {
        self.pace.note(self.keeper.as_ref().map_or(EVERY, |keeper| keeper.every));
        let kept = self.keep_now(done, route);
        self.pace.begun = Instant::now();
        kept
    }

    fn keep_now(&mut self, done: String, route: impl FnOnce(&mut Packer<'_>)) -> Result<(), Error> {
        let (stop, mended) = (self.stop.load(Ordering::Relaxed), self.mended());
        let Some(keeper) = self.keeper.as_mut().filter(|keeper| keeper.is_due(stop)) else { return Ok(()) };
        let begun = Instant::now();
        let seconds = keeper.before + keeper.start.elapsed().as_secs_f64();
        let head = Left::new(&keeper.identity, done, seconds);
        let (writers, counts, best, solve) = (&mut self.writers, &self.counts, &self.best, self.solve);
        let (handed, under_way) = (&self.handed, &self.under_way);
        let kept = keeper.folder.keep(&head, stop, |to| {
            to.put(&(counts, best, (solve.as_secs_f64(), mended, handed), under_way));
            writers.pack(to)?;
            route(to);
            Ok(())
        })?;
        if kept {
            keeper.last = Instant::now();
            keeper.pause = keeper.every.max(begun.elapsed() * SHARE);
        }
        self.check_stop()
    }

    /// What the route of a stopped run packed, once.
    pub fn resumed<T: DeserializeOwned>(&mut self) -> Result<Option<T>, Error> {
        let Some(state) = self.state.take() else { return Ok(None) };
        self.progress.begin(self.counts.taps);
        let mut state = Unpacker(&state);
        let value = state.take().filter(|_| state.0.is_empty());
        let damaged =
            || Error::Run("the state of the stopped run cannot be read; --force begins anew".into());
        value.map(Some).ok_or_else(damaged)
    }
}
