//! Several starts, each a swarm and the polish of its best candidates.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};

use super::polish::{self, Radii};
use super::{Ended, Found, Goal, Halt, Place, Score, Session, Stage, Variables};
use crate::scene::{Sampler, Tuple};

pub const STARTS: u32 = 12;
const LEAST: u32 = 4;
const AGREEING: usize = 3;
/// Relative difference at which starts agree.
const SAME: f64 = 1e-5;
/// Maximum number of repeated polishes, and the relative gain that each needs.
const AGAIN: usize = 4;
const GAIN: f64 = 1e-6;
const POLISHED: usize = 3;
/// Candidates closer than this in every variable of the unit box count as one.
const DISTINCT: f64 = 0.08;

/// Radii of a polish from a swarm's candidate to an optimum.
pub const COLD: Radii = Radii { stage: Stage::Polish, first: 0.04, last: 1e-5 };

/// Radii of a polish on charts; at smaller radii the charts' errors show.
const READ: Radii = Radii { stage: Stage::Swarm, first: 0.04, last: 2e-3 };
/// Radii of the f64 polish after the one on charts.
const WARM: Radii = Radii { stage: Stage::Polish, first: 5e-3, last: 1e-5 };
/// Relative difference at which starts on charts agree.
const SAME_READ: f64 = 1e-4;
const FINISHED: usize = 2;
/// Maximum number of evaluations kept for the final polish.
const KEPT_BACK: u64 = 3000;

pub fn run(session: &mut Session<'_>, goal: Goal, seed: u64) -> Result<(), Halt> {
    if session.scorers[0].rows.is_none() {
        return starting(session, goal, seed, (COLD, SAME)).map(drop);
    }
    // Charts are smooth and accurate to their tolerance: only their best candidates are polished in f64; part of the budget is kept for that.
    session.kept_back = session.budget.evaluations.map_or(0, |n| (n / 8).min(KEPT_BACK));
    let found = match starting(session, goal, seed, (READ, SAME_READ)) {
        Err(Halt::Ended(Ended::Evaluations)) => session.best[0].into_iter().collect(),
        other => other?,
    };
    let out_of = session.left() == Some(0);
    session.kept_back = 0;
    session.take();
    for at in pick(session.variables, goal, found, FINISHED) {
        to_the_end(session, goal, at, WARM)?;
    }
    if out_of { Err(Halt::Ended(Ended::Evaluations)) } else { Ok(()) }
}

/// Runs the starts: a swarm and the polish of its best candidates each. Returns the best of each start.
fn starting(session: &mut Session<'_>, goal: Goal, seed: u64, how: (Radii, f64)) -> Result<Vec<Found>, Halt> {
    let ((radii, same), mut all) = (how, Vec::<Found>::new());
    for start in 0..STARTS {
        session.start = start;
        let seeds: Vec<Vec<f64>> = session.variables.start.iter().filter(|_| start == 0).cloned().collect();
        swarm(session, goal, seed, &seeds)?;
        let picked = pick(session.variables, goal, session.take(), POLISHED).into_iter();
        let found = picked.map(|at| to_the_end(session, goal, at, radii));
        let found: Vec<Found> = found.collect::<Result<_, _>>()?;
        session.take();
        all.extend(found.into_iter().min_by(|a, b| goal.compare(&a.score, &b.score)));
        let orders: Vec<f64> = all.iter().map(|f| goal.order(&f.score)).collect();
        let least = orders.iter().copied().fold(f64::INFINITY, f64::min);
        let agreeing = orders.iter().filter(|f| (**f - least).abs() <= same * least.abs()).count();
        if start + 1 >= LEAST && agreeing >= AGREEING {
            break;
        }
    }
    Ok(all)
}

/// Repeats the polish while it helps: where limits of many samples meet, its models stop too early.
fn to_the_end(session: &mut Session<'_>, goal: Goal, at: Place, radii: Radii) -> Result<Found, Halt> {
    let mut best = polish::run(session, goal, at, radii)?;
    for _ in 0..AGAIN {
        let next = polish::run(session, goal, session.variables.place(&best.point), radii)?;
        let (old, new) = (goal.order(&best.score), goal.order(&next.score));
        if new < old {
            best = next;
        }
        if old - new <= GAIN * old.abs() {
            break;
        }
    }
    Ok(best)
}

pub fn pick(variables: &Variables, goal: Goal, mut scored: Vec<Found>, count: usize) -> Vec<Place> {
    scored.sort_by(|a, b| goal.compare(&a.score, &b.score));
    let mut picked: Vec<Place> = Vec::new();
    for (u, j) in scored.iter().map(|f| variables.place(&f.point)) {
        let near = |(v, k): &Place| *k == j && v.iter().zip(&u).all(|(a, b)| (a - b).abs() < DISTINCT);
        if picked.len() == count {
            break;
        }
        if !picked.iter().any(near) {
            picked.push((u, j));
        }
    }
    picked
}

pub fn ending(result: Result<(), Halt>) -> Result<Ended, crate::error::Error> {
    match result {
        Ok(()) => Ok(Ended::Converged),
        Err(Halt::Ended(ended)) => Ok(ended),
        Err(Halt::Failed(e)) => Err(e),
    }
}

const PARTICLES: usize = 24;

/// Particles and steps of the starts: a small first one, so that a small budget still gives a result. A particle with several drives counts several times.
const SIZES: [(usize, u64); 4] = [(24, 12), (48, 20), (96, 30), (192, 40)];

/// Weights of a particle's velocity, and of the ways to its own best place and to that of all (M. Clerc, Standard Particle Swarm Optimisation, 2012).
const INERTIA: f64 = 0.5 / std::f64::consts::LN_2;
const PULL: f64 = 0.5 + std::f64::consts::LN_2;

struct Particle {
    position: Vec<f64>,
    velocity: Vec<f64>,
    /// Its best place, and the order there.
    best: Vec<f64>,
    order: f64,
}

/// Runs one swarm towards `goal`; its scores go to the session's archive. `seeds` are initial positions in the unit box.
pub fn swarm(session: &mut Session<'_>, goal: Goal, seed: u64, seeds: &[Vec<f64>]) -> Result<(), Halt> {
    let (particles, steps) = SIZES[session.start.min(3) as usize];
    let particles = (particles / session.variables.drives()).max(PARTICLES);
    let k = session.variables.list.len();
    session.swarms += 1;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for _ in 0..session.start {
        random.jump();
    }
    let scramble = random.next_u64() | 1;
    let even = |i: usize, c: usize| Sampler::Sobol.uniform(scramble, c as u32, i as u32);
    let particle = |i: usize| {
        let position = seeds.get(i).cloned().unwrap_or_else(|| (0..k).map(|c| even(i, c)).collect());
        let velocity = (0..k).map(|c| 0.5 * (even(particles + i, c) - 0.5)).collect();
        Particle { best: position.clone(), position, velocity, order: f64::INFINITY }
    };
    let mut swarm: Vec<Particle> = (0..particles).map(particle).collect();
    let first = orders(session, goal, &swarm)?;
    swarm.iter_mut().zip(first).for_each(|(one, order)| one.order = order);
    swarm.sort_by(|a, b| a.order.total_cmp(&b.order));
    let (mut best, mut least) = (swarm[0].best.clone(), swarm[0].order);
    for _ in 0..steps {
        for one in &mut swarm {
            let own = pull(&mut random, &one.position, &one.best);
            let all = pull(&mut random, &one.position, &best);
            let pulls = own.iter().zip(&all);
            for ((v, x), (own, all)) in one.velocity.iter_mut().zip(&mut one.position).zip(pulls) {
                *v = *v * INERTIA + own + all;
                *x = (*x + *v).clamp(0.0, 1.0);
            }
        }
        for (i, order) in orders(session, goal, &swarm)?.into_iter().enumerate() {
            let one = &mut swarm[i];
            if order < one.order {
                (one.best, one.order) = (one.position.clone(), order);
            }
            if order < least {
                (best, least) = (one.position.clone(), order);
            }
        }
    }
    Ok(())
}

/// A random part of the way from one place to another, times its weight.
fn pull(random: &mut Xoshiro256PlusPlus, from: &[f64], to: &[f64]) -> Vec<f64> {
    let drawn = |(from, to): (&f64, &f64)| {
        let way = to - from;
        if way == 0.0 {
            return 0.0;
        }
        let share = (random.next_u64() >> 12) as f64 / 2f64.powi(52);
        PULL * (share * way.abs() + way.min(0.0))
    };
    from.iter().zip(to).map(drawn).collect()
}

/// The order of each particle at its position, at its best drive.
fn orders(session: &mut Session<'_>, goal: Goal, swarm: &[Particle]) -> Result<Vec<f64>, Halt> {
    let variables = session.variables;
    let drives = variables.drives();
    let at = |one: &Particle| (0..drives).map(|j| variables.point(&one.position, j)).collect::<Vec<_>>();
    let points: Vec<Tuple> = swarm.iter().flat_map(at).collect();
    let scores = session.scores(Stage::Swarm, &points)?;
    let best = |s: &[Score]| s.iter().map(|s| goal.order(s)).fold(f64::INFINITY, f64::min);
    Ok(scores.chunks(drives).map(best).collect())
}
