//! A zero that drifts and was never read: repeats of the same tap tell how fast.

use crate::estimator::cells::{Cell, Levels, cells};
use crate::estimator::taps::Tap;
use crate::measure::Rig;
use crate::reduce::median;

/// A slope is one beyond so many of its standard errors, and where it carries the zero by so many standard deviations of a reading.
const CERTAIN: f64 = 6.0;
/// Rows that were carried by more than so many standard deviations are named.
const NAMED: f64 = 3.0;

/// A drift of the zero, taken as straight over the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Signal per row.
    pub slope: f64,
    /// Its standard error.
    pub error: f64,
    /// Drift below which a row is not named.
    pub least: f64,
}

/// The drift that repeats of all sides show together.
pub fn of_all(rig: &Rig, taps: &[Tap], signs: &[f64]) -> Option<Drift> {
    let mut all = Vec::new();
    for sign in signs {
        let here = |t: &Tap| t.reason.is_none() && t.signal.signum() == *sign;
        let levels = |f: fn(&Tap) -> f64| Levels::of(taps.iter().filter(|t| here(t)).map(f));
        all.extend(cells(taps, rig, &levels(|t| t.group[0]), &levels(|t| t.group[1]), here));
    }
    find(taps, &all)
}

/// The drift that repeats in `all` show, if it is certain; the slope is a median of pairs, so that single wrong rows do not count.
fn find(taps: &[Tap], all: &[Cell]) -> Option<Drift> {
    let mut slopes = Vec::new();
    for cell in all.iter().filter(|c| c.taps.len() >= 2) {
        let half = cell.taps.len() / 2;
        slopes.extend((0..half).map(|k| {
            let (p, q) = (&taps[cell.taps[k]], &taps[cell.taps[k + cell.taps.len() - half]]);
            (q.signal - p.signal) / (q.place as f64 - p.place as f64)
        }));
    }
    if slopes.len() < 5 {
        return None;
    }
    let slope = median(&mut slopes);
    let (mut spread, mut off, mut n) = (0.0, Vec::new(), 0.0);
    for cell in all.iter().filter(|c| c.taps.len() >= 2) {
        let mean = |f: &dyn Fn(&Tap) -> f64| cell.taps.iter().map(|&k| f(&taps[k])).sum::<f64>() / cell.n();
        let rest = |t: &Tap| t.signal - slope * t.place as f64;
        let (place, level) = (mean(&|t| t.place as f64), mean(&rest));
        let small = (cell.n() / (cell.n() - 1.0)).sqrt();
        for tap in cell.taps.iter().map(|&k| &taps[k]) {
            spread += (tap.place as f64 - place).powi(2);
            off.push((rest(tap) - level).abs() * small);
        }
        n += cell.n();
    }
    let noise = 1.4826 * median(&mut off);
    // A median is 1.25 times as uncertain as a mean; pairs of halves use most of the lever there is.
    let error = 1.5 * noise / spread.sqrt();
    let carried = slope.abs() * taps.len() as f64;
    let sizes: f64 = all.iter().map(|c| c.signal * c.n()).sum::<f64>() / n;
    let certain = slope.abs() > CERTAIN * error && carried > CERTAIN * noise && carried > 1e-6 * sizes;
    certain.then_some(Drift { slope, error, least: NAMED * noise })
}

/// Takes the drift off every tap; the first row of the file is taken as right.
pub fn remove(taps: &mut [Tap], drift: &Drift) {
    for tap in taps {
        tap.drift = drift.slope * tap.place as f64;
        tap.signal -= tap.drift;
    }
}
