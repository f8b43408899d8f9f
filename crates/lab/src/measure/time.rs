//! Times of rows: the runs of a file, during which the rig was not set up anew, and a sensor that lags, as rubber and glue creep.

use super::{Data, Row};
use crate::error::InputError;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

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

/// Runs by their names, with the number of rows and the first line of each.
#[derive(Debug, Default)]
pub struct Runs(IndexMap<String, (usize, usize)>);

impl Runs {
    /// Index of the run named `field`, for the row in `line`.
    pub fn number(&mut self, field: &str, line: usize) -> usize {
        let run = self.0.entry(field.trim().to_owned());
        let place = run.index();
        run.or_insert((0, line)).0 += 1;
        place
    }

    /// Refuses a column that does not name runs, in a file of `rows` rows.
    /// Errors: a run of one row; a different value in each row.
    pub fn check(&self, rows: usize) -> Result<(), InputError> {
        let allowed = "the same value for all rows of a run, two or more; or --columns ignore=NAME";
        if self.0.len() == rows && rows > 1 {
            let error = InputError::new("this column has another value in each row: it does not name runs");
            return Err(error.value(format!("{rows} values")).allowed(allowed));
        }
        let several = self.0.values().any(|run| run.0 > 1);
        let alone = self.0.iter().find(|(_, run)| run.0 == 1 && several);
        let Some((name, (_, line))) = alone else { return Ok(()) };
        let error = InputError::new("this run has one row: nothing is known of its zero and gain");
        Err(InputError { line: Some(*line), ..error.value(name).allowed(allowed) })
    }
}

/// Times above this (3000 years) are not in seconds.
const SECONDS: f64 = 1e11;

/// Refuses a time that cannot be in seconds.
pub fn seconds(t: f64) -> Result<(), InputError> {
    if t.is_nan() || t.abs() < SECONDS {
        return Ok(());
    }
    let unit = match t.abs() {
        t if t < 1e14 => "milliseconds",
        t if t < 1e17 => "microseconds",
        _ => "nanoseconds",
    };
    let error = InputError::new(format!("this time is in {unit}, it seems")).value(t);
    Err(error.allowed("seconds; or --columns ignore=NAME where no time is needed"))
}

/// Refuses times that run backwards. A clock may restart at another distance or run.
/// Errors: The line and the fault.
pub fn forward(rows: &[Row]) -> Result<(), (usize, InputError)> {
    let back = |w: &&[Row]| w[1].t < w[0].t;
    let often = 2 * rows.windows(2).filter(back).count() > rows.len();
    let wrong = |w: &&[Row]| {
        !w[0].t.is_finite()
            || !w[1].t.is_finite()
            || (back(w) && (often || (w[0].run == w[1].run && w[0].a == w[1].a)))
    };
    let Some([above, row]) = rows.windows(2).find(wrong) else { return Ok(()) };
    let (message, least) = match above.t.is_finite() && row.t.is_finite() {
        true => ("this time is before that of the row above it", format!(", {} or later", above.t)),
        false => ("this time is missing", String::new()),
    };
    let line = if above.t.is_finite() { row.line } else { above.line };
    let error = InputError::new(message).value(if row.t.is_finite() { row.t } else { f64::NAN });
    Err((line, error.allowed(format!("seconds that grow{least}; or --columns ignore=t_s"))))
}
