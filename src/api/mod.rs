//! What is meant to be used from outside: a rig described in code, swept, its best tap angle, its readings answered. Everything else is
//! public for the program and its tests, changes with them, and is hidden in the documentation. Structs of answers may get more fields.
//!
//! ```no_run
//! use vibrissa::api::*;
//! let setup = Setup::default().material(Material::NeoHookean(3.2)).surface().noise(20e-6);
//! let whisker = Whisker::mm(10.0, 4.0, 50.0).gauge_mm(5.0, 2.0).distance_mm(30.0).theta_deg(4.0);
//! let tap = strains(&setup, &[whisker.tap()?])?[0];
//! println!("{:.6} {}", tap.strain, tap.status);
//! # Ok::<(), vibrissa::api::Error>(())
//! ```

mod whisker;

use std::path::Path;

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
pub use crate::taps::Taps;
pub use whisker::Whisker;

use crate::backend::Choice;
use crate::plan::Plan;
use crate::plan::pays;
use crate::progress::{NEVER, Silent};
use crate::sweep::{self, Target};
use crate::tap;

/// Strain, forces and contact of each of `taps` (mm, degrees or mm), on the CPU kernels.
///
/// # Errors
/// Threads or kernels that fail; a tap without a solution says so in its status.
pub fn strains(setup: &Setup, taps: &[Tuple]) -> Result<Vec<Outcome>, Error> {
    let options = RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() };
    let mut all = vec![Outcome::NOTHING; taps.len()];
    Taps::new(setup.clone(), &options)?.solve(|i| taps[i], |outcome| *outcome, &mut all)?;
    Ok(all)
}

/// Sweeps `study` and writes its tables and `run.json` into the folder `out`, as `vibrissa sweep` does with a spec named `name`.
///
/// # Errors
/// A folder that holds something else, tables that would be too large, a backend that fails.
pub fn sweep(name: &str, study: &Study, options: &RunOptions, out: &Path) -> Result<Swept, Error> {
    let choice = Choice::for_work(options, pays::of_study(study, options))?;
    let plan = Plan::new(study, &choice)?;
    let target = Target { force: options.force == Some(true), ..Target::new(out, &NEVER) };
    sweep::run(&Spec::of(name, study.clone()), &plan, &choice, &target, &mut Silent)
}

/// The tap angle (degrees; displacement, mm) between `ends` at which the one whisker of `study` tells distance best, over its distances.
///
/// # Errors
/// No drive that keeps the strain limit, no complete row, a backend that fails.
pub fn best_tap(study: &Study, ends: [f64; 2], objective: Objective) -> Result<BestTap, Error> {
    tap::find(
        study,
        ends,
        objective,
        &tap::choice(&RunOptions::default(), study)?,
        (None, &NEVER, &mut Silent),
    )
}
