//! Two readings of one tap, by gauges 90° apart round the whisker, over distance and tilt, and backwards (model §6).
//!
//! Readings are counted positive as those of the first gauge are on its side: r₁ = s₁ ε₁, r₂ = s₂ ε(90° + δ), δ the misalignment of the second gauge.

use super::error::ModelError;
use super::exact::{Extent, Values, scene_with};
use super::surface::continued;
use crate::design::Design;
use crate::error::SolveError;
use crate::evaluate::{Evaluator, Method, Task};
use crate::measure::Rig;
use crate::scene::{Direction, Setup, Side};
use crate::status::Status;

/// Largest |tilt| that is looked for, degrees.
pub const STEEPEST: f64 = 85.0;
/// Rounds of Newton's method at most.
const ROUNDS: usize = 12;
/// Steps of the difference quotients: of a, relative; of the tilt, degrees.
const STEPS: [f64; 2] = [1e-4, 1e-2];
/// Longest step of a round: of a, relative; of the tilt, degrees.
const LONGEST: [f64; 2] = [0.25, 15.0];
/// Changes below which a root is found: of a, relative; of the tilt, degrees.
const STILL: [f64; 2] = [2e-7, 1e-5];

/// A tap as it is labelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Contact distance, mm.
    pub a: f64,
    /// Tilt, degrees.
    pub tilt: f64,
    /// Degrees or mm.
    pub drive: f64,
}

/// Two readings, and where their tap is looked for first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// Where the search starts.
    pub start: Place,
    /// r₁ > 0 and r₂.
    pub readings: [f64; 2],
}

/// The tap of two readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inverted {
    /// Where it is.
    pub place: Place,
    /// Rows: d r₁, d r₂; columns: da (mm), dβ (rad).
    pub slopes: [[f64; 2]; 2],
}

/// What the second gauge shows beside the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfer {
    /// s₁ and s₂, reading per strain.
    pub factors: [f64; 2],
    /// δ, rad.
    pub misalignment: f64,
}

/// The model of a calibrated whisker with two gauges.
#[derive(Debug, Clone)]
pub struct Pair {
    setup: Setup,
    designs: [Design; 1],
    /// What is added to a labelled distance, mm, and to a labelled drive.
    offsets: [f64; 2],
    /// Lean of the pole, degrees.
    lean: f64,
    /// Distances covered, mm, as labelled.
    reach: [f64; 2],
}

impl Pair {
    /// The model of `rig` with the parameters `values`, over the distances of `at`, of poles that lean by `lean`, degrees.
    ///
    /// # Errors
    /// Distances that no whisker has.
    pub fn new(rig: &Rig, values: &Values, at: Extent, lean: f64) -> Result<Self, ModelError> {
        let mut setup = scene_with(&rig.setup, values);
        setup.gauge.side = at.side;
        setup.gauge.second = true;
        let (reach, tuple) = continued(rig, at.reach)?;
        let design = Design::new(&setup, tuple);
        if design.shared.is_none() {
            return Err(ModelError::TooFar);
        }
        let reach = reach.map(|a| a - values[2]);
        Ok(Self { setup, designs: [design], offsets: [values[2], values[1]], lean, reach })
    }

    /// What evaluates its taps by `method`.
    pub fn evaluator(&self, method: Method) -> Evaluator<'_> {
        Evaluator::new(&self.setup, method)
    }

    /// The model that `method` must solve.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Mean strains of taps: of the centreline, of the first gauge, and 90° further; each positive as that of the first is. `None` where the model
    /// has none.
    ///
    /// # Errors
    /// A backend that fails.
    pub fn strains(
        &self,
        evaluator: &mut Evaluator<'_>,
        places: &[Place],
    ) -> Result<Vec<Option<[f64; 3]>>, SolveError> {
        let [a0, drive0] = self.offsets;
        let task = |p: &Place| {
            let direction = Direction { tilt: p.tilt, lean: self.lean };
            Task { design: 0, a: p.a + a0, direction, drive: p.drive + drive0 }
        };
        let tasks: Vec<Task> = places.iter().map(task).collect();
        let sign = if self.setup.gauge.side == Side::Far { -1.0 } else { 1.0 };
        let outcomes = evaluator.run(&self.designs, &tasks)?;
        let strains = outcomes.iter().map(|o| {
            let strains = [o.axial, o.strain, o.strain_2].map(|e| sign * e);
            let there = strains.iter().all(|e| e.is_finite()) && !o.status.has(Status::NO_STRAIN);
            there.then_some(strains)
        });
        Ok(strains.collect())
    }

    /// The taps of two readings each, through `transfer`; `None` where none is found.
    ///
    /// # Errors
    /// A backend that fails.
    pub fn invert(
        &self,
        evaluator: &mut Evaluator<'_>,
        transfer: &Transfer,
        asked: &[Asked],
    ) -> Result<Vec<Option<Inverted>>, SolveError> {
        let mut found = vec![None; asked.len()];
        let begin = |(i, one): (usize, &Asked)| Trial { i, at: self.within(one.start), step: [0.0; 2] };
        let mut open: Vec<Trial> = asked.iter().enumerate().map(begin).collect();
        for _ in 0..ROUNDS {
            if open.is_empty() {
                break;
            }
            let places: Vec<Place> = open.iter().flat_map(|trial| around(trial.at)).collect();
            let strains = self.strains(evaluator, &places)?;
            let mut rest = Vec::new();
            for (mut trial, seen) in open.into_iter().zip(strains.chunks_exact(3)) {
                let &[Some(here), Some(nearer), Some(steeper)] = seen else {
                    // There is no such tap: half the way back to one that is.
                    if trial.step != [0.0; 2] {
                        trial.step = trial.step.map(|s| 0.5 * s);
                        trial.at = moved(trial.at, trial.step.map(|s| -s));
                        rest.push(trial);
                    }
                    continue;
                };
                let [here, nearer, steeper] = [here, nearer, steeper].map(|e| transfer.readings(e));
                let steps = [-STEPS[0] * trial.at.a, STEPS[1].to_radians()];
                let slopes =
                    [0, 1].map(|k| [(nearer[k] - here[k]) / steps[0], (steeper[k] - here[k]) / steps[1]]);
                let target = asked[trial.i].readings;
                let Some([da, tilt]) = solve(slopes, [target[0] - here[0], target[1] - here[1]]) else {
                    continue;
                };
                let step = [da, tilt.to_degrees()];
                let sizes = [step[0].abs() / trial.at.a, step[1].abs()];
                if sizes[0] <= STILL[0] && sizes[1] <= STILL[1] {
                    found[trial.i] = Some(Inverted { place: moved(trial.at, step), slopes });
                    continue;
                }
                let share = (LONGEST[0] / sizes[0]).min(LONGEST[1] / sizes[1]).min(1.0);
                let next = self.within(moved(trial.at, step.map(|s| share * s)));
                trial.step = [next.a - trial.at.a, next.tilt - trial.at.tilt];
                trial.at = next;
                if trial.step != [0.0; 2] {
                    rest.push(trial);
                }
            }
            open = rest;
        }
        Ok(found)
    }

    /// The nearest place that is covered, with its difference quotients.
    fn within(&self, at: Place) -> Place {
        let [near, far] = self.reach;
        let near = near * (1.0 + 2.0 * STEPS[0]);
        Place { a: at.a.max(near).min(far), tilt: at.tilt.clamp(-STEEPEST, STEEPEST), ..at }
    }
}

impl Transfer {
    /// r₁ and r₂ of [`Pair::strains`].
    pub fn readings(&self, [axial, first, second]: [f64; 3]) -> [f64; 2] {
        let (sin, cos) = self.misalignment.sin_cos();
        let strain_2 = axial + (second - axial) * cos - (first - axial) * sin;
        [self.factors[0] * first, self.factors[1] * strain_2]
    }

    /// ε₁ and ε₂ of r₁ and r₂, the strain of the centreline left out.
    pub fn strains(&self, readings: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.misalignment.sin_cos();
        let first = readings[0] / self.factors[0];
        [first, (readings[1] / self.factors[1] + first * sin) / cos]
    }
}

/// A tap that is looked for.
struct Trial {
    i: usize,
    at: Place,
    /// What led there: mm and degrees.
    step: [f64; 2],
}

/// A place, and those of its difference quotients.
fn around(at: Place) -> [Place; 3] {
    [at, moved(at, [-STEPS[0] * at.a, 0.0]), moved(at, [0.0, STEPS[1]])]
}

fn moved(at: Place, [a, tilt]: [f64; 2]) -> Place {
    Place { a: at.a + a, tilt: at.tilt + tilt, ..at }
}

/// Inverse of a 2 × 2 matrix, given by rows; `None` of a singular one.
pub fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a * d - b * c;
    let inverse = [[d / determinant, -b / determinant], [-c / determinant, a / determinant]];
    inverse.iter().flatten().all(|x| x.is_finite()).then_some(inverse)
}

fn solve(slopes: [[f64; 2]; 2], [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let solved = inverse(slopes)?.map(|[p, q]| p * x + q * y);
    solved.iter().all(|s| s.is_finite()).then_some(solved)
}
