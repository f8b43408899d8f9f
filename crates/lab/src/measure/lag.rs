//! A sensor that lags: a part of its reading comes late, as rubber and glue creep.

use serde::{Deserialize, Serialize};

use super::Data;

/// A standard linear solid between whisker and reading: of a signal s that settles, y = s − gain (s − x) is read, where x follows s
/// with the time constant τ. A row stands at the end of what it shows: s has been as it is since the row before.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lag {
    /// Share of the signal that comes late; below 0 where the signal is too large first and fades.
    pub gain: f64,
    /// Its standard error, the time constant being uncertain too.
    pub sigma_gain: f64,
    /// Time constant, seconds.
    pub tau_s: f64,
    /// Its standard error.
    pub sigma_tau_s: f64,
}

/// Largest |gain|.
pub const MOST: f64 = 0.9;

/// What a sensor that lags remembers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Memory {
    /// Time and run of the last reading, and x.
    last: Option<(f64, u64, f64)>,
}

impl Memory {
    /// Whether a reading at `t` seconds comes after the one that is remembered, of its run; the first one of a run does.
    pub fn follows(&self, t: f64, run: u64) -> bool {
        t.is_finite() && self.last.is_none_or(|(before, of, _)| of != run || t >= before)
    }

    /// What a reading at `t` seconds settles to, and the share of what it settles to that was missing. The first one of a run, and the
    /// first one after a clock that starts anew, is taken as settled; one that is missing tells nothing.
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
    /// Whether its numbers are those of a lag.
    pub fn is_sound(&self) -> bool {
        self.gain.abs() <= MOST
            && [self.sigma_gain, self.sigma_tau_s].iter().all(|s| *s >= 0.0 && s.is_finite())
            && self.tau_s > 0.0
            && self.tau_s.is_finite()
    }

    /// What every row of `data` settles to, and what of it was missing.
    pub fn settle(&self, data: &Data) -> Vec<(f64, f64)> {
        let mut memory = Memory::default();
        data.rows.iter().map(|r| memory.settled(self, r.t, r.run as u64, r.value)).collect()
    }
}
