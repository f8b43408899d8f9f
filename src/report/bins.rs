//! Many rows in few cells.

use super::table::distinct;
use crate::figure::{Axis, Cells};

/// Cells along an axis.
pub const MOST: usize = 40;

/// Cells along one axis: their ends, and the cell of a value.
struct Bins {
    edges: Vec<f64>,
    values: Option<Vec<f64>>,
}

impl Bins {
    fn of(numbers: &[f64]) -> Self {
        let mut few = Vec::new();
        // Most axes have few values: they are known after few rows, and a million need no set.
        for x in numbers.iter().filter(|x| x.is_finite()) {
            if few.len() <= MOST && !few.contains(x) {
                few.push(*x);
            }
        }
        if few.len() <= MOST {
            let values = distinct(few);
            return Self { edges: edges(&values), values: Some(values) };
        }
        let finite = numbers.iter().copied().filter(|x| x.is_finite());
        let (a, b) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        Self { edges: (0..=MOST).map(|i| a + (b - a) * i as f64 / MOST as f64).collect(), values: None }
    }

    fn place(&self, x: f64) -> Option<usize> {
        match &self.values {
            Some(values) => values.iter().position(|v| *v == x),
            None if x.is_finite() => {
                let (a, b) = (self.edges[0], self.edges[MOST]);
                Some((((x - a) / (b - a) * MOST as f64) as usize).min(MOST - 1))
            }
            None => None,
        }
    }
}

/// Ends of cells about `values`, half-way between neighbours.
pub fn edges(values: &[f64]) -> Vec<f64> {
    match values {
        [] => vec![0.0, 1.0],
        [x] => vec![x - 0.5, x + 0.5],
        _ => {
            let n = values.len();
            let between = values.windows(2).map(|w| 0.5 * (w[0] + w[1]));
            let (first, last) =
                (1.5 * values[0] - 0.5 * values[1], 1.5 * values[n - 1] - 0.5 * values[n - 2]);
            std::iter::once(first).chain(between).chain([last]).collect()
        }
    }
}

/// Least `value` of the rows in each cell; whether values had to share cells.
pub fn map([x, y]: [&[f64]; 2], value: impl Fn(usize) -> f64, of: Axis) -> (Cells, bool) {
    let (bx, by) = (Bins::of(x), Bins::of(y));
    let wide = bx.edges.len() - 1;
    let mut z = vec![f64::NAN; wide * (by.edges.len() - 1)];
    for (r, (x, y)) in x.iter().zip(y).enumerate() {
        if let (Some(i), Some(j)) = (bx.place(*x), by.place(*y)) {
            z[j * wide + i] = z[j * wide + i].min(value(r));
        }
    }
    let binned = bx.values.is_none() || by.values.is_none();
    (Cells { x: bx.edges, y: by.edges, z, of }, binned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_holds_the_least_of_its_rows() {
        let n = 10_000;
        let x: Vec<f64> = (0..n).map(|i| f64::from(i % 100)).collect();
        let y: Vec<f64> = (0..n).map(|i| f64::from(i % 3)).collect();
        let v: Vec<f64> = (0..n).map(|i| f64::from((i * 7919) % 10007)).collect();
        let (cells, binned) = map([&x, &y], |r| v[r], Axis::new("v", ""));
        assert!(binned);
        assert_eq!((cells.x.len(), cells.y.len()), (MOST + 1, 4));
        for (k, z) in cells.z.iter().enumerate() {
            let (i, j) = (k % MOST, k / MOST);
            let inside = |r: &usize| {
                let last = i == MOST - 1;
                x[*r] >= cells.x[i] && (x[*r] < cells.x[i + 1] || last) && y[*r] == j as f64
            };
            let least = (0..n as usize).filter(inside).map(|r| v[r]).fold(f64::INFINITY, f64::min);
            assert_eq!(*z, least, "cell {i}, {j}");
        }
    }

    #[test]
    fn nothing_is_no_cell() {
        let (cells, _) = map([&[1.0, f64::NAN], &[2.0, 2.0]], |_| f64::NAN, Axis::new("v", ""));
        assert!(cells.z.iter().all(|z| z.is_nan()));
        assert_eq!(edges(&[1.0, 2.0, 4.0]), [0.5, 1.5, 3.0, 5.0]);
    }
}
