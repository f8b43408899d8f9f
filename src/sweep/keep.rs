//! The state after the last complete chunk of a sweep, saved regularly, so that a stopped sweep continues from there.
//! With it the rows that a sweep keeps with `top`, and those that it shows; in bounded memory.

use std::cmp::Ordering;
use std::sync::atomic;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::output::{About, Writers};
use super::{Run, key};
use crate::chart::lanes::Found;
use crate::error::Error;
use crate::kernel::gpu::Log;
use crate::recommend::{self, Standing};
use crate::sink::{AtDrive, Folder, folder::Left, parquet::More, run_json::Counts};

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
    pub every: Duration,
    pub start: Instant,
    pub before: f64,
    pub last: Instant,
    pub pause: Duration,
}

impl Keeper {
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
        self.writers = Writers::new((self.study, self.plan), about, Some(folder), more)?;
        Ok(left)
    }

    /// Marks the next `designs` of `of` as complete and written; saves if it is time.
    pub fn complete(&mut self, designs: u64, (of, what): (u64, &str)) -> Result<(), Error> {
        let from = self.reached.next;
        self.reached.next += designs;
        self.reached.handed.note(what, [from + 1, self.reached.next, of]);
        let stop = self.stop.load(atomic::Ordering::Relaxed);
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

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    pub rank: f64,
    /// Number of the design, then of the stroke.
    pub index: (u64, u32),
    pub at: AtDrive,
    /// Rank value from a chart, which selects candidates; NaN for a row solved tap by tap.
    pub(super) charted: f32,
}

impl Kept {
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.rank.total_cmp(&other.rank).then(self.index.cmp(&other.index))
    }
}

#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Best {
    pub n: usize,
    /// The best rows, and newer ones not compared yet.
    pub rows: Vec<Kept>,
    pub offered: u64,
}

const WAITING: usize = 64;

impl Best {
    pub fn offer(&mut self, row: Kept) {
        self.offered += 1;
        self.rows.push(row);
        if self.rows.len() >= 2 * self.n + WAITING {
            self.rows.select_nth_unstable_by(self.n, Kept::order);
            self.rows.truncate(self.n);
        }
    }

    pub fn into_rows(mut self) -> Vec<Kept> {
        self.rows.sort_unstable_by(Kept::order);
        self.rows.truncate(self.n);
        self.rows
    }
}

const SHOWN: usize = 8;

/// The best of all offered rows, and the best row of each of the best designs.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Highlights {
    pub offered: u64,
    least: Option<f64>,
    rows: Vec<Kept>,
    designs: Vec<Kept>,
}

fn order(a: &Kept, b: &Kept) -> Ordering {
    let of = |row: &Kept| (row.at.row.status, row.rank);
    recommend::order(of(a), of(b)).then(a.index.cmp(&b.index))
}

fn put(best: &mut Vec<Kept>, row: &Kept, of_each_design: bool) {
    if best.len() == SHOWN && order(row, &best[SHOWN - 1]).is_ge() {
        return;
    }
    let same = |old: &Kept| of_each_design && key(&old.at.design) == key(&row.at.design);
    if let Some(place) = best.iter().position(same) {
        if order(row, &best[place]).is_ge() {
            return;
        }
        best.remove(place);
    }
    best.insert(best.partition_point(|old| order(old, row).is_lt()), row.clone());
    best.truncate(SHOWN);
}

impl Highlights {
    pub fn offer(&mut self, row: &Kept) {
        self.offered += 1;
        self.least = Some(self.least.map_or(row.rank, |least| least.min(row.rank)));
        put(&mut self.rows, row, false);
        put(&mut self.designs, row, true);
    }

    /// Position of the recommended row relative to the strain limit; `None` without a complete row.
    pub fn standing(&self) -> Option<Standing> {
        let best = self.rows.first()?;
        Some(Standing::of((best.at.row.status, best.rank), self.least?))
    }

    /// The rows shown, the recommended one first: all if they are few or were `asked` for, else one per design if there are several.
    pub fn into_rows(self, asked: bool) -> (Vec<Kept>, bool) {
        let by_design = !asked && self.offered > SHOWN as u64 && self.designs.len() > 1;
        (if by_design { self.designs } else { self.rows }, by_design)
    }
}
