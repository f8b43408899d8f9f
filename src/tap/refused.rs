//! Whiskers for which there is no best drive, and why.

use super::{Sample, write};
use crate::design::Design;
use crate::error::InputError;
use crate::optimise::score::Limit;
use crate::scene::{Layout, Setup, Signal};

/// Fails where a tap is asked for that no drive makes felt: with its contact at or before the gauge's near end.
pub(super) fn beyond_gauge(setup: &Setup, layout: &Layout) -> Result<(), InputError> {
    let design = Design::new(setup, layout.design(0));
    let ([nearest, _], Some(shared)) = (layout.reach(), design.shared) else { return Ok(()) };
    let begins = shared.gauge[0];
    if setup.signal != Signal::Strain || setup.channels.is_some() || nearest > begins {
        return Ok(());
    }
    let name = write::unit(setup).0;
    Err(InputError::new(format!(
        "no {name} gives a complete row: a tap at {nearest} mm does not bend the gauge, which begins at {begins} mm (no_strain)"
    ))
    .key("tap.a")
    .value(nearest)
    .allowed(format!("> {begins} mm, or a gauge nearer to the clamp")))
}

/// No drive gives a complete row.
pub(super) fn incomplete(setup: &Setup, samples: &[Sample]) -> InputError {
    let status = samples.iter().fold(samples[0].row.status, |all, s| all | s.row.status);
    let name = write::unit(setup).0;
    InputError::new(format!("no {name} of the interval gives a complete row; the taps are {status}"))
        .key("tap.a")
        .allowed("distances beyond the gauge and before the tip")
}

/// No drive keeps the strain limit.
pub(super) fn overstrained(setup: &Setup, samples: &[Sample]) -> InputError {
    let name = write::unit(setup).0;
    let over = samples.iter().map(|s| s.score.limit(Limit::Strain)).fold(f64::INFINITY, f64::min);
    // Of the skin, which a foil reads less of.
    let least = setup.gauge.strain_limit * (1.0 + over);
    InputError::new(format!(
        "every {name} of the interval strains the gauge beyond its limit: at least {least:.4}, {:.3} times the limit",
        1.0 + over
    ))
    .key("gauge.strain_limit")
    .value(setup.gauge.strain_limit)
    .allowed(format!("≥ {least:.4}, or a smaller {name}"))
}
