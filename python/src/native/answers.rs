//! What is told of taps.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use vibrissa::api::Outcome;
use vibrissa::evaluate::OUTPUTS;

use super::words::bits;

/// What is told of a tap: strain, that of the estimator's theory, K − 1, P, T, arc, strain of the second gauge, azimuth (degrees) and slide;
/// words as bits, and whether it sticks.
pub type Told = ([f64; NUMBERS], u16, bool);

pub const NUMBERS: usize = OUTPUTS;

pub fn numbers_of(o: &Outcome) -> Told {
    let upright = [o.strain, o.strain_linear, o.deviation, o.normal_force, o.tangential_force, o.arc];
    let [strain, linear, deviation, normal, tangential, arc] = upright;
    let azimuth = o.azimuth.to_degrees();
    let numbers = [strain, linear, deviation, normal, tangential, arc, o.strain_2, azimuth, o.slide];
    (numbers, bits(o.status), o.sticking)
}

/// What is told of taps, by columns.
pub struct Answers {
    numbers: [Vec<f64>; NUMBERS],
    status: Vec<u16>,
    sticking: Vec<bool>,
}

impl Answers {
    pub fn new(n: usize) -> Self {
        let numbers = std::array::from_fn(|_| Vec::with_capacity(n));
        Self { numbers, status: Vec::with_capacity(n), sticking: Vec::with_capacity(n) }
    }

    pub fn push<'a>(&mut self, some: impl Iterator<Item = &'a Told>) {
        for (numbers, status, sticking) in some {
            self.numbers.iter_mut().zip(numbers).for_each(|(column, x)| column.push(*x));
            self.status.push(*status);
            self.sticking.push(*sticking);
        }
    }

    pub fn into_arrays(self, py: Python<'_>) -> PyResult<Bound<'_, PyTuple>> {
        let numbers = self.numbers.into_iter().map(|column| PyArray1::from_vec(py, column).into_any());
        let mut all: Vec<_> = numbers.collect();
        let last = all.split_off(6);
        all.push(PyArray1::from_vec(py, self.status).into_any());
        all.push(PyArray1::from_vec(py, self.sticking).into_any());
        all.extend(last);
        PyTuple::new(py, all)
    }
}
