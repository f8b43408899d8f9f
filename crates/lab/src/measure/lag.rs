//! A sensor that lags: part of its reading comes late, as rubber and glue creep.

use serde::{Deserialize, Serialize};

use super::Data;

/// A standard linear solid: a settled signal s is read as y = s − gain (s − x), where x follows s with time constant τ. s is assumed constant since
/// the row before.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lag {
    /// Share of the signal that comes late; below 0 if the signal overshoots and fades.
    pub gain: f64,
    /// Standard error of the gain, including that of the time constant.
    pub sigma_gain: f64,
    /// Time constant, seconds.
    pub tau_s: f64,
    /// Standard error of the time constant, s.
    pub sigma_tau_s: f64,
}

/// Largest |gain|.
pub const MOST: f64 = 0.9;

/// State of a lagging sensor.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Memory {
    /// Time and run of the last reading, and x.
    last: Option<(f64, u64, f64)>,
}

impl Memory {
    /// True if `t`, s, is not before the last reading of the same run.
    pub fn follows(&self, t: f64, run: u64) -> bool {
        t.is_finite() && self.last.is_none_or(|(before, of, _)| of != run || t >= before)
    }

    /// The settled value of a reading at `t` s, and the late share of it. The first reading of a run, or after a clock restart, counts as settled; a
    /// missing one changes nothing.
    pub fn settled(&mut self, lag: &Lag, t: f64, run: u64, reading: f64) -> (f64, f64) {
        if !t.is_finite() || !reading.is_finite() {
            return (reading, 0.0);
        }
        let known = self.last.filter(|(before, of, _)| *of == run && t >= *before);
        let Some((before, _, x)) = known else {
            self.last = Some((t, run, reading));
            return (reading, 0.0);
        };
        let stays = (-(t - before) / lag.tau_s).exp();
        let late = lag.gain * stays;
        let settled = (reading - late * x) / (1.0 - late);
        self.last = Some((t, run, settled + stays * (x - settled)));
        (settled, late)
    }
}

impl Lag {
    /// True if the numbers are in range.
    pub fn is_sound(&self) -> bool {
        self.gain.abs() <= MOST
            && [self.sigma_gain, self.sigma_tau_s].iter().all(|s| *s >= 0.0 && s.is_finite())
            && self.tau_s > 0.0
            && self.tau_s.is_finite()
    }

    /// Settled value and late share of every row.
    pub fn settle(&self, data: &Data) -> Vec<(f64, f64)> {
        let mut memory = Memory::default();
        data.rows.iter().map(|r| memory.settled(self, r.t, r.run as u64, r.value)).collect()
    }
}
