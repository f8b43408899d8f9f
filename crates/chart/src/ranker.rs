//! Ranks the designs of a sweep from charts, in lanes or on a device, and reads rows for searches.

use std::ops::Range;

use rayon::prelude::*;

use super::lanes::Found;
pub use super::lanes::Ranker;
use super::ranges::Wanted;
use super::scope::{Scope, Summary};
use crate::error::SolveError;
use crate::evaluate::Evaluator;
use crate::kernel::gpu::ranking::DeviceRanker;
use crate::kernel::ranking::Case;
use crate::reduce::Sweeps;
use crate::scene::{Layout, Setup, Study, Tuple};

/// Fewest and most designs of one work item, in whole packs of lanes; in between as many as have about `GRAIN` taps.
const GRAINS: [u64; 2] = [256, 2048];
const GRAIN: u64 = 1 << 18;

/// One ranker per rig; `None` for a rig whose designs are all solved.
#[derive(Debug)]
pub struct Rankers(pub Vec<Option<Ranker>>);

impl Rankers {
    /// Those that exist.
    pub fn all(&self) -> impl Iterator<Item = &Ranker> {
        self.0.iter().flatten()
    }

    /// Candidates to bring back: more than requested, because they are solved again before they are ranked.
    pub fn keep(&self) -> usize {
        self.all().filter_map(|ranker| ranker.scope.output.top).map(|top| 2 * top + 64).max().unwrap_or(0)
    }

    /// Summary of the first charts for `run.json`.
    pub fn summary(&self) -> Option<Summary> {
        self.all().next().map(|ranker| ranker.scope.summary())
    }

    /// The path of the design `t`.
    pub fn case(&self, t: &Tuple) -> Case {
        let ranker = self.0.get(t.rig as usize).and_then(Option::as_ref);
        ranker.map_or(Case::Hard, |ranker| ranker.case(t))
    }

    /// Rows of a range of designs of `layout` that rank below `bound`.
    pub fn rank_all(&self, layout: &Layout, designs: Range<u64>, bound: f32) -> Found {
        self.rank(layout, &designs.collect::<Vec<u64>>(), bound)
    }

    /// Rows of the designs `ks` of `layout` that rank below `bound`.
    pub fn rank(&self, layout: &Layout, ks: &[u64], bound: f32) -> Found {
        let one = |ks: &[u64]| {
            let mut found = Found::default();
            let mut easy: Vec<(Vec<u64>, Vec<Tuple>)> = vec![Default::default(); self.0.len()];
            for (&k, tuple) in ks.iter().zip(layout.designs(ks)) {
                match self.case(&tuple) {
                    Case::Easy => {
                        let (ks, tuples) = &mut easy[tuple.rig as usize];
                        ks.push(k);
                        tuples.push(tuple);
                    }
                    Case::Hard => found.hard.push(k),
                    Case::Void => found.words.invalid += layout.block(),
                }
            }
            for (ranker, (ks, tuples)) in self.0.iter().zip(&easy) {
                ranker.iter().for_each(|ranker| ranker.rank(ks, tuples, bound, &mut found));
            }
            found
        };
        let merge = |mut a: Found, b: Found| {
            a.merge(b);
            a
        };
        let [least, most] = GRAINS;
        let grain = (GRAIN / layout.block() / least * least).clamp(least, most);
        ks.par_chunks(grain as usize).map(one).reduce(Found::default, merge)
    }

    /// The device of `evaluator`, if it can rank the designs of `layout`: those of one rig.
    pub fn on_device(
        &self,
        evaluator: &mut Evaluator<'_>,
        layout: &Layout,
    ) -> Result<Option<DeviceRanker>, SolveError> {
        let [Some(ranker)] = self.0.as_slice() else { return Ok(None) };
        evaluator.ranking(|| ranker.sheet(), layout, &|ks, bound| self.rank(layout, ks, bound))
    }
}

impl Ranker {
    /// Ranks `study` at `tolerance`; `None` if its taps must be solved one by one.
    pub fn new(study: &Study, layout: &Layout, tolerance: f64) -> Result<Option<Self>, SolveError> {
        Ok(Scope::new(study, layout, tolerance)?.and_then(Self::over))
    }

    /// Reads rows of whiskers `wanted` at `distances` mm, strain accurate to a tenth of `tolerance`; `None` if rows are reduced from taps.
    pub fn of_rows(
        setup: &Setup,
        distances: &[f64],
        wanted: &Wanted,
        tolerance: f64,
    ) -> Result<Option<Self>, SolveError> {
        Ok(Scope::tried(setup, distances, wanted, tolerance)?.0.and_then(Self::over))
    }

    /// The path of the design `t`.
    pub fn case(&self, t: &Tuple) -> Case {
        self.scope.case(t)
    }

    /// Sweeps of the taps solved to make and to check the charts.
    pub fn sweeps(&self) -> Sweeps {
        let mut all = Sweeps::default();
        self.scope.charts.iter().for_each(|chart| all.merge(&chart.sweeps));
        all
    }
}
