//! `best.toml`.

use super::report::Report;
use super::run::TOLERANCE;
use super::why::why;
use super::write::key;
use crate::error::Error;
use crate::scene::search::Search;
use crate::scene::{Column, Material, Property, Spec, Tuple};

/// A spec of the best design at its drive, for `sweep`.
pub fn text(spec: &Spec, search: &Search, report: &Report) -> Result<String, Error> {
    let fail = |e: &dyn std::fmt::Display| Error::Run(format!("best.toml: {e}"));
    let mut best: toml::Table = spec.text.parse().map_err(|e| fail(&e))?;
    for section in ["optimise", "output", "run"] {
        best.remove(section);
    }
    let Tuple { D, d, L_a, x_ss, l, drive, .. } = report.best.point;
    let setup = &spec.study.setup;
    let drive_key = key(setup, Column::Drive);
    let profile = best.get("whisker").is_some_and(|whisker| whisker.get("profile").is_some());
    let own = [("D", D), ("d", d), ("L_a", L_a)].into_iter().filter(|_| !profile);
    let rest = [("gauge", "x_ss", x_ss), ("gauge", "l", l), ("tap", drive_key, drive)];
    let columns = own.map(|(key, value)| ("whisker", key, value)).chain(rest);
    let properties = setup.rigs.iter().flat_map(|rigs| {
        rigs.properties.iter().map(|property| {
            let key = match (property, setup.model.material) {
                (Property::Modulus, Material::NeoHookean(_)) => "material.neo-hookean",
                (Property::Modulus, _) => "material.hooke",
                _ => property.about().key,
            };
            (property.about().section, key, rigs.value(report.best.point.rig, *property))
        })
    });
    for (section, key, value) in columns.chain(properties) {
        let mut table = &mut best;
        let mut path: Vec<&str> = std::iter::once(section).chain(key.split('.')).collect();
        let name = path.pop().unwrap_or_default();
        for part in path {
            let inner = table.entry(part).or_insert_with(|| toml::Table::new().into());
            table = inner.as_table_mut().ok_or_else(|| fail(&format!("{part} is no table")))?;
        }
        table.insert(name.into(), value.into());
    }
    if let (Some(_), Material::Yeoh(c)) = (&spec.material_fit, &spec.study.setup.model.material) {
        // The curve's path is relative to the spec; its fit is what was computed with.
        let material: toml::Table =
            [("yeoh".to_owned(), toml::Value::from(c.to_vec()))].into_iter().collect();
        if let Some(model) = best.get_mut("model").and_then(toml::Value::as_table_mut) {
            model.insert("material".into(), material.into());
        }
    }
    let b = &report.backends[1];
    let mut run = toml::Table::new();
    run.insert("backend".into(), b.name.into());
    if b.tolerance.is_some() {
        run.insert("precision".into(), "f64".into());
        run.insert("tolerance".into(), TOLERANCE.into());
    }
    best.insert("run".into(), run.into());
    let head = format!(
        "# Best design of {} by objective = \"{}\" ({} evaluations, ended by {}). {}\n# [run] as the search computed it: sweep gives the same figures.\n",
        spec.name,
        search.objective.word(),
        report.evaluations,
        report.ended.name(),
        why(&spec.study.setup, search, report),
    );
    Ok(head + &toml::to_string(&best).map_err(|e| fail(&e))?)
}
