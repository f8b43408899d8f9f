//! How much one reading scatters.

use super::suspects::Scatter;
use crate::error::Error;
use crate::estimator::cells::{Cell, Levels, cells, repeatability};
use crate::estimator::fit::{Taring, Task};
use crate::estimator::model::error::ModelError;
use crate::estimator::model::exact::Opener;
use crate::estimator::taps::Tap;
use crate::locate::Parameter;
use crate::measure::Rig;
use crate::measure::group::rounding;
use crate::scene::Side;

/// Degrees of freedom that a noise stated in the spec is worth where the repeats bear it out.
const STATED: f64 = 200.0;
/// Readings are of a converter where they differ by whole steps, but for this share of one, and at so many values at least.
const WHOLE: f64 = 0.02;
const VALUES: usize = 4;

/// Step of the readings, as a difference of signals: of the converter that made them, or of the digits that were written; 0 where they
/// have none.
pub fn step(taps: &[Tap]) -> f64 {
    let known = || taps.iter().filter(|t| t.value.is_finite() && t.signal.is_finite());
    let mut values: Vec<f64> = known().map(|t| t.value).collect();
    values.sort_by(f64::total_cmp);
    let [Some(first), Some(last)] = [values.first(), values.last()] else { return 0.0 };
    let [first, last] = [*first, *last];
    values.dedup_by(|q, p| *q - *p <= rounding(last.abs().max(first.abs())));
    let gaps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let whole = |gap: &f64| (gap / least - (gap / least).round()).abs() <= WHOLE;
    if values.len() < VALUES || !gaps.iter().all(whole) {
        return 0.0;
    }
    let signals = known().map(|t| t.signal).fold([f64::MAX, f64::MIN], |[lo, hi], s| [lo.min(s), hi.max(s)]);
    least * (signals[1] - signals[0]) / (last - first)
}

/// Noise of one reading and where it comes from, where the steps of the readings are not more: their standard deviation is step/√12.
pub fn or_steps((noise, from): (f64, String), taps: &[Tap]) -> (f64, String) {
    let of_steps = step(taps) / 12.0f64.sqrt();
    if noise < of_steps { (of_steps, "the steps of the readings".to_owned()) } else { (noise, from) }
}

/// Standard deviation of one reading from repeats or from the spec, and where it comes from; `None` where neither says.
pub fn stated(
    rig: &Rig,
    strain: bool,
    taps: &[Tap],
    sides: &[(f64, Side, Scatter)],
) -> Option<(f64, String)> {
    let (mut squares, mut freedom) = (0.0, 0.0);
    for (sign, ..) in sides {
        if let Some((sd, n)) = repeatability(&of_side(rig, taps, *sign)) {
            squares += sd * sd * n;
            freedom += n;
        }
    }
    // A spread that is only rounding is none.
    let mut sizes: Vec<f64> = taps.iter().filter(|t| t.reason.is_none()).map(|t| t.signal.abs()).collect();
    let rounding = 1e-12 * crate::reduce::median(&mut sizes);
    let repeats = (squares / freedom).sqrt();
    let repeats = if repeats < rounding { 0.0 } else { repeats };
    let stated = rig.setup.gauge.noise_strain.filter(|_| strain);
    let agree = |s: f64| repeats > 0.0 && s > 0.0 && (repeats / s).ln().abs() < 2.0 / (2.0 * freedom).sqrt();
    match (freedom >= 3.0, stated) {
        (true, Some(s)) if agree(s) => {
            let pooled = (freedom * repeats * repeats + STATED * s * s) / (freedom + STATED);
            let from =
                "repeats ({n} degrees of freedom), and gauge.noise_strain of the spec, which they bear out";
            Some((pooled.sqrt(), from.replace("{n}", &freedom.to_string())))
        }
        (true, _) => Some((repeats, format!("repeats ({freedom} degrees of freedom)"))),
        (false, Some(noise)) => {
            Some((noise, "gauge.noise_strain of the spec, for want of repeats".to_owned()))
        }
        (false, None) => None,
    }
}

/// Standard deviation of one reading from what a smooth surface, or the fit of the model, leaves: the smaller of the two, since
/// either may leave more than noise.
///
/// # Errors
/// A backend that fails.
pub fn scatter(
    rig: &Rig,
    taps: &[Tap],
    sides: &[(f64, Side, Scatter)],
    recorded: bool,
    fit: &[Parameter],
    open: Opener<'_>,
) -> Result<(f64, String), Error> {
    let smooth = sides.iter().map(|s| s.2.signal).fold(0.0, f64::max);
    let from = |what: &str| format!("{what}, for want of repeats");
    let (mut squares, mut freedom) = (0.0, 0.0);
    for (sign, gauge, _) in sides {
        let cells = of_side(rig, taps, *sign);
        let Some(at) = super::extent(rig, taps, *sign, *gauge).filter(|_| recorded) else { continue };
        let task = Task { rig, at, cells: &cells, noise: 0.0, zero: Taring::Known, open };
        let Some(fit) = ModelError::of_run(task.fit(fit))? else { continue };
        squares += fit.residuals.iter().zip(&fit.cells).map(|(e, k)| e * e / cells[*k].share).sum::<f64>();
        freedom += fit.cells.len() as f64 - fit.exact.fitted.len() as f64;
    }
    let left = (squares / freedom).sqrt();
    if freedom > 0.0 && left < smooth {
        return Ok((left, from("residuals of the model")));
    }
    Ok((smooth, from("scatter about a smooth surface")))
}

/// Cells of the usable taps of one side.
pub(super) fn of_side(rig: &Rig, taps: &[Tap], sign: f64) -> Vec<Cell> {
    let here = |t: &Tap| t.reason.is_none() && t.signal.signum() == sign;
    let levels = |f: fn(&Tap) -> f64| Levels::of(taps.iter().filter(|t| here(t)).map(f));
    let (distances, drives) = (levels(|t| t.group[0]), levels(|t| t.group[1]));
    if distances.is_empty() {
        return Vec::new();
    }
    cells(taps, rig, &distances, &drives, here)
}
