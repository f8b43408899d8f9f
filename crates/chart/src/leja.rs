//! Leja points on [−1, 1], Newton's polynomials through them, and the way to Chebyshev's.
//!
//! Each point is where the product of the distances to those before it is largest (from 0). So Newton's polynomial of order k,
//! N_k(x) = Π_{j<k} (x − x_j)/(x_k − x_j), is 1 at its own point, 0 at those before, and nowhere larger than 1: what a new point adds to an
//! interpolant, its surplus, is as large as the surplus shows. Points are nested, one more for each order.

use std::sync::LazyLock;

use crate::physics::chebyshev::{coefficients, points};

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
