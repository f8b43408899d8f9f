//! Interpolation on as few points as a function of several variables needs.
//!
//! Orders ν = (ν₁ … ν₅) form a lower set: with ν all smaller orders are in it. One Leja point belongs to each, and one surplus for each
//! function (Chkifa, Cohen, Schwab 2014). From the middle of the box orders are added next to those whose surplus still matters
//! (Gerstner, Griebel 2003), until none does: one tap for each order, where a tensor product takes ten.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use rustc_hash::FxHashSet;

use super::axis::{AXES, ORDERS, Quantity};
use super::series::{Row, Series};
use crate::physics::chebyshev::{coefficients, points};

/// Orders over each axis.
pub type Orders = [u8; AXES];

/// An interpolant of `F` functions.
#[derive(Debug, Clone)]
pub struct Interpolant<const F: usize> {
    /// In the order in which they came.
    surplus: Vec<(Orders, [f64; F])>,
    /// Those of `surplus`.
    known: FxHashSet<Orders>,
    /// Orders that every axis may have; 1 of an axis that is a point.
    most: [usize; AXES],
}

impl<const F: usize> Interpolant<F> {
    /// Of nothing yet; `points` says which axes have one value only.
    pub fn new(points: [bool; AXES]) -> Self {
        let mut most = points.map(|point| if point { 1 } else { MOST });
        most[Quantity::Drive as usize] = most[Quantity::Drive as usize].min(ORDERS);
        Self { surplus: Vec::new(), known: FxHashSet::default(), most }
    }

    /// x of the point of `orders`.
    pub fn point(orders: &Orders) -> [f64; AXES] {
        orders.map(|k| point(usize::from(k)))
    }

    /// Orders that are asked for next: those with all smaller neighbours there, next to one with a surplus above `least`. Sorted, so that
    /// the same is asked on every run.
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

    /// Takes the values at the points of `orders`.
    pub fn add(&mut self, orders: &[Orders], values: &[[f64; F]]) {
        // No order of one call is below another: what a point adds is what the interpolant before lacks there.
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

    /// Chebyshev coefficients of all orders, ascending.
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

    /// Points it goes through.
    pub fn len(&self) -> usize {
        self.surplus.len()
    }

    /// Whether it goes through none.
    pub fn is_empty(&self) -> bool {
        self.surplus.is_empty()
    }
}

/// Points there are.
pub const MOST: usize = 24;

/// Points, values and coefficients of Newton's polynomials.
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

/// Point `k`.
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
