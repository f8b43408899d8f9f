//! What goes with poles that are not upright, and with a second gauge (model §6).

use super::reader::{Item, Result};
use super::schema::Sections;
use crate::scene::{Estimate, Gauge, Model, Theory};

/// Refuses contacts for which there is no model at the poles that tilt, and lean, where `leaning` says.
pub(super) fn allowed(leaning: &[Option<Item<'_>>; 2], model: &Model) -> Result<()> {
    let [tilt, lean] = leaning;
    let why = model.forbids([tilt.is_some(), lean.is_some()]);
    match tilt.as_ref().or(lean.as_ref()).zip(why) {
        Some((item, why)) => Err(item.error(why).allowed("0, or contact = \"frictionless\" in [model]")),
        None => Ok(()),
    }
}

/// Refuses to invert the model for one distance where two gauges are read.
pub(super) fn told(sections: &Sections<'_>, gauge: &Gauge, estimate: &Estimate) -> Result<()> {
    if !gauge.second || estimate.theory != Theory::Exact {
        return Ok(());
    }
    let message = "with second = true in [gauge] a distance is read from two strains, by a formula: the model is not inverted for both";
    let theory = sections.section("estimate").get("theory")?;
    Err(theory.error(message).allowed("\"euler-bernoulli\" or \"timoshenko\", or second = false"))
}
