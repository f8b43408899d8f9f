//! A tap and its outcome.

use crate::design::Design;
use crate::error::SolveError;
use crate::physics::driven::Driven;
use crate::scene::{Direction, Setup, Tuple};
use crate::status::Status;

/// A contact is far at this multiple of the distance of the gauge's far end, and of the base diameter, from the base.
const FAR: f64 = 1.5;

/// One tap of one design of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Task {
    /// Place of the design in the batch.
    pub design: u32,
    /// Contact distance, mm.
    pub a: f64,
    /// Direction of the pole.
    pub direction: Direction,
    /// Tap angle, degrees, or displacement, mm: the user's number, as tuples and tables repeat it digit by digit. [`Self::driven`] converts it.
    pub drive: f64,
}

impl Task {
    /// The tap `t` of the design at place `design` of the batch.
    pub fn of(design: u32, t: &Tuple) -> Self {
        Self { design, a: t.a, direction: t.direction(), drive: t.drive }
    }

    /// Its drive, in a rig of `setup`.
    pub fn driven(&self, setup: &Setup) -> Driven {
        Driven::of_users(setup.drive, self.drive)
    }

    /// True if bending may leave the plane: at a tilted pole, or with a second gauge.
    pub(super) fn is_spatial(&self, setup: &Setup) -> bool {
        setup.gauge.second || !self.direction.is_upright()
    }

    /// True if the contact is so far from gauge and base that kernels solve every tap that has a solution.
    pub fn is_far(&self, design: &Design) -> bool {
        let x2 = design.shared.as_ref().map_or(f64::INFINITY, |shared| shared.gauge[1]);
        self.a > FAR * x2.max(design.tuple.D)
    }
}

/// Outcomes of taps, in their order.
pub type Outcomes = Result<Vec<Outcome>, SolveError>;

/// The results of a tap; NaN where undefined.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outcome {
    /// Signed gauge strain.
    pub strain: f64,
    /// Signed strain of the second gauge; NaN without one.
    pub strain_2: f64,
    /// Signed strain of the estimator's theory, ±θ f.
    pub strain_linear: f64,
    /// K − 1 at full relative precision.
    pub deviation: f64,
    /// P, N.
    pub normal_force: f64,
    /// T, N.
    pub tangential_force: f64,
    /// c, mm.
    pub arc: f64,
    /// Wrench of the whisker on its root: M₀, N mm, F_x and F_y, N; NaN if not computed.
    pub wrench: [f64; 3],
    /// Azimuth φ of the plane in which the whisker bends, rad; NaN if not computed.
    pub azimuth: f64,
    /// Slide λ of the contact along the pole, mm; NaN if not computed.
    pub slide: f64,
    /// Mean strain of the centreline over the gauge; NaN in plane, and from charts.
    pub axial: f64,
    /// True if the contact sticks.
    pub sticking: bool,
    /// Kernel sweeps spent.
    pub sweeps: f32,
    /// Answered by the reference in a kernel's place.
    pub referred: bool,
    /// Words of the physics; the estimate adds more.
    pub status: Status,
}

impl Outcome {
    /// Size of the strain: of both gauges, where there are two.
    pub fn magnitude(&self) -> f64 {
        if self.strain_2.is_nan() { self.strain.abs() } else { self.strain.hypot(self.strain_2) }
    }

    /// cos β̂, where tan β̂ = ε₂/ε₁; 1 of one gauge.
    pub fn cosine(&self) -> f64 {
        if self.strain_2.is_nan() { 1.0 } else { self.strain.abs() / self.magnitude() }
    }

    /// No values, and no status.
    pub const NOTHING: Self = Self {
        strain: f64::NAN,
        strain_2: f64::NAN,
        strain_linear: f64::NAN,
        deviation: f64::NAN,
        normal_force: f64::NAN,
        tangential_force: f64::NAN,
        arc: f64::NAN,
        wrench: [f64::NAN; 3],
        azimuth: f64::NAN,
        slide: f64::NAN,
        axial: f64::NAN,
        sticking: false,
        sweeps: 0.0,
        referred: false,
        status: Status::OK,
    };

    /// The outcome of a tap outside the domain.
    pub const OUTSIDE: Self = Self { status: Status::INVALID_GEOMETRY, ..Self::NOTHING };
}
