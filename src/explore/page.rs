//! The page of `vibrissa explore`: template, style and modules of `pages/explore`, with a chart in its place.

use serde_json::Value;

const TEMPLATE: &str = include_str!("../../pages/explore/template.html");
const STYLE: &str = include_str!("../../pages/explore/style.css");

/// The modules, each after those that it imports from, as the type checker gives them (`npm --prefix pages run build`).
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

/// How a page of ours begins.
pub const HEAD: &str = "<!doctype html>\n<!-- vibrissa explore";

/// Places in the template, in their order.
const STYLE_PLACE: &str = "/* style */";
const CHART_PLACE: &str = "CHART";
const SCRIPT_PLACE: &str = "/* script */";

/// One HTML file that asks for nothing else.
pub fn html(chart: &Value) -> String {
    // Within a script nothing but `<` ends it.
    let chart = chart.to_string().replace('<', "\\u003c");
    TEMPLATE.replacen(STYLE_PLACE, STYLE, 1).replacen(SCRIPT_PLACE, &script(), 1).replacen(
        CHART_PLACE,
        &chart,
        1,
    )
}

/// The modules as one script: a page that is opened from a disk may not import.
fn script() -> String {
    let mut script = String::from("\"use strict\";\n(() => {\n");
    for line in MODULES.iter().flat_map(|module| module.lines()).filter(|line| !line.starts_with("import ")) {
        script += line.strip_prefix("export ").unwrap_or(line);
        script.push('\n');
    }
    script + "})();"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the modules declare, which all share one scope in the page.
    #[test]
    fn no_name_is_declared_twice() {
        let script = script();
        let words = ["const ", "let ", "function ", "class "];
        let named = |line: &str| words.iter().find_map(|word| line.strip_prefix(word).map(str::to_owned));
        let name =
            |rest: String| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().map(str::to_owned);
        let mut names: Vec<String> = script.lines().filter_map(named).filter_map(name).collect();
        assert!(names.len() > 40, "{names:?}");
        names.sort();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
        assert!(
            !script.contains("</script") && !script.contains("\nexport ") && !script.contains("\nimport ")
        );
    }
}
