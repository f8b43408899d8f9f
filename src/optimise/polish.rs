//! Local stage: a trust-region method in f64. Objective and limits are evaluated on a small stencil around the best place and modelled by quadratics
//! ([`Stencil`]). The step that minimises the model within trust region, bounds and limits is tried, also with tightened limits, because a binding
//! limit is only as good as its model. Bounds are met exactly, a binding limit from its inner side to about the square of the last radius.

use nalgebra::{DMatrix, DVector};

use super::quadratic::{Quadratic, Stencil, step};
use super::score::{Goal, Score};
use super::session::{Found, Halt, Session, Stage};

const LARGEST: f64 = 0.25;
/// Limits are tightened by these multiples of the squared radius.
const MARGINS: [f64; 3] = [0.0, 0.02, 0.3];
/// Limits farther from binding than this are ignored in a step.
const FAR: f64 = -0.9;
const STEPS: u32 = 80;

/// Trust radii at the start and at the end of a polish.
#[derive(Debug, Clone, Copy)]
pub struct Radii {
    pub first: f64,
    pub last: f64,
}

impl Stage {
    /// Shortest arm of a stencil in the unit box: below it the rounding of the scores disturbs the curvature.
    fn arm(self) -> f64 {
        match self {
            Self::Swarm => 1e-2,
            Self::Polish => 1e-3,
        }
    }
}

/// Improves the candidate at `u` (drive `j` of the list), scored at `stage`; returns the best found.
pub fn run(
    session: &mut Session<'_>,
    goal: Goal,
    (u, j): (&[f64], usize),
    (stage, radii): (Stage, Radii),
) -> Result<Found, Halt> {
    let variables = session.variables;
    let mut ask = |places: &[Vec<f64>]| {
        let points: Vec<_> = places.iter().map(|u| variables.point(u, j)).collect();
        session.scores(stage, &points)
    };
    let order = |s: &Score| goal.order(s);
    let first = |all: &[Score]| (0..all.len()).min_by(|&a, &b| order(&all[a]).total_cmp(&order(&all[b])));
    let (mut u, mut radius) = (u.to_vec(), radii.first);
    let mut here = ask(std::slice::from_ref(&u))?[0];
    for _ in 0..STEPS {
        if radius < radii.last {
            break;
        }
        let stencil = Stencil::new(&u, (0.5 * radius).max(stage.arm()));
        let mut scores = vec![here];
        scores.extend(ask(&stencil.places[1..])?);
        let steps = steps(goal, radius, &u, &stencil, &scores);
        let tried = ask(&steps)?;
        let (old, near) = (here, first(&scores).unwrap_or_default());
        let stepped = first(&tried).filter(|&i| order(&tried[i]) < order(&scores[near]));
        match stepped {
            Some(i) => {
                let length = steps[i].iter().zip(&u).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                radius = match length / radius {
                    full if full > 0.99 => (2.0 * radius).min(LARGEST),
                    share => radius * (2.0 * share).clamp(0.25, 1.0),
                };
                (u, here) = (steps[i].clone(), tried[i]);
            }
            None => {
                radius *= if near == 0 { 0.25 } else { 0.5 };
                (u, here) = (stencil.places[near].clone(), scores[near]);
            }
        }
        // Without any gain the radius shrinks faster.
        let (before, after) = (goal.value(&old), goal.value(&here));
        if stepped.is_some() && goal.feasible(&old) && before - after < 1e-11 * before {
            radius *= 0.25;
        }
    }
    Ok(Found { point: variables.point(&u, j), score: here })
}

/// Places to try, from the models around `u`; empty if a value is missing.
fn steps(goal: Goal, radius: f64, u: &[f64], stencil: &Stencil, scores: &[Score]) -> Vec<Vec<f64>> {
    let model = |f: &dyn Fn(&Score) -> f64| stencil.model(&scores.iter().map(f).collect::<Vec<_>>());
    let mut limits: Vec<Quadratic> = (0..scores[0].limits.len())
        .filter(|&i| scores[0].limits[i] > FAR)
        .map(|i| model(&|s| s.limits[i]))
        .collect();
    if matches!(goal, Goal::Capped(_)) {
        limits.push(model(&|s| goal.cap(s)));
    }
    let scale = goal.value(&scores[0]).abs();
    let mut aim = model(&|s| goal.value(s) / scale);
    if !aim.is_finite() {
        let k = u.len();
        aim = Quadratic { value: 0.0, slope: DVector::zeros(k), curvature: DMatrix::zeros(k, k) };
    }
    limits.retain(Quadratic::is_finite);
    let lo: Vec<f64> = u.iter().map(|x| (-radius).max(-x)).collect();
    let hi: Vec<f64> = u.iter().map(|x| radius.min(1.0 - x)).collect();
    let mut steps: Vec<Vec<f64>> = Vec::new();
    for margin in MARGINS {
        let drawn: Vec<Quadratic> = limits
            .iter()
            .map(|l| Quadratic { value: l.value + margin * radius * radius, ..l.clone() })
            .collect();
        let p = step(&aim, &drawn, [&lo, &hi]);
        let place = u.iter().zip(&p).map(|(u, p)| snapped(u + p)).collect();
        if !steps.contains(&place) {
            steps.push(place);
        }
    }
    steps
}

fn snapped(u: f64) -> f64 {
    match u {
        u if u < 1e-9 => 0.0,
        u if u > 1.0 - 1e-9 => 1.0,
        u => u,
    }
}
