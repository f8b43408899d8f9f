//! From designs and taps to outcomes, on whichever backend: the one place where statuses of the physics are decided.

use rayon::prelude::*;

use crate::design::{Design, Shared, amount};
use crate::kernel::{
    self, Effects, Kernel, Rung, Solution, Solver, Tap,
    rule::limits::ASTRAY,
    tap::{Ask, Frame, Response},
};
use crate::physics::onset::Grip;
use crate::physics::rod::{RodError, RodProblem};
use crate::scene::{Contact, Geometry, Scene, Side};
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
        rungs: Vec<Rung>,
        /// Bound on the strain error.
        tolerance: f64,
    },
    /// f64 shooting; the closed forms where the geometry is linear.
    Reference,
}

/// A framed tap and its solution.
type Solved = (Frame, Solution<f64>);

/// Taps with what their contacts do.
struct Contacts {
    /// `None` outside the domain or at the apex.
    solved: Vec<Option<Solved>>,
    /// Whether each sticks.
    sticking: Vec<bool>,
    /// Whether the kernel cannot tell if it sticks, or which way it slides.
    undecided: Vec<bool>,
}

impl Contacts {
    fn all(solved: Vec<Option<Solved>>, sticking: bool) -> Self {
        let n = solved.len();
        Self { solved, sticking: vec![sticking; n], undecided: vec![false; n] }
    }
}

/// Load on a chart that ends before the material does, from which on the material has surely ended too: the load is the square of the
/// bending moment.
const SURELY_BEYOND: f64 = 3.0;

/// Errors of the forces of a sticking contact, per error of the strain, at most.
const ROUGH: f64 = 100.0;

impl<'a> Evaluator<'a> {
    /// Evaluates taps of `scene` by `method`.
    pub fn new(scene: &'a Scene, method: Method) -> Self {
        Self { scene, method, taps: Vec::new(), solutions: Vec::new() }
    }

    /// Outcomes of `tasks`, in their order. The reference answers what a kernel cannot: sticking contacts that no rung
    /// solves, whether a contact sticks where none finds out, and taps where the chart of the section law ends before the
    /// material does.
    pub fn run(&mut self, designs: &[Design], tasks: &[Task]) -> Result<Vec<Outcome>, String> {
        let scene = self.scene;
        if matches!(self.method, Method::Reference) {
            return Ok(tasks.par_iter().map(|t| reference(scene, &designs[t.design as usize], t)).collect());
        }
        let slide = |_| Grip::Slide(0.0);
        let Contacts { solved, sticking, undecided } = match scene.model.contact {
            Contact::Coulomb(mu) if mu > 0.0 && scene.model.geometry == Geometry::Exact => {
                self.coulomb(designs, tasks, mu)?
            }
            Contact::Stick if scene.model.geometry == Geometry::Exact => {
                Contacts::all(self.solve(designs, tasks, &|_| Grip::Stick)?, true)
            }
            _ => Contacts::all(self.solve(designs, tasks, &slide)?, false),
        };
        let tolerance = match &self.method {
            Method::Fast { tolerance, .. } => *tolerance,
            Method::Reference => 0.0,
        };
        // A law that softens until its tangent vanishes has no chart up to there.
        let beyond_chart = match &self.method {
            Method::Fast { rungs, .. } => {
                rungs.last().and_then(|r| r.chart.as_ref()).is_some_and(|c| !c.whole)
            }
            Method::Reference => false,
        };
        let doubtful = |i: usize| {
            let missed = solved[i].as_ref().filter(|(_, s)| !s.within(tolerance));
            let most = if beyond_chart { SURELY_BEYOND } else { 1.0 };
            missed.is_some_and(|(_, s)| (beyond_chart || sticking[i]) && s.load <= most)
        };
        let finish = |i: usize| {
            if undecided[i] || doubtful(i) {
                return reference(scene, &designs[tasks[i].design as usize], &tasks[i]);
            }
            fast(
                scene,
                tolerance,
                &designs[tasks[i].design as usize],
                &tasks[i],
                solved[i].as_ref(),
                sticking[i],
            )
        };
        Ok((0..tasks.len()).into_par_iter().map(finish).collect())
    }

    /// Frames and solutions of `tasks`; `None` outside the domain or at the apex.
    fn solve(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        grip: &(dyn Fn(usize) -> Grip + Sync),
    ) -> Result<Vec<Option<Solved>>, String> {
        let scene = self.scene;
        let Method::Fast { solver, rungs, tolerance } = &mut self.method else {
            return Ok(vec![None; tasks.len()]);
        };
        let at = |i: usize| frame(scene, &designs[tasks[i].design as usize], &tasks[i], grip(i));
        let mut solved: Vec<Option<Solved>> =
            (0..tasks.len()).into_par_iter().map(|i| at(i).map(|f| (f, Solution::FAILED))).collect();
        if tasks.is_empty() {
            return Ok(solved);
        }
        self.taps.clear();
        self.taps.extend(solved.iter().flatten().map(|(frame, _)| *frame.tap()));
        let kernel = match (scene.model.geometry, grip(0)) {
            (Geometry::Linear, _) => Kernel::Linear,
            (_, g) => Kernel::Exact(Effects::new(&scene.model, scene.gauge.side, g == Grip::Stick)),
        };
        kernel::solve(solver.as_mut(), kernel, rungs, *tolerance, &self.taps, &mut self.solutions)?;
        for ((_, place), s) in solved.iter_mut().flatten().zip(&self.solutions) {
            *place = *s;
        }
        Ok(solved)
    }

    /// Coulomb friction: the sticking solution where |T| ≤ μP, else sliding with the sign of the sticking T. Also which taps stick, and which
    /// are undecided: the kernel found no sticking solution, or one too rough to tell.
    fn coulomb(&mut self, designs: &[Design], tasks: &[Task], mu: f64) -> Result<Contacts, String> {
        let stuck = Kernel::Exact(Effects::new(&self.scene.model, self.scene.gauge.side, true));
        let mut solved = self.solve(designs, tasks, &|_| Grip::Stick)?;
        let grip = |solved: &Option<Solved>| {
            let (frame, s) = solved.as_ref().filter(|(_, s)| s.within(ASTRAY))?;
            let Response { tangential, normal, .. } = frame.response(stuck, s);
            let (spare, rough) =
                (mu * normal - tangential.abs(), ROUGH * s.error * tangential.abs().max(normal.abs()));
            match spare {
                _ if spare.abs() <= rough => None,
                _ if spare >= 0.0 => Some(Grip::Stick),
                _ => Some(Grip::Slide(mu.copysign(tangential))),
            }
        };
        let grips: Vec<Option<Grip>> = solved.iter().map(grip).collect();
        let sliding: Vec<(usize, Grip)> = grips
            .iter()
            .enumerate()
            .filter_map(|(i, g)| Some((i, g.filter(|g| *g != Grip::Stick)?)))
            .collect();
        let again: Vec<Task> = sliding.iter().map(|&(i, _)| tasks[i]).collect();
        let slid = self.solve(designs, &again, &|k| sliding[k].1)?;
        for (&(i, _), s) in sliding.iter().zip(slid) {
            solved[i] = s;
        }
        let sticking = grips.iter().map(|g| *g == Some(Grip::Stick)).collect();
        let undecided = (0..tasks.len()).map(|i| solved[i].is_some() && grips[i].is_none()).collect();
        Ok(Contacts { solved, sticking, undecided })
    }
}

fn frame(scene: &Scene, design: &Design, task: &Task, grip: Grip) -> Option<Frame> {
    let shared = design.shared.as_ref().filter(|_| design.admits(scene.drive, task.a, task.drive))?;
    let ask = Ask {
        model: &scene.model,
        side: scene.gauge.side,
        curve: &shared.model,
        peak: shared.peak,
        a: task.a,
        amount: amount(scene.drive, task.drive),
        grip,
    };
    match scene.model.geometry {
        Geometry::Linear => Frame::linear(&ask),
        Geometry::Exact => Frame::exact(&ask),
    }
}

fn fast(
    scene: &Scene,
    tolerance: f64,
    design: &Design,
    task: &Task,
    solved: Option<&Solved>,
    sticking: bool,
) -> Outcome {
    let Some(shared) = design.shared.as_ref().filter(|_| design.admits(scene.drive, task.a, task.drive))
    else {
        return Outcome { status: Status::INVALID_GEOMETRY, ..Outcome::NOTHING };
    };
    let linear = amount(scene.drive, task.drive) * shared.theory.curve().value(task.a);
    let Some((frame, solution)) = solved.filter(|(_, s)| s.within(tolerance)) else {
        let limit = solved.is_some_and(|(_, s)| s.load > 1.0);
        let why = if limit { Status::MATERIAL_LIMIT } else { Status::NOT_CONVERGED };
        return unsolved(scene, shared, task, linear, why);
    };
    let kernel = match scene.model.geometry {
        Geometry::Linear => Kernel::Linear,
        Geometry::Exact => Kernel::Exact(Effects::default()),
    };
    let response = frame.response(kernel, solution);
    // K = θ f/ε and ε = ε₀ (1 + δ): the ratio of two closed forms in f64, then the kernel's δ.
    let ratio = match scene.model.geometry {
        Geometry::Linear => theories_apart(shared, task),
        Geometry::Exact => linear / frame.tap().strain - 1.0,
    };
    let found = Found {
        strain: response.strain,
        deviation: (ratio - response.deviation) / (1.0 + response.deviation),
        normal: response.normal,
        tangential: response.tangential,
        arc: response.arc,
        sticking,
    };
    Outcome { sweeps: solution.sweeps as f32, ..outcome(scene, design, shared, task, linear, found) }
}

/// f of the estimator's theory over f of the linear model, less 1, free of cancellation.
fn theories_apart(shared: &Shared, task: &Task) -> f64 {
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
        let deviation = theories_apart(shared, task);
        let normal = amount * shared.model.force(scene.model.material.e0(), task.a);
        let found = Found { strain, deviation, normal, tangential: 0.0, arc: task.a, sticking: false };
        return outcome(scene, design, shared, task, linear, found);
    }
    let problem = RodProblem {
        taper: shared.taper,
        gauge: shared.gauge,
        side: scene.gauge.side,
        distance: task.a,
        hub: scene.hub,
        drive: scene.drive,
        amount,
        model: &scene.model,
    };
    match problem.solve() {
        Ok(tap) => {
            let found = Found {
                strain: sign(scene) * tap.strain,
                deviation: linear / (sign(scene) * tap.strain) - 1.0,
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
