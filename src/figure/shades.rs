//! What the colours of a map mean.

use super::colour::{self, Rgb};
use super::data::Cells;
use super::scale::Scale;

/// Different values of which each has a colour of its own; more are a scale.
const FEW: usize = 6;

/// Colours of values.
#[derive(Debug, Clone, PartialEq)]
pub enum Shades {
    /// Of any value between two ends.
    Scale(Scale),
    /// Of these values alone, ascending: equal steps of colour.
    Bands(Vec<f64>),
}

impl Shades {
    /// Those of a map: bands where it has few values.
    pub fn of(cells: &Cells) -> Self {
        let mut values: Vec<f64> = cells.z.iter().copied().filter(|z| z.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|b, a| *b - *a <= 1e-9 * a.abs().max(b.abs()));
        match values.len() {
            1..=FEW => Self::Bands(values),
            _ => Self::Scale(Scale::tight(&cells.of, cells.z.iter().copied())),
        }
    }

    /// Colour of `z`.
    pub fn colour(&self, z: f64) -> Rgb {
        colour::along(match self {
            Self::Scale(scale) => scale.share(z),
            Self::Bands(values) => {
                let off = |i: &usize| (values[*i] - z).abs();
                let nearest = (0..values.len()).min_by(|i, j| off(i).total_cmp(&off(j))).unwrap_or(0);
                nearest as f64 / (values.len().max(2) - 1) as f64
            }
        })
    }
}
