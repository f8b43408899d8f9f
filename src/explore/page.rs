//! The page of `vibrissa explore`: template, style and modules of `pages/explore`, with a chart.

use serde_json::Value;

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
