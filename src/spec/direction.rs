//! What goes with poles that are not upright, and with a second gauge (model §6).

use super::reader::{Item, Result};
use super::schema::Sections;
use crate::curve::both;
use crate::scene::{Contact, Estimate, Gauge, Model, Theory};

/// Refuses contacts for which there is no model at the poles that tilt, and lean, where `leaning` says.
pub(super) fn allowed(leaning: &[Option<Item<'_>>; 2], model: &Model) -> Result<()> {
    let [tilt, lean] = leaning;
    let why = model.forbids([tilt.is_some(), lean.is_some()]);
    match tilt.as_ref().or(lean.as_ref()).zip(why) {
        Some((item, why)) if model.contact == Contact::Frictionless => {
            item.refuse(why, "0, or that effect off in [model]")
        }
        Some((item, why)) => item.refuse(why, "0, or contact = \"frictionless\" in [model]"),
        None => Ok(()),
    }
}

/// Refuses to invert the model of two strains for contacts at which they do not tell the tilt.
pub(super) fn check_second_gauge(
    sections: &Sections<'_>,
    gauge: &Gauge,
    estimate: &Estimate,
    model: &Model,
) -> Result<()> {
    let why = both::forbids(model.contact).filter(|_| gauge.second && estimate.theory == Theory::Exact);
    let Some(why) = why else { return Ok(()) };
    let theory = sections.section("estimate").get("theory")?;
    theory.refuse(why, "\"euler-bernoulli\" or \"timoshenko\"; second = false in [gauge]; or contact = \"frictionless\" in [model]")
}
