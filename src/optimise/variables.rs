//! Maps the unit box of a search to designs.

use crate::plan::Layout;
use crate::scene::search::{Quantity, Search, Variable};
use crate::scene::{Column, Property, Setup, Tuple};

#[derive(Debug, Clone, PartialEq)]
pub struct Variables {
    pub list: Vec<Variable>,
    base: Tuple,
    /// Drives from which each design takes the best; a single placeholder if the drive is a variable.
    drives: Vec<f64>,
    setup: Setup,
    pub start: Option<Vec<f64>>,
}

impl Variables {
    /// Cuts off parts of the bounds that contain no valid candidate for the distances of `layout`.
    pub fn new(setup: &Setup, layout: &Layout, search: &Search) -> Self {
        let base = Tuple { a: 0.0, ..layout.stroke(&layout.design(0), 0) };
        let mut list = search.variables.clone();
        for v in &mut list {
            let farthest = layout.reach()[1];
            if v.quantity == Quantity::Column(Column::Length) && farthest > v.min && farthest < v.max {
                v.min = farthest;
            }
        }
        let drive_varies = list.iter().any(|v| v.quantity == Quantity::Column(Column::Drive));
        let drives = if drive_varies {
            vec![f64::NAN]
        } else {
            (0..layout.n_drives).map(|j| layout.stroke(&base, j).drive).collect()
        };
        let middle = |v: &Variable| v.start.unwrap_or(0.5 * (v.min + v.max));
        let start = list
            .iter()
            .any(|v| v.start.is_some())
            .then(|| list.iter().map(|v| ((middle(v) - v.min) / (v.max - v.min)).clamp(0.0, 1.0)).collect());
        Self { list, base, drives, setup: setup.clone(), start }
    }

    pub fn drives(&self) -> usize {
        self.drives.len()
    }

    /// The design at `u` in the unit box, with its drive, or drive `j` of the list.
    pub fn point(&self, u: &[f64], j: usize) -> Tuple {
        let mut values = self.base.to_array();
        values[Column::Drive as usize] = self.drives[j];
        let (mut properties, mut scale) = (Vec::new(), 1.0);
        for (v, u) in self.list.iter().zip(u) {
            let value = match *u {
                u if u <= 0.0 => v.min,
                u if u >= 1.0 => v.max,
                u => v.min + (v.max - v.min) * u,
            };
            match v.quantity {
                Quantity::Column(column) => values[column as usize] = value,
                Quantity::Property(property) => {
                    properties.push(value);
                    scale = if property == Property::Scale { value } else { scale };
                }
            }
        }
        let point = Tuple::from_array(values);
        match &self.setup.rigs {
            Some(rigs) => {
                Tuple { D: scale * point.D, d: scale * point.d, rig: rigs.number(&properties), ..point }
            }
            None => point,
        }
    }

    pub fn place(&self, point: &Tuple) -> (Vec<f64>, usize) {
        let u = self
            .list
            .iter()
            .map(|v| (value(&self.setup, point, v.quantity) - v.min) / (v.max - v.min))
            .collect();
        (u, self.drives.iter().position(|d| *d == point.drive).unwrap_or(0))
    }

    pub fn at_bounds(&self, point: &Tuple) -> Vec<(Quantity, &'static str)> {
        let (u, _) = self.place(point);
        let at = |(v, u): (&Variable, &f64)| match *u {
            u if u <= 1e-6 => Some((v.quantity, "min")),
            u if u >= 1.0 - 1e-6 => Some((v.quantity, "max")),
            _ => None,
        };
        self.list.iter().zip(&u).filter_map(at).collect()
    }
}

/// Value of `quantity` at `point`; NaN for a property that does not vary.
pub fn value(setup: &Setup, point: &Tuple, quantity: Quantity) -> f64 {
    match (quantity, &setup.rigs) {
        (Quantity::Column(column), _) => point.to_array()[column as usize],
        (Quantity::Property(property), Some(rigs)) => rigs.value(point.rig, property),
        (Quantity::Property(_), None) => f64::NAN,
    }
}
