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

#[cfg(test)]
mod tests {
    use super::super::data::{Axis, Figure, Mark, Panel};
    use super::super::drawing::Item;
    use super::super::{Style, sheet};
    use super::*;

    #[test]
    fn a_map_of_three_values_has_three_colours() {
        let cells = |z: Vec<f64>| Cells {
            x: (0..=z.len()).map(|i| i as f64).collect(),
            y: vec![0.0, 1.0],
            z,
            of: Axis::new("v", ""),
        };
        let colours = |z: Vec<f64>| {
            let panel = Panel::new("", Axis::new("x", ""), Axis::new("y", "")).with(Mark::Cells(cells(z)));
            let d = sheet::lay(&Figure::new("f", "F", "", vec![panel]), &Style::default());
            let fills = d.items.into_iter().filter_map(|item| match item {
                Item::Path { fill, clip: Some(_), .. } => fill,
                _ => None,
            });
            fills.collect::<std::collections::HashSet<_>>()
        };
        // Of the map and of the scale beside it; values that differ in their last digit are one.
        for third in [3.0, 3000.0] {
            let z = vec![1.0, 2.0, third, 2.0, 2.0 * (1.0 + f64::EPSILON), f64::NAN, 1.0];
            assert_eq!(colours(z).len(), 3);
        }
        assert_eq!(colours(vec![5.0; 4]).len(), 1);
        assert!(colours((0..20).map(f64::from).collect()).len() > 20);
        let Shades::Bands(values) = Shades::of(&cells(vec![7.0, 1.0, 7.0])) else { panic!("bands") };
        assert_eq!(values, [1.0, 7.0]);
    }
}
