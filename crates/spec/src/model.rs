//! `[model]`.

use std::path::Path;

use super::check;
use super::curve;
use super::properties::first;
use super::reader::{Item, Result};
use super::sections::Section;
use crate::scene::{Amount, Contact, Geometry, Material, MaterialFit, Model, TERMS};

/// The section, and where its material comes from if that is a curve.
pub(super) struct Read {
    pub model: Model,
    pub fit: Option<MaterialFit>,
    pub warning: Option<String>,
}

/// Reads the section and refuses effects that contradict each other; paths are relative to `base`.
pub(super) fn read(section: &Section<'_>, base: &Path) -> Result<Read> {
    let geometries = [("exact", Geometry::Exact), ("linear", Geometry::Linear)];
    let (material, fit, warning) = material(&section.get("material")?, base)?;
    let mut model = Model { geometry: section.get("geometry")?.word(&geometries)?, material, ..Model::PLAIN };
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
    if let Err((key, message, allowed)) = check::consistent(&model) {
        // What `solid = true` switched on is told where that stands.
        let item = section.written(key).or_else(|| section.written("solid"));
        return item.map_or_else(|| section.get(key), Ok)?.refuse(message, allowed);
    }
    Ok(Read { model, fit, warning })
}

fn contact(item: &Item<'_>) -> Result<Contact> {
    if item.value.is_table() {
        item.only_known()?;
        return Ok(Contact::Coulomb(first(&item.need("coulomb")?)?));
    }
    item.word(&[("frictionless", Contact::Frictionless), ("stick", Contact::Stick)])
}

/// The law, the fit it comes from, and a warning about the curve file.
type Law = (Material, Option<MaterialFit>, Option<String>);

fn material(item: &Item<'_>, base: &Path) -> Result<Law> {
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
            return Ok((Material::Yeoh(fit.coefficients), Some(fit), warning));
        }
    };
    if material.e0() > 0.0 && material.e0().is_finite() {
        return Ok((material, None, None));
    }
    let message = format!("the initial modulus E0 is {} MPa", material.e0());
    let allowed = if law == "yeoh" { "E0 = 6 C10 > 0 MPa" } else { "E0 = 6 (C10 + C01) > 0 MPa" };
    value.refuse(message, allowed)
}
