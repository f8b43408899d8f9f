//! The paper's distance estimate, f(â) = K̄ |ε|/θ, its error and its noise (model §4).

use crate::design::Shared;
use crate::physics::driven::Driven;
use crate::scene::{Convention, Setup};
use crate::status::Status;

/// Relative widening of the range of interest, in which a second root makes an estimate ambiguous.
pub const WIDENING: f64 = 1e-6;

/// Farthest root, over L_a, of a tap beyond the peak of f, where f levels off: no error of a calibration leads farther.
pub const FAR: f64 = 2.0;

/// An estimated distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimated {
    /// â, mm; NaN where no distance gives the reading.
    pub distance: f64,
    /// σ_a = K̄ σ_ε/(θ |f′(â)|), mm.
    pub sigma: f64,
    /// Contact force, N; NaN with a single channel.
    pub force: f64,
    /// `no_root`, `ambiguous` (a second root may be the contact), `outside_calibration` (see [`Estimator::estimate`]), or ok.
    pub status: Status,
}

impl Estimated {
    /// No distance and no status word.
    pub const NOTHING: Self =
        Self { distance: f64::NAN, sigma: f64::NAN, force: f64::NAN, status: Status::OK };

    /// No distance gives the reading.
    pub const NO_ROOT: Self = Self { status: Status::NO_ROOT, ..Self::NOTHING };
}

/// Estimator of one design.
#[derive(Debug, Clone, Copy)]
pub struct Estimator<'a> {
    /// Curves of the design.
    pub shared: &'a Shared,
    noise: f64,
    range: [f64; 2],
    /// Length by which K is multiplied in the tables: 1, or x2 − x1 for elongation.
    pub k_unit: f64,
    /// `[estimate] K`, without unit.
    pub fixed: Option<f64>,
}

impl<'a> Estimator<'a> {
    /// `reach`: smallest and largest distance asked of this design, mm.
    pub fn new(setup: &Setup, shared: &'a Shared, reach: [f64; 2]) -> Self {
        let [lo, hi] = setup.estimate.range.unwrap_or(reach);
        let [x1, x2] = shared.gauge;
        let k_unit = if setup.estimate.convention == Convention::Mean { 1.0 } else { x2 - x1 };
        Self {
            shared,
            noise: setup.gauge.noise_strain.unwrap_or(0.0),
            range: [lo * (1.0 - WIDENING), hi * (1.0 + WIDENING)],
            k_unit,
            fixed: setup.estimate.k.map(|k| k / k_unit),
        }
    }

    /// Largest strain per unit of drive that has a distance.
    pub fn peak(&self) -> f64 {
        self.shared.theory.peak().1
    }

    /// K̄ of a row from the mean of its K − 1: the given K, else the mean of two or more taps.
    pub fn calibration(&self, n: u64, mean_deviation: Option<f64>) -> Option<f64> {
        self.fixed.or(mean_deviation.filter(|_| n >= 2).map(|m| 1.0 + m))
    }

    /// Distance from |ε| = `strain` of a tap at `a` mm, `driven`, with the calibration `k`. Where f levels off a
    /// single root is `outside_calibration` beyond the tip if the tap is before the peak of f, else beyond [`FAR`].
    pub fn estimate(&self, k: f64, strain: f64, driven: Driven, a: f64) -> Estimated {
        let Some(roots) = self.shared.theory.roots_in(k * strain / driven.size(), self.range) else {
            return Estimated::NO_ROOT;
        };
        let slope = self.shared.theory.curve().slope(roots.far);
        let told = self.estimated(roots.far, driven.size() * slope / k, roots.near, roots.unseen);
        let (length, its_own) = (self.shared.length, a > self.shared.theory.peak().0);
        let farthest = if its_own { FAR * length } else { length * (1.0 + WIDENING) };
        let outside = told.status == Status::OK && roots.levels_off && roots.far > farthest;
        if outside { Estimated { status: Status::OUTSIDE_CALIBRATION, ..told } } else { told }
    }

    /// True for a distance in the range of interest.
    pub fn interesting(&self, a: f64) -> bool {
        a >= self.range[0] && a <= self.range[1]
    }

    /// The estimate `a` mm, where |ε| has the slope `slope` (1/mm); `second` is another distance with the same strain, `unseen` if there may be one
    /// beyond the farthest known.
    pub fn estimated(&self, a: f64, slope: f64, second: Option<f64>, unseen: bool) -> Estimated {
        let sigma = if self.noise == 0.0 { 0.0 } else { self.noise / slope.abs() };
        let twice = unseen || second.is_some_and(|a| self.interesting(a));
        let status = if twice { Status::AMBIGUOUS } else { Status::OK };
        Estimated { distance: a, sigma, status, ..Estimated::NOTHING }
    }
}
