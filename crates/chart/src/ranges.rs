//! Ranges of the designs, and the box of a chart that holds them.

use super::axis::{AXES, FIRST_PLACE};
use crate::physics::{driven::Driven, solid::Held, taper::Taper};
use crate::scene::built::Profile;
use crate::scene::{Column, Drive, Layout, Setup};

/// Largest x2/a of a charted tap: nearer contacts are solved.
pub const NEAREST: f64 = 0.9;

/// Relative slack of the box: sums of decimal numbers.
const SLACK: f64 = 1e-9;

/// Smallest and largest D, d, L_a, x_ss and l, mm, and drive, degrees or mm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(non_snake_case)]
pub struct Wanted {
    /// Base diameter D.
    pub D: [f64; 2],
    /// Tip diameter d.
    pub d: [f64; 2],
    /// Length L_a.
    pub L_a: [f64; 2],
    /// Gauge position x_ss.
    pub x_ss: [f64; 2],
    /// Gauge length l.
    pub l: [f64; 2],
    /// θ or δ.
    pub drive: [f64; 2],
}

impl Wanted {
    /// Ranges of the designs of `layout`.
    pub fn of(layout: &Layout) -> Self {
        let drive = layout.bounds(Column::Drive);
        let [base, tip, length, x_ss, grid] = std::array::from_fn(|k| layout.bounds(Column::ALL[k]));
        Self { D: base, d: tip, L_a: length, x_ss, l: grid, drive }
    }

    /// Ranges of drive (rad or mm), lengths of the rig, D, τ and gauge points (with a foil their middles), for whiskers that reach `far` mm and
    /// gauges that end before `gauge_end`; and the largest x2 − x1. `None` if empty.
    pub fn ranges(&self, setup: &Setup, far: f64, gauge_end: f64) -> Option<([[f64; 2]; AXES], f64)> {
        let longest = self.L_a.map(|length| length.max(far));
        // τ and tan α are monotonic in each of D, d and L_a.
        let (mut tau, mut steepest) = ([f64::INFINITY, f64::NEG_INFINITY], 0.0f64);
        for big in self.D {
            for small in self.d {
                for length in longest {
                    let taper = Taper::new(big, small, length);
                    tau = [tau[0].min(taper.tau), tau[1].max(taper.tau)];
                    steepest = steepest.max(taper.tan_alpha.abs());
                }
            }
        }
        let tau = [tau[0].max(-1.0 / far), tau[1].min(0.99 / far)];
        let shortest = self.l[0] / steepest.hypot(1.0);
        let [first, last] = [self.x_ss[0], (self.x_ss[1] + self.l[1]).min(gauge_end)];
        let place = match setup.gauge.foil {
            None => [first, last],
            // A chart holds grids of one length by their middle. Their foils lie between the clamp and the last end of a gauge.
            Some(_) if self.l[0] < self.l[1] => return None,
            Some(foil) => {
                let begins = Held::new(&setup.model).c0.max(0.0) * self.D[1] + FIRST_PLACE * far;
                let middles = [first + 0.5 * shortest, self.x_ss[1] + 0.5 * self.l[1]];
                [middles[0].max(begins + 0.5 * foil.length), middles[1].min(gauge_end - 0.5 * foil.length)]
            }
        };
        let drive = self.drive.map(|drive| Driven::of_users(setup.drive, drive).size());
        // A profile other than a cone depends on the length: charts are of one length.
        let length = match shaped(setup) {
            true if self.L_a[0] < self.L_a[1] => return None,
            true => self.L_a,
            false => [0.0; 2],
        };
        let ranges = [drive, length, self.D, tau, place];
        let whole = ranges.iter().all(|[lo, hi]| lo.is_finite() && lo <= hi);
        (whole && drive[0] > 0.0 && shortest > 0.0 && self.D[0] > 0.0).then_some((ranges, self.l[1]))
    }
}

/// True if the whiskers of `setup` have a profile other than a cone, which depends on their length.
pub fn shaped(setup: &Setup) -> bool {
    setup.built.as_ref().is_some_and(|built| built.profile != Profile::Power(1.0))
}

/// The range, widened by rounding slack.
pub fn slackened([lo, hi]: [f64; 2]) -> [f64; 2] {
    let slack = SLACK * lo.abs().max(hi.abs());
    [lo - slack, hi + slack]
}

/// True if `value` lies in the range, or within its slack.
pub fn holds(range: [f64; 2], value: f64) -> bool {
    let [lo, hi] = slackened(range);
    value >= lo && value <= hi
}

/// Ranges of quantities at `a` from numbers in mm.
pub fn scaled(kind: Drive, numbers: &[[f64; 2]; AXES], a: f64) -> [[f64; 2]; AXES] {
    let factors = factors(kind, a);
    std::array::from_fn(|k| numbers[k].map(|x| x * factors[k]))
}

/// Quantities at `a` over drive, a length of the rig, D, τ and x.
pub fn factors(kind: Drive, a: f64) -> [f64; AXES] {
    let drive = if kind == Drive::Angle { 1.0 } else { 1.0 / a };
    [drive, 1.0 / a, 1.0 / a, a, 1.0 / a]
}
