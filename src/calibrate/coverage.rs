//! Whether σ keeps its word: errors at positions left out, against the σ that `locate` gives there. Positions to which an estimator
//! extrapolates when they are left out say nothing of it.

use serde::Serialize;

use super::Calibrated;
use super::output::side_name;
use crate::estimator::judged;
use crate::locate::Locator;

/// How many errors of one position lie within 1 σ and beyond 3 σ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// contact or far.
    pub side: &'static str,
    /// The position, mm.
    pub a_mm: f64,
    /// Taps with an answer.
    pub n: usize,
    /// Share within 1 σ.
    pub within_1: f64,
    /// The binomial interval of that share at 95 % (Wilson 1927).
    pub interval: [f64; 2],
    /// Share beyond 3 σ.
    pub beyond_3: f64,
}

impl Coverage {
    fn new(side: &'static str, a_mm: f64, ratios: &[f64]) -> Self {
        let n = ratios.len() as f64;
        let share = |f: &dyn Fn(&f64) -> bool| ratios.iter().filter(|r| f(r)).count() as f64 / n;
        let (p, z2) = (share(&|r| *r <= 1.0), 1.96f64 * 1.96);
        let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = (p * (1.0 - p) * z2 / n + z2 * z2 / (4.0 * n * n)).sqrt() / (1.0 + z2 / n);
        let interval = [(middle - half).max(0.0), (middle + half).min(1.0)];
        Self { side, a_mm, n: ratios.len(), within_1: p, interval, beyond_3: share(&|r| *r > 3.0) }
    }
}

/// Of the estimator that won.
#[derive(Debug, Clone, PartialEq)]
pub struct Covered {
    /// By position.
    pub positions: Vec<Coverage>,
    /// Over all positions; `None` without answers.
    pub all: Option<Coverage>,
}

/// How errors on distances left out compare with the σ of `locator`.
pub fn coverage(found: &Calibrated, locator: &Locator) -> Covered {
    let (mut positions, mut all) = (Vec::new(), Vec::new());
    for side in &found.sides {
        let Some(held) = side.held_out(found.winner) else { continue };
        let judged = judged(found.winner, side.distances.len());
        for (i, a) in side.distances.centres.iter().enumerate().filter(|(i, _)| judged.contains(i)) {
            let taps = side.cells.iter().filter(|c| c.i == i).flat_map(|c| &c.taps);
            let ratio = |k: &usize| {
                let tap = &found.taps[*k];
                let drive = tap.drive + locator.drive_origin;
                (held.taps[*k] / locator.locate_above(drive, tap.signal, 0.0, tap.zero_share()).sigma).abs()
            };
            let ratios: Vec<f64> = taps.map(ratio).filter(|r| r.is_finite()).collect();
            if !ratios.is_empty() {
                positions.push(Coverage::new(side_name(side.gauge), *a, &ratios));
                all.extend(ratios);
            }
        }
    }
    let all = (!all.is_empty()).then(|| Coverage::new("", f64::NAN, &all));
    Covered { positions, all }
}
