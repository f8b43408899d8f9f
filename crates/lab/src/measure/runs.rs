//! Runs of a data file, during which the rig was not set up anew, and their times.

use indexmap::IndexMap;

use super::file::Row;
use crate::error::InputError;

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
    ///
    /// # Errors
    /// A run of one row; a different value in each row.
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
///
/// # Errors
/// The line and the fault.
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
