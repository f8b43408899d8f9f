//! Scores of candidates, and figures and limits of one whisker from its taps. Limits follow feasibility rules (K. Deb, Comput. Methods Appl. Mech.
//! Engrg. 186, 2000), not penalties: a feasible candidate beats an infeasible one; of two feasible ones the smaller objective wins; of two infeasible ones the smaller violation.

use vibrissa_core::normal::quantile;

use super::judge::{Calibration, Judge};
use crate::curve::both::Both;
use crate::design::Design;
use crate::estimate::Estimator;
use crate::evaluate::Outcome;
use crate::physics::driven::Driven;
use crate::scene::{COLUMNS, Column, Convention, Measure, Robust, Sampler, Tuple};
use crate::statistics::{DriveRow, Told};
use crate::status::Status;

vibrissa_core::words! {
    /// A limit of a candidate; its value is relative, ≤ 0 where kept.
    Limit {
        /// The gauge ends on the whisker: (x_ss + l)/L_a − 1.
        Gauge = "gauge_on_whisker",
        /// The farthest distance lies on the whisker: a/L_a − 1.
        Reach = "a_on_whisker",
        /// The tip is not wider than the base: d/D − 1.
        Tip = "tip_not_wider",
        /// All contacts lie beyond the gauge's near end: x1/min(a, c) − 1.
        NoStrain = "no_strain",
        /// No contact runs past the tip: c/L_a − 1.
        Slipped = "slipped_off",
        /// Every reading has a distance: K̄|ε|/(θ f_max) − 1.
        Root = "no_root",
        /// Every tap is solved; the share of those that are not.
        Solved = "not_converged",
        /// |ε| over its limit, less 1.
        Strain = "strain",
        /// Contact force over its limit, less 1.
        Force = "force_N",
        /// Distances are unambiguous: 1 − a_min over the distance of the peak.
        Unambiguous = "unambiguous",
        /// 90 % of the sampled whiskers keep all of the above: the 90 % quantile of their worst.
        Samples = "samples",
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// K_sd (in the unit of the tables), total_rms_mm and the weighted sum; NaN if missing.
    pub figures: [f64; 3],
    /// By [`Limit::WORDS`]; −∞ for a limit that is off, NaN if it could not be computed.
    pub limits: [f64; Limit::WORDS.len()],
}

impl Score {
    pub const NOTHING: Self =
        Self { figures: [f64::NAN; 3], limits: [f64::NEG_INFINITY; Limit::WORDS.len()] };

    pub fn limit(&self, limit: Limit) -> f64 {
        self.limits[limit as usize]
    }

    pub fn set(&mut self, limit: Limit, value: f64) {
        self.limits[limit as usize] = value;
    }

    /// True if the gauge or a distance lies beyond the whisker, so that nothing can be computed.
    pub fn outside(&self) -> bool {
        self.limit(Limit::Gauge) > 0.0 || self.limit(Limit::Reach) > 0.0
    }

    pub fn violation(&self) -> f64 {
        self.limits.iter().filter(|v| **v > 0.0).fold(0.0, |sum, v| sum + v)
    }

    pub fn worst(&self) -> f64 {
        self.limits.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    Figure(usize),
    /// K_sd^w · total_rms^(1−w): a direction between both figures of a front.
    Blend(f64),
    /// total_rms with K_sd at most this.
    Capped(f64),
}

impl Goal {
    pub fn value(self, score: &Score) -> f64 {
        let [sd, distance, _] = score.figures;
        match self {
            Self::Figure(i) => score.figures[i],
            Self::Blend(w) => sd.powf(w) * distance.powf(1.0 - w),
            Self::Capped(_) => distance,
        }
    }

    pub fn cap(self, score: &Score) -> f64 {
        match self {
            Self::Capped(sd) => score.figures[0] / sd - 1.0,
            _ => f64::NEG_INFINITY,
        }
    }

    pub fn feasible(self, score: &Score) -> bool {
        score.violation() == 0.0 && self.cap(score) <= 0.0 && self.value(score).is_finite()
    }

    /// Compares two candidates; the better one is less.
    pub fn compare(self, a: &Score, b: &Score) -> std::cmp::Ordering {
        self.order(a).total_cmp(&self.order(b))
    }

    /// Orders candidates by the feasibility rules; smaller is better. Feasible: < 0; infeasible: in (0, 1); not a valid whisker: in (1, 2).
    pub fn order(self, score: &Score) -> f64 {
        if self.feasible(score) {
            return (-1.0 / self.value(score)).max(-f64::MAX);
        }
        let cap = self.cap(score);
        let violation = score.violation() + if cap > 0.0 { cap } else { 0.0 };
        let violation = if violation > 0.0 { violation } else { 1.0 };
        // v/(1 + v), to 1 for an infinite one.
        let share = 1.0 / (1.0 + 1.0 / violation);
        if score.outside() { 1.0 + share } else { share }
    }
}

/// Figures over the samples; limits of the nominal whisker, and the limit that 90 % of the samples keep theirs.
pub(super) fn gather(robust: &Robust, nominal: &Score, samples: &[Score]) -> Score {
    let mut score = *nominal;
    let least = |s: &Score| if s.figures.iter().all(|f| f.is_nan()) { 1.0 } else { f64::NEG_INFINITY };
    let mut worst: Vec<f64> = samples.iter().map(|s| s.worst().max(least(s))).collect();
    worst.sort_by(f64::total_cmp);
    let kept = (0.9 * worst.len() as f64).ceil() as usize;
    score.set(Limit::Samples, worst[kept - 1]);
    for (i, figure) in score.figures.iter_mut().enumerate() {
        let values: Vec<f64> = samples.iter().map(|s| s.figures[i]).filter(|f| f.is_finite()).collect();
        *figure = measure(robust.measure, values);
    }
    score
}

/// Mean, or mean of the worst tenth (R. T. Rockafellar and S. Uryasev, J. Risk 2, 2000); NaN if empty.
fn measure(measure: Measure, mut values: Vec<f64>) -> f64 {
    let n = values.len() as f64;
    match measure {
        Measure::Mean => values.iter().sum::<f64>() / n,
        Measure::Cvar90 => {
            values.sort_by(|a, b| b.total_cmp(a));
            let mass = 0.1 * n;
            let part = |(i, v): (usize, &f64)| v * (mass - i as f64).clamp(0.0, 1.0);
            values.iter().enumerate().map(part).sum::<f64>() / mass
        }
    }
}

/// Φ(−3).
const BELOW: f64 = 1.349_898_031_630_094_5e-3;

/// Standard normal deviations, truncated at ±3, by sample and column: scrambled Sobol points, the same for every candidate.
pub fn deviations(seed: u64, samples: u32) -> Vec<[f64; COLUMNS]> {
    // Whisker and drive take the first Sobol dimensions, the pole's direction the next.
    let mut columns = Column::ALL;
    columns.sort_by_key(|column| matches!(column, Column::Tilt | Column::Lean));
    let one = |i| {
        let mut z = [0.0; COLUMNS];
        (0..).zip(columns).for_each(|(dimension, column)| z[column as usize] = normal(seed, i, dimension));
        z
    };
    (0..samples).map(one).collect()
}

pub(super) fn normal(seed: u64, i: u32, dimension: u32) -> f64 {
    // Odd, because a seed of 0 does not scramble.
    let seed = seed.wrapping_mul(2).wrapping_add(1);
    let uniform = Sampler::Sobol.uniform(seed, dimension, i);
    quantile(BELOW + (1.0 - 2.0 * BELOW) * uniform)
}

/// The taps of slipped contacts are continued beyond the tip, so that figures stay smooth; a separate limit excludes them.
pub(super) fn continued(taps: &[Outcome]) -> Vec<Outcome> {
    taps.iter().map(|t| Outcome { status: t.status.without(Status::SLIPPED_OFF), ..*t }).collect()
}

/// Score of a whisker, and its K̄.
pub(super) fn read(
    judge: &Judge<'_>,
    design: &Design,
    (taps, both): (&[Outcome], &[Option<Both>]),
    told: Told<'_>,
    other: Option<&Calibration<'_>>,
) -> (Score, Option<f64>) {
    let setup = design.setup(judge.setup);
    let Tuple { D, d, L_a, x_ss, l, drive, .. } = design.tuple;
    let mut score = judge.shape(&design.tuple);
    let valid = [D, d, L_a, l].iter().all(|x| *x > 0.0) && x_ss >= 0.0;
    let Some(shared) = design.shared.as_ref().filter(|_| valid && !score.outside()) else {
        if !score.outside() {
            score.set(Limit::Solved, 1.0);
        }
        return (score, None);
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
    let nearest = taps.iter().zip(judge.distances.iter()).map(near).fold(f64::INFINITY, f64::min);
    let (estimator, drive) = other.map_or((&own, drive), |other| (&other.estimator, other.drive));
    let driven = Driven::of_users(setup.drive, drive);
    let highest = match (told, other.and_then(|other| other.curve)) {
        _ if !both.is_empty() => None,
        (_, Some(curve)) => Some((1.0, curve.peak().1)),
        (Told::Formula, None) => row.k.map(|k| (k, estimator.peak() * driven.size())),
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
    (score, row.k)
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
