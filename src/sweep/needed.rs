//! A sweep by a model with effects left off: taps at which a word could be another one, and the rows that show whether the model does.

use std::collections::HashMap;
use std::sync::Arc;

use super::key;
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Evaluator, Outcome, Task};
use crate::needed::{Needed, Row};
use crate::scene::{Layout, Setup, Space, Tuple};
use crate::status::Status;

/// Solves by the full model the taps that lie so near to a threshold that their words could be other ones.
pub(super) struct Guard<'a> {
    full: &'a Setup,
    evaluator: Evaluator<'a>,
    strain: f64,
    arc: f64,
}

impl<'a> Guard<'a> {
    /// For the model of `needed`, of which `full` is the full one.
    pub fn new(needed: &Needed, full: &'a Setup) -> Result<Self, Error> {
        let [strain, arc] = needed.margins();
        Ok(Self { full, evaluator: Evaluator::new(full, needed.method()?), strain, arc })
    }

    /// Whether the full model may say another word of a tap of `design`.
    fn doubts(&self, design: &Design, tap: &Outcome) -> bool {
        let near = |x: f64, edge: f64, margin: f64| (x - edge).abs() <= margin * edge;
        let start = design.shared.as_ref().map_or(0.0, |shared| shared.gauge[0]);
        tap.status.has(Status::NOT_CONVERGED)
            || tap.status.has(Status::MATERIAL_LIMIT)
            || near(tap.strain.abs(), self.full.gauge.strain_limit, self.strain)
            || near(tap.arc, design.tuple.L_a, self.arc)
            || near(tap.arc, start, self.arc)
    }

    /// Replaces the doubtful ones of `outcomes`; how many.
    pub fn mend(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        outcomes: &mut [Outcome],
    ) -> Result<u64, Error> {
        let doubtful = |i: &usize| self.doubts(&designs[tasks[*i].design as usize], &outcomes[*i]);
        let places: Vec<usize> = (0..tasks.len()).filter(doubtful).collect();
        let whisker = |i: &usize| Design::new(self.full, designs[tasks[*i].design as usize].tuple);
        let full: Vec<Design> = places.iter().map(whisker).collect();
        let again = |(k, i): (usize, &usize)| Task { design: k as u32, ..tasks[*i] };
        let again: Vec<Task> = places.iter().enumerate().map(again).collect();
        let solved = self.evaluator.run(&full, &again)?;
        places.iter().zip(solved).for_each(|(i, outcome)| outcomes[*i] = outcome);
        Ok(places.len() as u64)
    }
}

/// The rows of `space` that are `kept`, each a design with its drive.
///
/// # Errors
/// A tuple file that cannot be read again.
pub(super) fn rows(space: &Space, kept: &[Tuple]) -> Result<Vec<Row>, Error> {
    let identity = |t: &Tuple| (key(t), (t.drive + 0.0).to_bits());
    let mut distances: HashMap<_, Vec<f64>> = kept.iter().map(|t| (identity(t), Vec::new())).collect();
    let mut note = |t: &Tuple| distances.get_mut(&identity(t)).into_iter().for_each(|row| row.push(t.a));
    match space {
        _ if kept.is_empty() => {}
        Space::Grid(factors) => {
            let layout = Layout::new(factors);
            let all: Arc<[f64]> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
            return Ok(kept.iter().map(|t| Row::new(*t, all.clone())).collect());
        }
        Space::List(tuples) => tuples.iter().for_each(note),
        Space::File(file) => {
            let mut rows = file.rows().map_err(|e| Error::Run(e.to_string()))?;
            for _ in 0..file.len() {
                note(&rows.next().map_err(|e| Error::Run(e.to_string()))?);
            }
        }
    }
    let row = |t: &Tuple| Row::new(*t, distances[&identity(t)].as_slice().into());
    Ok(kept.iter().map(row).collect())
}
