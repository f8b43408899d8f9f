//! Opened devices, lent to one test after another, so that compiled shaders are reused.

use std::sync::{Mutex, OnceLock, PoisonError};

use vibrissa::backend::Choice;
use vibrissa::error::{Error, SolveError};
use vibrissa::evaluate::Method;
use vibrissa::kernel::gpu::{Adapter, adapters};
use vibrissa::kernel::{Job, Solution, Solver, Tap};
use vibrissa::scene::{BackendChoice, Model, RunOptions};

use super::sweeping::Place;

static IDLE: Mutex<Vec<(Place, Box<dyn Solver>)>> = Mutex::new(Vec::new());

static ADAPTERS: OnceLock<Vec<Adapter>> = OnceLock::new();

/// The backend of `options`; adapters are enumerated once.
pub fn choice(options: &RunOptions) -> Result<Choice, Error> {
    match options.backend {
        Some(BackendChoice::Gpu) => Choice::among(options, ADAPTERS.get_or_init(adapters)),
        _ => Choice::new(options),
    }
}

/// Returns its solver to the pool when dropped.
struct Lent {
    place: Place,
    solver: Option<Box<dyn Solver>>,
}

impl Lent {
    fn solver(&self) -> &dyn Solver {
        self.solver.as_deref().expect("there until it is dropped")
    }
}

impl Solver for Lent {
    fn solve(
        &mut self,
        job: &Job<'_>,
        taps: &[Tap<f64>],
        out: &mut Vec<Solution<f64>>,
    ) -> Result<(), SolveError> {
        self.solver.as_mut().expect("there until it is dropped").solve(job, taps, out)
    }

    fn batch_limit(&self) -> usize {
        self.solver().batch_limit()
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        // After a panic the solver's state is unknown.
        if let Some(solver) = self.solver.take().filter(|_| !std::thread::panicking()) {
            IDLE.lock().unwrap_or_else(PoisonError::into_inner).push((self.place, solver));
        }
    }
}

pub fn open(place: Place, choice: &Choice, model: &Model) -> Method {
    let idle = {
        let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
        let at = idle.iter().position(|(p, _)| *p == place);
        at.map(|at| idle.swap_remove(at).1)
    };
    let solver =
        idle.unwrap_or_else(|| choice.solver().unwrap_or_else(|e| panic!("{place:?} does not open: {e}")));
    choice.method(Box::new(Lent { place, solver: Some(solver) }), model)
}
