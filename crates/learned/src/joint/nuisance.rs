//! What an object may have of its own that changes the signal, and nobody asks for.

/// By how much such a number changes the signal of a tap, in shares of it: on a grid of ln a and drive, each evenly spaced.
#[derive(Debug, Clone, PartialEq)]
pub struct Nuisance {
    /// First and last ln a, first and last drive.
    pub ends: [[f64; 2]; 2],
    /// Number of values of ln a.
    pub rows: usize,
    /// Mean change and its standard deviation, drive after drive for each ln a.
    pub changes: Vec<[f64; 2]>,
}

impl Nuisance {
    /// Mean change of a tap at ln a = x by the drive `u`, and its standard deviation; beyond the grid that of its edge.
    pub fn at(&self, x: f64, u: f64) -> [f64; 2] {
        let columns = self.changes.len() / self.rows;
        let place = |v: f64, [first, last]: [f64; 2], n: usize| {
            let s = if last > first {
                ((v - first) / (last - first)).clamp(0.0, 1.0) * (n - 1) as f64
            } else {
                0.0
            };
            let k = (s as usize).min(n.saturating_sub(2));
            (k, s - k as f64)
        };
        let ((i, s), (j, t)) = (place(x, self.ends[0], self.rows), place(u, self.ends[1], columns));
        let value = |i: usize, j: usize| self.changes[i.min(self.rows - 1) * columns + j.min(columns - 1)];
        std::array::from_fn(|k| {
            let along = |i: usize| (1.0 - t) * value(i, j)[k] + t * value(i, j + 1)[k];
            (1.0 - s) * along(i) + s * along(i + 1)
        })
    }
}
