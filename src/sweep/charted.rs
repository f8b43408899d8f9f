//! A ranked sweep from charts: all rows are ranked in a few flops each, the best are solved.

use std::ops::Range;
use std::time::Instant;

use rayon::prelude::*;

use super::running::{chunks, offer};
use super::{Kept, Reached, Run, Taps};
use crate::census::{self, Row};
use crate::chart::lanes::Found;
use crate::chart::ranker::{Ranker, Rankers};
use crate::error::{Error, SolveError};
use crate::kernel::gpu::ranking::DeviceRanker;
use crate::plan::Layout;
use crate::sink::AtDrive;
use crate::statistics::Told;

/// Maximum number of designs in a chunk, and approximate number of its taps.
const GROUP: u64 = 1 << 16;
const CHUNK: u64 = 1 << 26;

/// Designs of the first chunk, before there is a bound; each further chunk multiplies the finished designs by `GROWTH`.
const FIRST: u64 = 64;
const GROWTH: u64 = 16;

pub(super) fn run(run: &mut Run<'_>, search: &Search<'_>) -> Result<Vec<Kept>, Error> {
    let Search { layout, ranker, .. } = *search;
    if run.reached.next == 0 {
        for sweeps in ranker.all().map(Ranker::sweeps) {
            run.reached.counts.solved += sweeps.taps;
            run.reached.counts.sweeps.merge(&sweeps);
        }
    }
    let mut by = "lanes";
    if let Some(device) = ranker.on_device(&mut run.evaluator, layout)? {
        match search.on_device(run, device) {
            // The CPU continues after the last batch that came back.
            Err(Error::Solve(SolveError::Device(why))) => run.evaluator.give_up(&why),
            other => {
                other?;
                by = "device";
            }
        }
    }
    search.on_host(run)?;
    let Reached { counts, found, best, .. } = &mut run.reached;
    if let Some(chart) = &mut counts.chart {
        chart["ranked_by"] = by.into();
    }
    let (mut found, mut best) = (std::mem::take(found), std::mem::take(best));
    let noted = found.words.combinations().filter(|(_, n)| *n > 0);
    noted.for_each(|(status, n)| counts.combinations.note(status, n));
    bound(&mut found, ranker.keep());
    counts.complete = Some(best.offered + found.complete);
    let solved = solve(run, layout, &found.rows)?;
    if run.writers.places.is_some() {
        // Candidates of the whole can be selected only when all parts are known.
        let mut rows: Vec<Kept> = best.into_rows().into_iter().chain(solved).collect();
        rows.sort_by(Kept::order);
        return Ok(rows);
    }
    solved.into_iter().for_each(|row| best.offer(row));
    Ok(best.into_rows())
}

pub(super) struct Search<'a> {
    pub taps: &'a Taps<'a>,
    pub layout: &'a Layout,
    pub ranker: &'a Rankers,
}

impl Search<'_> {
    fn on_host(&self, run: &mut Run<'_>) -> Result<(), Error> {
        let (Range { start, end }, most) =
            (run.designs.clone(), (CHUNK / self.layout.block()).clamp(1, GROUP));
        while start + run.reached.next < end {
            run.check_stop()?;
            let begun = Instant::now();
            let from = start + run.reached.next;
            // Few designs at first, until there is a bound.
            let to = end.min(from + most.min(FIRST + (GROWTH - 1) * run.reached.next));
            let bound = bound(&mut run.reached.found, self.ranker.keep());
            let found = self.ranker.rank_all(self.layout, from..to, bound);
            run.reached.solve += begun.elapsed().as_secs_f64();
            self.take(run, found, to - from)?;
        }
        Ok(())
    }

    /// Ranks on a GPU in overlapping batches; the few designs with rows below the bound are listed in CPU lanes.
    fn on_device(&self, run: &mut Run<'_>, mut device: DeviceRanker) -> Result<(), Error> {
        let Range { start, end } = run.designs;
        let mut next = start + run.reached.next;
        loop {
            run.check_stop()?;
            while next < end && device.free() {
                let to = (next + device.most().min(FIRST + run.reached.next)).min(end);
                device.start(next..to, bound(&mut run.reached.found, self.ranker.keep()));
                next = to;
            }
            let begun = Instant::now();
            let Some(batch) = device.finish() else { return Ok(()) };
            let batch = batch?;
            let bound = bound(&mut run.reached.found, self.ranker.keep());
            let rows = self.ranker.rank(self.layout, &batch.best, bound).rows;
            run.reached.solve += begun.elapsed().as_secs_f64();
            let designs = batch.range.end - batch.range.start;
            self.take(run, Found { rows, ..batch.found }, designs)?;
        }
    }

    /// Adds the results of the next `designs` designs; the hard ones are solved tap by tap.
    fn take(&self, run: &mut Run<'_>, found: Found, designs: u64) -> Result<(), Error> {
        let all = &mut run.reached.found;
        all.merge(found);
        let mut hard = std::mem::take(&mut all.hard);
        hard.sort_unstable();
        let easy = (designs - hard.len() as u64) * self.layout.block();
        run.reached.counts.taps += easy;
        run.reached.counts.interpolated += easy;
        chunks(run, self.taps, (hard.into_iter(), None), (&[], None), offer)?;
        run.show(0);
        bound(&mut run.reached.found, self.ranker.keep());
        run.complete(designs, (run.designs.end - run.designs.start, "designs"))
    }
}

/// Keeps the `keep` best rows; returns the worst of them once there are that many, else infinity.
pub(super) fn bound(found: &mut Found, keep: usize) -> f32 {
    if found.rows.len() < keep {
        return f32::INFINITY;
    }
    found.rows.select_nth_unstable_by(keep - 1, |a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    found.rows.truncate(keep);
    found.rows[keep - 1].0
}

fn solve(run: &mut Run<'_>, layout: &Layout, rows: &[(f32, u64, u32)]) -> Result<Vec<Kept>, Error> {
    let study = run.study;
    let mut kept = Vec::with_capacity(rows.len());
    let n = layout.n_distances as usize;
    let row = Row::over(layout, layout.n_distances);
    for rows in rows.chunks((super::CHUNK as usize / n).max(1)) {
        let stroke = |&(_, k, j): &(f32, u64, u32)| layout.stroke(&layout.design(k), j.into());
        let asked: Vec<Row> = rows.iter().map(stroke).map(&row).collect();
        let taps = census::Taps::of_rows(&study.setup, &asked);
        let outcomes = run.evaluate(&taps.designs, &taps.tasks)?;
        let one = |at: usize| {
            let (design, (charted, k, j)) = (&taps.designs[at], rows[at]);
            let outcomes = &outcomes[at * n..(at + 1) * n];
            let (reduced, _) = asked[at].reduced(&study.setup, design, outcomes, |_| Told::Formula, None);
            let rank = reduced.drives[0].rank(study.listed_by(), reduced.unit())?;
            let at = AtDrive { design: design.tuple, row: reduced.drives[0].figures(), unit: reduced.unit() };
            Some(Kept { rank, index: (k, j), at, charted })
        };
        kept.par_extend((0..rows.len()).into_par_iter().filter_map(one));
    }
    Ok(kept)
}
