//! Index ↔ tuple, without listing the tuples.
//! A grid is designs × distances × strokes, last fastest: tap (i, j) of design k has the index (k · distances + i) · strokes + j. A stroke is a
//! direction of the pole and a drive: tilts × leans × drives. Parts of it that are sampled with a design's axes belong to the design.

use std::sync::OnceLock;

use super::axis::Axis;
use super::property::Property;
use super::space::{COLUMNS, Column, Direction, Factor, Tuple};
use crate::reduce::range;

/// A grid of taps.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    designs: Vec<Factor>,
    distance: Axis,
    reach: OnceLock<[f64; 2]>,
    strokes: Vec<Factor>,
    /// Number of designs.
    pub n_designs: u64,
    /// Distances of each design.
    pub n_distances: u64,
    /// Strokes of each design; 1 if all parts are single values, or sampled with the design.
    pub n_drives: u64,
    /// Directions of each design, each with all of its drives: strokes j with the same j / (strokes / directions).
    pub n_directions: u64,
    /// Combinations of properties of the rig.
    pub n_rigs: u64,
}

impl Layout {
    /// The grid of the factors of a space, in row order.
    pub fn new(factors: &[Factor]) -> Self {
        let (mut designs, mut strokes) = (Vec::new(), Vec::new());
        let mut distance = Axis::Value(f64::NAN);
        for factor in factors {
            match factor.axes.as_slice() {
                [(Column::Distance, axis)] => distance = axis.clone(),
                axes if factor.properties.is_empty()
                    && axes.iter().all(|(column, _)| *column > Column::Distance) =>
                {
                    strokes.push(factor.clone());
                }
                _ => designs.push(factor.clone()),
            }
        }
        let product = |factors: &[Factor]| factors.iter().map(|f| f.len).product();
        let (n_designs, n_drives) = (product(&designs), product(&strokes));
        let angles = strokes.last().map_or(1, |f| if alone(f).is_some() { f.len } else { 1 });
        Self {
            n_designs,
            n_distances: distance.len(),
            n_drives,
            n_directions: n_drives / angles,
            n_rigs: designs.iter().filter(|f| !f.properties.is_empty()).map(|f| f.len).product(),
            designs,
            distance,
            reach: OnceLock::new(),
            strokes,
        }
    }

    /// Taps of one design.
    pub fn block(&self) -> u64 {
        self.n_distances * self.n_drives
    }

    /// Taps of the grid.
    pub fn len(&self) -> u64 {
        self.n_designs * self.block()
    }

    /// True without taps.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Design `k` as a tuple without distance; direction and drive are set only if sampled with the design.
    pub fn design(&self, k: u64) -> Tuple {
        self.designs(&[k])[0]
    }

    /// [`Self::design`] of each of `ks`.
    pub fn designs(&self, ks: &[u64]) -> Vec<Tuple> {
        let (mut values, mut stride) = (vec![[f64::NAN; COLUMNS]; ks.len()], 1);
        let mut rigs = vec![(0, 1.0); if self.n_rigs > 1 { ks.len() } else { 0 }];
        let (mut rest, mut at, mut left) = (ks.to_vec(), vec![0; ks.len()], self.n_designs);
        for factor in self.designs.iter().rev() {
            // Division is slow: it is left out for factors of length 1, and for the first factor that is longer.
            match factor.len {
                1 => at.fill(0),
                len if len == left => (rest, at) = (vec![0; ks.len()], rest),
                len => rest.iter_mut().zip(&mut at).for_each(|(k, at)| (*k, *at) = (*k / len, *k % len)),
            }
            left /= factor.len;
            for (column, axis) in &factor.axes {
                axis.each(&at, |n, value| values[n][*column as usize] = value);
            }
            if self.n_rigs > 1 && !factor.properties.is_empty() {
                rigs.iter_mut().zip(&at).for_each(|((rig, _), at)| *rig += at * stride);
                stride *= factor.len;
                let scale = factor.properties.iter().find(|(property, _)| *property == Property::Scale);
                scale.iter().for_each(|(_, axis)| axis.each(&at, |n, value| rigs[n].1 = value));
            }
        }
        if self.n_rigs == 1 {
            return values.into_iter().map(Tuple::from_array).collect();
        }
        let scaled = |(values, (rig, scale))| {
            let Tuple { D, d, .. } = Tuple::from_array(values);
            Tuple { D: D * scale, d: d * scale, rig, ..Tuple::from_array(values) }
        };
        values.into_iter().zip(rigs).map(scaled).collect()
    }

    /// Distance `i`, mm.
    pub fn distance(&self, i: u64) -> f64 {
        self.distance.at(i)
    }

    /// Smallest and largest distance, mm; for a sampled axis those of its points, which the first call computes.
    pub fn reach(&self) -> [f64; 2] {
        *self.reach.get_or_init(|| match self.distance {
            Axis::Samples { .. } => range(self.distance.iter()),
            _ => [self.distance.min(), self.distance.max()],
        })
    }

    /// Smallest and largest value of `column`; of sampled axes, their bounds.
    pub fn bounds(&self, column: Column) -> [f64; 2] {
        let axes = self.designs.iter().chain(&self.strokes).flat_map(|f| &f.axes);
        let axis = axes.filter(|(c, _)| *c == column).map(|(_, axis)| axis).next();
        axis.map_or([f64::NAN; 2], |axis| [axis.min(), axis.max()])
    }

    /// The axis of drives, unless each design or each direction has its own.
    pub fn drives(&self) -> Option<&Axis> {
        self.strokes.last().and_then(alone)
    }

    /// The direction of all poles, if they have one.
    pub fn direction(&self) -> Option<Direction> {
        let [[tilt, most], [lean, last]] = [Column::Tilt, Column::Lean].map(|column| self.bounds(column));
        (tilt == most && lean == last).then_some(Direction { tilt, lean })
    }

    /// True if every pole is upright.
    pub fn is_upright(&self) -> bool {
        self.direction().is_some_and(Direction::is_upright)
    }

    /// Drives of each direction.
    pub fn drives_each(&self) -> u64 {
        self.n_drives / self.n_directions
    }

    /// The factors of a design, last fastest.
    pub fn factors(&self) -> &[Factor] {
        &self.designs
    }

    /// `design` with direction and drive of its stroke `j`, in degrees or mm.
    pub fn stroke(&self, design: &Tuple, j: u64) -> Tuple {
        let (mut values, mut rest) = (design.to_array(), j);
        for factor in self.strokes.iter().rev() {
            for (column, axis) in &factor.axes {
                values[*column as usize] = axis.at(rest % factor.len);
            }
            rest /= factor.len;
        }
        Tuple::from_array(values).of_rig(design.rig)
    }

    /// Place of tap `t` of a design among its pairs of distance and direction, and among its strokes.
    pub fn place(&self, t: u64) -> (usize, usize) {
        let (i, j) = (t / self.n_drives, t % self.n_drives);
        ((i * self.n_directions + j / self.drives_each()) as usize, j as usize)
    }

    /// Tuple `index`.
    pub fn tuple(&self, index: u64) -> Tuple {
        let design = self.design(index / self.block());
        let (i, j) = (index % self.block() / self.n_drives, index % self.n_drives);
        Tuple { a: self.distance(i), ..self.stroke(&design, j) }
    }
}

fn alone(factor: &Factor) -> Option<&Axis> {
    match factor.axes.as_slice() {
        [(Column::Drive, axis)] => Some(axis),
        _ => None,
    }
}
