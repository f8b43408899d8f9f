//! The public interface: a rig described in code, swept, its best tap angle, its readings answered. The rest is public for the program and its tests
//! only, and hidden in the documentation. Structs of answers may get more fields.
//!
//! ```no_run
//! use vibrissa::api::*;
//! let setup = Setup::default().material(Material::NeoHookean(3.2)).surface().noise(20e-6);
//! let whisker = Whisker::mm(10.0, 4.0, 50.0).gauge_mm(5.0, 2.0).distance_mm(30.0).theta_deg(4.0);
//! let tap = strains(&setup, &[whisker.tap()?])?[0];
//! println!("{:.6} {}", tap.strain, tap.status);
//! # Ok::<(), vibrissa::api::Error>(())
//! ```

use std::path::Path;

use crate::backend::Choice;
pub use crate::error::Error;
use crate::error::InputError;
pub use crate::evaluate::Outcome;
pub use crate::locate::{Located, Locator};
use crate::plan::{self, Plan};
use crate::progress::{NEVER, Silent};
pub use crate::scene::{
    Axis, BackendChoice, Contact, Convention, Drive, Material, Model, Objective, Output, RankBy, RunOptions,
    Setup, Side, Space, Spec, Study, Theory, Tuple,
};
pub use crate::status::Status;
pub use crate::sweep::Report as Swept;
use crate::sweep::{self, Target};
use crate::tap;
pub use crate::tap::Report as BestTap;
pub use crate::taps::Taps;

/// Strain, forces and contact of each of `taps` (mm, degrees or mm), on the CPU kernels.
/// Errors: threads or kernels that fail; a tap without a solution says so in its status.
pub fn strains(setup: &Setup, taps: &[Tuple]) -> Result<Vec<Outcome>, Error> {
    let options = RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() };
    let mut all = vec![Outcome::NOTHING; taps.len()];
    Taps::new(setup.clone(), &options)?.solve(|i| taps[i], |outcome| *outcome, &mut all)?;
    Ok(all)
}

/// Sweeps `study` and writes its tables and `run.json` into the folder `out`, as `vibrissa sweep` does with a spec named `name`.
/// Errors: a folder that holds something else, tables that would be too large, a backend that fails.
pub fn sweep(name: &str, study: &Study, options: &RunOptions, out: &Path) -> Result<Swept, Error> {
    let choice = Choice::for_work(options, plan::of_study(study, options))?;
    let plan = Plan::new(study, &choice)?;
    let target = Target { force: options.force == Some(true), ..Target::new(out, &NEVER) };
    sweep::run(&Spec::of(name, study.clone()), &plan, &choice, &target, &mut Silent)
}

/// The tap angle (degrees; displacement, mm) between `ends` at which the one whisker of `study` tells distance best, over its distances.
/// Errors: no drive that keeps the strain limit, no complete row, a backend that fails.
pub fn best_tap(study: &Study, ends: [f64; 2], objective: Objective) -> Result<BestTap, Error> {
    let choice = tap::choice(&RunOptions::default(), study)?;
    tap::find(study, ends, objective, &choice, (None, &NEVER, &mut Silent))
}

/// A whisker, its gauge and its taps: every quantity is a number, or an [`Axis`] of several.
///
/// ```
/// use vibrissa::api::*;
/// let whisker = Whisker::mm(10.0, 4.0, 50.0).gauge_mm(5.0, 2.0).distance_mm(30.0).theta_deg(4.0);
/// let tap = strains(&Setup::default(), &[whisker.tap()?])?[0];
/// assert!((tap.strain - 0.0223).abs() < 0.0001, "{}", tap.strain);
/// # Ok::<(), vibrissa::api::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Whisker {
    /// D, d, L_a, x_ss, l, a, drive.
    axes: [Axis; 7],
    drive: Drive,
}

#[allow(non_snake_case)]
impl Whisker {
    /// Diameters D and d of base and tip, and length L_a, mm. Defaults: gauge of 2 mm at 5 mm, object at 30 mm, tap angle 4°.
    pub fn mm(base: impl Into<Axis>, tip: impl Into<Axis>, length: impl Into<Axis>) -> Self {
        let [at, grid, distance, theta] = [5.0, 2.0, 30.0, 4.0].map(Axis::from);
        let axes = [base.into(), tip.into(), length.into(), at, grid, distance, theta];
        Self { axes, drive: Drive::Angle }
    }

    /// Start of the gauge's grid, x_ss, and length of the grid, l, mm.
    pub fn gauge_mm(mut self, at: impl Into<Axis>, grid: impl Into<Axis>) -> Self {
        (self.axes[3], self.axes[4]) = (at.into(), grid.into());
        self
    }

    /// The distance a of the object from the base, mm.
    pub fn distance_mm(mut self, a: impl Into<Axis>) -> Self {
        self.axes[5] = a.into();
        self
    }

    /// The tap angle θ, degrees.
    pub fn theta_deg(mut self, theta: impl Into<Axis>) -> Self {
        (self.axes[6], self.drive) = (theta.into(), Drive::Angle);
        self
    }

    /// The displacement δ of the object, mm, in place of an angle.
    pub fn delta_mm(mut self, delta: impl Into<Axis>) -> Self {
        (self.axes[6], self.drive) = (delta.into(), Drive::Displacement);
        self
    }

    /// Its one tap, for [`strains`]; of a displacement, the setup must say so ([`Setup::drive`]).
    /// Errors: an axis of several values.
    pub fn tap(&self) -> Result<Tuple, Error> {
        let names = ["D", "d", "L_a", "x_ss", "l", "a", self.drive.column()];
        if let Some(k) = (0..7).find(|k| self.axes[*k].len() != 1) {
            let error = InputError::new("a tap has one value of each quantity").key(names[k]);
            return Err(error.value(format!("{} values", self.axes[k].len())).allowed("one number").into());
        }
        let [D, d, L_a, x_ss, l, a, drive] = [0, 1, 2, 3, 4, 5, 6].map(|k| self.axes[k].at(0));
        Ok(Tuple { D, d, L_a, x_ss, l, a, drive, ..Tuple::default() })
    }

    /// The study of every combination of its axes, with this model, gauge and output, for [`sweep()`] and [`best_tap`].
    /// Errors: more than 2⁶⁴ combinations.
    pub fn study(self, setup: Setup, output: Output) -> Result<Study, Error> {
        let space = Space::grid(self.axes);
        let too_many = || InputError::new("these axes have too many combinations").allowed("fewer than 2^64");
        let setup = Setup { drive: self.drive, ..setup };
        Ok(Study { setup, space: space.ok_or_else(too_many)?, output })
    }
}
