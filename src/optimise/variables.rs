//! Between the unit box in which a search moves and the designs it scores.

use crate::plan::Layout;
use crate::scene::search::{Search, Variable};
use crate::scene::{Column, Tuple};

/// What varies, and what does not.
#[derive(Debug, Clone, PartialEq)]
pub struct Variables {
    list: Vec<Variable>,
    base: Tuple,
    /// Drives of which each design takes the best; one, unused, where the drive is a variable.
    drives: Vec<f64>,
    /// The first start of the spec, in the unit box.
    pub start: Option<Vec<f64>>,
}

impl Variables {
    /// Of `search` over the distances of `layout`. Parts of the bounds in which no candidate can lie are cut off.
    pub fn new(layout: &Layout, search: &Search) -> Self {
        let base = Tuple { a: 0.0, ..layout.stroke(&layout.design(0), 0) };
        let mut list = search.variables.clone();
        for v in &mut list {
            let farthest = layout.reach()[1];
            if v.column == Column::Length && farthest > v.min && farthest < v.max {
                v.min = farthest;
            }
        }
        let drive_varies = list.iter().any(|v| v.column == Column::Drive);
        let drives = if drive_varies {
            vec![f64::NAN]
        } else {
            (0..layout.n_drives).map(|j| layout.drive(&base, j)).collect()
        };
        let middle = |v: &Variable| v.start.unwrap_or(0.5 * (v.min + v.max));
        let start = list
            .iter()
            .any(|v| v.start.is_some())
            .then(|| list.iter().map(|v| ((middle(v) - v.min) / (v.max - v.min)).clamp(0.0, 1.0)).collect());
        Self { list, base, drives, start }
    }

    /// Their number.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Never: a search has variables.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Bounds in force.
    pub fn list(&self) -> &[Variable] {
        &self.list
    }

    /// Drives from which each design takes its best.
    pub fn drives(&self) -> usize {
        self.drives.len()
    }

    /// The design at `u` in the unit box with its drive, or with drive `j` of the list.
    pub fn point(&self, u: &[f64], j: usize) -> Tuple {
        let mut values = self.base.to_array();
        values[Column::Drive as usize] = self.drives[j];
        for (v, u) in self.list.iter().zip(u) {
            // Bounds are met exactly.
            values[v.column as usize] = match *u {
                u if u <= 0.0 => v.min,
                u if u >= 1.0 => v.max,
                u => v.min + (v.max - v.min) * u,
            };
        }
        Tuple::from_array(values)
    }

    /// Where a point lies in the unit box, and which drive of the list it has.
    pub fn place(&self, point: &Tuple) -> (Vec<f64>, usize) {
        let values = point.to_array();
        let u = self.list.iter().map(|v| (values[v.column as usize] - v.min) / (v.max - v.min)).collect();
        (u, self.drives.iter().position(|d| *d == point.drive).unwrap_or(0))
    }

    /// Variables that lie at a bound of `point`, and at which.
    pub fn at_bounds(&self, point: &Tuple) -> Vec<(Column, &'static str)> {
        let (u, _) = self.place(point);
        let at = |(v, u): (&Variable, &f64)| match *u {
            u if u <= 1e-6 => Some((v.column, "min")),
            u if u >= 1.0 - 1e-6 => Some((v.column, "max")),
            _ => None,
        };
        self.list.iter().zip(&u).filter_map(at).collect()
    }
}
