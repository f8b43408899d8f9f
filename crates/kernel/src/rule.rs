//! Resolution of a tap: nodes, polynomial terms, sweeps.

use super::Effects;
use vibrissa_core::scene::Precision;

/// One rung of the ladder that hard taps climb.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Rule {
    /// Gauss–Legendre nodes n between contact and base.
    pub nodes: usize,
    /// Terms of the series of 1 − cos ψ and ψ − sin ψ.
    pub terms: usize,
    /// Full Newton: the lag settles between steps, and the Jacobian includes its response. Slower, but solves taps on which one step per sweep
    /// diverges, such as a sticking contact next to a fine tip. In f64 on the CPU only.
    pub full: bool,
    /// Most sweeps before a tap counts as not converged on this rung.
    pub sweeps: u32,
}

impl Rule {
    /// Least number of sweeps: several where the first-order solution leaves out effects that do not vanish with the angle, since K − K₀ ~ θ² must be
    /// right relative to itself; a nonlinear law at a fine tolerance takes one more.
    pub fn least(effects: &Effects, tolerance: f64) -> u32 {
        match (effects.plain(), effects.law && tolerance < FINE) {
            (true, _) => 1,
            (_, false) => 3,
            (_, true) => 4,
        }
    }

    /// Sweeps per Newton step.
    pub fn settle(&self) -> u32 {
        if self.full { 4 } else { 1 }
    }

    /// Iterations for the lag's part of the Jacobian.
    pub fn passes(&self) -> u32 {
        if self.full { 8 } else { 0 }
    }

    /// Largest contraction rate of a Newton step that is believed when the remaining error is extrapolated. Steps of full Newton that do not shrink any
    /// more are rounding noise.
    pub fn largest_rate(&self) -> f64 {
        if self.full { 0.5 } else { 0.9 }
    }

    /// Smallest contraction rate that is believed: steps of full Newton shrink faster than the error left in the lag.
    pub fn smallest_rate(&self) -> f64 {
        if self.full { 0.5 } else { 0.05 }
    }

    /// Share of the tolerance at which the iteration stops; the rest is for truncation and for optimism. With any effect the lag converges later than the
    /// steps; full Newton has nodes to spare.
    pub fn stop(&self, effects: &Effects) -> f64 {
        match (self.full, effects.plain()) {
            (true, _) => 0.5,
            (false, true) => 0.1,
            (false, false) => 0.05,
        }
    }

    /// Gauss points on the gauge: the mean of a polynomial of degree n times (1 − τs)^(-3/2) is then exact.
    pub fn gauge_points(&self) -> usize {
        self.nodes / 2 + 2
    }

    /// Largest |ψ| (rad) for which `terms` terms of both series suffice; a tap that bends further climbs. Beyond 2 rad a rod has several equilibria,
    /// and only the path from the unloaded one decides.
    pub fn max_angle(&self) -> f64 {
        if self.terms < 9 { 1.0 } else { 2.0 }
    }

    /// Least 1 − τa that few nodes serve with an offset force: next to the apex the radius enters with a high power.
    pub fn least_rest(&self) -> f64 {
        let first = [Precision::F32, Precision::F64].iter().any(|p| every_rule(*p).first() == Some(self));
        if first { limits::SHARP } else { 0.0 }
    }
}

/// Tolerances below this are for the sake of K − K₀ in f32.
const FINE: f64 = 5e-6;

/// Smallest tolerance that `precision` reaches on every configuration: charts of section laws end above 1e-11.
pub fn smallest_tolerance(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => 1e-6,
        Precision::F64 => 1e-10,
    }
}

/// Rungs for `tolerance` in `precision`, cheapest first.
pub fn ladder(precision: Precision, tolerance: f64) -> Vec<Rule> {
    let all = every_rule(precision);
    match precision {
        Precision::F32 if tolerance < FINE => all[1..].to_vec(),
        Precision::F64 if tolerance < 1e-8 => all[1..].to_vec(),
        _ => all,
    }
}

/// All rungs with compiled kernels. In f32 fewer terms suffice; 5 hold to 1 rad, which most taps never reach. Full Newton is CPU only: a device would
/// compile that kernel longer than all its others, for few taps.
pub fn every_rule(precision: Precision) -> Vec<Rule> {
    let rule = |nodes, terms, full, sweeps| Rule { nodes, terms, full, sweeps };
    match precision {
        Precision::F32 => vec![rule(6, 5, false, 8), rule(10, 9, false, 40)],
        Precision::F64 => vec![rule(10, 14, false, 16), rule(16, 14, false, 60), rule(24, 14, true, 120)],
    }
}

/// Largest axial strain, and largest bending strain b₀ + b₁ t.
pub type Range = (f64, [f64; 2]);

/// Ranges of section charts. Most whiskers stay within the first; the last reaches to the ends of a material's range.
pub const CHART_RANGES: [Range; 3] = [(0.04, [0.15, 0.0]), (0.08, [0.3, 0.4]), (0.15, [0.9, 0.0])];

/// Shares of the tolerance: where a chart is cut, and its largest error before its range is shortened.
pub const COARSE_SHARES: [f64; 2] = [0.02, 0.2];

/// The range of the section chart on this rung, as a list of one, and its shares of the tolerance: half the coarse one, beyond which sticking contacts
/// climb. Taps climb to the second rung also because bending and the force along the whisker nearly cancel at the gauge: that amplifies both errors.
pub fn charted(precision: Precision, rule: &Rule) -> (&'static [Range], [f64; 2]) {
    let place = every_rule(precision).iter().position(|r| r == rule).unwrap_or(2).min(2);
    let [cut, allowed] = COARSE_SHARES;
    (&CHART_RANGES[place..=place], [if place == 1 { 0.002 } else { 0.5 * cut }, allowed])
}

/// Guards of the iteration, the same numbers on every backend.
pub mod limits {
    macro_rules! named {
        ($($(#[$doc:meta])+ $name:ident = $x:expr;)+) => {
            $($(#[$doc])+ pub const $name: f64 = $x;)+

            /// All of these, by the names they have in the shaders.
            pub const NAMED: [(&str, f64); 19] = [$((stringify!($name), $name)),+];
        };
    }

    named! {
        /// Least (1 − τc)/(1 − τa) while iterating: keeps the contact on this side of the apex.
        APEX = 1e-3;
        /// Least c/a − 1 while iterating.
        LEAST_ARC = -0.5;
        /// Largest c/a − 1 while iterating.
        MOST_ARC = 2.0;
        /// Least W/W₀ − 1 while iterating.
        LEAST_FORCE = -0.95;
        /// Largest W/W₀ − 1 while iterating.
        MOST_FORCE = 20.0;
        /// Least share of the expected change of a step that is believed, with friction or a radius.
        CHANCE = 0.25;
        /// Distance of a contact beyond a gauge it started on, per length of the gauge, from which on it counts as clear of it.
        LEFT = 0.25;
        /// Growth of the distance between contact and gauge from which on a step may be small by chance.
        GROWN = 2.0;
        /// Largest growth of the lever; the kernel takes larger ones for this.
        MOST_GROWTH = 1e10;
        /// Error from which on an iteration has not come near any equilibrium.
        ASTRAY = 1e-2;
        /// Least W/W₀ − 1 of a sticking contact, which may pull, while iterating.
        MOST_PULL = -20.0;
        /// Error of a tap at an equilibrium beyond what the kernel can tell: the range of its series or of its chart, or a fold of the path.
        HOPELESS = 1e9;
        /// Error of an iteration that has gone astray as far.
        LOST = 1e12;
        /// Roundings that add up in a residual of the closure, at most.
        ROUNDINGS = 16.0;
        /// Roundings of the arc where no Jacobian tells how they show.
        ARC_ROUNDINGS = 30.0;
        /// Below every number of interest and above underflow in f32.
        TINY = 1e-20;
        /// Weight of the tail of the height's integrand, which the gauge interpolates, in the truncation error.
        HEIGHT_TAIL = 0.005;
        /// Weight of the tail of the bending integrand (to the power 3/2) in the truncation error.
        BENDING_TAIL = 0.05;
        /// Weight of the tail of the shortening integrand in the truncation error.
        SHORTENING_TAIL = 0.01;
    }

    /// Least 1 − τa on the first rung with friction or a radius.
    pub const SHARP: f64 = 0.1;
    /// Largest change of w in a step of full Newton, relative to 1 + |w|.
    pub const LONGEST_STEP: f64 = 0.5;
    /// The reference decides whether the material ends if a fibre's load is this close to 1.
    pub const EDGE: f64 = 0.02;
}
