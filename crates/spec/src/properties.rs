//! Properties of the rig that differ between designs: places of their keys, their axes (a value, a list, a range or samples), and conflicts.

use std::sync::Arc;

use toml::de::DeValue;

use super::keys::Key;
use super::model::{self, check_second_gauge, consistent};
use super::{Item, Result, Sections, built, sections};
use crate::scene::{Axis, Material, Property, Quantity, Rigs, Robust, Sampler, Search, Setup, Signal, Spec};
use crate::scene::{axis::Points, property::Description};

pub(super) fn written<'a>(sections: &Sections<'a>, property: Property) -> Option<Item<'a>> {
    let Description { section, key, .. } = *property.about();
    let section = sections.section(section);
    let mut path = key.split('.');
    let item = match property {
        Property::Noise if super::channels::several(&sections.section("sensor")) => return None,
        Property::Noise if of_strain(sections) => section.written(key)?,
        Property::Noise => sections.section("sensor").written("noise")?,
        Property::Modulus => {
            let material = section.written(key)?;
            ["hooke", "neo-hookean"].into_iter().find_map(|law| material.child(law))?
        }
        _ => section.written(path.next()?)?,
    };
    match property {
        Property::Noise | Property::Modulus => Some(item),
        _ => path.try_fold(item, |item, key| item.child(key)),
    }
}

fn of_strain(sections: &Sections<'_>) -> bool {
    let word = sections.section("sensor").written("signal").and_then(|item| item.text().ok());
    word.is_none_or(|word| word == Signal::Strain.word())
}

pub(super) fn is_axis(item: &Item<'_>) -> bool {
    match item.value {
        DeValue::Array(list) => !list.first().is_some_and(|first| first.get_ref().is_array()),
        DeValue::Table(_) => true,
        _ => false,
    }
}

pub(super) fn axes<'a>(sections: &Sections<'a>, sampled: &mut u32) -> Result<Vec<RigAxis<'a>>> {
    let mut all = Vec::new();
    for property in Property::ALL {
        let Some(item) = written(sections, property).filter(is_axis) else { continue };
        let read = AxisItem::read(item, *sampled)?;
        *sampled += u32::from(read.axis.points().is_some());
        all.push((property, read));
    }
    Ok(all)
}

/// The number at `item`, or the first of its axis; the others are set in each rig.
pub(super) fn first(item: &Item<'_>) -> Result<f64> {
    Ok(AxisItem::read(item.clone(), 0)?.axis.at(0))
}

pub(super) fn searched(sections: &Sections<'_>, property: Property) -> bool {
    let variables = sections.section("optimise").written("variables");
    variables.is_some_and(|variables| variable(&variables, property).is_some())
}

/// Bounds or deviation of `property` in a table of `[optimise]`, under its key or the last part of it.
pub(super) fn variable<'a>(table: &Item<'a>, property: Property) -> Option<Item<'a>> {
    let key = property.name();
    let name = key.trim_start_matches("root.");
    let nested = key.split('.').try_fold(table.clone(), |item, key| item.child(key));
    let found = nested.or_else(|| table.child(key)).or_else(|| table.child(name))?;
    Some(found.of(table.table().and_then(|keys| keys.key(name))))
}

pub(super) fn allowed_together(
    sections: &Sections<'_>,
    setup: &Setup,
    axes: &[RigAxis<'_>],
    tilts: bool,
) -> Result<()> {
    let check = |setup: &Setup, at: Option<&Item<'_>>| {
        check_second_gauge(sections, setup)?;
        built::allowed(sections, setup, tilts, at)?;
        model::allowed(sections, setup, tilts)
    };
    check(setup, None)?;
    for (property, AxisItem { item, axis }) in axes {
        let ends = [axis.min(), axis.max()];
        for value in if let Axis::List(values) = axis { &values[..] } else { &ends } {
            let mut one = setup.clone();
            property.set(&mut one, *value);
            if let Err((_, message, allowed)) = consistent(&one.model) {
                return item.refuse(message, allowed);
            }
            let leaning = one.model.forbids([true; 2]).filter(|_| tilts && one.model.pole_radius > 0.0);
            if let Some(why) = leaning {
                return item.refuse(why, "0, or no tilt and no lean in [tap]");
            }
            check(&one, Some(item))?;
        }
    }
    Ok(())
}

pub(super) fn corners(setup: &Setup, axes: &[RigAxis<'_>]) -> Vec<(Setup, f64)> {
    let mut all = vec![(setup.clone(), 1.0)];
    for (property, axis) in axes {
        let ends = [axis.axis.min(), axis.axis.max()];
        let both = |(setup, scale): &(Setup, f64)| {
            ends.map(|value| {
                let mut one = setup.clone();
                property.set(&mut one, value);
                (one, if *property == Property::Scale { value } else { *scale })
            })
        };
        all = all.iter().flat_map(both).collect();
    }
    all
}

/// Properties that a search may vary: those that can be chosen.
pub(super) fn varied() -> impl Iterator<Item = Property> {
    Property::ALL.into_iter().filter(|property| !matches!(property, Property::Friction | Property::Noise))
}

pub(super) fn unsure() -> impl Iterator<Item = Property> {
    varied().chain([Property::Friction])
}

pub(super) fn names(properties: impl IntoIterator<Item = Property>) -> Vec<&'static str> {
    properties.into_iter().map(|property| property.name().trim_start_matches("root.")).collect()
}

pub(super) fn known(item: &Item<'_>, names: &[&'static str]) -> Result<()> {
    let mut nested: Vec<_> = ["k_theta", "k_y", "k_x"].map(|key| ("root", key)).into();
    nested.extend(names.iter().filter_map(|name| name.split_once('.')));
    let all: Vec<&str> = names.iter().copied().chain(nested.iter().map(|(table, _)| *table)).collect();
    let inner = |(table, _): &(&str, &str)| {
        let own: Vec<&str> = nested.iter().filter(|(one, _)| one == table).map(|(_, key)| *key).collect();
        item.child(table).map_or(Ok(()), |inner| inner.only(&own))
    };
    let judged = item.only(&all).and_then(|()| nested.iter().try_for_each(inner));
    judged.map_err(|e| e.allowed(names.join(", ")))
}

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
        for property in unsure() {
            let Some(place) = variable(&item, property) else { continue };
            let mut unsure = search.robust.iter().flat_map(|robust| &robust.properties);
            // A deviation of 0 has no effect.
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
    allowed_together(sections, setup, &axes, tilts)?;
    let mut varied = Vec::new();
    for v in &mut search.variables {
        let Quantity::Property(property) = v.quantity else { continue };
        varied.push(property);
        let written = written(sections, property);
        v.start = written.map(|item| first(&item)).transpose()?;
    }
    if !varied.is_empty() {
        spec.study.setup.rigs = Some(Arc::new(Rigs::listed(varied)));
    }
    Ok(())
}

const SCALES: [(&str, bool); 2] = [("linear", false), ("log", true)];
const RANGE_KEYS: [&str; 4] = ["from", "to", "steps", "step"];
const SAMPLE_KEYS: [&str; 5] = ["min", "max", "samples", "sampler", "seed"];
const FORMS: &str =
    "a number, a list [4, 7, 10], { from, to, steps }, { from, to, step } or { min, max, samples }";

#[derive(Debug, Clone)]
pub(super) struct AxisItem<'a> {
    pub item: Item<'a>,
    pub axis: Axis,
}

impl<'a> AxisItem<'a> {
    pub fn read(item: Item<'a>, dimension: u32) -> Result<Self> {
        let Some(known) = item.known else { return item.refuse("no axis is asked for", "a number") };
        let axis = match item.value {
            DeValue::Array(_) => Axis::List(list(&item)?),
            DeValue::Table(_) => {
                item.only_known().map_err(|e| e.allowed(FORMS))?;
                let found = |keys: &[&str]| keys.iter().find_map(|key| item.child(key));
                match (found(&RANGE_KEYS), found(&SAMPLE_KEYS)) {
                    (Some(_), Some(other)) => {
                        return other.refuse("this belongs to samples, but the axis is a range", FORMS);
                    }
                    (None, Some(_)) => samples(&item, known, dimension)?,
                    _ => range(&item, known)?,
                }
            }
            DeValue::Integer(_) | DeValue::Float(_) | DeValue::String(_) => Axis::Value(item.ranged()?),
            _ => return item.refuse("this must be a number or an axis", FORMS),
        };
        Ok(Self { item, axis })
    }

    /// The first value that is `bad`, and its place. Ranges are judged by their ends, samples by the single value `best`.
    pub fn first_where(&self, best: f64, bad: impl Fn(f64) -> bool) -> Option<(f64, Item<'a>)> {
        let whole = |value: f64| vec![(value, self.item.clone())];
        let places: Vec<_> = match &self.axis {
            Axis::Value(value) => whole(*value),
            Axis::List(values) => values.iter().copied().zip(self.item.elements()?).collect(),
            Axis::Even(_) | Axis::Log { .. } => {
                let ends = [(self.axis.min(), "from"), (self.axis.max(), "to")];
                ends.into_iter().filter_map(|(value, key)| Some((value, self.item.child(key)?))).collect()
            }
            Axis::Samples { .. } => whole(best),
        };
        places.into_iter().find(|(value, _)| bad(*value))
    }
}

/// A property of the rig with its axis.
pub(super) type RigAxis<'a> = (Property, AxisItem<'a>);

fn list(item: &Item<'_>) -> Result<Vec<f64>> {
    let values = item.elements().into_iter().flatten().map(|e| e.ranged()).collect::<Result<Vec<_>>>()?;
    let empty = values.is_empty();
    item.refuse_if(empty, "this list is empty; at least one value is needed", FORMS).map(|()| values)
}

fn end(item: &Item<'_>, key: &str, known: &'static Key) -> Result<f64> {
    item.need(key)?.of(Some(known)).ranged()
}

fn range(item: &Item<'_>, known: &'static Key) -> Result<Axis> {
    let from = end(item, "from", known)?;
    let last = item.need("to")?.of(Some(known));
    let to = last.number()?;
    let log = scale(item)?;
    let axis = match (item.child("steps"), item.child("step")) {
        (Some(steps), None) => {
            let steps = steps.whole()?;
            if log { Axis::log_steps(from, to, steps) } else { Axis::steps(from, to, steps) }
        }
        (None, Some(step)) if log => return Err(step.error("a logarithmic scale needs steps, not step")),
        (None, Some(step)) => Axis::step(from, to, step.number()?),
        (Some(_), Some(step)) => {
            return Err(step.error("steps and step contradict each other; keep one of them"));
        }
        (None, None) => {
            return item.refuse("steps (the number of values) or step (their distance) is missing", FORMS);
        }
    };
    let axis = axis.map_err(|e| item.place(e))?;
    // `to` itself need not be a value of the axis.
    let outside = known.form.interval().is_some_and(|interval| !interval.holds(axis.max()));
    last.wrong_if(outside, format!("the last value, {}, is out of range", axis.max())).map(|()| axis)
}

fn samples(item: &Item<'_>, known: &'static Key, dimension: u32) -> Result<Axis> {
    let (min, max) = (end(item, "min", known)?, end(item, "max", known)?);
    let samples = item.need("samples")?.whole()?;
    let sampler = item.child("sampler").map_or(Ok(Sampler::Sobol), |s| s.word(&Sampler::WORDS))?;
    let seed = item.child("seed").map_or(Ok(sections::SEED), |s| s.whole())?;
    let log = scale(item)?;
    Axis::samples(min, max, log, Points { samples, sampler, seed }, dimension).map_err(|e| item.place(e))
}

fn scale(item: &Item<'_>) -> Result<bool> {
    item.child("scale").map_or(Ok(false), |s| s.word(&SCALES))
}
