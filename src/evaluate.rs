//! From designs and taps to outcomes, on whichever backend: the one place where statuses of the physics are decided.

use rayon::prelude::*;

use crate::design::{Design, Shared, amount};
use crate::kernel::{self, Kernel, Rule, Solution, Solver, Tap, tap::Frame};
use crate::physics::rod::{RodError, RodProblem};
use crate::scene::{Drive, Geometry, Scene, Side};
use crate::status::Status;

/// One tap of one design of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Task {
    /// Place of the design in the batch.
    pub design: u32,
    /// Contact distance, mm.
    pub a: f64,
    /// Tap angle, degrees, or displacement, mm.
    pub drive: f64,
}

/// What a tap gives; NaN where there is no value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Signed gauge strain.
    pub strain: f64,
    /// Signed strain of the estimator's theory, ±θ f.
    pub strain_linear: f64,
    /// K − 1 at full relative precision.
    pub deviation: f64,
    /// P, N.
    pub normal_force: f64,
    /// T, N.
    pub tangential_force: f64,
    /// c, mm.
    pub arc: f64,
    /// Whether the contact sticks.
    pub sticking: bool,
    /// Kernel sweeps spent.
    pub sweeps: f32,
    /// Words of the physics; the estimate adds its own.
    pub status: Status,
}

impl Outcome {
    const NOTHING: Self = Self {
        strain: f64::NAN,
        strain_linear: f64::NAN,
        deviation: f64::NAN,
        normal_force: f64::NAN,
        tangential_force: f64::NAN,
        arc: f64::NAN,
        sticking: false,
        sweeps: 0.0,
        status: Status::OK,
    };
}

/// A backend, ready to evaluate taps of one scene.
pub struct Evaluator<'a> {
    scene: &'a Scene,
    method: Method,
    taps: Vec<Tap<f64>>,
    solutions: Vec<Solution<f64>>,
}

/// How taps are solved.
pub enum Method {
    /// A fast kernel.
    Fast {
        /// Where it runs.
        solver: Box<dyn Solver>,
        /// Rungs for the tolerance.
        rules: Vec<Rule>,
        /// Bound on the strain error.
        tolerance: f64,
    },
    /// f64 shooting; the closed forms where the geometry is linear.
    Reference,
}

impl<'a> Evaluator<'a> {
    /// Evaluates taps of `scene` by `method`.
    pub fn new(scene: &'a Scene, method: Method) -> Self {
        Self { scene, method, taps: Vec::new(), solutions: Vec::new() }
    }

    /// Outcomes of `tasks`, in their order.
    pub fn run(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, String> {
        let scene = self.scene;
        match &mut self.method {
            Method::Reference => {
                Ok(tasks.par_iter().map(|t| reference(scene, &designs[t.design as usize], t)).collect())
            }
            Method::Fast { solver, rules, tolerance } => {
                let kernel = kernel_of(scene);
                let frames: Vec<_> =
                    tasks.par_iter().map(|t| frame(scene, kernel, &designs[t.design as usize], t)).collect();
                let solvable: Vec<usize> = (0..frames.len()).filter(|&i| frames[i].is_some()).collect();
                self.taps.clear();
                self.taps.extend(solvable.iter().filter_map(|&i| frames[i].map(|(_, tap)| tap)));
                kernel::solve(solver.as_mut(), kernel, rules, *tolerance, &self.taps, &mut self.solutions)?;
                let mut solution = vec![None; tasks.len()];
                for (&i, s) in solvable.iter().zip(&self.solutions) {
                    solution[i] = Some(*s);
                }
                let finish = |i: usize| {
                    let solved = frames[i].zip(solution[i]).filter(|(_, s)| s.within(*tolerance));
                    let solved = solved.map(|((frame, _), s)| (frame, s));
                    fast(scene, kernel, &designs[tasks[i].design as usize], &tasks[i], solved)
                };
                Ok((0..tasks.len()).into_par_iter().map(finish).collect())
            }
        }
    }
}

/// The kernel that the model needs.
pub fn kernel_of(scene: &Scene) -> Kernel {
    match scene.model.geometry {
        Geometry::Linear => Kernel::Linear,
        Geometry::Exact => Kernel::Exact,
    }
}

fn frame(scene: &Scene, kernel: Kernel, design: &Design, task: &Task) -> Option<(Frame, Tap<f64>)> {
    let shared = design.shared.as_ref().filter(|_| design.admits(scene.drive, task.a, task.drive))?;
    let amount = amount(scene.drive, task.drive);
    let frame = match kernel {
        Kernel::Linear => Frame::linear(&shared.model, task.a, amount),
        Kernel::Exact => Frame::new(&shared.model, task.a, amount, shared.peak),
    };
    frame.tap().map(|tap| (frame, tap))
}

fn fast(
    scene: &Scene,
    kernel: Kernel,
    design: &Design,
    task: &Task,
    solved: Option<(Frame, Solution<f64>)>,
) -> Outcome {
    let Some(shared) = design.shared.as_ref().filter(|_| design.admits(scene.drive, task.a, task.drive))
    else {
        return Outcome { status: Status::INVALID_GEOMETRY, ..Outcome::NOTHING };
    };
    let linear = amount(scene.drive, task.drive) * shared.theory.curve().value(task.a);
    let Some((frame, solution)) = solved else {
        return unsolved(scene, shared, task, linear, Status::NOT_CONVERGED);
    };
    let response = frame.response(kernel, scene.model.material.e0(), &solution);
    // K = θ f_theory/ε, and ε = (θ f)_frame (1 + δ): the ratio of the two closed forms, then δ.
    let ratio = closed_ratio(scene, shared, &frame, task, linear);
    let deviation = (ratio - response.strain_deviation) / (1.0 + response.strain_deviation);
    let found = Found {
        strain: response.strain,
        deviation,
        normal: response.force,
        tangential: 0.0,
        arc: response.arc,
        sticking: false,
    };
    Outcome { sweeps: solution.sweeps as f32, ..outcome(scene, design, shared, task, linear, found) }
}

/// (θ f of the estimator's theory)/(θ f of the solved frame) − 1, without cancellation where both are the same curve.
fn closed_ratio(scene: &Scene, shared: &Shared, frame: &Frame, task: &Task, linear: f64) -> f64 {
    let same_drive = scene.drive == Drive::Angle || scene.model.geometry == Geometry::Linear;
    if !same_drive {
        return linear / frame.linear_strain() - 1.0;
    }
    let u2 = 1.0 / (task.a * task.a);
    let (model, theory) = (shared.model.shear * u2, shared.theory.curve().shear * u2);
    (model - theory) / (1.0 + theory)
}

fn reference(scene: &Scene, design: &Design, task: &Task) -> Outcome {
    let Some(shared) = design.shared.as_ref().filter(|_| design.admits(scene.drive, task.a, task.drive))
    else {
        return Outcome { status: Status::INVALID_GEOMETRY, ..Outcome::NOTHING };
    };
    let amount = amount(scene.drive, task.drive);
    let linear = amount * shared.theory.curve().value(task.a);
    if scene.model.geometry == Geometry::Linear {
        let strain = amount * shared.model.value(task.a);
        let u2 = 1.0 / (task.a * task.a);
        let (model, theory) = (shared.model.shear * u2, shared.theory.curve().shear * u2);
        let deviation = (model - theory) / (1.0 + theory);
        let normal = amount * shared.model.force(scene.model.material.e0(), task.a);
        let found = Found { strain, deviation, normal, tangential: 0.0, arc: task.a, sticking: false };
        return outcome(scene, design, shared, task, linear, found);
    }
    let problem = RodProblem {
        taper: shared.taper,
        gauge: shared.gauge,
        side: Side::Contact,
        distance: task.a,
        hub: scene.hub,
        drive: scene.drive,
        amount,
        model: &scene.model,
    };
    match problem.solve() {
        Ok(tap) => {
            let found = Found {
                strain: tap.strain,
                deviation: (linear - tap.strain) / tap.strain,
                normal: tap.normal_force,
                tangential: tap.tangential_force,
                arc: tap.contact_arc,
                sticking: tap.sticking,
            };
            outcome(scene, design, shared, task, linear, found)
        }
        Err(RodError::NotConverged) => unsolved(scene, shared, task, linear, Status::NOT_CONVERGED),
        Err(RodError::MaterialLimit) => unsolved(scene, shared, task, linear, Status::MATERIAL_LIMIT),
    }
}

/// A solved tap before its status is known; strain as on the contact side.
struct Found {
    strain: f64,
    deviation: f64,
    normal: f64,
    tangential: f64,
    arc: f64,
    sticking: bool,
}

fn sign(scene: &Scene) -> f64 {
    match scene.gauge.side {
        Side::Contact => 1.0,
        Side::Far => -1.0,
    }
}

/// No values but the linear theory's.
fn unsolved(scene: &Scene, shared: &Shared, task: &Task, linear: f64, why: Status) -> Outcome {
    let off = if task.a <= shared.gauge[0] { Status::NO_STRAIN } else { Status::OK };
    Outcome { strain_linear: sign(scene) * linear, status: why | off, ..Outcome::NOTHING }
}

fn outcome(
    scene: &Scene,
    design: &Design,
    shared: &Shared,
    task: &Task,
    linear: f64,
    found: Found,
) -> Outcome {
    let mut status = Status::OK;
    let x1 = shared.gauge[0];
    let no_strain = task.a <= x1 || found.arc <= x1;
    if no_strain {
        status |= Status::NO_STRAIN;
    }
    if found.arc > design.tuple.L_a * (1.0 + 1e-12) {
        status |= Status::SLIPPED_OFF;
    }
    let strain = if no_strain { 0.0 } else { found.strain };
    if strain.abs() > scene.gauge.strain_limit {
        status |= Status::STRAIN_LIMIT;
    }
    Outcome {
        strain: sign(scene) * strain + 0.0,
        strain_linear: sign(scene) * linear + 0.0,
        deviation: if no_strain { f64::NAN } else { found.deviation },
        normal_force: found.normal,
        tangential_force: found.tangential,
        arc: found.arc,
        sticking: found.sticking,
        sweeps: 0.0,
        status,
    }
}
