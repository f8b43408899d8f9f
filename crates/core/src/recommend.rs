//! The recommended row among complete ones: within the strain limit first, then the smaller value, then the earlier row.

use std::cmp::Ordering;

use crate::status::Status;

/// Order of two complete rows by the words of their taps and their value, smaller is better. [`Ordering::Less`] is the better row.
pub fn order(a: (Status, f64), b: (Status, f64)) -> Ordering {
    a.0.is_strained().cmp(&b.0.is_strained()).then(a.1.total_cmp(&b.1))
}

/// The recommended row and the strain limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// It is within the limit, and no row has a smaller value.
    Best,
    /// It is within the limit, and a row beyond the limit has a smaller value.
    BestWithin,
    /// It is beyond the limit, as every row is.
    Beyond,
}

impl Standing {
    /// Standing of the recommended row `best`; `least` is the smallest value of all rows.
    pub fn of(best: (Status, f64), least: f64) -> Self {
        match best {
            (status, _) if status.is_strained() => Self::Beyond,
            (_, value) if least < value => Self::BestWithin,
            _ => Self::Best,
        }
    }
}

/// Index and standing of the recommended row. A row is incomplete if a tap does not count or its value is missing.
pub fn recommended(rows: impl Iterator<Item = (Status, f64)>) -> Option<(usize, Standing)> {
    let complete = rows.enumerate().filter(|(_, (status, value))| status.counts() && value.is_finite());
    let (mut best, mut least): (Option<(usize, (Status, f64))>, _) = (None, f64::INFINITY);
    for (place, row) in complete {
        least = least.min(row.1);
        if best.is_none_or(|(_, old)| order(row, old).is_lt()) {
            best = Some((place, row));
        }
    }
    best.map(|(place, row)| (place, Standing::of(row, least)))
}
