//! What goes with poles that are not upright, and with a second gauge (model §6).

use super::reader::{Item, Result};
use super::schema::Sections;
use crate::scene::{Contact, Estimate, Gauge, Model, Theory};

/// Refuses contacts for which there is no model at the poles that tilt, and lean, where `leaning` says.
pub(super) fn allowed([tilt, lean]: &[Option<Item<'_>>; 2], model: &Model) -> Result<()> {
    match model.contact {
        Contact::Coulomb(_) => {
            let Some(item) = tilt.as_ref().or(lean.as_ref()) else { return Ok(()) };
            let message = "with contact = { coulomb = … } the object's edge must be upright: the contact slides along the whisker and along \
                           the edge, and friction depends on the path";
            Err(item.error(message).allowed("0, or contact = \"frictionless\" in [model]"))
        }
        Contact::Stick if model.surface => {
            let Some(item) = tilt else { return Ok(()) };
            let message = "with contact = \"stick\" and surface = true the object's edge must not tilt: the point that sticks lies off the \
                           plane of rotation, and twists the whisker";
            Err(item.error(message).allowed("0, or surface = false or contact = \"frictionless\" in [model]"))
        }
        Contact::Stick | Contact::Frictionless => Ok(()),
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
