//! What an estimator is made of, for whoever writes it down in another form.

use super::learnt::Inverted;
use super::model::polynomial::Polynomial;

/// What answers one side.
pub enum Shape<'a> {
    /// Distance as a polynomial of signal and drive.
    Direct(&'a Polynomial),
    /// Signal as a function of distance and drive, read backwards.
    Inverted(&'a dyn Forward),
    /// The posterior of a learned curve, from a table.
    Learned(&'a Inverted),
}

impl<'a> Shape<'a> {
    /// The learned curve, if it is one.
    pub fn learned(self) -> Option<&'a Inverted> {
        match self {
            Self::Learned(curve) => Some(curve),
            _ => None,
        }
    }
}

/// How sure an estimator is of the signal that it expects.
pub trait Forward {
    /// Variance of the signal expected of a tap at a (mm) by `drive`, which the noise of the calibration leaves.
    fn variance(&self, a: f64, drive: f64) -> f64;
}
