//! Repeated timing.

use std::time::Instant;

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
}
