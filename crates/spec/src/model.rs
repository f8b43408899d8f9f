//! `[model]`, with `solid`, and `[gauge] foil`: what they exclude, and warnings outside their tested range (model §8).

use std::path::Path;
use std::sync::LazyLock;

use super::properties::first;
use super::{Item, Result, Sections, curve};
use crate::evaluated::both;
use crate::physics::solid::Held;
use crate::scene::{
    Amount, Clamp, Column, Contact, Drive, Foil, Geometry, Material, MaterialFit, Model, Property, Setup,
    Spec, TERMS, Term, Theory,
};

pub(super) fn read(sections: &Sections<'_>, base: &Path) -> Result<(Model, Option<MaterialFit>)> {
    let section = sections.section("model");
    let (material, fit) = law(&section.get("material")?, sections, base)?;
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

fn law(item: &Item<'_>, sections: &Sections<'_>, base: &Path) -> Result<(Material, Option<MaterialFit>)> {
    item.only_known()?;
    let mut laws = item.value.as_table().into_iter().flatten().map(|(key, _)| &**key.get_ref());
    let (Some(law), None) = (laws.next(), laws.next()) else {
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
        let allowed = format!("\"frictionless\", or {off} in [model]");
        return Err(("contact", format!("friction needs {off}: {why}"), allowed));
    }
    Ok(())
}

pub(super) fn leaning([tilt, lean]: &[Option<Item<'_>>; 2], model: &Model) -> Result<()> {
    let why = model.forbids([tilt.is_some(), lean.is_some()]);
    let Some((item, why)) = tilt.as_ref().or(lean.as_ref()).zip(why) else { return Ok(()) };
    let frictionless = model.contact == Contact::Frictionless;
    let off = if frictionless { "that effect off" } else { "contact = \"frictionless\"" };
    item.refuse(why, format!("0, or {off} in [model]"))
}

pub(super) fn check_second_gauge(sections: &Sections<'_>, setup: &Setup) -> Result<()> {
    let inverts = setup.gauge.second && setup.estimate.theory == Theory::Exact;
    let Some(why) = both::forbids(setup.model.contact).filter(|_| inverts) else { return Ok(()) };
    let theory = sections.section("estimate").get("theory")?;
    theory.refuse(why, "\"euler-bernoulli\" or \"timoshenko\"; second = false in [gauge]; or contact = \"frictionless\" in [model]")
}

pub(super) const ALL: &str = r#"[model]
shear = true
extension = true
surface = true
clamp = "bonded"
indentation = true
section = "distorting"
"#;

/// Foils by name, with base length and width of their data sheet, mm. Stiffness of some 33 µm of polyimide, 3 GPa.
const NAMED: [(&str, Foil); 1] =
    [("KFGS-2-120", Foil { stiffness: 100.0, length: 6.3, width: 2.8, strain_limit: None })];

pub(super) fn foil(item: &Item<'_>) -> Result<Foil> {
    if item.value.as_str().is_some() {
        return item.word(&NAMED);
    }
    item.wrong_if(!item.value.is_table(), "this is not a foil")?;
    item.only_known()?;
    let [length, width] = [item.needs("length")?.ranged()?, item.needs("width")?.ranged()?];
    let strain_limit = item.child("strain_limit").map(|v| v.ranged()).transpose()?;
    let stiffness = match (item.child("stiffness"), item.child("thickness"), item.child("modulus")) {
        (Some(stiffness), None, None) => first(&stiffness)?,
        (None, Some(thickness), Some(modulus)) => {
            let stiffness = thickness.ranged()? * modulus.ranged()?;
            let about = Property::Foil.about();
            let message = format!("thickness times modulus is {stiffness} N/mm");
            modulus.refuse_if(!about.range.holds(stiffness), message, about.allowed)?;
            stiffness
        }
        (Some(stiffness), ..) => {
            let message = "a foil has a stiffness, or a thickness and a modulus, not both";
            return stiffness.refuse(message, item.allowed());
        }
        _ => return item.wrong("a foil needs a stiffness, or a thickness and a modulus"),
    };
    Ok(Foil { stiffness, length, width, strain_limit })
}

pub(super) fn is_asked(user: &toml::de::DeTable<'_>) -> bool {
    let model = user.get("model").and_then(|model| model.get_ref().as_table());
    model.and_then(|model| model.get("solid")).and_then(|solid| solid.get_ref().as_bool()) == Some(true)
}

pub(super) fn allowed(sections: &Sections<'_>, setup: &Setup, tilts: bool) -> Result<()> {
    let (model, gauge) = (&setup.model, &setup.gauge);
    let on = |term: &&Term| (term.get)(model).is_on();
    if gauge.second
        && let Some((term, why)) = TERMS.iter().filter(on).find_map(|term| Some((term, term.upright?)))
    {
        let item = sections.section("model").get(term.key)?;
        return item.refuse(why, format!("{}, or second = false in [gauge]", term.off()));
    }
    if gauge.foil.is_none() {
        return Ok(());
    }
    let item = sections.section("gauge").get("foil")?;
    let refuse = |wrong, why, instead| item.refuse_if(wrong, why, format!("no foil, or {instead}"));
    let (linear, rubs) = (model.geometry == Geometry::Linear, model.contact != Contact::Frictionless);
    refuse(linear, "linear theory has no foil", "geometry = \"exact\" in [model]")?;
    let why = "a foil has been computed without friction only";
    refuse(rubs, why, "contact = \"frictionless\" in [model]")?;
    refuse(gauge.second, "a foil has been computed for one gauge only", "second = false")?;
    refuse(tilts, "a foil has been computed for upright edges only", "no tilt and no lean in [tap]")
}

fn ends(spec: &Spec, column: Column) -> Option<[f64; 2]> {
    spec.study.space.axis(column).map(|axis| [axis.min(), axis.max()])
}

/// Refuses a gauge inside the clamp of every whisker, and a foil that none can carry: over its clamp, beyond its tip, or too wide or short.
pub(super) fn fits(sections: &Sections<'_>, spec: &Spec) -> Result<()> {
    let setup = &spec.study.setup;
    let columns = [Column::BaseDiameter, Column::Length, Column::GaugePosition, Column::GridLength];
    let [Some(base), Some(length), Some(place), Some(grid)] = columns.map(|column| ends(spec, column)) else {
        return Ok(());
    };
    if sections.section("optimise").written("variables").is_some() {
        return Ok(()); // A search skips designs that cannot carry it.
    }
    let c0 = Held::new(&setup.model).c0;
    if place[1] < c0 * base[0] && setup.is_plain() {
        let item = sections.section("gauge").get("x_ss")?;
        let why = format!("the gauge begins inside its clamp, which holds the whisker up to {c0} D");
        return item.refuse(why, format!("x_ss ≥ {:.4} mm, or clamp = \"rigid\"", c0 * base[0]));
    }
    let Some(foil) = setup.gauge.foil else { return Ok(()) };
    let half = 0.5 * foil.length;
    let (nearest, farthest) = (place[0] + 0.5 * grid[0], place[1] + 0.5 * grid[1]);
    let item = sections.section("gauge").get("foil")?;
    let (long, wide, [grid, _], [_, tip]) = (foil.length, foil.width, grid, length);
    let allowed = "a foil between the clamp and the tip, centred on the grid";
    let why = format!("a foil of {long} mm is shorter than its grid of {grid} mm: is it written in metres?");
    item.refuse_if(long < grid, why, allowed)?;
    let why = format!("a foil of {wide} mm is wider than the skin of the whisker is round");
    item.refuse_if(wide > std::f64::consts::PI * base[1], why, allowed)?;
    let why = format!("its middle is at most {farthest} mm from there, and it is {long} mm long");
    item.refuse_if(farthest < half, format!("the foil reaches over the clamp: {why}"), allowed)?;
    let why = format!("its middle is at least {nearest} mm from the clamp, it is {long} mm long");
    let why = format!("the foil ends beyond the whisker: {why}, and the largest L_a is {tip} mm");
    item.refuse_if(nearest + half > tip, why, allowed)
}

pub(super) fn doubts(sections: &Sections<'_>, spec: &Spec) -> Vec<String> {
    static WORDS: LazyLock<toml::Table> =
        LazyLock::new(|| include_str!("tested.toml").parse().expect("tested.toml is TOML"));
    let Setup { model, gauge, .. } = &spec.study.setup;
    let [Some(base), Some(tip), Some(length), Some(place), Some(grid), Some(a), _, _, Some(drive)] =
        Column::ALL.map(|column| ends(spec, column))
    else {
        return Vec::new();
    };
    // A rig of a calibration has no distances.
    let tapped = sections.section("tap").written("a").is_some();
    let held = model.clamp != Clamp::Rigid;
    let slender = tip[0] < 0.1 * base[1] || tip[1] > 1.2 * base[0];
    let near = match model.clamp {
        Clamp::Bonded => 0.24,
        Clamp::Glued => 0.45,
        _ => f64::INFINITY,
    };
    let poles = [0.15 * tip[0].min(base[0]), 1.5 * base[1]];
    let [least, most] = match spec.study.setup.drive {
        Drive::Angle => drive,
        Drive::Displacement => [drive[0] / a[1], drive[1] / a[0]].map(|x| x.atan().to_degrees()),
    };
    // Without indentation small angles are the linear limit, which was tested.
    let small = model.indentation && least < 0.5 * (1.0 - 1e-9);
    let any = held || model.indentation || model.distorting || gauge.foil.is_some();
    let mut all = vec![
        ("clamp_contact", held && tapped && a[0] < 1.8 * base[1]),
        ("clamp_length", held && length[0] < 2.5 * base[1]),
        ("clamp_taper", held && slender),
        ("clamp_nu", held && model.nu < 0.3),
        ("clamp_shear", held && !model.shear),
        ("indentation_pole", model.indentation && !(poles[0]..=poles[1]).contains(&model.pole_radius)),
        ("section_contact", model.distorting && tapped && a[0] - place[1] < 1.2 * base[1]),
        ("section_clamp", model.distorting && near.is_infinite()),
        ("section_gauge", model.distorting && near.is_finite() && place[0] < near * base[1]),
        ("angles", tapped && (small || any && most > 10.0 * (1.0 + 1e-9))),
    ];
    if let Some(foil) = &gauge.foil {
        let half = 0.5 * foil.length;
        let [begins, stops] = [place[0] + 0.5 * grid[0] - half, place[1] + 0.5 * grid[1] + half];
        let beyond = |x: f64, range: [f64; 2]| x / base[1] < range[0] || x / base[0] > range[1];
        let wide = beyond(foil.width, [0.15, 0.5]);
        all.extend([
            ("foil_contact", tapped && a[0] < stops + base[1]),
            ("foil_begin", begins < 0.1 * base[1]),
            ("foil_width_near", beyond(foil.width, [0.22, 0.34]) && !wide),
            ("foil_width", wide),
            ("foil_soft", foil.stiffness < 1.0),
            ("foil_length", beyond(foil.length, [0.4, 1.0])),
            ("foil_stiffness", beyond(foil.stiffness / model.material.e0(), [3e-4, 6.3])),
        ]);
    }
    let words = |(key, _)| format!("{} (docs/model.md §8)", WORDS[key].as_str().unwrap_or_default());
    all.into_iter().filter(|(_, beyond)| *beyond).map(words).collect()
}
