//! What a chart holds where the plane of bending is asked for (model §6): the second gauge's strain, φ and λ, each less what linear theory has.

use std::sync::atomic::AtomicBool;

use super::axis::{AXES, Axis, Quantity};
use super::build::{Bound, Built, build};
use super::distance::{DistanceChart, FUNCTIONS, room};
use super::taps::Taps;
use crate::error::SolveError;
use crate::evaluate::{Outcome, beside_linear, path};
use crate::reduce::Sweeps;
use crate::scene::{Direction, Drive, Setup};
use crate::status::Status;

/// Box and series over `axes` of what linear theory lacks, over driveᵉ, e = `power`, each good to `error`.
pub fn branch(
    setup: &Setup,
    (a, direction): (f64, Direction),
    axes: [Axis; AXES],
    (power, error, solved, stop): (i32, f64, f64, &AtomicBool),
    sweeps: &mut Sweeps,
) -> Result<Option<Built<FUNCTIONS>>, SolveError> {
    let mut taps = Taps::new(setup, a, None, solved).towards(direction).stopping(stop);
    let known = beside_linear(direction);
    let bad = Status::NOT_CONVERGED | Status::MATERIAL_LIMIT | Status::NO_STRAIN | Status::INVALID_GEOMETRY;
    let value = |q: &[f64; AXES], o: &Outcome| -> Option<[f64; FUNCTIONS]> {
        let drive = q[Quantity::Drive as usize];
        let moved = path(setup, a) * if setup.drive == Drive::Angle { drive } else { drive * a };
        let found = [o.strain_2 / o.strain_linear, o.azimuth, o.slide / moved];
        let rooms = [room(q), 1.0, 1.0];
        let values: [f64; FUNCTIONS] =
            std::array::from_fn(|f| rooms[f] * (found[f] - known[f]) / drive.powi(power));
        Some(values).filter(|v| !o.status.has(bad) && v.iter().all(|v| v.is_finite()))
    };
    let bounds = [Bound::of(error); FUNCTIONS];
    let built = build(axes, &bounds, &mut |q| {
        let found = taps.solve(q)?;
        Ok(q.iter().zip(&found).map(|(q, o)| value(q, o)).collect())
    })?;
    sweeps.merge(&taps.sweeps);
    Ok(built)
}

impl DistanceChart {
    /// Its functions beside the first gauge's as a chart of their own, where it has any.
    pub fn beside(&self) -> Option<Self> {
        let built = self.beside.clone()?;
        Some(Self { branches: vec![built], ratios: Vec::new(), beside: None, ..self.clone() })
    }
}
