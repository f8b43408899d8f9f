//! Global stage: argmin's particle swarm, one swarm step one batch.

use std::borrow::Borrow;
use std::cell::RefCell;

use argmin::core::{CostFunction, Executor, PopulationState};
use argmin::solver::particleswarm::{Particle, ParticleSwarm};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};

use super::score::Goal;
use super::session::{Halt, Session, Stage};
use crate::scene::sampler::Sampler;

const LEAST: usize = 24;

/// Particles and steps of start `k`: small first, so that a small budget sees a whole search, then larger. A particle that tries
/// several drives counts for several.
fn size(k: u32, drives: usize) -> (usize, u64) {
    let (particles, steps) = match k {
        0 => (24, 12),
        1 => (48, 20),
        2 => (96, 30),
        _ => (192, 40),
    };
    ((particles / drives).max(LEAST), steps)
}

/// Runs one swarm towards `goal`; what it scored is in the session's archive. `seeds` are places in the unit box where particles begin.
pub fn run(session: &mut Session<'_>, goal: Goal, seed: u64, seeds: &[Vec<f64>]) -> Result<(), Halt> {
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

/// The candidates as argmin sees them.
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
