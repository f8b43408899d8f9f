//! The score of a candidate from those of the whiskers that are sampled around it.

use super::score::{Limit, Score};
use crate::scene::search::{Measure, Robust};

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
}
