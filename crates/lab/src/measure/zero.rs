//! The sensor's zero: readings without contact, joined by straight lines in file order.

use serde::{Deserialize, Serialize};

/// Source of a signal's zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TaredBy {
    /// Rows with drive 0.
    Rows,
    /// Rows before contact, whose signal does not depend on drive and distance.
    Plateau,
    /// A constant with which the signals of all drives agree.
    Fitted,
    /// None: the signal counts as tared.
    None,
}

/// The zero of the signal of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tared {
    /// Its source.
    pub from: TaredBy,
    /// Mean subtracted value, in strain or the unit of the reading.
    pub value: f64,
    /// Standard error of a constant zero, same unit; 0 if the zero is not known.
    pub error: f64,
    /// Largest drive before contact, if other than 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
    /// True if readings are 16-bit counts that wrap.
    pub wraps: bool,
}

impl Tared {
    /// True if a row with this drive is a zero reading.
    pub fn rests(&self, drive: f64) -> bool {
        drive == 0.0 || self.until.is_some_and(|until| drive <= until)
    }

    /// Standard error of an unread zero, which may have drifted; 0 if the zero was read or is unknown.
    pub fn unread(&self) -> f64 {
        if matches!(self.from, TaredBy::Rows | TaredBy::Plateau) { 0.0 } else { self.error }
    }
}

/// One of three or four readings is an outlier if the others agree within this share of its deviation.
const TOGETHER: f64 = 0.01;

/// Zero readings of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Zero {
    /// Of each run of zero readings, in file order: mean index in the file, mean value, number of readings.
    runs: Vec<(f64, f64, usize)>,
    /// Number of zero readings.
    pub count: usize,
}

impl Zero {
    /// From (index in the file, value) in file order. Readings without a tap between them form one run.
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
        Self { runs, count: readings.len() }
    }

    /// Zero at an index of the file; constant before the first and after the last reading; 0 without any.
    pub fn at(&self, place: usize) -> f64 {
        self.weights(place).iter().filter(|w| w.1 != 0.0).map(|(r, w, _)| w * self.runs[*r].1).sum()
    }

    /// The runs that determine the zero at an index: their weights, and the variance of their means in units of a reading's.
    pub fn weights(&self, place: usize) -> [(usize, f64, f64); 2] {
        let x = place as f64;
        let next = self.runs.partition_point(|run| run.0 < x);
        let of = |run: usize, weight: f64| (run, weight, 1.0 / self.runs[run].2 as f64);
        match (next.checked_sub(1).map(|i| self.runs[i].0), self.runs.get(next)) {
            (Some(p), Some(&(q, ..))) => {
                let w = (x - p) / (q - p);
                [of(next - 1, 1.0 - w), of(next, w)]
            }
            (Some(_), None) => [of(next - 1, 1.0), (0, 0.0, 0.0)],
            (None, Some(_)) => [of(next, 1.0), (0, 0.0, 0.0)],
            (None, None) => [(0, 0.0, 0.0); 2],
        }
    }

    /// Largest zero minus smallest.
    pub fn drift(&self) -> f64 {
        let values = || self.runs.iter().map(|run| run.1);
        (values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)).max(0.0)
    }

    /// Zero readings off the median of their neighbours by more than 8 standard deviations and a tenth of `scale`: probably taps. Of three or four
    /// readings, one is an outlier if the others agree.
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
