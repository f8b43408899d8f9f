//! Whether the machine was quiet enough for the figures: by how much repeats of the same work differ.

use serde_json::{Value, json};

use super::Measured;
use super::place::Place;
use super::stopwatch::Times;

/// Largest spread of repeats, (slowest − fastest) / median, with which a time is sound. On a quiet machine repeats differ by some percent;
/// backends and tolerances are compared where they differ by tens.
pub const BOUND: f64 = 0.15;

/// The spread of all measurements.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    /// Measurements that were repeated.
    pub measurements: usize,
    /// Those whose repeats differ by more than [`BOUND`].
    pub beyond: usize,
    /// The largest spread, and of what.
    pub worst: Option<(f64, String)>,
}

impl Noise {
    /// Of everything that was `measured` on `places`.
    pub fn of(measured: &Measured, places: &[Place]) -> Self {
        let mut noise = Self::default();
        let on = |place: usize| &places[place].name;
        for p in &measured.points {
            let tolerance = p.tolerance.map_or(String::new(), |t| format!(", tolerance {t:e}"));
            noise.take(&p.whole, || {
                format!("{} {} on {}{tolerance}", p.configuration, p.solved.name(), on(p.place))
            });
        }
        for t in &measured.threaded {
            noise.take(&t.times, || format!("{} threads of {}", t.threads, on(t.place)));
        }
        for s in &measured.scaled {
            noise.take(&s.seconds, || {
                format!("a sweep of {} {} taps on {}", s.taps, s.shape.name(), on(s.place))
            });
        }
        noise
    }

    fn take(&mut self, times: &Times, what: impl FnOnce() -> String) {
        let Some(spread) = times.spread else { return };
        self.measurements += 1;
        self.beyond += usize::from(spread > BOUND);
        if self.worst.as_ref().is_none_or(|(worst, _)| spread > *worst) {
            self.worst = Some((spread, what()));
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
    fn a_spread_beyond_the_bound_is_told() {
        let mut noise = Noise::default();
        noise.take(&Times::of(vec![1.0]), || unreachable!("one run has no spread"));
        noise.take(&Times::of(vec![1.0, 1.1, 1.05]), || "quiet".to_owned());
        assert_eq!((noise.measurements, noise.warning()), (1, None));
        noise.take(&Times::of(vec![1.0, 2.0, 3.0]), || "loud".to_owned());
        let said = noise.warning().expect("a spread of 100 %");
        assert!(
            said.starts_with("1 of 2") && said.contains("15 %") && said.contains("loud, by 100 %"),
            "{said}"
        );
        assert_eq!(noise.json()["worst"], 1.0);
    }
}
