//! Designs rows read from the charts of their distances in place of being reduced from solved taps.

use rayon::prelude::*;

use super::lanes::{Figures, Tables};
use super::ranges::Wanted;
use super::scope::Scope;
use crate::error::SolveError;
use crate::kernel::ranking::Case;
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

    /// Rows of `tuples`, each at its own drive; `None` of those that must be solved.
    pub fn read(&self, tuples: &[Tuple]) -> Vec<Option<Figures>> {
        let part = |tuples: &[Tuple]| {
            let easy: Vec<usize> =
                (0..tuples.len()).filter(|&i| self.scope.case(&tuples[i]) == Case::Easy).collect();
            let these: Vec<Tuple> = easy.iter().map(|&i| tuples[i]).collect();
            let mut all = vec![None; tuples.len()];
            easy.into_iter().zip(self.tables.figures(&these)).for_each(|(i, figures)| all[i] = figures);
            all
        };
        tuples.par_chunks(GRAIN).flat_map_iter(part).collect()
    }
}
