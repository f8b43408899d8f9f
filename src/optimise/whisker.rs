//! Figures and limits of one whisker from its taps.

use super::judge::{Calibration, Judge};
use super::score::{Limit, Score};
use crate::curve::both::Both;
use crate::design::{Design, amount};
use crate::estimate::Estimator;
use crate::evaluate::Outcome;
use crate::scene::{Convention, Tuple};
use crate::statistics::{DriveRow, Told};
use crate::status::Status;

/// The taps of slipped contacts are continued beyond the tip, so that figures stay smooth; a separate limit excludes them.
pub(super) fn continued(taps: &[Outcome]) -> Vec<Outcome> {
    taps.iter().map(|t| Outcome { status: t.status.without(Status::SLIPPED_OFF), ..*t }).collect()
}

pub(super) struct Read {
    pub score: Score,
    pub k: Option<f64>,
}

impl Read {
    pub fn new(
        judge: &Judge<'_>,
        design: &Design,
        (taps, both): (&[Outcome], &[Option<Both>]),
        told: Told<'_>,
        other: Option<&Calibration<'_>>,
    ) -> Self {
        let setup = design.setup(judge.setup);
        let Tuple { D, d, L_a, x_ss, l, drive, .. } = design.tuple;
        let mut score = judge.shape(&design.tuple);
        let valid = [D, d, L_a, l].iter().all(|x| *x > 0.0) && x_ss >= 0.0;
        let Some(shared) = design.shared.as_ref().filter(|_| valid && !score.outside()) else {
            if !score.outside() {
                score.set(Limit::Solved, 1.0);
            }
            return Self { score, k: None };
        };
        let taps = continued(taps);
        let own = Estimator::new(setup, shared, judge.reach);
        let mut row = judge.reduce(design, (&taps, both), told, other);
        if let Some(spread) = other.and_then(|other| other.upright).filter(|_| row.complete()) {
            row.deviation = spread;
        }
        if row.complete() {
            score.figures = figures(judge, &row, own.k_unit, L_a);
        }

        let largest =
            |f: &dyn Fn(&Outcome) -> f64| taps.iter().map(f).filter(|x| x.is_finite()).fold(0.0, f64::max);
        let unsolved =
            taps.iter().filter(|t| t.status.has(Status::NOT_CONVERGED | Status::MATERIAL_LIMIT)).count();
        let near = |t: (&Outcome, &f64)| if t.0.arc.is_finite() { t.1.min(t.0.arc) } else { *t.1 };
        let nearest = taps.iter().zip(&judge.distances).map(near).fold(f64::INFINITY, f64::min);
        let (estimator, drive) = other.map_or((&own, drive), |other| (&other.estimator, other.drive));
        let highest = match (told, other.and_then(|other| other.curve)) {
            _ if !both.is_empty() => None,
            (_, Some(curve)) => Some((1.0, curve.peak().1)),
            (Told::Formula, None) => row.k.map(|k| (k, estimator.peak() * amount(setup.drive, drive))),
            // A reading of the own model always has a distance.
            (Told::Own(_) | Told::Other(_) | Told::Both(_), None) => None,
        };
        let peak = match told {
            Told::Own(Some(curve)) => curve.peak().0,
            _ => shared.theory.peak().0,
        };
        judge.limits(
            &mut score,
            &Seen {
                nearest: shared.gauge[0] / nearest,
                farthest: largest(&|t| t.arc) / L_a,
                strain: shared.borne(largest(&Outcome::magnitude), &setup.gauge),
                reading: largest(&|t| t.magnitude() / t.cosine()),
                force: largest(&|t| t.normal_force),
                unsolved: unsolved as f64 / taps.len() as f64,
                highest,
                peak,
            },
        );
        Self { score, k: row.k }
    }
}

pub(super) struct Seen {
    /// Near end of the gauge over the nearest contact.
    pub nearest: f64,
    /// Farthest contact over L_a.
    pub farthest: f64,
    /// Largest |ε|.
    pub strain: f64,
    /// Largest reading as strain: |ε|; with two gauges √(ε₁² + ε₂²)/cos β̂.
    pub reading: f64,
    /// Largest P, N.
    pub force: f64,
    /// Share of unsolved taps.
    pub unsolved: f64,
    /// K̄, and the largest strain for which the theory has a distance, if needed.
    pub highest: Option<(f64, f64)>,
    /// Distance of the peak of the curve in use, mm.
    pub peak: f64,
}

/// Removes the rounding of a sum of decimal numbers.
pub(super) fn over(value: f64) -> f64 {
    if value <= 1e-12 { value.min(0.0) } else { value }
}

pub(super) fn figures(judge: &Judge<'_>, row: &DriveRow, gauge: f64, length: f64) -> [f64; 3] {
    let unit = if judge.setup.estimate.convention == Convention::Elongation { gauge } else { 1.0 };
    let row = row.figures();
    let [sd, total] = [row.sd, row.total_rms()].map(|x| x.unwrap_or(f64::NAN));
    let mean = 1.0 + row.mean.unwrap_or(f64::NAN);
    let [by_sd, by_distance] = judge.search.weights;
    // A weight of 0 drops its term, even a missing one.
    let term = |weight: f64, value: f64| if weight == 0.0 { 0.0 } else { weight * value };
    [sd * unit, total, term(by_sd, sd / mean) + term(by_distance, total / length)]
}
