//! Taps that are read in place of being solved, and linear theory out of plane.

use std::fmt::Debug;
use std::sync::Arc;

use super::{Evaluator, Outcome, Outcomes, Task};
use crate::design::{Design, radians};
use crate::scene::{Direction, Drive, Setup};

/// A source of outcomes: charts.
pub trait Source: Debug + Send + Sync {
    /// Outcomes of `tasks`; `None` of those that must be solved.
    fn read(&self, setup: &Setup, designs: &[Design], tasks: &[Task]) -> Vec<Option<Outcome>>;
}

impl Evaluator<'_> {
    /// With a `reader` for [`Self::read`], if there is one.
    pub fn reading(self, reader: Option<Arc<impl Source + 'static>>) -> Self {
        Self { reader: reader.map(|reader| reader as Arc<dyn Source>), ..self }
    }

    /// Outcomes of `tasks`, in their order: read where possible, else as [`Self::run`].
    pub fn read(&mut self, designs: &[Design], tasks: &[Task]) -> Outcomes {
        let Some(reader) = &self.reader else { return self.run(designs, tasks) };
        let found = reader.read(self.setup, designs, tasks);
        let open: Vec<usize> = (0..tasks.len()).filter(|&i| found[i].is_none()).collect();
        let again: Vec<Task> = open.iter().map(|&i| tasks[i]).collect();
        let solved = self.unguarded(|one| one.run(designs, &again))?;
        let mut all: Vec<Outcome> = found.into_iter().map(|o| o.unwrap_or(Outcome::NOTHING)).collect();
        open.iter().zip(solved).for_each(|(&i, outcome)| all[i] = outcome);
        self.mend(designs, tasks, all)
    }
}

/// ε₂/(θ f), φ (rad) and λ over the path of the pole, in linear theory, for a pole of `direction` (model §6).
pub fn beside_linear(direction: Direction) -> [f64; 3] {
    let [tilt, lean] = radians(direction);
    [tilt.cos() * tilt.sin(), tilt, -tilt.sin() / lean.cos()]
}

/// Path of the pole towards the base, mm per unit of the drive: rad, or mm.
pub fn path(setup: &Setup, a: f64) -> f64 {
    match setup.drive {
        Drive::Angle => a + setup.hub,
        Drive::Displacement => 1.0,
    }
}
