//! The trade-off between the spread of K and the total of bias and noise: ε-constraint scans.
//!
//! A point of the front has the least total_rms_mm among the designs with K_sd ≤ ε: the polish solves this with one more limit. The next ε halves the
//! largest gap. Swarms find the branch to follow; each of their candidates that beats the front is another start.
//! `moors`, the maintained multi-objective crate, evolves populations (NSGA-II and similar). Such a front lies near the true one, but not on the limits
//! that bind; pymoo's NSGA-II (`benches/search`) reaches less hypervolume with the same evaluations.

use super::global::{COLD, ending, pick, swarm};
use super::polish::{self, Radii};
use super::report::Design;
use super::{Ended, Found, Goal, Halt, Place, Session, Stage};
use crate::error::Error;
use crate::scene::Tuple;

const POINTS: usize = 128;
/// Gaps below this share of the front's extent are not divided further.
const GAP: f64 = 0.004;
const WARM: Radii = Radii { stage: Stage::Polish, first: 0.01, last: 1e-3 };
const CHALLENGE: Radii = Radii { stage: Stage::Polish, first: 0.04, last: 1e-3 };
/// A candidate that is better than the front by this share in both figures becomes a start.
const BETTER: f64 = 1e-3;
const CHALLENGES: usize = 12;
/// Goals of the swarms, and the number of starts of each.
const SWARMS: [(Goal, u32); 4] =
    [(Goal::Figure(1), 2), (Goal::Figure(0), 2), (Goal::Blend(0.5), 2), (Goal::Blend(0.2), 1)];

/// Non-dominated points: no point is better than another in both figures.
#[derive(Debug)]
pub struct Front {
    pub points: Vec<Design>,
    /// Area between the front and `reference`, K_sd × mm.
    pub hypervolume: f64,
    /// Largest K_sd and largest total_rms_mm of the front.
    pub reference: [f64; 2],
    /// Mean absolute deviation of the gaps, relative to their mean (Deb's Δ without its ends); 0 for even gaps.
    pub spread: f64,
}

impl Front {
    pub fn new(points: Vec<Design>) -> Self {
        let figures: Vec<[f64; 2]> =
            points.iter().map(|p| [p.score.figures[0], p.score.figures[1]]).collect();
        let reference = [0, 1].map(|i| figures.iter().map(|f| f[i]).fold(0.0, f64::max));
        Self { points, hypervolume: hypervolume(&figures, reference), reference, spread: spread(&figures) }
    }
}

/// Area dominated by `figures` (first rising, second falling) up to `reference`.
fn hypervolume(figures: &[[f64; 2]], reference: [f64; 2]) -> f64 {
    let next = |i: usize| figures.get(i + 1).map_or(reference[0], |f| f[0]);
    figures.iter().enumerate().map(|(i, f)| (next(i) - f[0]).max(0.0) * (reference[1] - f[1]).max(0.0)).sum()
}

fn spread(figures: &[[f64; 2]]) -> f64 {
    let gaps = gaps(figures);
    let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
    if gaps.is_empty() || mean == 0.0 {
        return 0.0;
    }
    gaps.iter().map(|g| (g - mean).abs()).sum::<f64>() / (gaps.len() as f64 * mean)
}

fn gaps(figures: &[[f64; 2]]) -> Vec<f64> {
    let (Some(first), Some(last)) = (figures.first(), figures.last()) else { return Vec::new() };
    let extent = [0, 1].map(|i| (last[i] - first[i]).abs().max(f64::MIN_POSITIVE));
    figures
        .windows(2)
        .map(|w| f64::hypot((w[1][0] - w[0][0]) / extent[0], (w[1][1] - w[0][1]) / extent[1]))
        .collect()
}

/// Searches for the front; returns how the search ended, and the front by rising K_sd.
pub fn search(session: &mut Session<'_>, seed: u64) -> Result<(Ended, Option<Vec<Found>>), Error> {
    let mut scan = Scan { session, front: Vec::new(), pool: Vec::new() };
    let ended = scan.run(seed);
    if ended.is_err() {
        scan.gather();
        let points: Vec<Tuple> = scan.pool.iter().map(|f| f.point).collect();
        scan.front.extend(scan.session.again(&points)?);
    }
    Ok((ending(ended)?, Some(nondominated(scan.front))))
}

fn figures(f: &Found) -> [f64; 2] {
    [f.score.figures[0], f.score.figures[1]]
}

/// Keeps the non-dominated candidates within all limits, by rising K_sd.
fn nondominated(mut all: Vec<Found>) -> Vec<Found> {
    all.retain(|f| f.score.violation() == 0.0 && figures(f).iter().all(|x| x.is_finite()));
    unbeaten(&mut all, figures);
    all
}

/// Keeps the non-dominated items, sorted by the first figure.
pub(crate) fn unbeaten<T>(all: &mut Vec<T>, figures: impl Fn(&T) -> [f64; 2]) {
    let order = |[a, c]: [f64; 2], [b, d]: [f64; 2]| a.total_cmp(&b).then(c.total_cmp(&d));
    all.sort_by(|a, b| order(figures(a), figures(b)));
    let mut least = f64::INFINITY;
    all.retain(|f| {
        let better = figures(f)[1] < least * (1.0 - 1e-9);
        least = if better { figures(f)[1] } else { least };
        better
    });
}

struct Scan<'s, 'a> {
    session: &'s mut Session<'a>,
    front: Vec<Found>,
    pool: Vec<Found>,
}

impl Scan<'_, '_> {
    fn run(&mut self, seed: u64) -> Result<(), Halt> {
        let variables = self.session.variables;
        let seeds: Vec<Vec<f64>> = variables.start.iter().cloned().collect();
        for (n, (goal, starts)) in SWARMS.into_iter().enumerate() {
            for start in 0..starts {
                self.session.start = start;
                swarm(self.session, goal, seed.wrapping_add((n as u64) << 32), &seeds)?;
                let scored = self.session.take();
                self.pool.extend(&scored);
                for at in pick(variables, goal, scored, if goal == Goal::Blend(0.2) { 1 } else { 2 }) {
                    self.polish(goal, at, COLD)?;
                }
                self.gather();
            }
        }
        // The end with the least K_sd may still allow a smaller total.
        if let Some(end) = nondominated(self.front.clone()).first() {
            let goal = Goal::Capped(figures(end)[0] * (1.0 + 1e-6));
            self.polish(goal, variables.place(&end.point), COLD)?;
        }
        for _ in 0..2 {
            self.challenge()?;
            self.fill()?;
        }
        Ok(())
    }

    fn polish(&mut self, goal: Goal, at: Place, radii: Radii) -> Result<Found, Halt> {
        let found = polish::run(self.session, goal, at, radii)?;
        self.front.push(found);
        Ok(found)
    }

    fn gather(&mut self) {
        self.pool.extend(self.session.take());
        self.pool = nondominated(std::mem::take(&mut self.pool));
    }

    fn challenge(&mut self) -> Result<(), Halt> {
        self.gather();
        for _ in 0..CHALLENGES {
            let front = nondominated(self.front.clone());
            // No point of the front is as good, and some loses to it in both figures: a point inside a gap is not better.
            let better = |p: &&Found| {
                let [sd, distance] = figures(p).map(|x| x * (1.0 + BETTER));
                let good = |f: &Found| [figures(f)[0] <= sd, figures(f)[1] <= distance];
                let loses = front.is_empty() || front.iter().any(|f| good(f) == [false; 2]);
                loses && !front.iter().any(|f| good(f) == [true; 2])
            };
            let Some(p) = self.pool.iter().find(better).copied() else { break };
            let at = self.session.variables.place(&p.point);
            self.polish(Goal::Capped(figures(&p)[0]), at, CHALLENGE)?;
            self.pool.retain(|q| q.point != p.point);
            self.gather();
        }
        Ok(())
    }

    fn fill(&mut self) -> Result<(), Halt> {
        let mut closed: Vec<[u64; 2]> = Vec::new();
        loop {
            let front = nondominated(self.front.clone());
            if front.len() < 2 || front.len() >= POINTS {
                return Ok(());
            }
            let all: Vec<[f64; 2]> = front.iter().map(figures).collect();
            let key = |i: usize| [all[i][0].to_bits(), all[i + 1][0].to_bits()];
            let gaps = gaps(&all);
            let open = (0..gaps.len()).filter(|&i| gaps[i] > GAP && !closed.contains(&key(i)));
            let Some(i) = open.max_by(|&a, &b| gaps[a].total_cmp(&gaps[b])) else { return Ok(()) };
            closed.push(key(i));
            let cap = 0.5 * (all[i][0] + all[i + 1][0]);
            let ends = [i, i + 1].map(|k| self.session.variables.place(&front[k].point));
            let middle: Vec<f64> = ends[0].0.iter().zip(&ends[1].0).map(|(a, b)| 0.5 * (a + b)).collect();
            let found = self.polish(Goal::Capped(cap), (middle, ends[0].1), WARM)?;
            // No design between two branches: start again from either end.
            let inside = |f: &Found| Goal::Capped(cap).feasible(&f.score) && figures(f)[1] < all[i][1];
            if !inside(&found) {
                for at in ends {
                    self.polish(Goal::Capped(cap), at, CHALLENGE)?;
                }
            }
            if self.pool.len() > 4096 {
                self.gather();
            }
        }
    }
}
