//! Several taps of one object by two gauges: one distance and one tilt.
//!
//! A tap tells x_i = x + B_i s + e_i, x distance and tilt, s ~ N(0, 1) what all taps share (the calibration, the zero above which they stand), e_i its own
//! error. Least squares for x and s together count what is shared once. Their sums are kept, so that a tap more costs the same after a thousand.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use vibrissa_learned::joint::integrate;

/// Taps at most among which one that contradicts the others is looked for.
const JUDGED: usize = 256;
/// Numbers of the sums: distance and tilt, what all taps share, and the zeros of both gauges.
const ALL: usize = ZEROS + 2;
const ZEROS: usize = 2 + SHARED;

/// Errors that all taps share: zero and curve of the calibration, factor and misalignment of the second gauge, bias of distances.
const SHARED: usize = 5;

/// Distance, mm, and tilt, rad, of a tap, and of what their errors are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parts {
    pub at: [f64; 2],
    /// Covariance that is of this tap alone.
    pub own: [[f64; 2]; 2],
    /// By how much one standard deviation of each number moves them: of those that all taps share, and of the zero of each gauge.
    pub moved: [[f64; 2]; SHARED + 2],
}

impl Parts {
    /// The covariance with what these numbers move.
    pub fn with(&self, moved: &[[f64; 2]]) -> [[f64; 2]; 2] {
        let more = covariance(moved);
        [0, 1].map(|i| [0, 1].map(|j| self.own[i][j] + more[i][j]))
    }
}

/// Covariance of what independent numbers move so far.
pub(super) fn covariance(by: &[[f64; 2]]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| [0, 1].map(|j| by.iter().map(|by| by[i] * by[j]).sum()))
}

pub(super) struct PairObject {
    sums: Sums,
    /// The zero readings above which the last tap stands.
    zero: Option<u64>,
    /// The last ones, which [`Self::apart`] compares.
    pub taps: Vec<Parts>,
    pub count: usize,
}

type Sums = (DMatrix<f64>, DVector<f64>);

/// Of `n` numbers: nothing is known of the first two, of the others their prior.
fn prior(n: usize) -> Sums {
    let matrix = DMatrix::from_fn(n, n, |i, j| if i == j && i > 1 { 1.0 } else { 0.0 });
    (matrix, DVector::zeros(n))
}

fn add((matrix, vector): &mut Sums, tap: &Parts, weight: &Matrix2<f64>) {
    let rows = rows(tap, vector.len());
    let weighted = rows.transpose() * weight;
    *matrix += &weighted * rows;
    *vector += &weighted * Vector2::from(tap.at);
}

/// By how much one tap is moved by each of so many numbers; by the zeros where those are numbers.
fn rows(tap: &Parts, n: usize) -> DMatrix<f64> {
    let own = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    DMatrix::from_fn(2, n, |i, j| j.checked_sub(2).map_or_else(|| own(i, j), |k| tap.moved[k][i]))
}

/// Distances of taps from what the others say, relative, that count as equal.
const ALIKE: f64 = 1e-6;

impl PairObject {
    pub fn new() -> Self {
        Self { sums: prior(ALL), zero: None, taps: Vec::new(), count: 0 }
    }

    /// Adds a tap above the zero with the number `zero`; whether it tells anything.
    pub fn add(&mut self, tap: Parts, zero: u64) -> bool {
        let Some(weight) = Matrix2::from(tap.own).try_inverse() else { return false };
        if self.zero.replace(zero).is_some_and(|before| before != zero) {
            // The zeros before are done with: integrates over them, and their numbers are free for the new ones.
            for k in ZEROS..ALL {
                integrate(&mut self.sums.0, &mut self.sums.1, k);
            }
        }
        add(&mut self.sums, &tap, &weight);
        self.count += 1;
        if self.taps.len() == JUDGED {
            self.taps.remove(0);
        }
        self.taps.push(tap);
        true
    }

    /// Distance, mm, and tilt, rad, that all taps tell, and their standard deviations.
    pub fn told(&self) -> Option<[[f64; 2]; 2]> {
        let factor = self.sums.0.clone().cholesky()?;
        let (at, covariance) = (factor.solve(&self.sums.1), factor.inverse());
        let sigma = [0, 1].map(|k| covariance[(k, k)].sqrt());
        (at[0].is_finite() && sigma.iter().all(|s| *s > 0.0)).then_some([[at[0], at[1]], sigma])
    }

    /// The tap farthest from what the others say: how many taps ago, and by how many standard deviations; `None` of one tap.
    pub fn apart(&self) -> Option<(usize, f64)> {
        if self.taps.len() < 2 {
            return None;
        }
        // The error of the zero counts with each tap.
        let own = |tap: &Parts| Matrix2::from(tap.with(&tap.moved[SHARED..]));
        let mut sums = prior(ZEROS);
        for tap in &self.taps {
            add(&mut sums, tap, &own(tap).try_inverse()?);
        }
        let factor = sums.0.cholesky()?;
        let (solved, covariance) = (factor.solve(&sums.1), factor.inverse());
        let off = |tap: &Parts| {
            let h = rows(tap, ZEROS);
            let known = &h * &solved;
            let left = Vector2::from(tap.at) - Vector2::new(known[0], known[1]);
            let known = &h * &covariance * h.transpose();
            let of_left = own(tap) - Matrix2::from_fn(|i, j| known[(i, j)]);
            Some((left.transpose() * of_left.try_inverse()? * left)[0].max(0.0).sqrt())
        };
        let offs = self.taps.iter().map(|tap| off(tap).unwrap_or(0.0)).enumerate();
        // Two taps are as far from each other: the first counts.
        let (k, most) =
            offs.reduce(|first, next| if next.1 > (1.0 + ALIKE) * first.1 { next } else { first })?;
        Some((self.taps.len() - 1 - k, most))
    }
}
