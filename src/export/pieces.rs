//! The signal that an estimator expects over distance and drive, as polynomials on rectangles.
//!
//! What is written as Chebyshev series is ln(signal/drive), and the variance of ln signal, over ln a and the drive. Rectangles end where
//! the estimator has a kink, and are halved until the last coefficients vanish.

use super::signal::Signal;
use crate::physics::chebyshev::{coefficients2, placed, points, series};

/// Chebyshev points of a rectangle over ln a and the drive.
const NODES: [usize; 2] = [14, 8];
/// Most halvings of ln a, and of the drive between two calibrated ones.
const HALVINGS: [u32; 2] = [8, 3];
/// Sizes of the last coefficients that are small enough, tried in this order.
const FINE: [f64; 3] = [1e-8, 1e-7, 1e-6];
/// Most coefficients, as long as a coarser fit is left to try.
const MOST: usize = 5000;
/// Steps in which the roots of a piece are looked for that may have a peak.
const LOOKS: usize = 12;
/// Places along each side at which slopes are looked at.
const PLACES: usize = 33;
/// Share of σ² that the variance may be off by.
const SHARE: f64 = 2e-3;

/// One rectangle.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Distances, mm.
    pub a: [f64; 2],
    /// Signal per drive to which the series is relative.
    pub scale: f64,
    /// ln(signal/(drive scale)): rows over ln a, columns over the drive.
    pub value: Vec<Vec<f64>>,
    /// Variance of ln signal, in the same way.
    pub variance: Vec<Vec<f64>>,
    /// Steps in which roots are looked for: 1 where the signal rises, or falls, all over.
    pub looks: usize,
}

/// Rectangles of one interval of the drive.
#[derive(Debug, Clone)]
pub struct Strip {
    /// The interval.
    pub drives: [f64; 2],
    /// From the far end.
    pub pieces: Vec<Piece>,
}

/// All of one side.
#[derive(Debug, Clone)]
pub struct Pieces {
    /// By drive, ascending.
    pub strips: Vec<Strip>,
    /// Largest error of a distance on the far side, among the calibrated ones, mm.
    pub error: f64,
}

/// Why there are none: a place where the estimator has no number, mm and drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole(pub f64, pub f64);

impl Pieces {
    /// Of `signal`.
    ///
    /// # Errors
    /// Where the estimator has no number.
    pub fn new(signal: &Signal<'_>) -> Result<Self, Hole> {
        let mut all = Self::to(signal, FINE[0])?;
        for fine in &FINE[1..] {
            if all.count() > MOST {
                all = Self::to(signal, *fine)?;
            }
        }
        all.error = all.strips.iter().map(|s| s.error(signal)).fold(0.0, f64::max);
        Ok(all)
    }

    fn to(signal: &Signal<'_>, fine: f64) -> Result<Self, Hole> {
        let mut strips = Vec::new();
        let ends = match signal.drives {
            [one] => vec![*one; 2],
            several => several.to_vec(),
        };
        split(signal, &ends, HALVINGS[1], fine, &mut strips)?;
        Ok(Self { strips, error: f64::NAN })
    }

    /// Number of coefficients.
    fn count(&self) -> usize {
        let of = |c: &Vec<Vec<f64>>| c.len() * c[0].len();
        self.strips.iter().flat_map(|s| &s.pieces).map(|p| of(&p.value) + of(&p.variance)).sum()
    }
}

/// Strips between the first and the last of the calibrated drives `ends`; the interval of two of them is halved at most `more` times.
fn split(signal: &Signal<'_>, ends: &[f64], more: u32, fine: f64, done: &mut Vec<Strip>) -> Result<(), Hole> {
    let (first, last) = (ends[0], ends[ends.len() - 1]);
    let knots: Vec<Vec<f64>> = ends.windows(2).map(|w| signal.knots(0.5 * (w[0] + w[1]))).collect();
    let may = ends.len() > 2 || (first < last && more > 0);
    if knots.iter().all(|k| *k == knots[0])
        && let Some(strip) = Strip::new(signal, [first, last], &knots[0], fine, may)?
    {
        done.push(strip);
        return Ok(());
    }
    if ends.len() > 2 {
        let middle = ends.len() / 2;
        split(signal, &ends[..=middle], more, fine, done)?;
        return split(signal, &ends[middle..], more, fine, done);
    }
    let middle = 0.5 * (first + last);
    split(signal, &[first, middle], more - 1, fine, done)?;
    split(signal, &[middle, last], more - 1, fine, done)
}

impl Strip {
    /// `None` where the drives ought to be split, if they `may` be.
    fn new(
        signal: &Signal<'_>,
        drives: [f64; 2],
        knots: &[f64],
        fine: f64,
        may: bool,
    ) -> Result<Option<Self>, Hole> {
        let mut open: Vec<([f64; 2], u32)> = knots.windows(2).map(|w| ([w[0], w[1]], 0)).collect();
        let mut pieces = Vec::new();
        while let Some((a, depth)) = open.pop() {
            let (piece, tails) = Piece::new(signal, a, drives, fine)?;
            if may && tails[1] > fine {
                return Ok(None);
            }
            if tails[0] > fine && depth < HALVINGS[0] {
                let middle = (a[0] * a[1]).sqrt();
                open.extend([([a[0], middle], depth + 1), ([middle, a[1]], depth + 1)]);
            } else {
                pieces.push(piece);
            }
        }
        Ok(Some(Self { drives, pieces }))
    }

    /// As [`Pieces::error`].
    fn error(&self, signal: &Signal<'_>) -> f64 {
        let looks = [-0.97, -0.6, -0.2, 0.3, 0.7, 0.98];
        let mut worst = 0.0f64;
        for piece in &self.pieces {
            for (x, y) in looks.iter().flat_map(|x| looks.map(|y| (*x, y))) {
                let a = placed(piece.a.map(f64::ln), x).exp();
                let (value, slope) = piece.at(x, y);
                let [lo, hi] = signal.distances;
                if slope < 0.0 && (lo..=hi).contains(&a) {
                    let drive = placed(self.drives, y);
                    let off = value - (signal.of.expected(a, drive) / (drive * piece.scale)).ln();
                    worst = worst.max((off * a * piece.half() / slope).abs());
                }
            }
        }
        worst
    }
}

impl Piece {
    /// The rectangle, and the size of its last two rows and columns.
    fn new(signal: &Signal<'_>, a: [f64; 2], drives: [f64; 2], fine: f64) -> Result<(Self, [f64; 2]), Hole> {
        let columns = if drives[0] < drives[1] { NODES[1] } else { 1 };
        let ys: Vec<f64> = points(columns).iter().map(|y| placed(drives, *y)).collect();
        let distances: Vec<f64> = points(NODES[0]).iter().map(|x| placed(a.map(f64::ln), *x).exp()).collect();
        let scale = {
            let drive = placed(drives, 0.0);
            signal.of.expected((a[0] * a[1]).sqrt(), drive) / drive
        };
        let (mut values, mut variances) = (Vec::new(), Vec::new());
        let mut least = f64::INFINITY;
        for a in &distances {
            let (mut row, mut of_row) = (Vec::new(), Vec::new());
            for drive in &ys {
                let expected = signal.of.expected(*a, *drive);
                let value = (expected / (drive * scale)).ln();
                let variance = signal.of.variance(*a, *drive) / (expected * expected);
                if !value.is_finite() || !variance.is_finite() {
                    return Err(Hole(*a, *drive));
                }
                least = least.min((signal.noise / expected).powi(2) + variance);
                row.push(value);
                of_row.push(variance);
            }
            values.push(row);
            variances.push(of_row);
        }
        let value = coefficients2(&values);
        let rows = value[NODES[0] - 2..].iter().flatten().map(|x| x.abs()).sum();
        let last =
            |row: &Vec<f64>| row[columns.saturating_sub(2).max(1)..].iter().map(|x| x.abs()).sum::<f64>();
        let tails = [rows, value.iter().map(last).sum()];
        let value = trimmed(value, 0.25 * fine);
        let variance = trimmed(coefficients2(&variances), SHARE * least);
        let mut piece = Self { a, scale, value, variance, looks: 1 };
        if !piece.is_monotone() {
            piece.looks = LOOKS;
        }
        Ok((piece, tails))
    }

    /// Whether the signal rises, or falls, all over.
    fn is_monotone(&self) -> bool {
        let place = |k: usize| 2.0 * k as f64 / (PLACES - 1) as f64 - 1.0;
        let mut slopes = (0..PLACES * PLACES).map(|k| self.at(place(k / PLACES), place(k % PLACES)).1);
        let sign = self.at(0.0, 0.0).1.signum();
        slopes.all(|s| s * sign > 0.0)
    }

    /// Half width in ln a.
    pub fn half(&self) -> f64 {
        0.5 * (self.a[1] / self.a[0]).ln()
    }

    /// Value and slope at a place in the rectangle, each of −1 … 1.
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let rows: Vec<f64> = self.value.iter().map(|row| series(row, y).0).collect();
        series(&rows, x)
    }
}

/// Without the last rows and columns whose coefficients sum to `small`.
fn trimmed(mut c: Vec<Vec<f64>>, small: f64) -> Vec<Vec<f64>> {
    let mut left = small;
    let mut drop = |size: f64, n: usize| {
        let dropped = n > 1 && size <= left;
        left -= if dropped { size } else { 0.0 };
        dropped
    };
    while drop(c[c.len() - 1].iter().map(|x| x.abs()).sum(), c.len()) {
        c.pop();
    }
    while drop(c.iter().map(|row| row[row.len() - 1].abs()).sum(), c[0].len()) {
        c.iter_mut().for_each(|row| row.truncate(row.len() - 1));
    }
    c
}
