//! What is meant to be used from outside: a rig described in code, swept, its best tap angle, its readings answered. Everything else is
//! public for the program and its tests, and changes with them.
//!
//! ```no_run
//! use vibrissa::api::*;
//! let setup = Setup::default().material(Material::NeoHookean(3.2)).surface().noise(20e-6);
//! let whisker = Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, a: 30.0, drive: 4.0 };
//! let tap = strains(&setup, &[whisker])?[0];
//! println!("{:.6} {}", tap.strain, tap.status);
//! # Ok::<(), vibrissa::api::Error>(())
//! ```

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

pub use crate::error::Error;
pub use crate::evaluate::Outcome;
pub use crate::locate::{Located, Locator};
pub use crate::scene::search::Objective;
pub use crate::scene::{
    Axis, BackendChoice, Contact, Convention, Drive, Material, Model, Output, RankBy, RunOptions, Setup,
    Side, Space, Spec, Study, Theory, Tuple,
};
pub use crate::status::Status;
pub use crate::sweep::Report as Swept;
pub use crate::tap::Report as BestTap;

use crate::backend::{Backend, Choice};
use crate::design::Design;
use crate::evaluate::{Evaluator, Method, Task};
use crate::plan::{CHUNK, Plan};
use crate::progress::Silent;
use crate::sweep::{self, Target};
use crate::tap;

/// Strain, forces and contact of each of `taps` (mm, degrees or mm), on the CPU kernels.
///
/// # Errors
/// Threads or kernels that fail; a tap without a solution says so in its status.
pub fn strains(setup: &Setup, taps: &[Tuple]) -> Result<Vec<Outcome>, Error> {
    let options = RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() };
    let mut all = Vec::with_capacity(taps.len());
    let mut each = |some: &[Outcome]| {
        all.extend_from_slice(some);
        true
    };
    Taps::new(setup.clone(), &options)?.solve(taps, &mut each)?;
    Ok(all)
}

/// What solves taps of one setup, as often as it is asked, from any thread.
pub struct Taps {
    setup: Setup,
    choice: Choice,
    /// Opened, and not in use just now.
    methods: Mutex<Vec<Method>>,
}

impl Taps {
    /// Of `setup`, where `options` say.
    ///
    /// # Errors
    /// A backend that the machine does not have; a tolerance that it cannot keep.
    pub fn new(setup: Setup, options: &RunOptions) -> Result<Self, Error> {
        Ok(Self { setup, choice: Choice::new(options)?, methods: Mutex::default() })
    }

    /// What all taps share.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Where they are solved.
    pub fn backend(&self) -> &Backend {
        &self.choice.backend
    }

    /// Opens what solves them, once more.
    ///
    /// # Errors
    /// A device that does not open.
    pub fn method(&self) -> Result<Method, Error> {
        self.choice.open(&self.setup.model)
    }

    /// Solves `taps` (mm, degrees or mm) in order, many at a time, and hands the outcomes to `each` until it says `false`. A tap without a
    /// solution says so in its status.
    ///
    /// # Errors
    /// Threads or kernels that fail.
    pub fn solve(&self, taps: &[Tuple], each: &mut dyn FnMut(&[Outcome]) -> bool) -> Result<(), Error> {
        let idle = || self.methods.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = idle().pop();
        let method = waiting.map_or_else(|| self.method(), Ok)?;
        let mut evaluator = Evaluator::new(&self.setup, method);
        for some in taps.chunks(CHUNK as usize) {
            let designs: Vec<Design> = some.par_iter().map(|t| Design::new(&self.setup, *t)).collect();
            let task = |(i, t): (usize, &Tuple)| Task { design: i as u32, a: t.a, drive: t.drive };
            let tasks: Vec<Task> = some.par_iter().enumerate().map(task).collect();
            if !each(&evaluator.run(&designs, &tasks)?) {
                break;
            }
        }
        idle().push(evaluator.into_method());
        Ok(())
    }
}

/// Sweeps `study` and writes its tables and `run.json` into the folder `out`, as `vibrissa sweep` does with a spec named `name`.
///
/// # Errors
/// A folder that holds something else, tables that would be too large, a backend that fails.
pub fn sweep(name: &str, study: &Study, options: &RunOptions, out: &Path) -> Result<Swept, Error> {
    let choice = Choice::new(options)?;
    let (plan, never) = (Plan::new(study, &choice)?, AtomicBool::new(false));
    let target = Target { force: options.force == Some(true), ..Target::new(out, &never) };
    sweep::run(&Spec::of(name, study.clone()), &plan, &choice, &target, &mut Silent)
}

/// The tap angle (degrees; displacement, mm) between `ends` at which the one whisker of `study` tells distance best, over its distances.
///
/// # Errors
/// No drive that keeps the strain limit, no complete row, a backend that fails.
pub fn best_tap(study: &Study, ends: [f64; 2], objective: Objective) -> Result<BestTap, Error> {
    tap::find(study, ends, objective, &Choice::new(&RunOptions::default())?)
}
