//! `[model]`.

use std::path::Path;

use super::curve;
use super::properties::first;
use super::reader::{Item, Result};
use super::sections::Sections;
use crate::evaluated::both;
use crate::scene::{Amount, Contact, Geometry, Material, MaterialFit, Model, Setup, TERMS, Term, Theory};

pub(super) fn read(sections: &Sections<'_>, base: &Path) -> Result<(Model, Option<MaterialFit>)> {
    let section = sections.section("model");
    let (material, fit) = material(&section.get("material")?, sections, base)?;
    let mut model =
        Model { geometry: section.get("geometry")?.word(&Geometry::WORDS)?, material, ..Model::PLAIN };
    section.get("solid")?.flag()?;
    for term in &TERMS {
        let item = section.get(term.key)?;
        let value = match term.trial {
            Amount::Flag(_) => Amount::Flag(item.flag()?),
            Amount::Word(_) if item.value.as_str().is_some() || item.interval().is_none() => {
                Amount::Word(item.own_word()?)
            }
            Amount::Word(_) => Amount::Number(item.ranged()?),
            Amount::Number(_) => Amount::Number(first(&item)?),
        };
        (term.set)(&mut model, value);
    }
    model.nu = first(&section.get("nu")?)?;
    model.contact = contact(&section.get("contact")?)?;
    if let Err((key, message, allowed)) = consistent(&model) {
        // An effect that `solid = true` switched on is reported at that key.
        let item = section.written(key).or_else(|| section.written("solid"));
        return item.map_or_else(|| section.get(key), Ok)?.refuse(message, allowed);
    }
    Ok((model, fit))
}

fn contact(item: &Item<'_>) -> Result<Contact> {
    if item.value.is_table() {
        item.only_known()?;
        return Ok(Contact::Coulomb(first(&item.need("coulomb")?)?));
    }
    item.word(&[("frictionless", Contact::Frictionless), ("stick", Contact::Stick)])
}

fn material(
    item: &Item<'_>,
    sections: &Sections<'_>,
    base: &Path,
) -> Result<(Material, Option<MaterialFit>)> {
    item.only_known()?;
    let laws = item.value.as_table().into_iter().flatten().map(|(key, _)| &**key.get_ref());
    let laws: Vec<&str> = laws.collect();
    let &[law] = laws.as_slice() else {
        return item.wrong("exactly one material law is needed");
    };
    let value = item.need(law)?;
    let material = match law {
        "hooke" => Material::Hooke(first(&value)?),
        "neo-hookean" => Material::NeoHookean(first(&value)?),
        "mooney-rivlin" => Material::MooneyRivlin(value.numbers()?),
        "yeoh" => Material::Yeoh(value.numbers()?),
        _ => {
            let (fit, warning) = curve::read(&value, base)?;
            sections.warn(warning);
            return Ok((Material::Yeoh(fit.coefficients), Some(fit)));
        }
    };
    if material.e0() > 0.0 && material.e0().is_finite() {
        return Ok((material, None));
    }
    let message = format!("the initial modulus E0 is {} MPa", material.e0());
    let allowed = if law == "yeoh" { "E0 = 6 C10 > 0 MPa" } else { "E0 = 6 (C10 + C01) > 0 MPa" };
    value.refuse(message, allowed)
}

/// Key of an effect in `[model]` that contradicts another, the reason, and the allowed values.
pub(super) type Fault = (&'static str, String, String);

pub(super) fn consistent(model: &Model) -> std::result::Result<(), Fault> {
    let on = |term: &&Term| (term.get)(model).is_on();
    let rubs = model.contact != Contact::Frictionless;
    if model.geometry == Geometry::Linear {
        let term = TERMS.iter().filter(on).find(|term| !term.linear);
        let wrong = match term {
            Some(term) => Some((term.key, term.off())),
            None if rubs => Some(("contact", "\"frictionless\"")),
            None => (!matches!(model.material, Material::Hooke(_))).then_some(("material", "{ hooke = E }")),
        };
        if let Some((key, instead)) = wrong {
            let why = "geometry = \"linear\" has no such effect; it takes only shear, nu, hub, side and a hooke material";
            return Err((key, why.into(), format!("{instead}, or geometry = \"exact\"")));
        }
    }
    for term in TERMS.iter().filter(on) {
        let Some((other, why)) = term.needs else { continue };
        if TERMS.iter().filter(|term| term.key == other).any(|term| !(term.get)(model).is_on()) {
            let why = format!("{} needs {other}: {why}", term.key);
            return Err((term.key, why, format!("{}, or {other} in [model]", term.off())));
        }
    }
    if rubs && !model.extension {
        let why =
            "friction needs extension = true: an inextensible whisker held at its own arc length cannot bend";
        let allowed = "\"frictionless\", or add extension = true to [model]";
        return Err(("contact", why.into(), allowed.into()));
    }
    if rubs && let Some((term, why)) = TERMS.iter().rev().filter(on).find_map(|t| Some((t, t.frictionless?)))
    {
        let off = format!("{} = {}", term.key, term.off());
        return Err((
            "contact",
            format!("friction needs {off}: {why}"),
            format!("\"frictionless\", or {off} in [model]"),
        ));
    }
    Ok(())
}

pub(super) fn leaning([tilt, lean]: &[Option<Item<'_>>; 2], model: &Model) -> Result<()> {
    let why = model.forbids([tilt.is_some(), lean.is_some()]);
    match tilt.as_ref().or(lean.as_ref()).zip(why) {
        Some((item, why)) if model.contact == Contact::Frictionless => {
            item.refuse(why, "0, or that effect off in [model]")
        }
        Some((item, why)) => item.refuse(why, "0, or contact = \"frictionless\" in [model]"),
        None => Ok(()),
    }
}

pub(super) fn check_second_gauge(sections: &Sections<'_>, setup: &Setup) -> Result<()> {
    let inverts = setup.gauge.second && setup.estimate.theory == Theory::Exact;
    let Some(why) = both::forbids(setup.model.contact).filter(|_| inverts) else { return Ok(()) };
    let theory = sections.section("estimate").get("theory")?;
    theory.refuse(why, "\"euler-bernoulli\" or \"timoshenko\"; second = false in [gauge]; or contact = \"frictionless\" in [model]")
}
