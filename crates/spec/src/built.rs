//! Built whiskers in `[whisker]`, and `[sensor]` (model §7).

use std::path::Path;
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use super::properties::{first, is_axis, searched};
use super::table::{self, Columns, Source};
use super::{AxisItem, Document, InputError, Item, Limit, Result, Section, Sections, channels, keys};
use crate::design::MOST;
use crate::scene::built::{Built, Inner, Profile, Root};
use crate::scene::{Channels, Clamp, Convention, Gauge, Material, Property, Setup, Signal, TERMS, Term};

struct Shape {
    diameter: Vec<[f64; 2]>,
    inner: Option<(&'static str, Vec<[f64; 2]>)>,
    warning: Option<String>,
}

fn pairs(item: &Item<'_>) -> Result<Vec<[f64; 2]>> {
    let Some(elements) = item.elements() else { return item.wrong("this must be a list of pairs") };
    let mut all: Vec<[f64; 2]> = Vec::new();
    for pair in elements {
        let [s, value] = pair.numbers()?;
        let falls = s < 0.0 || all.last().is_some_and(|last| last[0] >= s);
        pair.wrong_if(falls, "s must be at least 0 and rise from pair to pair")?;
        pair.wrong_if(value <= 0.0, "a diameter must be larger than 0")?;
        all.push([s, value]);
    }
    item.wrong_if(all.len() < 2, "at least 2 pairs are needed")?;
    Ok(all)
}

fn profile(item: &Item<'_>, base: &Path) -> Result<Shape> {
    if item.value.as_str().is_some() {
        return of_file(item, base);
    }
    let diameter = pairs(item)?;
    let begins = diameter[0][0];
    item.wrong_if(begins != 0.0, format!("the profile begins at s = {begins} mm"))?;
    Ok(Shape { diameter, inner: None, warning: None })
}

fn of_file(item: &Item<'_>, base: &Path) -> Result<Shape> {
    const NAMES: [&str; 4] = ["s_mm", "D_mm", "bore_mm", "core_mm"];
    fn allowed(column: &str) -> &'static str {
        match column {
            "s_mm" => "an arc in mm, rising from 0 to L_a",
            "D_mm" => "a diameter > 0 in mm",
            _ => "a diameter ≥ 0 in mm, smaller than D_mm",
        }
    }
    let (label, text) = table::open(item, base, "profile", Limit::Whole)?;
    let document = Document { file: &label, text: &text };
    let columns = Columns { names: &NAMES, spare: &NAMES[2..], allowed };
    let (rows, header) = table::read::<4>(document, columns)?;
    let source = Source::Text(document);
    let warning = header.warning(&label);
    let mut before = -1.0;
    for (row @ [s, outer, bore, core], at) in &rows {
        let wrong = [
            (0, *s <= before || before < 0.0 && *s != 0.0),
            (1, *outer <= 0.0),
            (2, *bore < 0.0 || bore >= outer),
            (3, *core < 0.0 || core >= outer),
        ];
        if let Some((column, _)) = wrong.iter().find(|(_, wrong)| *wrong) {
            let error = InputError::new("this is not a section of a whisker").key(NAMES[*column]);
            return Err(source.placed(error.value(row[*column]).allowed(allowed(NAMES[*column])), *at));
        }
        before = *s;
    }
    if rows.len() < 2 {
        let error = InputError::new("a profile needs two rows or more").value(format!("{} rows", rows.len()));
        return Err(source.whole(error.allowed(item.allowed())));
    }
    let of = |column: usize| rows.iter().map(|(row, _)| [row[0], row[column]]).collect::<Vec<_>>();
    let inner: Vec<_> = [("bore", 2), ("core", 3)]
        .into_iter()
        .filter(|(_, column)| header.places[*column].is_some())
        .map(|(key, column)| (key, of(column)))
        .collect();
    if inner.len() > 1 {
        let header = table::line_span(&text, 0);
        let error = document.error(Some(header), "a whisker has a bore or a core, not both");
        return Err(error.key("bore_mm, core_mm").allowed("one of these columns"));
    }
    Ok(Shape { diameter: of(1), inner: inner.into_iter().next(), warning })
}

/// Keys that follow from the user's, as TOML: D, d and L_a from a profile, and a default gauge if no gauge is read.
pub(super) fn beside(document: &Document<'_>, user: &DeTable<'_>, base: &Path) -> Result<String> {
    let find = |section: &str, key: &str| {
        let value = user.get(section)?.get_ref().as_table()?.get(key)?;
        Some(Item::written(document, format!("{section}.{key}"), value).of(keys::section(section).key(key)))
    };
    let mut text = String::new();
    let profile = find("whisker", "profile").map(|item| profile(&item, base)).transpose()?;
    let scale = find("whisker", "scale");
    if let Some(item) = scale.as_ref().filter(|_| profile.is_none()) {
        let allowed = "a profile, or D and d without scale";
        return item.refuse("only the diameters of a profile are scaled", allowed);
    }
    if let Some(Shape { diameter, .. }) = profile {
        let variables = find("optimise", "variables");
        let searched = variables.as_ref().is_some_and(|v| v.child("scale").is_some());
        let scale = scale.filter(|_| !searched).map_or(Ok(1.0), |item| constant(&item))?;
        let mut keys = ["D", "d", "L_a", "exponent"].into_iter();
        if let Some(other) = keys.find_map(|key| find("whisker", key)) {
            let allowed = "profile, or D, d, L_a and perhaps exponent";
            return other.refuse("this follows from the profile; remove one of the two", allowed);
        }
        if let Some(tuples) = find("tuples", "file") {
            let error = tuples.error("a tuple file has its own D, d and L_a; remove it or the profile");
            return Err(error.allowed("profile with axes, or a tuple file without a profile"));
        }
        let mut keys = ["D", "d", "L_a"].into_iter();
        if let Some(other) = variables.and_then(|v| keys.find_map(|key| v.child(key))) {
            return other.refuse(
                "this follows from the profile and cannot be searched over",
                "scale, x_ss, l, theta (delta) as variables; or D, d and L_a in place of the profile",
            );
        }
        let (first, [length, last]) = (diameter[0][1], diameter[diameter.len() - 1]);
        let [base, tip] = [first, last].map(|diameter| scale * diameter);
        text = format!("[whisker]\nD = {base:?}\nd = {tip:?}\nL_a = {length:?}\n");
    }
    let strain = channels::read_strain(find("sensor", "signal"), find("sensor", "matrix"));
    if !strain && user.get("tuples").is_none() {
        text += "[gauge]\nx_ss = 0.0\nl = 0.001\n";
    }
    Ok(text)
}

fn constant(item: &Item<'_>) -> Result<f64> {
    let axis = AxisItem::read(item.clone(), 0)?.axis;
    Ok(if axis.len() == 1 { axis.at(0) } else { 1.0 })
}

fn inside(item: &Item<'_>) -> Result<Vec<[f64; 2]>> {
    match item.elements().and_then(|mut elements| elements.next()) {
        Some(one) if one.value.is_array() => pairs(item),
        _ => first(item).map(|diameter| vec![[0.0, diameter], [MOST, diameter]]),
    }
}

fn core(item: &Item<'_>, file: Option<Vec<[f64; 2]>>) -> Result<Inner> {
    item.only_known()?;
    let modulus = first(&item.needs("modulus")?)?;
    let diameter = match (item.child("diameter"), file) {
        (Some(item), None) => inside(&item)?,
        (None, Some(diameter)) => diameter,
        (Some(item), Some(_)) => {
            return item.refuse("the profile has the core's diameter already", "core = { modulus }");
        }
        (None, None) => return Err(item.needs("diameter").expect_err("it is missing")),
    };
    Ok(Inner { modulus, diameter })
}

fn root(item: &Item<'_>) -> Result<Root> {
    item.only_known()?;
    // `inf`, out of range for any quantity, makes a spring rigid.
    let rigid =
        |k: &Item<'_>| matches!(k.value, DeValue::Float(x) if x.as_str().parse() == Ok(f64::INFINITY));
    let spring = |key| item.or(key, f64::INFINITY, |k| if rigid(k) { Ok(f64::INFINITY) } else { first(k) });
    let root = Root { k_theta: spring("k_theta")?, k_y: spring("k_y")?, k_x: spring("k_x")? };
    let empty = item.value.as_table().is_some_and(|table| table.is_empty());
    item.wrong_if(empty, "a root needs a spring").map(|()| root)
}

pub(super) fn whisker(sections: &Sections<'_>, base: &Path) -> Result<Option<Built>> {
    let section = sections.section("whisker");
    // A search scales its candidates itself.
    let scaled = searched(sections, Property::Scale);
    let shape = section.optional("profile", |item| profile(item, base))?;
    let (mut outline, mut file) = (Profile::Power(1.0), None);
    if let Some(Shape { diameter, inner, warning }) = shape {
        sections.warn(warning);
        file = inner;
        // Two knots are a cone.
        if diameter.len() > 2 {
            let scale =
                section.written("scale").filter(|_| !scaled).map_or(Ok(1.0), |item| constant(&item))?;
            outline = Profile::Table(diameter.into_iter().map(|[s, d]| [s, scale * d]).collect());
        }
    } else if let Some(n) = section.optional("exponent", first)? {
        outline = Profile::Power(n);
    }
    let (bore, shell) = (section.written("bore"), section.written("core"));
    let double = |item: &Item<'_>, why: &str| item.refuse(why.to_owned(), "a bore, or a core");
    let inner = match (&bore, &shell, file) {
        (Some(item), Some(_), _) => return double(item, "a whisker has a bore or a core, not both"),
        (Some(item), None, Some(_)) => return double(item, "the profile's file has what is inside already"),
        (Some(item), None, None) => Some(Inner { modulus: 0.0, diameter: inside(item)? }),
        (None, Some(item), Some(("bore", _))) => {
            return double(item, "the profile's file has a bore already");
        }
        (None, Some(item), file) => Some(core(item, file.map(|(_, table)| table))?),
        (None, None, Some(("bore", diameter))) => Some(Inner { modulus: 0.0, diameter }),
        (None, None, Some(_)) => {
            let item = section.get("profile")?;
            return item.refuse("the core of this file needs a modulus", "core = { modulus = 60000 } (MPa)");
        }
        (None, None, None) => None,
    };
    let bend = |key| section.optional(key, first).map(Option::unwrap_or_default);
    let curvature = [bend("curvature")?, bend("curvature_slope")?];
    let root = section.optional("root", root)?.unwrap_or(Root::RIGID);
    let several = shell.as_ref().and_then(|core| core.child("diameter")).is_some_and(|d| is_axis(&d));
    let inner = inner.filter(|inner| several || inner.diameter.iter().any(|knot| knot[1] != 0.0));
    let built = Built { profile: outline, inner, curvature, root };
    Ok(Some(built).filter(|built| *built != Built::CONE))
}

/// The signal; its noise and the strain limit are put into `gauge`.
pub(super) fn sensor(section: &Section<'_>, gauge: &mut Gauge) -> Result<(Signal, Option<Arc<Channels>>)> {
    if let Some((signal, channels)) = channels::read(section)? {
        if signal != Signal::Strain {
            gauge.strain_limit = f64::INFINITY;
        }
        return Ok((signal, Some(channels)));
    }
    let signal = section.get("signal")?.word(&Signal::WORDS)?;
    let noise = section.written("noise");
    if signal == Signal::Strain {
        let allowed = "noise with signal = \"moment\" or \"force\"";
        return noise.map_or(Ok((signal, None)), |item| {
            item.refuse("the noise of a strain is noise_strain in [gauge]", allowed)
        });
    }
    gauge.noise_strain = noise.map(|item| Ok(AxisItem::read(item, 0)?.axis.at(0))).transpose()?;
    gauge.strain_limit = f64::INFINITY;
    Ok((signal, None))
}

pub(super) fn fixed(section: &Section<'_>, signal: Signal, channels: Option<&Channels>) -> Result<bool> {
    let item = section.get("fixed")?;
    let moment = |channels: &Channels| channels.rows.iter().any(|row| row[0] != 0.0);
    let (fixed, moment) = (item.flag()?, channels.map_or(signal == Signal::Moment, moment));
    let allowed = "fixed with a signal, or a row of a matrix, that shows the moment";
    item.refuse_if(fixed && !moment, "no moment is read", allowed).map(|()| fixed)
}

/// Refuses combinations that are not modelled; `at` is the place of the whisker if no key of `[whisker]` has it.
pub fn allowed(sections: &Sections<'_>, setup: &Setup, tilts: bool, at: Option<&Item<'_>>) -> Result<()> {
    let of = |section, key| sections.section(section).get(key);
    if setup.asks_wrench() {
        let (item, what) = match setup.signal {
            _ if setup.channels.is_some() => {
                let sensor = sections.section("sensor");
                let item = sensor.written("matrix").map_or_else(|| sensor.get("signal"), Ok)?;
                channels::allowed(sections, setup, &item)?;
                (item, "a sensor of several channels")
            }
            Signal::Strain => (of("output", "wrench")?, "the wrench on the base"),
            _ => (of("sensor", "signal")?, "a signal other than strain"),
        };
        let refuse =
            |wrong, why: &str, instead: &str| item.refuse_if(wrong, format!("{what} {why}"), instead);
        refuse(tilts, "has been computed for upright edges only", "tilt = 0 and lean = 0")?;
        refuse(setup.gauge.second, "has no second gauge", "second = false in [gauge]")?;
        let elongation = setup.estimate.convention == Convention::Elongation;
        refuse(elongation, "has no elongation", "convention = \"mean\" in [estimate]")?;
        if let Some((_, key, instead)) = solid(setup) {
            let why = format!("{what} has been computed for a rod without {key}");
            return item.refuse(why, instead);
        }
    }
    let Some(built) = &setup.built else { return Ok(()) };
    let whisker = sections.section("whisker");
    if built.is_hollow_or_cored() && !matches!(setup.model.material, Material::Hooke(_)) {
        let written = ["bore", "core", "profile"].into_iter().find_map(|key| whisker.written(key));
        let item = at.cloned().or(written).map_or_else(|| whisker.get("bore"), Ok)?;
        let why = "a bore or a core needs material = { hooke = E }: the law of the others is charted for solid sections only";
        return item.refuse(why, "no bore and no core, or a hooke material");
    }
    let written = ["root", "curvature", "curvature_slope", "bore", "core", "profile", "exponent"];
    let key = written.into_iter().find(|key| whisker.written(key).is_some()).unwrap_or("profile");
    let item = whisker.written(key).or_else(|| at.cloned()).map_or_else(|| whisker.get(key), Ok)?;
    let key = item.key.rsplit('.').next().unwrap_or(key);
    if let Some((section, other, instead)) = solid(setup) {
        let why = format!(
            "{key} and {other} of [{section}] have not been checked together against three-dimensional elasticity"
        );
        return item.refuse(why, format!("no {key}, or {instead}"));
    }
    let leans = built.upright(setup.model.surface).filter(|_| tilts);
    leans.map_or(Ok(()), |why| item.refuse(why, "tilt = 0 and lean = 0"))
}

fn solid(setup: &Setup) -> Option<(&'static str, &'static str, String)> {
    let model = &setup.model;
    let on =
        |term: &&Term| ["clamp", "indentation", "section"].contains(&term.key) && (term.get)(model).is_on();
    let told =
        TERMS.iter().find(on).map(|term| ("model", term.key, format!("{} = {}", term.key, term.off())));
    let told = told.filter(|_| model.clamp != Clamp::At(0.0) || model.indentation || model.distorting);
    told.or(setup.gauge.foil.map(|_| ("gauge", "foil", "no foil".to_owned())))
}
