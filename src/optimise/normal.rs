//! Common samples of manufacture: independent normal deviations cut at ±3σ.

use vibrissa_core::normal::quantile;

use crate::scene::sampler::Sampler;
use crate::scene::{COLUMNS, Column};

/// Φ(−3).
const BELOW: f64 = 1.349_898_031_630_094_5e-3;

/// Columns by the dimension of the Sobol points that they take: those of the pole's direction after those of whisker and drive.
const DIMENSIONS: [Column; COLUMNS] = [
    Column::BaseDiameter,
    Column::TipDiameter,
    Column::Length,
    Column::GaugePosition,
    Column::GridLength,
    Column::Distance,
    Column::Drive,
    Column::Tilt,
    Column::Lean,
];

/// Standard normal deviations cut at ±3, by sample and column: scrambled Sobol points, the same for every candidate.
pub fn deviations(seed: u64, samples: u32) -> Vec<[f64; COLUMNS]> {
    let one = |i| {
        let mut z = [0.0; COLUMNS];
        for (dimension, column) in (0..).zip(DIMENSIONS) {
            z[column as usize] = normal(seed, i, dimension);
        }
        z
    };
    (0..samples).map(one).collect()
}

/// That of sample `i` for the `k`-th property of the rig.
pub fn deviation(seed: u64, i: usize, k: u32) -> f64 {
    normal(seed, i as u32, COLUMNS as u32 + k)
}

fn normal(seed: u64, i: u32, dimension: u32) -> f64 {
    // Any seed but 0 scrambles.
    let seed = seed.wrapping_mul(2).wrapping_add(1);
    let uniform = (f64::from(Sampler::Sobol.coordinate(seed, dimension, i)) + 0.5) / 4_294_967_296.0;
    quantile(BELOW + (1.0 - 2.0 * BELOW) * uniform)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_normal_cut_at_three_sigma() {
        for seed in [0, 1, 7, u64::MAX] {
            let all = deviations(seed, 1024);
            for column in 0..COLUMNS {
                let of = |power: i32| all.iter().map(|s| s[column].powi(power)).sum::<f64>() / 1024.0;
                assert!(all.iter().all(|s| s[column].abs() <= 3.0));
                // Variance of a normal distribution cut at ±3σ: 0.97334.
                assert!(of(1).abs() < 5e-3 && (of(2) - 0.973_34).abs() < 5e-3, "{} {}", of(1), of(2));
            }
        }
        assert_ne!(deviations(1, 2), deviations(2, 2));
    }
}
