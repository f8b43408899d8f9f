//! With effects left off, taps close enough to a status threshold that the full model could decide otherwise are solved by the full model.

use super::{Evaluator, Method, Outcome, Task};
use crate::design::Design;
use crate::error::SolveError;
use crate::scene::Setup;
use crate::status::Status;

/// The full model, for taps of a model with effects left off.
pub struct Guard<'a> {
    setup: &'a Setup,
    full: Evaluator<'a>,
    margin: f64,
    /// Taps that it has solved.
    pub mended: u64,
}

impl<'a> Guard<'a> {
    /// The model of `full`, solved by `method`; strains and contact arcs within `margin` of a threshold, relative, are doubtful.
    pub fn new(full: &'a Setup, method: Method, margin: f64) -> Self {
        Self { setup: full, full: Evaluator::new(full, method), margin, mended: 0 }
    }

    pub(super) fn mend(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        outcomes: &mut [Outcome],
    ) -> Result<(), SolveError> {
        let doubtful = |i: &usize| {
            let tap = &outcomes[*i];
            let design = &designs[tasks[*i].design as usize];
            doubts(self.setup, design, (tap.magnitude(), tap.arc, tap.status), self.margin)
        };
        let places: Vec<usize> = (0..tasks.len()).filter(doubtful).collect();
        let whisker = |i: &usize| Design::new(self.setup, designs[tasks[*i].design as usize].tuple);
        let whiskers: Vec<Design> = places.iter().map(whisker).collect();
        let again = |(k, i): (usize, &usize)| Task { design: k as u32, ..tasks[*i] };
        let again: Vec<Task> = places.iter().enumerate().map(again).collect();
        let solved = self.full.run(&whiskers, &again)?;
        places.iter().zip(solved).for_each(|(i, outcome)| outcomes[*i] = outcome);
        self.mended += places.len() as u64;
        Ok(())
    }
}

/// True if a model with strain and arc within `margin`, relative, may give another status: unsolved, or near a limit, the tip or the gauge.
pub fn doubts(
    setup: &Setup,
    design: &Design,
    (strain, arc, status): (f64, f64, Status),
    margin: f64,
) -> bool {
    let near = |x: f64, edge: f64| (x - edge).abs() <= margin * edge;
    let shared = design.shared.as_ref();
    let start = shared.map_or(0.0, |shared| shared.gauge[0]);
    let limit = shared.map_or(setup.gauge.strain_limit, |shared| shared.strain_limit(&setup.gauge));
    status.has(Status::NOT_CONVERGED)
        || status.has(Status::MATERIAL_LIMIT)
        || near(strain.abs(), limit)
        || near(arc, design.tuple.L_a)
        || near(arc, start)
}
