//! Several starts, each a swarm and the polish of the best of what it scored.

use std::borrow::Borrow;
use std::cell::RefCell;

use argmin::core::{CostFunction, Executor, PopulationState};
use argmin::solver::particleswarm::{Particle, ParticleSwarm};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};

use super::polish::{self, Radii};
use super::score::Goal;
use super::session::{Ended, Found, Halt, Session, Stage};
use super::variables::Variables;
use crate::scene::sampler::Sampler;

pub const STARTS: u32 = 12;
const LEAST: u32 = 4;
/// Starts that must have found the same.
const AGREEING: usize = 3;
/// What is the same, relative.
const SAME: f64 = 1e-5;
/// Most times that a polish is repeated, and the relative gain for which it is.
const AGAIN: usize = 4;
const GAIN: f64 = 1e-6;
/// Distinct candidates of a swarm that are polished.
const POLISHED: usize = 3;
/// Candidates closer than this in every variable of the unit box are not distinct.
const DISTINCT: f64 = 0.08;

/// Radii of a polish that begins at a swarm's candidate and ends at an optimum.
pub const COLD: Radii = Radii { first: 0.04, last: 1e-5 };

/// Radii of a polish of what is read from charts: farther down their errors show.
const READ: Radii = Radii { first: 0.04, last: 2e-3 };
/// Radii of the polish that begins at what that found.
const WARM: Radii = Radii { first: 5e-3, last: 1e-5 };
/// What is the same of what is read from charts.
const SAME_READ: f64 = 1e-4;
/// Candidates read from charts that are polished in f64.
const FINISHED: usize = 2;

/// Searches until starts agree, all are made, or the budget ends it.
pub fn run(session: &mut Session<'_>, goal: Goal, seed: u64, starts: u32) -> Result<(), Halt> {
    if session.scorers[0].rows.is_none() {
        return starting(session, goal, seed, starts, (Stage::Polish, COLD, SAME)).map(drop);
    }
    // What is read from charts is smooth, and good to their error: only what was found there is polished in f64, for which some of the
    // budget is kept.
    session.keep_back();
    let mut found = match starting(session, goal, seed, starts, (Stage::Swarm, READ, SAME_READ)) {
        Err(Halt::Ended(Ended::Evaluations)) => session.best[0].into_iter().collect(),
        other => other?,
    };
    let out_of = session.release();
    found.sort_by(|a, b| goal.order(&a.score).total_cmp(&goal.order(&b.score)));
    let scored: Vec<(Stage, Found)> = found.into_iter().map(|f| (Stage::Swarm, f)).collect();
    session.take();
    for (u, j) in pick(session.variables, goal, &scored, FINISHED) {
        to_the_end(session, goal, (u, j), (Stage::Polish, WARM))?;
    }
    if out_of { Err(Halt::Ended(Ended::Evaluations)) } else { Ok(()) }
}

/// The best of each start: swarms, and the best of what they scored improved.
fn starting(
    session: &mut Session<'_>,
    goal: Goal,
    seed: u64,
    starts: u32,
    (stage, radii, same): (Stage, Radii, f64),
) -> Result<Vec<Found>, Halt> {
    let mut all: Vec<Found> = Vec::new();
    for start in 0..starts {
        session.start = start;
        let seeds: Vec<Vec<f64>> = session.variables.start.iter().filter(|_| start == 0).cloned().collect();
        swarm(session, goal, seed, &seeds)?;
        let picked = pick(session.variables, goal, &session.take(), POLISHED);
        let mut found: Vec<Found> = Vec::new();
        for (u, j) in picked {
            found.push(to_the_end(session, goal, (u, j), (stage, radii))?);
        }
        session.take();
        all.extend(found.into_iter().min_by(|a, b| goal.order(&a.score).total_cmp(&goal.order(&b.score))));
        let orders: Vec<f64> = all.iter().map(|f| goal.order(&f.score)).collect();
        let least = orders.iter().copied().fold(f64::INFINITY, f64::min);
        let agreeing = orders.iter().filter(|f| (**f - least).abs() <= same * least.abs()).count();
        if start + 1 >= LEAST && agreeing >= AGREEING {
            break;
        }
    }
    Ok(all)
}

/// Polishes, and polishes again while that still helps: where limits of many samples meet, models stop too early.
fn to_the_end(
    session: &mut Session<'_>,
    goal: Goal,
    (u, j): (Vec<f64>, usize),
    how: (Stage, Radii),
) -> Result<Found, Halt> {
    let mut best = polish::run(session, goal, (&u, j), how)?;
    for _ in 0..AGAIN {
        let (u, j) = session.variables.place(&best.point);
        let next = polish::run(session, goal, (&u, j), how)?;
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

/// The best candidates of `scored` that are distinct, in the unit box.
pub fn pick(
    variables: &Variables,
    goal: Goal,
    scored: &[(Stage, Found)],
    count: usize,
) -> Vec<(Vec<f64>, usize)> {
    let mut order: Vec<(f64, usize)> =
        scored.iter().enumerate().map(|(i, (_, f))| (goal.order(&f.score), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut picked: Vec<(Vec<f64>, usize)> = Vec::new();
    for (_, i) in order {
        let (u, j) = variables.place(&scored[i].1.point);
        let near =
            |(v, k): &(Vec<f64>, usize)| *k == j && v.iter().zip(&u).all(|(a, b)| (a - b).abs() < DISTINCT);
        if !picked.iter().any(near) {
            picked.push((u, j));
            if picked.len() == count {
                break;
            }
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

/// Particles and steps of start `k`: small first, so that a small budget sees a whole search, then larger. A particle that tries
/// several drives counts for several.
fn size(k: u32, drives: usize) -> (usize, u64) {
    let (particles, steps) = match k {
        0 => (24, 12),
        1 => (48, 20),
        2 => (96, 30),
        _ => (192, 40),
    };
    ((particles / drives).max(PARTICLES), steps)
}

/// Runs one swarm towards `goal`; what it scored is in the session's archive. `seeds` are places in the unit box where particles begin.
pub fn swarm(session: &mut Session<'_>, goal: Goal, seed: u64, seeds: &[Vec<f64>]) -> Result<(), Halt> {
    let (particles, steps) = size(session.start, session.variables.drives());
    let k = session.variables.list.len();
    session.swarms += 1;
    // Each start has a stream of its own, whatever the seeds of others.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for _ in 0..session.start {
        random.jump();
    }
    let scramble = random.next_u64() | 1;
    let even = |i: usize, c: usize| {
        (f64::from(Sampler::Sobol.coordinate(scramble, c as u32, i as u32)) + 0.5) / 4_294_967_296.0
    };
    let mut positions: Vec<Vec<f64>> = seeds.iter().take(particles).cloned().collect();
    positions.extend((positions.len()..particles).map(|i| (0..k).map(|c| even(i, c)).collect()));
    let velocity = |i: usize| (0..k).map(|c| 0.5 * (even(particles + i, c) - 0.5)).collect();

    let flock = Flock { session: RefCell::new(session), goal, halt: RefCell::new(None) };
    let costs = flock.orders(&positions)?;
    let swarm: Vec<Particle<Vec<f64>, f64>> = positions
        .into_iter()
        .zip(costs)
        .enumerate()
        .map(|(i, (position, cost))| Particle::new(position, cost, velocity(i)))
        .collect();
    let solver = ParticleSwarm::new((vec![0.0; k], vec![1.0; k]), particles).with_rng_generator(random);
    let halt = &flock.halt;
    let run = Executor::new(&flock, solver)
        .configure(|state: PopulationState<_, f64>| state.population(swarm).max_iters(steps))
        .timer(false)
        .run();
    match (run, halt.take()) {
        (_, Some(halt)) => Err(halt),
        (Err(e), None) => Err(Halt::Failed(crate::error::Error::Run(e.to_string()))),
        (Ok(_), None) => Ok(()),
    }
}

struct Flock<'s, 'a> {
    session: RefCell<&'s mut Session<'a>>,
    goal: Goal,
    halt: RefCell<Option<Halt>>,
}

impl Flock<'_, '_> {
    /// Order of each position; where drives are listed, that of the best of them.
    fn orders<P: Borrow<Vec<f64>>>(&self, positions: &[P]) -> Result<Vec<f64>, Halt> {
        let mut session = self.session.borrow_mut();
        let variables = session.variables;
        let drives = variables.drives();
        let points: Vec<_> =
            positions.iter().flat_map(|u| (0..drives).map(|j| variables.point(u.borrow(), j))).collect();
        let scores = session.scores(Stage::Swarm, &points)?;
        let best = |s: &[_]| s.iter().map(|s| self.goal.order(s)).fold(f64::INFINITY, f64::min);
        Ok(scores.chunks(drives).map(best).collect())
    }
}

impl CostFunction for &Flock<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, u: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(self.bulk_cost(std::slice::from_ref(u))?[0])
    }

    fn bulk_cost<P>(&self, positions: &[P]) -> Result<Vec<f64>, argmin::core::Error>
    where
        P: Borrow<Vec<f64>>,
    {
        self.orders(positions).map_err(|halt| {
            let error = argmin::core::Error::msg(format!("{halt:?}"));
            self.halt.replace(Some(halt));
            error
        })
    }
}
