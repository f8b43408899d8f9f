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
use crate::scene::Side;

/// Degrees of freedom that a noise stated in the spec is worth where the repeats bear it out.
const STATED: f64 = 200.0;
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
