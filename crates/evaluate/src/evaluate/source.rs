//! Taps that are read in place of being solved, and what linear theory says where the plane of bending is asked for.

use std::fmt::Debug;
use std::sync::Arc;

use super::{Evaluator, Outcome, Outcomes, Task};
use crate::design::{Design, radians};
use crate::scene::{Direction, Drive, Setup};

/// Where taps are read: charts of them.
pub trait Source: Debug + Send + Sync {
    /// What it says of `tasks`; `None` of those that must be solved.
    fn read(&self, setup: &Setup, designs: &[Design], tasks: &[Task]) -> Vec<Option<Outcome>>;
}

impl Evaluator<'_> {
    /// With `readers` for [`Self::read`], one for each rig; none where nothing is read.
    pub fn reading(self, readers: impl IntoIterator<Item = Option<Arc<impl Source + 'static>>>) -> Self {
        let readers = readers.into_iter().map(|reader| reader.map(|reader| reader as Arc<dyn Source>));
        Self { readers: readers.collect(), ..self }
    }

    /// What readers say of `tasks`, each of those of its own rig.
    fn found(&self, designs: &[Design], tasks: &[Task]) -> Vec<Option<Outcome>> {
        if let [Some(reader)] = self.readers.as_slice() {
            return reader.read(self.setup, designs, tasks);
        }
        let mut all = vec![None; tasks.len()];
        for (rig, reader) in (0..).zip(&self.readers) {
            let own = |i: &usize| designs[tasks[*i].design as usize].tuple.rig == rig;
            let places: Vec<usize> = (0..tasks.len()).filter(own).collect();
            let (Some(reader), Some(first)) = (reader, places.first()) else { continue };
            let setup = designs[tasks[*first].design as usize].setup(self.setup);
            let these: Vec<Task> = places.iter().map(|&i| tasks[i]).collect();
            let found = reader.read(setup, designs, &these);
            places.into_iter().zip(found).for_each(|(i, outcome)| all[i] = outcome);
        }
        all
    }

    /// Outcomes of `tasks`, in their order: read from charts where there are any, else as [`Self::run`].
    pub fn read(&mut self, designs: &[Design], tasks: &[Task]) -> Outcomes {
        if self.readers.iter().all(Option::is_none) {
            return self.run(designs, tasks);
        }
        let found = self.found(designs, tasks);
        let open: Vec<usize> = (0..tasks.len()).filter(|&i| found[i].is_none()).collect();
        let again: Vec<Task> = open.iter().map(|&i| tasks[i]).collect();
        let solved = self.unguarded(|one| one.run(designs, &again))?;
        let mut all: Vec<Outcome> = found.into_iter().map(|o| o.unwrap_or(Outcome::NOTHING)).collect();
        open.iter().zip(solved).for_each(|(&i, outcome)| all[i] = outcome);
        self.mend(designs, tasks, all)
    }
}

/// ε₂/(θ f), φ (rad) and λ over the path of the pole, as linear theory has them, for a pole of `direction` (model §6).
pub fn beside_linear(direction: Direction) -> [f64; 3] {
    let [tilt, lean] = radians(direction);
    [tilt.cos() * tilt.sin(), tilt, -tilt.sin() / lean.cos()]
}

/// How far the pole comes towards the base, mm per unit of the drive: rad, or mm.
pub fn path(setup: &Setup, a: f64) -> f64 {
    match setup.drive {
        Drive::Angle => a + setup.hub,
        Drive::Displacement => 1.0,
    }
}
