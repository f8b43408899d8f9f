//! Sparse interpolation of a function of several variables.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use rustc_hash::FxHashSet;

use super::axis::{AXES, ORDERS, Quantity};
use super::series::{Row, Series};
use crate::physics::chebyshev::{coefficients, points};

/// Orders over each axis.
pub type Orders = [u8; AXES];

/// An interpolant of `F` functions. Its orders form a lower set; each has one Leja point and a surplus per function (Chkifa, Cohen, Schwab 2014).
/// Orders are added next to those whose surplus still matters (Gerstner, Griebel 2003): one tap per order, where a tensor product takes ten.
#[derive(Debug, Clone)]
pub struct Interpolant<const F: usize> {
    pub(super) surplus: Vec<(Orders, [f64; F])>,
    known: FxHashSet<Orders>,
    /// Limit of the orders over each axis; 1 for an axis that is a point.
    most: [usize; AXES],
}

impl<const F: usize> Interpolant<F> {
    /// Without points; `points`: true for axes with one value only.
    pub fn new(points: [bool; AXES]) -> Self {
        let mut most = points.map(|point| if point { 1 } else { MOST });
        most[Quantity::Drive as usize] = most[Quantity::Drive as usize].min(ORDERS);
        Self { surplus: Vec::new(), known: FxHashSet::default(), most }
    }

    /// x of the point of `orders`.
    pub fn point(orders: &Orders) -> [f64; AXES] {
        orders.map(|k| point(usize::from(k)))
    }

    /// Next orders to add, sorted: those with all smaller neighbours present, next to one with a surplus above `least`.
    pub fn wanted(&self, least: &[f64; F]) -> Vec<Orders> {
        if self.surplus.is_empty() {
            return vec![[0; AXES]];
        }
        let matters = |s: &[f64; F]| s.iter().zip(least).any(|(s, least)| s.abs() > *least);
        let mut wanted: Vec<Orders> = Vec::new();
        for (orders, _) in self.surplus.iter().filter(|(_, s)| matters(s)) {
            for axis in 0..AXES {
                let mut next = *orders;
                next[axis] += 1;
                let room = usize::from(next[axis]) < self.most[axis];
                if room && !self.known.contains(&next) && self.admissible(&next) {
                    wanted.push(next);
                }
            }
        }
        wanted.sort_unstable();
        wanted.dedup();
        wanted
    }

    fn admissible(&self, orders: &Orders) -> bool {
        (0..AXES).filter(|axis| orders[*axis] > 0).all(|axis| {
            let mut before = *orders;
            before[axis] -= 1;
            self.known.contains(&before)
        })
    }

    /// Adds the values at the points of `orders`.
    pub fn add(&mut self, orders: &[Orders], values: &[[f64; F]]) {
        // No order of one call is below another, so each surplus is the value less the interpolant before the call.
        let lacks = |(at, value): (&Orders, &[f64; F])| {
            let mut surplus = *value;
            for (orders, known) in &self.surplus {
                let share = newton(orders, at);
                if share != 0.0 {
                    surplus.iter_mut().zip(known).for_each(|(surplus, known)| *surplus -= share * known);
                }
            }
            (*at, surplus)
        };
        let new: Vec<(Orders, [f64; F])> = orders.iter().zip(values).map(lacks).collect();
        self.surplus.extend(new);
        self.known.extend(orders);
    }

    fn chebyshev(&self) -> BTreeMap<Orders, [f64; F]> {
        let mut all: BTreeMap<Orders, [f64; F]> = self.surplus.iter().copied().collect();
        for axis in 0..AXES {
            let starts: Vec<Orders> = all.keys().filter(|o| o[axis] == 0).copied().collect();
            for start in starts {
                let at = |k: u8| {
                    let mut orders = start;
                    orders[axis] = k;
                    orders
                };
                let line: Vec<[f64; F]> = (0..).map_while(|k| all.get(&at(k)).copied()).collect();
                if line.len() == 1 {
                    continue;
                }
                let mut lines: [Vec<f64>; F] = std::array::from_fn(|i| line.iter().map(|v| v[i]).collect());
                lines.iter_mut().for_each(|line| to_chebyshev(line));
                (0..line.len()).for_each(|k| {
                    all.insert(at(k as u8), std::array::from_fn(|i| lines[i][k]));
                });
            }
        }
        all
    }

    /// The series of every function, of terms above its `least`.
    pub fn series(&self, least: &[f64; F]) -> [Series; F] {
        let terms = self.chebyshev();
        std::array::from_fn(|i| {
            let mut rows: Vec<Row> = Vec::new();
            for (orders, c) in terms.iter().filter(|(_, c)| c[i].abs() > least[i]) {
                let [shared @ .., last] = orders.map(usize::from);
                if rows.last().is_none_or(|row| row.orders != shared) {
                    rows.push(Row { orders: shared, coefficients: Vec::new() });
                }
                let row = rows.last_mut().expect("pushed above");
                row.coefficients.resize(last + 1, 0.0);
                row.coefficients[last] = c[i];
            }
            Series { rows }
        })
    }
}

/// Largest number of points of an axis.
pub const MOST: usize = 24;

struct Table {
    points: [f64; MOST],
    /// N_j at point k, j ≤ k.
    newton: [[f64; MOST]; MOST],
    /// Coefficient of T_k in N_j, k ≤ j.
    chebyshev: [[f64; MOST]; MOST],
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    const GRID: usize = 4000;
    let mut found = [0.0; MOST];
    let mut product = [1.0f64; GRID + 1];
    for k in 0..MOST - 1 {
        for (i, product) in product.iter_mut().enumerate() {
            *product *= (2.0 * i as f64 / GRID as f64 - 1.0) - found[k];
        }
        let best = (0..=GRID).max_by(|a, b| product[*a].abs().total_cmp(&product[*b].abs())).unwrap_or(0);
        found[k + 1] = 2.0 * best as f64 / GRID as f64 - 1.0;
    }
    let value = |j: usize, x: f64| (0..j).map(|i| (x - found[i]) / (found[j] - found[i])).product::<f64>();
    let newton =
        std::array::from_fn(|j| std::array::from_fn(|k| if j <= k { value(j, found[k]) } else { 0.0 }));
    let at = points(MOST);
    let chebyshev = std::array::from_fn(|j| {
        let c = coefficients(&at.iter().map(|x| value(j, *x)).collect::<Vec<_>>());
        std::array::from_fn(|k| if k <= j { c[k] } else { 0.0 })
    });
    Table { points: found, newton, chebyshev }
});

/// Leja point `k`.
pub fn point(k: usize) -> f64 {
    TABLE.points[k]
}

/// The product of Newton's polynomials of `orders`, one per axis, at the point of the orders `at`.
pub fn newton<const N: usize>(orders: &[u8; N], at: &[u8; N]) -> f64 {
    if orders.iter().zip(at).any(|(j, k)| j > k) {
        return 0.0;
    }
    orders.iter().zip(at).map(|(j, k)| TABLE.newton[usize::from(*j)][usize::from(*k)]).product()
}

/// Surpluses → Chebyshev coefficients, in place.
pub fn to_chebyshev(line: &mut [f64]) {
    for k in 0..line.len() {
        line[k] = (k..line.len()).map(|j| line[j] * TABLE.chebyshev[j][k]).sum();
    }
}
