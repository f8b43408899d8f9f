//! The drive as a smooth axis, of any model: a tap solved at a few drives, and read at all others.
//!
//! What kernels return are deviations from the first-order solution, which vanish with the drive; divided by it they are smooth,
//! but where the contact starts to slide or the solution folds. Interpolated at Chebyshev points of the drive, and checked at points
//! in between: where a check fails, the caller solves drive by drive.

use crate::Solution;
use vibrissa_core::physics::chebyshev::{self, placed};

/// Share of the tolerance that an interpolated strain may be off at the checking points.
const SHARE: f64 = 0.1;

/// Share of the tolerance that the highest coefficients of a strain may have.
const TAIL: f64 = 0.3;

/// Largest error of a deviation divided by its drive, relative to the largest such: keeps SD(K) at small drives.
const RELATIVE: f64 = 2e-5;

/// Where the checking points lie in the range of drives: at both ends too, for there friction may change first.
const CHECKS: [f64; 3] = [0.0, 0.38, 1.0];

/// Drives that pay for interpolation, and the number of points, tried in turn.
const TRIES: [(usize, usize); 2] = [(24, 8), (40, 14)];

/// Drives of a sweep and the points they are interpolated from.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveAxis {
    /// Drives at which taps are solved: Chebyshev points, then the checking points.
    pub nodes: Vec<f64>,
    drives: Vec<f64>,
    /// Weights of the values at the Chebyshev points, for each drive and for each checking point.
    rows: Vec<Vec<f64>>,
    checks: Vec<Vec<f64>>,
    /// The same for the two highest Chebyshev coefficients, which betray a kink between the points.
    tails: Vec<Vec<f64>>,
}

impl DriveAxis {
    /// Whether so many drives pay for interpolation.
    pub fn pays(drives: u64) -> bool {
        TRIES.iter().any(|(least, _)| drives >= *least as u64)
    }

    /// Taps that are solved for so many drives, which pay: where they are smooth, or where every try fails.
    pub fn solved(drives: u64, smooth: bool) -> u64 {
        let nodes = TRIES.iter().filter(|(least, _)| drives >= *least as u64);
        let nodes = nodes.map(|(_, points)| (points + CHECKS.len()) as u64);
        if smooth { nodes.take(1).sum() } else { drives + nodes.sum::<u64>() }
    }

    /// The ways to interpolate `drives`, cheapest first; none where there are too few to pay.
    pub fn ways(drives: &[f64]) -> Vec<Self> {
        let pays = TRIES.iter().filter(|(least, _)| drives.len() >= *least);
        pays.map(|&(_, points)| Self::new(drives, points)).collect()
    }

    fn new(drives: &[f64], points: usize) -> Self {
        let lo = drives.iter().copied().fold(f64::INFINITY, f64::min);
        let hi = drives.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let angle = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / points as f64;
        let mut nodes: Vec<f64> =
            chebyshev::points(points).into_iter().map(|x| placed([lo, hi], x)).collect();
        // Barycentric weights of Chebyshev points of the first kind.
        let weights: Vec<f64> =
            (0..points).map(|k| if k % 2 == 0 { angle(k).sin() } else { -angle(k).sin() }).collect();
        let row = |x: f64| -> Vec<f64> {
            if let Some(hit) = nodes.iter().position(|&n| n == x) {
                return (0..points).map(|k| f64::from(u8::from(k == hit))).collect();
            }
            let terms: Vec<f64> = nodes.iter().zip(&weights).map(|(n, w)| w / (x - n)).collect();
            let whole: f64 = terms.iter().sum();
            terms.into_iter().map(|t| t / whole).collect()
        };
        let between: Vec<f64> = CHECKS.iter().map(|c| lo + c * (hi - lo)).collect();
        let rows = drives.iter().map(|&x| row(x)).collect();
        let checks = between.iter().map(|&x| row(x)).collect();
        let tails = chebyshev::matrix(points).split_off(points - 2);
        nodes.extend(between);
        Self { nodes, drives: drives.to_vec(), rows, checks, tails }
    }

    /// Solutions at every drive from those at the nodes, all of them within `tolerance`; `None` where a check fails.
    pub fn spread(&self, solutions: &[Solution], tolerance: f64) -> Option<Vec<Solution>> {
        let points = self.nodes.len() - self.checks.len();
        let slopes: Vec<[f64; 4]> = solutions
            .iter()
            .zip(&self.nodes)
            .map(|(s, x)| [s.force, s.along, s.arc, s.strain].map(|v| v / x))
            .collect();
        let read = |row: &[f64]| {
            let mut sum = [0.0; 4];
            for (weight, slope) in row.iter().zip(&slopes[..points]) {
                for (sum, v) in sum.iter_mut().zip(slope) {
                    *sum += weight * v;
                }
            }
            sum
        };
        let mut error = solutions.iter().map(|s| s.error).fold(0.0, f64::max);
        let load = solutions.iter().map(|s| s.load).fold(0.0, f64::max);
        // Errors count against the strain, which may be far below that of the first-order solution.
        let least = solutions.iter().map(|s| (1.0 + s.strain).abs()).fold(1.0, f64::min);
        let far = self.nodes.iter().copied().fold(0.0, f64::max);
        let tail: f64 = self.tails.iter().map(|row| read(row)[3].abs()).sum();
        if tail.is_nan() || tail * far > TAIL * tolerance * least {
            return None;
        }
        let largest = slopes.iter().map(|s| s[3].abs()).fold(0.0, f64::max);
        for (k, row) in self.checks.iter().enumerate() {
            let (x, exact, got) = (self.nodes[points + k], &slopes[points + k], read(row));
            let off: Vec<f64> = exact.iter().zip(got).map(|(e, g)| (e - g).abs()).collect();
            let strain = off[3] * x / least;
            let others = off[..3].iter().copied().fold(0.0, f64::max) * x;
            if !(strain <= SHARE * tolerance && others <= tolerance && off[3] <= RELATIVE * largest) {
                return None;
            }
            error = error.max(strain);
        }
        let one = |(row, x): (&Vec<f64>, &f64)| {
            let [force, along, arc, strain] = read(row).map(|v| v * x);
            Solution { force, along, arc, strain, error, load, ..Solution::default() }
        };
        Some(self.rows.iter().zip(&self.drives).map(one).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solution(x: f64, f: impl Fn(f64) -> f64) -> Solution {
        Solution {
            force: f(x),
            along: 0.5 * f(x),
            arc: 2.0 * f(x),
            strain: f(x),
            error: 1e-8,
            sweeps: 2.0,
            ..Solution::default()
        }
    }

    #[test]
    fn smooth_axes_are_read_and_kinks_are_refused() {
        let drives: Vec<f64> = (1..=60).map(|k| 0.2 * f64::from(k)).collect();
        let ways = DriveAxis::ways(&drives);
        assert_eq!(ways.len(), 2);
        let smooth = |x: f64| 1e-3 * x * x / (1.0 + 0.03 * x);
        let kink = |x: f64| smooth(x) + 1e-3 * (x - 5.0).max(0.0);
        for way in &ways {
            let solve =
                |f: &dyn Fn(f64) -> f64| way.nodes.iter().map(|&x| solution(x, f)).collect::<Vec<_>>();
            let got = way.spread(&solve(&smooth), 1e-5).expect("smooth");
            for (s, &x) in got.iter().zip(&drives) {
                assert!((s.strain - smooth(x)).abs() < 1e-6 && (s.strain / smooth(x) - 1.0).abs() < 1e-4);
            }
            assert!(way.spread(&solve(&kink), 1e-5).is_none());
        }
        assert!(DriveAxis::ways(&drives[..20]).is_empty());
    }
}
