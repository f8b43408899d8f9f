//! The page of `vibrissa explore`: its chart as JSON in template, style and modules of `pages/explore`.

use serde_json::{Map, Value, json};

use super::Baked;
use super::along::{FUNCTIONS, GAUSS};
use crate::chart::series::{Row, Series};
use crate::chart::{axis::Axis, build::Built};
use crate::error::Error;
use crate::optimise::best::fitted;
use crate::physics::solid::{Held, SKIN};
use crate::scene::{Convention, Spec};

/// Version of the format.
pub const FORMAT: u32 = 1;

const NAMES: [&str; FUNCTIONS] = ["contact", "far", "arc", "force", "signal"];

const AXIS_NAMES: [&str; 5] = ["drive", "offset_over_a", "D_over_a", "tau_a", "x_over_a"];

/// JSON of `baked`, with the parts of the spec that the page keeps. Errors: the text of the spec does not parse.
pub fn document(spec: &Spec, baked: &Baked) -> Result<Value, Error> {
    let (setup, domain, chart) = (&spec.study.setup, &baked.domain, &baked.chart);
    let branch = |(k, built): (usize, &Built<FUNCTIONS>)| {
        let functions: Map<String, Value> =
            chart.read(setup.signal).map(|f| (NAMES[f].to_owned(), rows(&built.series[f]))).collect();
        json!({ "T_over_P": chart.ratios.get(k).copied().unwrap_or(0.0), "functions": functions })
    };
    let axis = |(name, x): (&str, &Axis)| json!({ "name": name, "variable": x.map, "range": x.range });
    let axes: Vec<Value> = AXIS_NAMES.into_iter().zip(chart.axes()).map(axis).collect();
    let (estimate, ranges) = (&setup.estimate, &domain.whiskers);
    let held = Held::new(&setup.model);
    Ok(json!({
        "vibrissa_explore": FORMAT,
        "version": env!("CARGO_PKG_VERSION"),
        "name": spec.name,
        "drive": setup.drive.word(),
        "model": {
            "shear": setup.model.shear,
            "surface": setup.model.surface,
            "extension": setup.model.extension,
            "nu": setup.model.nu,
            "pole_radius": setup.model.pole_radius,
            "E_MPa": setup.model.material.e0(),
            "clamp": { "c0": held.c0, "k": held.shear },
            "skin": setup.model.distorting.then_some(SKIN),
        },
        "sensor": { "signal": setup.signal.word() },
        "gauge": { "side": setup.gauge.side.word(), "strain_limit": setup.gauge.strain_limit },
        "estimate": {
            "theory": super::theory(setup).word(),
            "elongation": estimate.convention == Convention::Elongation,
            "K": estimate.k,
            "range": estimate.range,
        },
        "domain": {
            "D": ranges.D, "d": ranges.d, "L_a": ranges.L_a, "x_ss": ranges.x_ss, "l": ranges.l,
            "hub": domain.hub, "a": domain.a, "drive": ranges.drive,
        },
        "start": {
            "D": domain.start.D, "d": domain.start.d, "L_a": domain.start.L_a, "x_ss": domain.start.x_ss,
            "l": domain.start.l, "hub": setup.hub, "drive": domain.start.drive, "distances": domain.distances,
            "from": domain.reach[0], "to": domain.reach[1],
            "noise": setup.gauge.noise_strain,
        },
        "gauss": GAUSS,
        "power": chart.power,
        "axes": axes,
        "branches": chart.branches.iter().enumerate().map(branch).collect::<Vec<_>>(),
        "census": baked.census,
        "kept": kept(spec)?,
    }))
}

/// Terms as rows: orders over all axes except the last, then coefficients in single precision.
fn rows(series: &Series) -> Value {
    let short = |c: &f64| {
        let text = format!("{:e}", *c as f32);
        text.parse::<f64>().map_or(Value::Null, |c| if c == 0.0 { json!(0) } else { json!(c) })
    };
    let row = |row: &Row| {
        let coefficients: Vec<Value> = row.coefficients.iter().map(short).collect();
        json!([row.orders, coefficients])
    };
    series.rows.iter().map(row).collect()
}

/// Sections of the spec that the page keeps, as TOML for a spec of the shown design.
fn kept(spec: &Spec) -> Result<Value, Error> {
    let fail = |e: &dyn std::fmt::Display| Error::Run(format!("{}: {e}", spec.name));
    let table: toml::Table = spec.text.parse().map_err(|e| fail(&e))?;
    let section = |name: &str, moved: &[&str]| -> Result<String, Error> {
        let mut section = table.get(name).and_then(toml::Value::as_table).cloned().unwrap_or_default();
        section.retain(|key, _| !moved.contains(&key));
        if let (Some(fitted), Some(material)) = (fitted(spec), section.get_mut("material")) {
            *material = fitted;
        }
        section.into_iter().map(|(key, value)| Ok(format!("{key} = {value}\n"))).collect()
    };
    Ok(json!({
        "gauge": section("gauge", &["x_ss", "l", "noise_strain"])?,
        "sensor": section("sensor", &["noise"])?,
        "tap": section("tap", &["a", "theta", "delta"])?,
        "model": section("model", &[])?,
        "estimate": section("estimate", &[])?,
    }))
}

const TEMPLATE: &str = include_str!("../../pages/explore/template.html");
const STYLE: &str = include_str!("../../pages/explore/style.css");

/// Modules in order of their imports, as built by `npm --prefix pages run build`.
const MODULES: [&str; 11] = [
    include_str!("../../pages/explore/beam.js"),
    include_str!("../../pages/explore/chart.js"),
    include_str!("../../pages/explore/rig.js"),
    include_str!("../../pages/explore/tap.js"),
    include_str!("../../pages/explore/statistics.js"),
    include_str!("../../pages/explore/shape.js"),
    include_str!("../../pages/explore/state.js"),
    include_str!("../../pages/explore/plot.js"),
    include_str!("../../pages/explore/scene.js"),
    include_str!("../../pages/explore/figures.js"),
    include_str!("../../pages/explore/main.js"),
];

/// Beginning of every page of this program.
pub const HEAD: &str = "<!doctype html>\n<!-- vibrissa explore";

/// A self-contained HTML file.
pub fn html(chart: &Value) -> String {
    // Inside a script only `<` can end it.
    let chart = chart.to_string().replace('<', "\\u003c");
    let page = TEMPLATE.replacen("/* style */", STYLE, 1).replacen("/* script */", &script(), 1);
    page.replacen("CHART", &chart, 1)
}

/// The modules as one script, since a page opened from disk may not import.
fn script() -> String {
    let mut script = String::from("\"use strict\";\n(() => {\n");
    for line in MODULES.iter().flat_map(|module| module.lines()).filter(|line| !line.starts_with("import ")) {
        script += line.strip_prefix("export ").unwrap_or(line);
        script.push('\n');
    }
    script + "})();"
}
