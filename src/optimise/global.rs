//! Several starts, each a swarm and the polish of the best of what it scored.

use super::polish::{self, Radii};
use super::score::Goal;
use super::session::{Ended, Found, Halt, Session, Stage};
use super::swarm;
use super::variables::Variables;

/// Most starts.
pub const STARTS: u32 = 12;
/// Least starts.
const LEAST: u32 = 4;
/// Starts that must have found the same.
const AGREEING: usize = 3;
/// What is the same, relative.
const SAME: f64 = 1e-5;
/// Most times that a polish is repeated, and the relative gain for which it is.
const AGAIN: usize = 4;
/// See [`AGAIN`].
const GAIN: f64 = 1e-6;
/// Distinct candidates of a swarm that are polished.
const POLISHED: usize = 3;
/// Candidates closer than this in every variable of the unit box are not distinct.
const DISTINCT: f64 = 0.08;

/// Radii of a polish that begins at a swarm's candidate and ends at an optimum.
pub const COLD: Radii = Radii { first: 0.04, last: 1e-5 };

/// Searches until starts agree, all are made, or the budget ends it.
pub fn run(session: &mut Session<'_>, goal: Goal, seed: u64, starts: u32) -> Result<(), Halt> {
    let mut found: Vec<f64> = Vec::new();
    for start in 0..starts {
        session.start = start;
        let seeds: Vec<Vec<f64>> = session.variables.start.iter().filter(|_| start == 0).cloned().collect();
        swarm::run(session, goal, seed, &seeds)?;
        let picked = pick(session.variables, goal, &session.take(), POLISHED);
        let mut best = f64::INFINITY;
        for (u, j) in picked {
            best = best.min(goal.order(&to_the_end(session, goal, (u, j))?.score));
        }
        session.take();
        found.push(best);
        let least = found.iter().copied().fold(f64::INFINITY, f64::min);
        let same = found.iter().filter(|f| (**f - least).abs() <= SAME * least.abs()).count();
        if start + 1 >= LEAST && same >= AGREEING {
            break;
        }
    }
    Ok(())
}

/// Polishes, and polishes again while that still helps: where limits of many samples meet, models stop too early.
fn to_the_end(session: &mut Session<'_>, goal: Goal, (u, j): (Vec<f64>, usize)) -> Result<Found, Halt> {
    let mut best = polish::run(session, goal, (&u, j), COLD)?;
    for _ in 0..AGAIN {
        let (u, j) = session.variables.place(&best.point);
        let next = polish::run(session, goal, (&u, j), COLD)?;
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

/// How a search ended, or why it failed.
pub fn ending(result: Result<(), Halt>) -> Result<Ended, crate::error::Error> {
    match result {
        Ok(()) => Ok(Ended::Converged),
        Err(Halt::Ended(ended)) => Ok(ended),
        Err(Halt::Failed(e)) => Err(e),
    }
}
