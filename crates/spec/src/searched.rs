//! Properties of the rig as variables and tolerances of `[optimise]`.

use std::sync::Arc;

use super::axis::AxisItem;
use super::properties::{self, variable};
use super::reader::{Item, Result};
use super::schema::Sections;
use crate::scene::search::{Quantity, Robust, Search};
use crate::scene::{Material, Property, Rigs, Spec};

pub(super) const VARIED: [Property; 15] = [
    Property::Exponent,
    Property::Scale,
    Property::Bore,
    Property::Core,
    Property::CoreModulus,
    Property::Curvature,
    Property::CurvatureSlope,
    Property::Turn,
    Property::Across,
    Property::Along,
    Property::Hub,
    Property::Modulus,
    Property::Nu,
    Property::PoleRadius,
    Property::Foil,
];
/// Properties that may differ from what was meant.
pub(super) const UNSURE: [Property; 16] = {
    let mut all = [Property::Friction; 16];
    let mut k = 0;
    while k < VARIED.len() {
        all[k] = VARIED[k];
        k += 1;
    }
    all
};

/// Names of `properties` in a table of `[optimise]`; what stands in an inline table of a spec may also stand in one there.
pub(super) fn names(properties: impl IntoIterator<Item = Property>) -> Vec<&'static str> {
    properties.into_iter().map(|property| property.name().trim_start_matches("root.")).collect()
}

/// Refuses keys that are none of `names`.
pub(super) fn known(item: &Item<'_>, names: &[&'static str]) -> Result<()> {
    let mut tables: Vec<(&str, Vec<&str>)> = vec![("root", vec!["k_theta", "k_y", "k_x"])];
    for (table, key) in names.iter().filter_map(|name| name.split_once('.')) {
        match tables.iter_mut().find(|(known, _)| *known == table) {
            Some((_, keys)) => keys.push(key),
            None => tables.push((table, vec![key])),
        }
    }
    let all: Vec<&str> = names.iter().copied().chain(tables.iter().map(|(table, _)| *table)).collect();
    let judged = item.only(&all).and_then(|()| {
        tables.iter().try_for_each(|(table, keys)| item.child(table).map_or(Ok(()), |inner| inner.only(keys)))
    });
    judged.map_err(|e| e.allowed(names.join(", ")))
}

/// Judges properties of the rig as variables and tolerances.
pub(super) fn vary(sections: &Sections<'_>, spec: &mut Spec, search: &mut Search) -> Result<()> {
    spec.one_rig()?;
    let section = sections.section("optimise");
    let setup = &spec.study.setup;
    let profiled = sections.section("whisker").written("profile").is_some();
    let lacking = |property: Property| match property {
        Property::Scale => (!profiled).then_some("a profile in [whisker]"),
        Property::Exponent => profiled.then_some("D, d and L_a in place of the profile"),
        Property::Core | Property::CoreModulus => {
            (property.get(setup).max(0.0) == 0.0).then_some("core = { diameter, modulus } in [whisker]")
        }
        Property::Bore => (Property::Core.get(setup) > 0.0).then_some("a bore or a core, not both"),
        Property::Modulus => {
            let law = matches!(setup.model.material, Material::Hooke(_) | Material::NeoHookean(_));
            (!law).then_some("material = { hooke = E } or { neo-hookean = E }")
        }
        Property::Foil => {
            property.get(setup).is_nan().then_some("foil = { stiffness, length, width } in [gauge]")
        }
        Property::Friction => property.get(setup).is_nan().then_some("contact = { coulomb = mu } in [model]"),
        _ => None,
    };
    let mut axes = Vec::new();
    for (table, names) in [("variables", true), ("robust", false)] {
        let Some(item) = section.written(table) else { continue };
        for property in UNSURE {
            let Some(place) = variable(&item, property) else { continue };
            let mut unsure = search.robust.iter().flat_map(|robust| &robust.properties);
            // A deviation of 0 asks nothing.
            if !names && !unsure.any(|(p, _)| *p == property) {
                continue;
            }
            let varied = search.variables.iter().find(|v| v.quantity == Quantity::Property(property));
            if let Some(what) = lacking(property) {
                return place.refuse(format!("{} needs more in the spec", property.name()), what);
            }
            if !names && !property.get(setup).is_finite() && varied.is_none() {
                let message = format!("{} has no value from which it could differ", property.name());
                return place.refuse(message, "its value in the spec, or bounds for it in variables");
            }
            if let Some(v) = varied.filter(|_| names) {
                axes.push((property, AxisItem { item: place, axis: vec![v.min, v.max].into() }));
            }
        }
    }
    let upright = spec.study.space.layout().is_none_or(|layout| layout.is_upright());
    let tilts = !upright || search.robust.as_ref().is_some_and(Robust::tilts);
    properties::allowed_together(sections, setup, &axes, tilts)?;
    let mut varied = Vec::new();
    for v in &mut search.variables {
        let Quantity::Property(property) = v.quantity else { continue };
        varied.push(property);
        let written = properties::written(sections, property);
        v.start = written.map(|item| properties::first(&item)).transpose()?;
    }
    if !varied.is_empty() {
        spec.study.setup.rigs = Some(Arc::new(Rigs::listed(varied)));
    }
    Ok(())
}
