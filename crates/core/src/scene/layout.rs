//! Index ↔ tuple, without listing the tuples.
//!
//! A grid is designs × distances × drives, last fastest: the tap (i, j) of design k has the index
//! (k · distances + i) · drives + j. A drive that is sampled together with a design's axes belongs to that design.

use std::sync::OnceLock;

use super::axis::Axis;
use super::space::{Column, Factor, Tuple};

/// A grid of taps.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    designs: Vec<Factor>,
    distance: Axis,
    reach: OnceLock<[f64; 2]>,
    drive: Option<Axis>,
    /// Number of designs.
    pub n_designs: u64,
    /// Distances of each design.
    pub n_distances: u64,
    /// Drives of each design; 1 where the drive is sampled with the design.
    pub n_drives: u64,
}

impl Layout {
    /// From the factors of a grid space, in row order.
    pub fn new(factors: &[Factor]) -> Self {
        let mut designs = Vec::new();
        let (mut distance, mut drive) = (Axis::Value(f64::NAN), None);
        for factor in factors {
            match factor.axes.as_slice() {
                [(Column::Distance, axis)] => distance = axis.clone(),
                [(Column::Drive, axis)] => drive = Some(axis.clone()),
                _ => designs.push(factor.clone()),
            }
        }
        let n_drives = drive.as_ref().map_or(1, Axis::len);
        let n_designs = designs.iter().map(|f| f.len).product();
        let reach = OnceLock::new();
        Self { n_designs, n_distances: distance.len(), n_drives, designs, distance, reach, drive }
    }

    /// Taps of one design.
    pub fn block(&self) -> u64 {
        self.n_distances * self.n_drives
    }

    /// Taps of the grid.
    pub fn len(&self) -> u64 {
        self.n_designs * self.block()
    }

    /// Whether there is no tap.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Design `k` as a tuple without distance; its drive is set only where it is sampled with the design.
    pub fn design(&self, mut k: u64) -> Tuple {
        let mut values = [f64::NAN; 7];
        for factor in self.designs.iter().rev() {
            let at = k % factor.len;
            k /= factor.len;
            for (column, axis) in &factor.axes {
                values[*column as usize] = axis.at(at);
            }
        }
        Tuple::from_array(values)
    }

    /// Distance `i`, mm.
    pub fn distance(&self, i: u64) -> f64 {
        self.distance.at(i)
    }

    /// Smallest and largest distance, mm; of sampled ones the points count, not the bounds. The first call goes through all
    /// points of a sampled axis.
    pub fn reach(&self) -> [f64; 2] {
        *self.reach.get_or_init(|| match self.distance {
            Axis::Samples { .. } => {
                let wider = |[lo, hi]: [f64; 2], a: f64| [lo.min(a), hi.max(a)];
                self.distance.iter().fold([f64::INFINITY, f64::NEG_INFINITY], wider)
            }
            _ => [self.distance.min(), self.distance.max()],
        })
    }

    /// Smallest and largest value of column `column` of a design; of sampled axes, their bounds.
    pub fn bounds(&self, column: usize) -> [f64; 2] {
        let axis = self.designs.iter().flat_map(|f| &f.axes).find(|(c, _)| *c as usize == column);
        axis.map_or([f64::NAN; 2], |(_, axis)| [axis.min(), axis.max()])
    }

    /// The axis of drives, unless each design has its own.
    pub fn drives(&self) -> Option<&Axis> {
        self.drive.as_ref()
    }

    /// The factors of a design, last fastest.
    pub fn factors(&self) -> &[Factor] {
        &self.designs
    }

    /// Drive `j` of `design`, degrees or mm.
    pub fn drive(&self, design: &Tuple, j: u64) -> f64 {
        self.drive.as_ref().map_or(design.drive, |axis| axis.at(j))
    }

    /// Tuple `index`.
    pub fn tuple(&self, index: u64) -> Tuple {
        let design = self.design(index / self.block());
        let (i, j) = (index % self.block() / self.n_drives, index % self.n_drives);
        Tuple { a: self.distance(i), drive: self.drive(&design, j), ..design }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::axis::Points;
    use crate::scene::sampler::Sampler;

    /// An axis of its own.
    fn alone(column: Column, values: &[f64]) -> Factor {
        Factor { axes: vec![(column, Axis::List(values.to_vec()))], len: values.len() as u64 }
    }

    fn sampled(min: f64, max: f64, dimension: u32) -> Axis {
        let points = Points { samples: 5, sampler: Sampler::Sobol, seed: 0 };
        Axis::samples(min, max, false, points, dimension).unwrap()
    }

    #[test]
    fn last_axis_is_fastest() {
        use Column::{BaseDiameter, Distance, Drive, GaugePosition, GridLength, Length, TipDiameter};
        let l = Layout::new(&[
            alone(BaseDiameter, &[8.0, 10.0]),
            alone(TipDiameter, &[4.0]),
            alone(Length, &[50.0]),
            alone(GaugePosition, &[3.0, 5.0, 7.0]),
            alone(GridLength, &[2.0]),
            alone(Distance, &[20.0, 30.0]),
            alone(Drive, &[1.0, 2.0, 3.0]),
        ]);
        assert_eq!((l.n_designs, l.n_distances, l.n_drives, l.len()), (6, 2, 3, 36));
        let mut index = 0;
        for big in [8.0, 10.0] {
            for x_ss in [3.0, 5.0, 7.0] {
                for a in [20.0, 30.0] {
                    for drive in [1.0, 2.0, 3.0] {
                        let want = Tuple { D: big, d: 4.0, L_a: 50.0, x_ss, l: 2.0, a, drive };
                        assert_eq!(l.tuple(index), want);
                        index += 1;
                    }
                }
            }
        }
    }

    #[test]
    fn a_drive_sampled_with_a_design_belongs_to_it() {
        let zipped =
            vec![(Column::BaseDiameter, sampled(8.0, 12.0, 0)), (Column::Drive, sampled(1.0, 2.0, 1))];
        let l = Layout::new(&[
            Factor { axes: zipped, len: 5 },
            alone(Column::TipDiameter, &[2.0, 4.0]),
            alone(Column::Length, &[50.0]),
            alone(Column::GaugePosition, &[5.0]),
            alone(Column::GridLength, &[2.0]),
            alone(Column::Distance, &[20.0, 30.0]),
        ]);
        assert_eq!((l.n_designs, l.n_distances, l.n_drives), (10, 2, 1));
        let (first, second) = (l.tuple(0), l.tuple(2));
        assert_eq!((first.D, first.drive), (second.D, second.drive));
        assert_eq!((first.d, second.d), (2.0, 4.0));
        assert_ne!(l.tuple(4).drive, first.drive);
    }
}
