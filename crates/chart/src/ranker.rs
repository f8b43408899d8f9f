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

    /// Candidates to bring back.
    pub fn keep(&self) -> usize {
        self.scope.rank.keep
    }

    /// Sweeps of the taps solved to make and to check the charts.
    pub fn sweeps(&self) -> Sweeps {
        self.scope.sweeps()
    }

    /// Summary of the charts for `run.json`.
    pub fn summary(&self) -> Summary {
        self.scope.summary()
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
