//! Complete specs in which one key has a given value, or is left out.

use std::path::Path;

use toml::{Table, Value};
use vibrissa::error::InputError;
use vibrissa::scene::{Search, Study};
use vibrissa::spec;
use vibrissa::spec::keys::{Key, Section};

/// Keys that every command needs.
const COMPLETE: &str = "[whisker]\nD = 10.0\nd = 4.0\nL_a = 50.0\n[gauge]\nx_ss = 5.0\nl = 2.0\nnoise_strain = 1e-5\n\
    [tap]\na = [20.0, 30.0]\ntheta = 2.0\n[optimise]\nobjective = \"sd\"\nvariables = { d = [2.0, 8.0] }\n";

/// Reads a spec as a sweep does; as a search if `section` belongs to one.
pub fn parsed(section: &Section, text: &str) -> Result<(Study, Option<Search>), InputError> {
    let base = Path::new("");
    if section.name.starts_with("optimise") {
        return spec::parse_search("spec", text, base).map(|(spec, search)| (spec.study, Some(search)));
    }
    spec::parse("spec", text, base).map(|spec| (spec.study, None))
}

/// A complete spec with `value` for `key`, or without it. A key of an inline table is set in the table's example.
pub fn with(section: &Section, key: &Key, value: Option<Value>) -> String {
    let mut spec: Table = COMPLETE.parse().expect("a complete spec");
    match (section.name, key.name) {
        ("tuples", _) => {
            ["whisker", "gauge", "tap", "optimise"].map(|s| spec.remove(s)).into_iter().for_each(drop)
        }
        ("tap" | "optimise.variables" | "optimise.robust", "delta") | ("tap", "drive") => {
            table(&mut spec, "tap").remove("theta");
            set(&mut spec, "tap", "delta = 2.0\ndrive = \"displacement\"");
            set(&mut spec, "optimise", "variables = { d = [2.0, 8.0] }");
        }
        ("whisker", "profile" | "scale") if value.is_some() => {
            let whisker = table(&mut spec, "whisker");
            ["D", "d", "L_a"].map(|key| whisker.remove(key)).into_iter().for_each(drop);
            if key.name == "scale" {
                set(&mut spec, "whisker", "profile = [[0.0, 10.0], [50.0, 4.0]]");
            }
            set(&mut spec, "optimise", "variables = { theta = [1.0, 8.0] }");
        }
        ("sensor", "noise" | "fixed") => set(&mut spec, "sensor", "signal = \"moment\""),
        ("sensor", "covariance") => set(&mut spec, "sensor", "signal = [\"moment\", \"force\"]"),
        ("model", "indentation" | "solid") => set(&mut spec, "model", "pole_radius = 3.0"),
        ("model" | "model.contact", "contact" | "coulomb") => set(&mut spec, "model", "extension = true"),
        _ => {}
    }
    let place = match (section.name, section.name.split_once('.')) {
        ("", _) => &mut spec,
        ("axis", _) => inline(table(&mut spec, "whisker"), "D", section, key),
        (_, Some((outer, inner))) => inline(table(&mut spec, outer), inner, section, key),
        (name, None) => table(&mut spec, name),
    };
    match value {
        Some(value) => place.insert(key.name.to_owned(), value),
        None => place.remove(key.name),
    };
    spec.to_string()
}

fn set(spec: &mut Table, name: &str, text: &str) {
    table(spec, name).extend(text.parse::<Table>().expect("keys of a section"));
}

fn table<'a>(of: &'a mut Table, name: &str) -> &'a mut Table {
    let value = of.entry(name).or_insert_with(|| Table::new().into());
    value.as_table_mut().expect("a table")
}

/// The inline table at `name`: the example of `section` that has `key`, or an empty table.
fn inline<'a>(of: &'a mut Table, name: &str, section: &Section, key: &Key) -> &'a mut Table {
    let mut examples = section
        .examples
        .iter()
        .map(|e| format!("x = {e}").parse::<Table>().expect("an example")["x"].clone());
    let first = examples.clone().next().filter(|_| name == "robust");
    let found = examples.find(|e| e.get(key.name).is_some());
    let found = found.or(first).unwrap_or_else(|| Table::new().into());
    of.insert(name.to_owned(), found);
    let inner = table(of, name);
    if key.name == "delta" {
        inner.remove("theta");
    }
    inner
}
