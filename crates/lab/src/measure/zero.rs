//! The sensor's zero: readings without contact, taken now and then, joined by straight lines in file order.

use serde::{Deserialize, Serialize};

/// How the zero of a signal was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TaredBy {
    /// Rows whose drive is 0.
    Rows,
    /// Rows before contact: the signal does not yet depend on drive and distance.
    Plateau,
    /// A constant that makes the signals of all drives fit together.
    Fitted,
    /// A value beyond all signals, for want of a zero: it gives them one sign, and means nothing.
    Reference,
    /// Not at all: the signal was taken as tared.
    None,
}

/// The zero of the signal of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tared {
    /// How it was found.
    pub from: TaredBy,
    /// Mean of what was subtracted, strain or unit of the reading.
    pub value: f64,
    /// Its standard error if it does not drift, in the same unit; 0 where nothing says what the zero is.
    pub error: f64,
    /// Largest drive of the rows before contact, where these are not at drive 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
    /// Whether readings are counts of 16 bits that begin anew beyond their range.
    pub wraps: bool,
}

impl Tared {
    /// Whether a row with this drive is a zero reading.
    pub fn rests(&self, drive: f64) -> bool {
        drive == 0.0 || self.until.is_some_and(|until| drive <= until)
    }
}

/// Share of what one of few readings is off by within which the others are together.
const TOGETHER: f64 = 0.01;

/// Zero readings of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Zero {
    /// (place in the file, value) of each run of zero readings: means over the run, in file order.
    runs: Vec<(f64, f64)>,
    /// Readings of each run.
    sizes: Vec<usize>,
    /// Zero readings that were used.
    pub count: usize,
}

impl Zero {
    /// From (place in the file, value), in file order. Readings that follow each other with no tap between are one run.
    pub fn new(readings: &[(usize, f64)]) -> Self {
        let mut runs: Vec<(f64, f64, usize)> = Vec::new();
        let mut last = None;
        for &(place, value) in readings {
            match runs.last_mut() {
                Some((p, v, n)) if last == Some(place.wrapping_sub(1)) => {
                    *n += 1;
                    *p += (place as f64 - *p) / *n as f64;
                    *v += (value - *v) / *n as f64;
                }
                _ => runs.push((place as f64, value, 1)),
            }
            last = Some(place);
        }
        Self {
            sizes: runs.iter().map(|r| r.2).collect(),
            runs: runs.into_iter().map(|(p, v, _)| (p, v)).collect(),
            count: readings.len(),
        }
    }

    /// Zero at a place in the file; held before the first and after the last reading; 0 without any.
    pub fn at(&self, place: usize) -> f64 {
        self.weights(place).iter().filter(|(_, w)| *w != 0.0).map(|(r, w)| w * self.runs[*r].1).sum()
    }

    /// The runs that make the zero at a place, and their weights.
    pub fn weights(&self, place: usize) -> [(usize, f64); 2] {
        let x = place as f64;
        let next = self.runs.partition_point(|(p, _)| *p < x);
        match (next.checked_sub(1).map(|i| self.runs[i].0), self.runs.get(next)) {
            (Some(p), Some(&(q, _))) => {
                let w = (x - p) / (q - p);
                [(next - 1, 1.0 - w), (next, w)]
            }
            (Some(_), None) => [(next - 1, 1.0), (0, 0.0)],
            (None, Some(_)) => [(next, 1.0), (0, 0.0)],
            (None, None) => [(0, 0.0); 2],
        }
    }

    /// Number of readings in each run.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Largest zero less smallest.
    pub fn drift(&self) -> f64 {
        let values = || self.runs.iter().map(|(_, v)| *v);
        (values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)).max(0.0)
    }

    /// Places of readings that lie off the line through their neighbours by more than 8 times what is usual, and by more
    /// than a tenth of `scale`: taps recorded as zero, most likely. Of three or four readings one is none where the others are together.
    pub fn outliers(readings: &[(usize, f64)], scale: f64) -> Vec<usize> {
        if readings.len() < 5 {
            let middle = crate::reduce::median(&mut readings.iter().map(|r| r.1).collect::<Vec<_>>());
            let mut by_size: Vec<(usize, f64)> =
                readings.iter().map(|r| (r.0, (r.1 - middle).abs())).collect();
            by_size.sort_by(|p, q| q.1.total_cmp(&p.1));
            return match by_size[..] {
                [(place, off), (_, next), _, ..] if off > 0.1 * scale && next < TOGETHER * off => vec![place],
                _ => Vec::new(),
            };
        }
        let off: Vec<f64> = (0..readings.len())
            .map(|i| {
                let from = i.saturating_sub(2).min(readings.len() - 5);
                let mut near: Vec<f64> = readings[from..from + 5].iter().map(|r| r.1).collect();
                (readings[i].1 - crate::reduce::median(&mut near)).abs()
            })
            .collect();
        let usual = crate::reduce::median(&mut off.clone());
        let far = |&i: &usize| off[i] > 8.0 * 1.4826 * usual && off[i] > 0.1 * scale;
        (0..readings.len()).filter(far).map(|i| readings[i].0).collect()
    }
}
