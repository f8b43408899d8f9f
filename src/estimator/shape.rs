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

/// The signal that an estimator expects, and where that is smooth.
pub trait Forward {
    /// Distances, ascending, mm, between which [`Self::expected`] is smooth at drives near `drive`. The first and the last are the ends of
    /// what is answered; the last may be infinite.
    fn knots(&self, drive: f64) -> Vec<f64>;

    /// |signal| expected of a tap at a (mm) by `drive`.
    fn expected(&self, a: f64, drive: f64) -> f64;

    /// Its variance, which the noise of the calibration leaves.
    fn variance(&self, a: f64, drive: f64) -> f64;

    /// Share of the signal at the farthest distance, 0 to 1, above which a distance on the near side of the peak is ambiguous although no other
    /// one is known.
    fn alone(&self) -> f64 {
        1.0
    }
}
