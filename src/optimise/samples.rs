//! The score of a candidate from those of the whiskers that are sampled around it.

use super::score::{Limit, Score};
use crate::scene::sampler::Sampler;
use crate::scene::search::{Measure, Robust};
use crate::scene::{COLUMNS, Column};
use vibrissa_core::normal::quantile;

/// Figures over the samples; limits of the nominal whisker, and that 90 % of the samples keep theirs.
pub(super) fn gather(robust: &Robust, nominal: &Score, samples: &[Score]) -> Score {
    let mut score = *nominal;
    let mut worst: Vec<f64> = samples
        .iter()
        .map(|s| if s.figures.iter().all(|f| f.is_nan()) { s.worst().max(1.0) } else { s.worst() })
        .collect();
    worst.sort_by(f64::total_cmp);
    let kept = (0.9 * worst.len() as f64).ceil() as usize;
    score.set(Limit::Samples, worst[kept - 1]);
    for (i, figure) in score.figures.iter_mut().enumerate() {
        let values: Vec<f64> = samples.iter().map(|s| s.figures[i]).filter(|f| f.is_finite()).collect();
        *figure = measure(robust.measure, values);
    }
    score
}

/// Mean, or mean of the worst tenth (R. T. Rockafellar and S. Uryasev, J. Risk 2, 2000); NaN of nothing.
fn measure(measure: Measure, mut values: Vec<f64>) -> f64 {
    let n = values.len() as f64;
    match measure {
        Measure::Mean => values.iter().sum::<f64>() / n,
        Measure::Cvar90 => {
            values.sort_by(|a, b| b.total_cmp(a));
            let mass = 0.1 * n;
            let part = |(i, v): (usize, &f64)| v * (mass - i as f64).clamp(0.0, 1.0);
            values.iter().enumerate().map(part).sum::<f64>() / mass
        }
    }
}

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
    use crate::scene::COLUMNS;
    use crate::scene::search::Calibrated;

    #[test]
    fn the_worst_tenth_takes_its_share_of_the_next_value() {
        let values: Vec<f64> = (1..=25).map(f64::from).collect();
        assert_eq!(measure(Measure::Mean, values.clone()), 13.0);
        // 2.5 values: 25, 24 and half of 23.
        assert!((measure(Measure::Cvar90, values) - (25.0 + 24.0 + 11.5) / 2.5).abs() < 1e-12);
        assert!(measure(Measure::Mean, vec![]).is_nan() && measure(Measure::Cvar90, vec![]).is_nan());
    }

    #[test]
    fn nine_of_ten_samples_keep_the_limits() {
        let sample = |strain| {
            let mut s = Score { figures: [1.0; 3], ..Score::NOTHING };
            s.set(Limit::Strain, strain);
            s
        };
        let robust = Robust {
            sd: [0.0; COLUMNS],
            properties: Vec::new(),
            samples: 10,
            measure: Measure::Mean,
            calibrated: Calibrated::Each,
        };
        let with = |bad: usize| {
            let all: Vec<Score> = (0..10).map(|i| sample(if i < bad { 0.5 } else { -0.5 })).collect();
            gather(&robust, &sample(-0.5), &all).violation()
        };
        assert_eq!((with(0), with(1), with(2)), (0.0, 0.0, 0.5));
    }

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
