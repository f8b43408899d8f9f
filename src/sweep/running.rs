//! State of a running sweep, and the order in which a sweep visits the designs: all of them, or ranked first and then those of the kept rows.

use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::group::{Group, Strokes};
use super::keep::Best;
use super::{Keeper, Kept, Place, Reached, Taps, Writers, charted, charted::Search};
use crate::design::Design;
use crate::error::{Error, SolveError};
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::plan::Plan;
use crate::progress::{Progress, go_on};
use crate::reduce::larger;
use crate::scene::{Per, Setup, Study};
use crate::sink::{AtDrive, Frame, Table};

pub(super) struct Run<'a> {
    pub study: &'a Study,
    pub evaluator: Evaluator<'a>,
    pub writers: Writers,
    pub reached: Reached,
    pub plan: &'a Plan,
    pub stop: &'a AtomicBool,
    pub progress: &'a mut dyn Progress,
    pub designs: Range<u64>,
    pub taps: u64,
    /// `None` if nothing is written.
    pub keeper: Option<Keeper>,
}

impl<'a> Run<'a> {
    pub fn new(
        (study, plan): (&'a Study, &'a Plan),
        method: Method,
        (stop, progress): (&'a AtomicBool, &'a mut dyn Progress),
    ) -> Self {
        let evaluator = Evaluator::new(&study.setup, method).stopping(stop);
        let best = Best { n: study.output.top.unwrap_or(0), ..Best::default() };
        let reached = Reached { best, ..Reached::default() };
        let (writers, designs, taps) = (Writers::default(), 0..plan.designs, plan.taps);
        Self { study, evaluator, writers, reached, plan, stop, progress, designs, taps, keeper: None }
    }

    /// Runs `f` unless stopped; records its time and sweeps.
    fn timed<R, E>(&mut self, f: impl FnOnce(&mut Evaluator<'a>) -> Result<R, E>) -> Result<R, Error>
    where
        Error: From<E>,
    {
        self.check_stop()?;
        let start = Instant::now();
        let done = f(&mut self.evaluator)?;
        self.reached.solve += start.elapsed().as_secs_f64();
        self.reached.counts.sweeps.merge(&self.evaluator.take_sweeps());
        Ok(done)
    }

    pub fn evaluate(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, Error> {
        let outcomes = self.timed(|evaluator| evaluator.run(designs, tasks))?;
        self.reached.counts.solved += outcomes.len() as u64;
        self.reached.counts.referred += outcomes.iter().filter(|o| o.referred).count() as u64;
        for o in outcomes.iter().filter(|o| o.status.counts()) {
            let strain = &mut self.reached.counts.strain;
            *strain = larger(*strain, o.magnitude());
        }
        Ok(outcomes)
    }

    /// The result of `solve`, which takes further taps and counts them.
    pub fn more<T>(
        &mut self,
        solve: impl FnOnce(&Setup, &mut Evaluator<'a>) -> Result<(Vec<T>, u64), SolveError>,
    ) -> Result<Vec<T>, Error> {
        let setup = &self.study.setup;
        let (found, solved) = self.timed(|evaluator| solve(setup, evaluator))?;
        self.reached.counts.solved += solved;
        Ok(found)
    }

    pub fn check_stop(&self) -> Result<(), Error> {
        Ok(go_on(self.stop)?)
    }

    /// Taps that the full model solved instead of the reduced one.
    pub fn mended(&self) -> u64 {
        self.reached.mended + self.evaluator.mended()
    }

    pub fn show(&mut self, more: u64) {
        self.progress.at(self.reached.counts.taps + more, self.taps);
    }

    pub fn write(&mut self, table: Table, pieces: &[Frame]) -> Result<(), Error> {
        if self.writers.wants(table) {
            self.reached.counts.rows[table as usize] +=
                pieces.iter().map(|piece| piece.len() as u64).sum::<u64>();
        }
        self.writers.write(table, pieces)
    }
}

pub(super) fn run(run: &mut Run<'_>, taps: &Taps<'_>) -> Result<(), Error> {
    let every: Vec<Table> = Table::ALL.into_iter().filter(|t| run.writers.wants(*t)).collect();
    let own = (run.designs.clone(), Some((run.designs.end - run.designs.start, "designs")));
    if run.study.output.top.is_none() {
        return chunks(run, taps, own, (&every, None), |run, complete| {
            complete.iter().flatten().for_each(|row| run.reached.shown.offer(row));
        });
    }
    if run.reached.kept.is_none() {
        let kept = match (&run.plan.rankers, taps) {
            (Some(ranker), Taps::Grid { layout, .. }) => charted::run(run, &Search { taps, layout, ranker })?,
            _ => {
                chunks(run, taps, own, (&[], None), offer)?;
                let best = std::mem::take(&mut run.reached.best);
                run.reached.counts.complete = Some(best.offered);
                best.into_rows()
            }
        };
        write_kept(run, taps, &kept)?;
    }

    let rest: Vec<Table> = every.into_iter().filter(|t| *t != Table::Designs).collect();
    if rest.is_empty() {
        return Ok(());
    }
    let kept = run.reached.kept.clone().unwrap_or_default();
    let mut designs: Vec<u64> = kept.iter().map(|(k, _)| *k).collect();
    designs.dedup();
    let of = designs.len() as u64;
    let before = run.reached.counts.clone();
    let designs = (designs.into_iter(), Some((of, "kept designs")));
    chunks(run, taps, designs, (&rest, Some(&kept)), |run, _| {
        run.reached.counts.taps = before.taps;
        run.reached.counts.combinations.clone_from(&before.combinations);
    })
}

/// Solves and writes the remaining `designs`, chunk by chunk, which are `counted` as complete of so many; `take` receives the complete rows of each
/// design.
pub(super) fn chunks(
    run: &mut Run<'_>,
    taps: &Taps<'_>,
    (designs, counted): (impl Iterator<Item = u64>, Option<(u64, &str)>),
    (tables, kept): (&[Table], Option<Strokes<'_>>),
    mut take: impl FnMut(&mut Run<'_>, Vec<Vec<Kept>>),
) -> Result<(), Error> {
    let done = counted.map_or(0, |_| run.reached.next as usize);
    let mut designs = designs.skip(done).peekable();
    let all = !taps.in_order() && !tables.is_empty();
    while let Some(group) = Group::next(run, taps, (&mut designs, all))? {
        let complete = group.finish(run, taps, (tables, kept))?;
        take(run, complete);
        if let Some(of) = counted {
            run.complete(group.numbers.len() as u64, of)?;
        }
    }
    Ok(())
}

/// Offers the complete rows of designs to the best ones.
pub(super) fn offer(run: &mut Run<'_>, complete: Vec<Vec<Kept>>) {
    let best = &mut run.reached.best;
    for rows in complete {
        match run.study.output.per {
            Per::Row => rows.into_iter().for_each(|row| best.offer(row)),
            Per::Design => rows.into_iter().min_by(Kept::order).into_iter().for_each(|row| best.offer(row)),
        }
    }
}

fn write_kept(run: &mut Run<'_>, taps: &Taps<'_>, kept: &[Kept]) -> Result<(), Error> {
    let n = kept.len() as u64;
    run.reached.handed.note("kept rows", [1, n, n]);
    run.reached.counts.kept = Some(n);
    let setup = &run.study.setup;
    let (columns, mut rows) = (AtDrive::chosen(setup), Table::Designs.heading().frame_for(setup));
    for row in kept {
        rows.row(columns.fields(&row.at))?;
        run.reached.shown.offer(row);
    }
    run.write(Table::Designs, &[rows])?;
    run.writers.place(kept.iter().map(|row| Place::of(row, taps.design_of(row.index))))?;
    let mut places: Vec<(u64, u32)> = kept.iter().map(|k| (taps.design_of(k.index), k.index.1)).collect();
    places.sort_unstable();
    (run.reached.next, run.reached.kept) = (0, Some(places));
    Ok(())
}
