//! ε/(θ f) over one interval of u = 1/a.

use std::sync::LazyLock;

use crate::physics::chebyshev::{basis, placed, scaled, series, transpose};
use crate::physics::linear::StrainCurve;

/// Most coefficients of a smooth piece.
pub const NODES: usize = 16;
/// Steps of a smooth piece between whose ends there is at most one extremum.
pub const LOOKS: usize = 12;
const SAME: f64 = 1e-14;
/// T_i at the looks of a piece: row i, column of the look.
static AT_LOOKS: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| {
    let at = |k| basis(NODES, look([-1.0, 1.0], k));
    transpose(&(0..=LOOKS).map(at).collect::<Vec<_>>())
});

/// Look `k` of a piece over `range`.
pub fn look(range: [f64; 2], k: usize) -> f64 {
    placed(range, 2.0 * k as f64 / LOOKS as f64 - 1.0)
}

/// The ratio over one interval of u.
#[derive(Debug, Clone)]
pub struct Piece {
    /// The interval.
    pub u: [f64; 2],
    /// The ratio.
    pub ratio: Ratio,
}

/// Representation of the ratio.
#[derive(Debug, Clone)]
pub enum Ratio {
    /// Chebyshev coefficients.
    Smooth([f64; NODES]),
    /// (u, ratio) of taps, NaN without a solution: the piece holds a boundary between sticking and sliding, or the end of the model's solutions.
    Rough(Vec<(f64, f64)>),
}

impl Ratio {
    /// From at most `NODES` coefficients.
    pub fn smooth(coefficients: &[f64]) -> Self {
        Self::Smooth(std::array::from_fn(|k| coefficients.get(k).copied().unwrap_or(0.0)))
    }
}

impl Piece {
    /// The ratio and its slope over u; in a rough piece interpolated between taps, with the slope of the chord of all.
    fn at(&self, u: f64) -> (f64, f64) {
        match &self.ratio {
            Ratio::Smooth(c) => {
                let (r, slope) = series(c, scaled(self.u, u));
                (r, slope * 2.0 / (self.u[1] - self.u[0]))
            }
            Ratio::Rough(taps) => {
                let solved: Vec<(f64, f64)> = taps.iter().copied().filter(|(_, r)| r.is_finite()).collect();
                let chord = |(v, r): (f64, f64), (w, s): (f64, f64)| (s - r) / (w - v);
                let [first, .., last] = solved[..] else { return (f64::NAN, f64::NAN) };
                let next = solved.partition_point(|(v, _)| *v <= u).clamp(1, solved.len() - 1);
                let (v, r) = solved[next - 1];
                (r + chord(solved[next - 1], solved[next]) * (u - v), chord(first, last))
            }
        }
    }

    pub(super) fn strain(&self, of: &StrainCurve, amount: f64, u: f64) -> (f64, f64) {
        let ((r, dr), (f, df)) = (self.at(u), of.at_inverse(u));
        (amount * f * r, amount * (df * r + f * dr))
    }

    /// Appends (u, |ε|) at the looks of this piece, with `f` at those of a smooth one; NaN where nothing is solved.
    pub(super) fn look_into(
        &self,
        looks: &mut Vec<(f64, f64)>,
        of: &StrainCurve,
        amount: f64,
        f: &[f64; LOOKS + 1],
    ) {
        match &self.ratio {
            Ratio::Smooth(coefficients) => {
                let mut ratios = [0.0; LOOKS + 1];
                for (c, row) in coefficients.iter().zip(AT_LOOKS.iter()) {
                    ratios.iter_mut().zip(row).for_each(|(sum, t)| *sum += c * t);
                }
                let known = |(u, _): &(f64, f64)| (u - self.u[0]).abs() <= SAME * u;
                let from = usize::from(looks.last().is_some_and(known));
                looks.extend((from..=LOOKS).map(|k| (look(self.u, k), amount * f[k] * ratios[k])));
            }
            Ratio::Rough(taps) => {
                let strain = |u| self.strain(of, amount, u).0;
                looks.extend(
                    taps.iter().map(|(u, r)| (*u, if r.is_finite() { strain(*u) } else { f64::NAN })),
                );
            }
        }
    }
}
