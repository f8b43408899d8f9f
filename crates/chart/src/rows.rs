//! Designs rows read from the charts of their distances in place of being reduced from solved taps.

use rayon::prelude::*;

use super::lanes::{Counting, Figures, Tables, Words};
use super::ranges::Wanted;
use super::scope::{Scope, Summary};
use crate::error::SolveError;
use crate::kernel::ranking::Case;
use crate::reduce::Sweeps;
use crate::scene::{Setup, Tuple};

/// Rows of one work item.
const GRAIN: usize = 1024;

/// Charts of some distances of one rig, from which whole rows are read.
#[derive(Debug)]
pub struct RowReader {
    scope: Scope,
    tables: Tables,
}

impl RowReader {
    /// Charts of `setup` at `distances` mm for whiskers as `wanted`, their strain good to a tenth of `tolerance`. `None` where rows are
    /// reduced from taps.
    pub fn new(
        setup: &Setup,
        distances: &[f64],
        wanted: &Wanted,
        tolerance: f64,
    ) -> Result<Option<Self>, SolveError> {
        let Some(scope) = Scope::tried(setup, distances, wanted, tolerance)?.0 else { return Ok(None) };
        Ok(Tables::new(&scope).map(|tables| Self { scope, tables }))
    }

    /// Rows of `tuples`, each at its own drive, and their taps per word; `None` of those that must be solved.
    pub fn read(&self, tuples: &[Tuple], counting: Counting) -> (Vec<Option<Figures>>, Words) {
        let part = |tuples: &[Tuple]| {
            let easy: Vec<usize> =
                (0..tuples.len()).filter(|&i| self.scope.case(&tuples[i]) == Case::Easy).collect();
            let these: Vec<Tuple> = easy.iter().map(|&i| tuples[i]).collect();
            let mut found = Vec::with_capacity(easy.len());
            let words = self.tables.figures(&these, counting, &mut found);
            let mut all = vec![None; tuples.len()];
            easy.into_iter().zip(found).for_each(|(i, figures)| all[i] = figures);
            (all, words)
        };
        let parts: Vec<(Vec<Option<Figures>>, Words)> = tuples.par_chunks(GRAIN).map(part).collect();
        let mut words = Words::default();
        parts.iter().for_each(|(_, part)| words.add(part));
        (parts.into_iter().flat_map(|(rows, _)| rows).collect(), words)
    }

    /// What `run.json` says of the charts.
    pub fn summary(&self) -> Summary {
        self.scope.summary()
    }

    /// Of the taps solved to make the charts.
    pub fn sweeps(&self) -> Sweeps {
        self.scope.sweeps()
    }
}
