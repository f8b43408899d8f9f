//! How finely a tap is solved: nodes, polynomial terms, sweeps.

use super::Effects;
use crate::scene::Precision;

/// One rung of the ladder that hard taps climb.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Rule {
    /// Gauss–Legendre nodes n between contact and base.
    pub nodes: usize,
    /// Terms of the series of 1 − cos ψ and ψ − sin ψ.
    pub terms: usize,
    /// Newton steps of a sticking contact are halved: slower, but it reaches taps on which full steps overshoot.
    pub damped: bool,
    /// Most sweeps before a tap counts as not converged on this rung.
    pub sweeps: u32,
}

impl Rule {
    /// Share of a Newton step that is taken.
    pub fn relaxation(&self, effects: &Effects) -> f64 {
        if self.damped && effects.stick { 0.5 } else { 1.0 }
    }

    /// Gauss points on the gauge: the mean of a polynomial of degree n times (1 − τs)^(-3/2) is then exact.
    pub fn gauge_points(&self) -> usize {
        self.nodes / 2 + 2
    }

    /// Largest |ψ| (rad) at which `terms` terms of both series reach the precision they are meant for; a tap that bends further
    /// climbs.
    pub fn max_angle(&self) -> f64 {
        match self.terms {
            ..9 => 1.0,
            _ => 3.2,
        }
    }
}

/// Smallest tolerance that `precision` reaches on every configuration.
pub fn smallest_tolerance(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => 1e-6,
        Precision::F64 => 1e-11,
    }
}

/// Rungs for `tolerance` in `precision`, cheapest first.
pub fn ladder(precision: Precision, tolerance: f64) -> Vec<Rule> {
    let all = every_rule(precision);
    match precision {
        Precision::F32 if tolerance < 5e-6 => all[1..].to_vec(),
        Precision::F64 if tolerance < 1e-8 => all[1..].to_vec(),
        _ => all,
    }
}

/// All rungs that kernels are compiled for. f32 needs fewer terms; 5 of them hold to 1 rad, which most taps never reach.
pub fn every_rule(precision: Precision) -> Vec<Rule> {
    let rule = |nodes, terms, damped, sweeps| Rule { nodes, terms, damped, sweeps };
    match precision {
        Precision::F32 => vec![rule(6, 5, false, 8), rule(10, 9, false, 40), rule(16, 9, true, 80)],
        Precision::F64 => vec![rule(10, 14, false, 16), rule(16, 14, false, 60), rule(24, 14, true, 120)],
    }
}

/// Range of the section chart on rung `rung` of every rule: largest axial strain, and largest bending strain b₀ + b₁ t. Most
/// whiskers stay within the first; the last reaches to the ends of the material's range.
pub fn chart_range(precision: Precision, rule: &Rule) -> (f64, [f64; 2]) {
    match every_rule(precision).iter().position(|r| r == rule) {
        Some(0) => (0.04, [0.15, 0.0]),
        Some(1) => (0.08, [0.3, 0.4]),
        _ => (0.15, [0.5, 0.9]),
    }
}

/// Guards of the iteration, the same numbers on every backend.
pub mod limits {
    /// Least (1 − τc)/(1 − τa) while iterating: keeps the contact on this side of the apex.
    pub const APEX: f64 = 1e-3;
    /// Least c/a − 1 while iterating.
    pub const LEAST_ARC: f64 = -0.5;
    /// Largest c/a − 1 while iterating.
    pub const MOST_ARC: f64 = 2.0;
    /// Least W/W₀ − 1 while iterating.
    pub const LEAST_FORCE: f64 = -0.95;
    /// Largest W/W₀ − 1 while iterating.
    pub const MOST_FORCE: f64 = 20.0;
    /// Largest contraction rate believed when the remaining error is extrapolated.
    pub const LARGEST_RATE: f64 = 0.9;
    /// Smallest contraction rate believed.
    pub const SMALLEST_RATE: f64 = 0.05;
    /// Largest growth of the lever that is told apart.
    pub const MOST_GROWTH: f64 = 1e10;
    /// Share of the tolerance at which the iteration stops; the rest is for truncation and for optimism.
    pub const STOP: f64 = 0.1;
    /// Error of a tap whose angle lies outside the range of the series.
    pub const HOPELESS: f64 = 1e9;
    /// Below every number of interest and above underflow in f32.
    pub const TINY: f64 = 1e-20;

    /// Weight of the tail of the bending integrand (to the power 3/2) in the truncation error.
    pub const BENDING_TAIL: f64 = 0.05;
    /// Weight of the tail of the shortening integrand in the truncation error.
    pub const SHORTENING_TAIL: f64 = 0.01;

    /// All, by the names they have in the shaders.
    pub const NAMED: [(&str, f64); 13] = [
        ("APEX", APEX),
        ("LEAST_ARC", LEAST_ARC),
        ("MOST_ARC", MOST_ARC),
        ("LEAST_FORCE", LEAST_FORCE),
        ("MOST_FORCE", MOST_FORCE),
        ("LARGEST_RATE", LARGEST_RATE),
        ("SMALLEST_RATE", SMALLEST_RATE),
        ("STOP", STOP),
        ("MOST_GROWTH", MOST_GROWTH),
        ("HOPELESS", HOPELESS),
        ("TINY", TINY),
        ("BENDING_TAIL", BENDING_TAIL),
        ("SHORTENING_TAIL", SHORTENING_TAIL),
    ];
}
