//! Chart functions for a tilted pole or a second gauge (model §6): the second gauge's strain, φ and λ, each less its value in linear theory.

use std::sync::atomic::AtomicBool;

use super::axis::{AXES, Axis, Quantity};
use super::build::{Bound, Built};
use super::distance::{DistanceChart, FUNCTIONS, room};
use super::taps::{Taps, amount};
use crate::error::SolveError;
use crate::evaluate::{Outcome, beside_linear, path};
use crate::reduce::Sweeps;
use crate::scene::{Direction, Setup};
use crate::status::Status;

/// Charts them over `axes`, divided by driveᵉ, e = `power`, each to `error`.
pub fn branch(
    setup: &Setup,
    (a, direction): (f64, Direction),
    axes: [Axis; AXES],
    (power, error, solved, stop): (i32, f64, f64, &AtomicBool),
    sweeps: &mut Sweeps,
) -> Result<Option<Built<FUNCTIONS>>, SolveError> {
    let known = beside_linear(direction);
    let value = |q: &[f64; AXES], o: &Outcome| -> Option<[f64; FUNCTIONS]> {
        let found =
            [o.strain_2 / o.strain_linear, o.azimuth, o.slide / (path(setup, a) * amount(setup, a, q))];
        let (rooms, scale) = ([room(q), 1.0, 1.0], q[Quantity::Drive as usize].powi(power));
        let values = std::array::from_fn(|f| rooms[f] * (found[f] - known[f]) / scale);
        (!o.status.has(Status::NO_READING)).then_some(values)
    };
    let taps = Taps::new(setup, a, None, solved).towards(direction).stopping(stop);
    taps.built(axes, &[Bound::of(error); FUNCTIONS], value, sweeps)
}

impl DistanceChart {
    /// The second gauge's functions as a separate chart; None without a second gauge.
    pub fn beside(&self) -> Option<Self> {
        let built = self.beside.clone()?;
        Some(Self { branches: vec![built], ratios: Vec::new(), beside: None, ..self.clone() })
    }
}
