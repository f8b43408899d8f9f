//! Repeated timing, and whether the machine was quiet enough for its figures.

use std::time::Instant;

use serde_json::{Value, json};

use super::{Measured, Place};

/// Seconds of repeated runs of the same work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// The fastest run: what the machine can do.
    pub best: f64,
    /// The median run: what it did.
    pub median: f64,
    /// (slowest − fastest) / median; `None` of one run.
    pub spread: Option<f64>,
}

impl Times {
    /// Of at least one run.
    pub fn of(mut seconds: Vec<f64>) -> Self {
        seconds.sort_by(f64::total_cmp);
        let n = seconds.len();
        let median = 0.5 * (seconds[(n - 1) / 2] + seconds[n / 2]);
        let spread = (n > 1).then(|| (seconds[n - 1] - seconds[0]) / median);
        Self { best: seconds[0], median, spread }
    }

    /// Nanoseconds per each of `n`.
    pub fn per(&self, n: usize) -> Self {
        let scale = 1e9 / n as f64;
        Self { best: self.best * scale, median: self.median * scale, spread: self.spread }
    }
}

/// Seconds after which slow work is not repeated more often than twice.
const ENOUGH: f64 = 1.5;

/// Times `repeats` ≥ 1 runs of `f`, slow ones only two; the result is that of the last.
pub(super) fn repeat<T, E>(repeats: usize, mut f: impl FnMut() -> Result<T, E>) -> Result<(T, Times), E> {
    let mut seconds = Vec::with_capacity(repeats);
    loop {
        let start = Instant::now();
        let result = f()?;
        seconds.push(start.elapsed().as_secs_f64());
        let slow = seconds.len() >= 2 && seconds.iter().sum::<f64>() > ENOUGH;
        if slow || seconds.len() >= repeats {
            return Ok((result, Times::of(seconds)));
        }
    }
}

/// Largest spread of repeats, (slowest − fastest) / median, with which a time is sound. On a quiet machine repeats differ by some percent;
/// backends and tolerances are compared where they differ by tens.
const BOUND: f64 = 0.15;

/// By how much repeats of the same work differ.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    /// Measurements that were repeated.
    measurements: usize,
    /// Those whose repeats differ by more than [`BOUND`].
    beyond: usize,
    /// The largest spread, and of what.
    worst: Option<(f64, String)>,
}

impl Noise {
    /// Of everything that was `measured` on `places`.
    pub fn of(measured: &[Measured], places: &[Place]) -> Self {
        let spreads: Vec<_> = measured.iter().filter_map(|m| Some((m.times.spread?, &m.step))).collect();
        let worst = spreads.iter().rev().max_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            measurements: spreads.len(),
            beyond: spreads.iter().filter(|(spread, _)| *spread > BOUND).count(),
            worst: worst.map(|(spread, step)| (*spread, step.words(places))),
        }
    }

    /// What to say where the machine was too noisy.
    pub fn warning(&self) -> Option<String> {
        let Self { measurements, beyond, worst: Some((spread, what)) } = self else { return None };
        (*beyond > 0).then(|| {
            format!(
                "{beyond} of {measurements} times differ by more than {:.0} % between repeats, (slowest − fastest) / median; most of all {what}, by {:.0} %: \
                 this machine does something else too, and these figures may be too slow",
                100.0 * BOUND,
                100.0 * spread
            )
        })
    }

    /// As in run.json.
    pub fn json(&self) -> Value {
        json!({
            "bound": BOUND,
            "measure": "(slowest - fastest) / median of the repeats",
            "measurements": self.measurements,
            "beyond": self.beyond,
            "worst": self.worst.as_ref().map(|(spread, _)| spread),
            "worst_of": self.worst.as_ref().map(|(_, what)| what),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn best_median_and_spread_of_as_many_runs_as_asked() {
        let t = Times::of(vec![4.0, 1.0, 2.0, 3.0]).per(1000);
        assert!((t.best - 1e6).abs() < 1e-6 && (t.median - 2.5e6).abs() < 1e-6 && t.spread == Some(1.2));
        assert_eq!(Times::of(vec![3.0]).spread, None);
        let mut n = 0;
        let last = repeat(4, || -> Result<i32, ()> {
            n += 1;
            Ok(n)
        });
        assert_eq!((last.unwrap().0, n), (4, 4));
        assert_eq!(repeat(4, || Err::<(), _>("no")), Err("no"));
    }

    #[test]
    fn a_spread_beyond_the_bound_is_told() {
        let noise = Noise { measurements: 2, beyond: 0, worst: Some((0.1, "quiet".to_owned())) };
        assert_eq!(noise.warning(), None);
        let loud = Noise { beyond: 1, worst: Some((1.0, "loud".to_owned())), ..noise };
        let said = loud.warning().expect("a spread of 100 %");
        assert!(
            said.starts_with("1 of 2") && said.contains("15 %") && said.contains("loud, by 100 %"),
            "{said}"
        );
    }
}
