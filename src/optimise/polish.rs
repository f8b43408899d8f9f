//! Local stage: a trust-region method in f64, run by argmin's executor.
//!
//! Around the best place so far the objective and every limit are read on a small stencil and modelled by quadratics
//! ([`Stencil`]); the step that makes the model small within the trust region, the bounds and the limits is
//! tried, also with the limits drawn in a little, for a limit that binds is only as good as its model. Of everything scored
//! the best by the feasibility rules is the next place. So a bound is met exactly, and a limit that binds from its inner side
//! to about the square of the last radius. argmin's own local solvers know neither bounds nor limits.

use std::cell::RefCell;

use argmin::core::{
    Error as ArgminError, Executor, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus,
};

use super::quadratic::{Quadratic, Stencil, step};
use super::score::{Goal, Score};
use super::session::{Found, Halt, Session, Stage};

/// Largest trust radius.
const LARGEST: f64 = 0.25;
/// Limits are drawn in by these multiples of the squared radius.
const MARGINS: [f64; 3] = [0.0, 0.02, 0.3];
/// Limits farther away than this play no part in a step.
const FAR: f64 = -0.9;
/// Most steps.
const STEPS: u64 = 80;

/// Size of the region in which a polish begins, and the radius at which it is done.
#[derive(Debug, Clone, Copy)]
pub struct Radii {
    /// First trust radius, of the unit box.
    pub first: f64,
    /// Last.
    pub last: f64,
}

impl Stage {
    /// Shortest arm of a stencil in the unit box: below it the rounding of the scores shows in the curvature.
    fn arm(self) -> f64 {
        match self {
            Self::Swarm => 1e-2,
            Self::Polish => 1e-3,
        }
    }
}

/// Improves the candidate at `u` (drive `j` of the list) by what scores at `stage`, and returns the best it found.
pub fn run(
    session: &mut Session<'_>,
    goal: Goal,
    (u, j): (&[f64], usize),
    (stage, radii): (Stage, Radii),
) -> Result<Found, Halt> {
    let local = Local { session: RefCell::new(session), stage, drive: j, halt: RefCell::new(None) };
    let solver = TrustRegion { goal, arm: stage.arm(), radius: radii.first, last: radii.last, here: None };
    let halt = &local.halt;
    let run = Executor::new(&local, solver)
        .configure(|state| state.param(u.to_vec()).max_iters(STEPS))
        .timer(false)
        .run();
    match (run, halt.take()) {
        (_, Some(halt)) => Err(halt),
        (Err(e), None) => Err(Halt::Failed(crate::error::Error::Run(e.to_string()))),
        (Ok(done), None) => {
            let (u, score) = done.solver.here.expect("a polish scores its start");
            let point = local.session.borrow().variables.point(&u, j);
            Ok(Found { point, score })
        }
    }
}

/// The candidates around one place.
struct Local<'s, 'a> {
    session: RefCell<&'s mut Session<'a>>,
    stage: Stage,
    drive: usize,
    halt: RefCell<Option<Halt>>,
}

impl Local<'_, '_> {
    fn scores(&self, places: &[Vec<f64>]) -> Result<Vec<Score>, ArgminError> {
        let mut session = self.session.borrow_mut();
        let variables = session.variables;
        let points: Vec<_> = places.iter().map(|u| variables.point(u, self.drive)).collect();
        session.scores(self.stage, &points).map_err(|halt| {
            let error = ArgminError::msg(halt.to_string());
            self.halt.replace(Some(halt));
            error
        })
    }
}

/// Sequential quadratic models in a box-shaped trust region.
struct TrustRegion {
    goal: Goal,
    arm: f64,
    radius: f64,
    last: f64,
    here: Option<(Vec<f64>, Score)>,
}

/// State of the polish in argmin's terms.
type Iterate = IterState<Vec<f64>, (), (), (), (), f64>;

impl TrustRegion {
    /// Places to try from the models around `u`; none where a value is missing.
    fn steps(&self, u: &[f64], stencil: &Stencil, scores: &[Score]) -> Vec<Vec<f64>> {
        let model = |f: &dyn Fn(&Score) -> f64| stencil.model(&scores.iter().map(f).collect::<Vec<_>>());
        let mut limits: Vec<Quadratic> = (0..scores[0].limits.len())
            .filter(|&i| scores[0].limits[i] > FAR)
            .map(|i| model(&|s| s.limits[i]))
            .collect();
        if matches!(self.goal, Goal::Capped(_)) {
            limits.push(model(&|s| self.goal.cap(s)));
        }
        let scale = self.goal.value(&scores[0]).abs();
        let mut goal = model(&|s| self.goal.value(s) / scale);
        if !goal.is_finite() {
            // Nothing to lower yet: only the limits lead.
            let k = u.len();
            goal = Quadratic { value: 0.0, slope: vec![0.0; k], curvature: vec![0.0; k * k] };
        }
        limits.retain(Quadratic::is_finite);
        let lo: Vec<f64> = u.iter().map(|x| (-self.radius).max(-x)).collect();
        let hi: Vec<f64> = u.iter().map(|x| self.radius.min(1.0 - x)).collect();
        let mut steps: Vec<Vec<f64>> = Vec::new();
        for margin in MARGINS {
            let drawn: Vec<Quadratic> = limits
                .iter()
                .map(|l| Quadratic { value: l.value + margin * self.radius * self.radius, ..l.clone() })
                .collect();
            let p = step(&goal, &drawn, [&lo, &hi]);
            let place = u.iter().zip(&p).map(|(u, p)| snapped(u + p)).collect();
            if !steps.contains(&place) {
                steps.push(place);
            }
        }
        steps
    }
}

/// A coordinate within rounding of a bound is at the bound.
fn snapped(u: f64) -> f64 {
    match u {
        u if u < 1e-9 => 0.0,
        u if u > 1.0 - 1e-9 => 1.0,
        u => u,
    }
}

impl Solver<&Local<'_, '_>, Iterate> for TrustRegion {
    fn name(&self) -> &str {
        "trust region on quadratic models"
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<&Local<'_, '_>>,
        mut state: Iterate,
    ) -> Result<(Iterate, Option<KV>), ArgminError> {
        let u = match &self.here {
            Some((u, _)) => u.clone(),
            None => state.take_param().expect("a polish has a start"),
        };
        let mut ask = |places: &[Vec<f64>]| problem.problem("cost_count", |local| local.scores(places));
        let stencil = Stencil::new(&u, (0.5 * self.radius).max(self.arm));
        // The centre is known but for the first time.
        let mut scores = match self.here {
            Some((_, here)) => vec![here],
            None => ask(&stencil.places[..1])?,
        };
        scores.extend(ask(&stencil.places[1..])?);
        let steps = self.steps(&u, &stencil, &scores);
        let tried = ask(&steps)?;

        let order = |s: &Score| self.goal.order(s);
        let first = |all: &[Score]| (0..all.len()).min_by(|&a, &b| order(&all[a]).total_cmp(&order(&all[b])));
        let (old, near) = (scores[0], first(&scores).expect("a centre"));
        let stepped = first(&tried).filter(|&i| order(&tried[i]) < order(&scores[near]));
        match stepped {
            Some(i) => {
                let length = steps[i].iter().zip(&u).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                self.radius = match length / self.radius {
                    full if full > 0.99 => (2.0 * self.radius).min(LARGEST),
                    share => self.radius * (2.0 * share).clamp(0.25, 1.0),
                };
                self.here = Some((steps[i].clone(), tried[i]));
            }
            None => {
                self.radius *= if near == 0 { 0.25 } else { 0.5 };
                self.here = Some((stencil.places[near].clone(), scores[near]));
            }
        }
        let (new, best) = self.here.clone().expect("just set");
        // Where nothing can be gained the region need not shrink to its last radius step by step.
        let (before, after) = (self.goal.value(&old), self.goal.value(&best));
        if stepped.is_some() && self.goal.feasible(&old) && before - after < 1e-11 * before {
            self.radius *= 0.25;
        }
        Ok((state.param(new).cost(order(&best)), None))
    }

    fn terminate(&mut self, _: &Iterate) -> TerminationStatus {
        if self.radius < self.last {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}
