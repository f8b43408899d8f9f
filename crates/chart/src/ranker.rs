//! Ranks the designs of a sweep from charts, in lanes or on a device, and reads rows for searches.

use rayon::prelude::*;

use super::lanes::{Figures, Found, Tables};
use super::ranges::Wanted;
use super::scope::{Scope, Summary};
use crate::error::SolveError;
use crate::kernel::ranking::{Case, Charts, Sheet};
use crate::reduce::Sweeps;
use crate::scene::{Layout, Setup, Study, Tuple};

const ROWS_EACH: usize = 1024;

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

    /// Candidates to bring back.
    pub fn keep(&self) -> usize {
        self.all().map(|ranker| ranker.scope.rank.keep).max().unwrap_or(0)
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
}

/// Charts of some distances of one rig, and their tables.
#[derive(Debug)]
pub struct Ranker {
    scope: Scope,
    tables: Tables,
}

impl Ranker {
    /// Ranks `study` at `tolerance`; `None` if its taps must be solved one by one.
    pub fn new(study: &Study, layout: &Layout, tolerance: f64) -> Result<Option<Self>, SolveError> {
        let Some(scope) = Scope::new(study, layout, tolerance)? else { return Ok(None) };
        Ok(Tables::new(&scope).map(|tables| Self { scope, tables }))
    }

    /// Reads rows of whiskers `wanted` at `distances` mm, strain accurate to a tenth of `tolerance`; `None` if rows are reduced from taps.
    pub fn of_rows(
        setup: &Setup,
        distances: &[f64],
        wanted: &Wanted,
        tolerance: f64,
    ) -> Result<Option<Self>, SolveError> {
        let Some(scope) = Scope::tried(setup, distances, wanted, tolerance)?.0 else { return Ok(None) };
        Ok(Tables::new(&scope).map(|tables| Self { scope, tables }))
    }

    /// Rows of `tuples`, each at its own drive; `None` of those that must be solved.
    pub fn figures(&self, tuples: &[Tuple]) -> Vec<Option<Figures>> {
        let part = |tuples: &[Tuple]| {
            let easy: Vec<usize> =
                (0..tuples.len()).filter(|&i| self.scope.case(&tuples[i]) == Case::Easy).collect();
            let these: Vec<Tuple> = easy.iter().map(|&i| tuples[i]).collect();
            let mut all = vec![None; tuples.len()];
            easy.into_iter().zip(self.tables.figures(&these)).for_each(|(i, figures)| all[i] = figures);
            all
        };
        tuples.par_chunks(ROWS_EACH).flat_map_iter(part).collect()
    }

    /// K − 1 of taps of easy designs, each with the place of its distance, as in the rows.
    pub fn deviations(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        self.tables.deviations(taps)
    }

    /// True if a device can rank by these charts: it reads one for each distance, without a foil.
    pub fn serves_devices(&self) -> bool {
        self.scope.between.is_none() && self.scope.setup.gauge.foil.is_none()
    }

    /// True if the words of taps are right: lanes and devices have f only for cones clamped at their base.
    pub fn tells_words(&self) -> bool {
        self.scope.setup.built.is_none()
    }

    /// Sweeps of the taps solved to make and to check the charts.
    pub fn sweeps(&self) -> Sweeps {
        self.scope.sweeps()
    }
}

impl Charts for Ranker {
    fn case(&self, t: &Tuple) -> Case {
        self.scope.case(t)
    }

    fn rank(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        self.tables.rank(ks, tuples, bound, found);
    }

    fn sheet(&self) -> Option<Sheet> {
        // Devices have the weights of a cone only.
        let cone = self.scope.charts.iter().all(|chart| chart.weight.is_none());
        cone.then(|| self.tables.sheet(&self.scope))
    }
}
