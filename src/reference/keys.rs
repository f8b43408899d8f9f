//! Keys of a spec: what `spec::keys` says of them, their defaults, and what the reader allows, asked of the reader itself.

use std::path::Path;

use toml::{Table, Value};

use super::layout::{EXAMPLE, Entry, Part};
use crate::error::InputError;
use crate::scene::{Search, Study};
use crate::spec;
use crate::spec::keys::form::Form;
use crate::spec::keys::{FORMAT, INLINE, Key, SECTIONS, Section, THAT_OF_THE_KEY};

/// Before the sections.
pub const ABOUT: &str = "A spec is TOML: lengths in mm, angles in degrees, moduli in MPa, forces in N; strain has no unit. Unknown keys are \
    errors, paths are relative to the spec. A key without default is required, or off. *axis*: the key takes a value, a list or an axis. \
    `--plan` prints every value in force.";

/// What every command needs of a spec.
const COMPLETE: &str = "[whisker]\nD = 10.0\nd = 4.0\nL_a = 50.0\n[gauge]\nx_ss = 5.0\nl = 2.0\nnoise_strain = 1e-5\n\
    [tap]\na = [20.0, 30.0]\ntheta = 2.0\n[optimise]\nobjective = \"sd\"\nvariables = { d = [2.0, 8.0] }\n";

/// Every section, then every inline table.
pub fn parts() -> Vec<Part> {
    let heads = ["key", "unit", "default", "allowed", EXAMPLE, "meaning"];
    let top = Part::new("Above all sections", "", &heads, [entry(None, &FORMAT)].into_iter());
    let entries = |s: &'static Section| s.keys.iter().map(|k| entry(Some(s), k));
    let section = |s: &'static Section| Part::new(format!("[{}]", s.name), s.about, &heads, entries(s));
    let inline = |s: &'static Section| Part {
        examples: s.examples.to_vec(),
        ..Part::new(s.name, s.about, &["key", "unit", "default", "allowed", "meaning"], entries(s))
    };
    std::iter::once(top).chain(SECTIONS.iter().map(section)).chain(INLINE.iter().map(inline)).collect()
}

fn entry(section: Option<&Section>, key: &Key) -> Entry {
    let note = if key.note.is_empty() { String::new() } else { format!(". {}", key.note) };
    let name = section.map_or("", |s| s.name);
    let axis = match key.form {
        Form::Axis(_) => "; axis",
        Form::Any(forms) if forms.iter().any(|form| matches!(form, Form::Axis(_))) => {
            "; a number may be an axis"
        }
        _ => "",
    };
    let axis = if name.contains('.') { "" } else { axis };
    let mut facts = vec![key.unit.to_owned(), default(name, key), allowed(section, key) + axis];
    if !key.example.is_empty() {
        facts.push(format!("`{} = {}`", key.name, key.example));
    }
    Entry { name: key.name.to_owned(), facts, meaning: format!("{}{note}", key.what) }
}

/// What holds where `key` is left out of `section`.
pub fn default(section: &str, key: &Key) -> String {
    match spec::keys::default(section, key.name) {
        Some(value) => format!("`{value}`"),
        None if key.absent.is_empty() => "required".to_owned(),
        None => key.absent.to_owned(),
    }
}

/// What the reader says of a value that it cannot take.
pub fn allowed(section: Option<&Section>, key: &Key) -> String {
    if key.unit == THAT_OF_THE_KEY {
        return THAT_OF_THE_KEY.to_owned();
    }
    // Angles may be negative.
    let refused = [-1.0, -1e3]
        .into_iter()
        .find_map(|x| parsed(section, &with(section, key, Some(Value::Float(x)))).err());
    refused.and_then(|e| e.allowed).unwrap_or_default()
}

/// Reads a spec as a sweep does, or as a search where `section` belongs to it.
pub fn parsed(section: Option<&Section>, text: &str) -> Result<(Study, Option<Search>), InputError> {
    let base = Path::new("");
    if section.is_some_and(|s| s.name.starts_with("optimise")) {
        return spec::parse_search("spec", text, base).map(|(spec, search)| (spec.study, Some(search)));
    }
    spec::parse("spec", text, base).map(|spec| (spec.study, None))
}

/// A complete spec in which `key` has `value`, or is left out; an inline table is its example with this key.
pub fn with(section: Option<&Section>, key: &Key, value: Option<Value>) -> String {
    let mut spec: Table = COMPLETE.parse().expect("a complete spec");
    let name = section.map_or("", |s| s.name);
    match (name, key.name) {
        ("tuples", _) => {
            ["whisker", "gauge", "tap", "optimise"].map(|s| spec.remove(s)).into_iter().for_each(drop)
        }
        ("tap", "delta" | "drive") => {
            table(&mut spec, "tap").remove("theta");
            set(&mut spec, "tap", "delta = 2.0\ndrive = \"displacement\"");
            set(&mut spec, "optimise", "variables = { d = [2.0, 8.0] }");
        }
        ("whisker", "profile" | "scale") if value.is_some() => {
            let whisker = table(&mut spec, "whisker");
            ["D", "d", "L_a"].map(|key| whisker.remove(key)).into_iter().for_each(drop);
            if key.name == "scale" {
                // The cone that is complete.
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
    let place = match (name, name.split_once('.')) {
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

/// Puts the keys of `text` into the section `name`.
fn set(spec: &mut Table, name: &str, text: &str) {
    table(spec, name).extend(text.parse::<Table>().expect("keys of a section"));
}

fn table<'a>(of: &'a mut Table, name: &str) -> &'a mut Table {
    let value = of.entry(name).or_insert_with(|| Table::new().into());
    value.as_table_mut().expect("a table")
}

/// The inline table at `name`, as in the example of `section` that has `key`, or empty.
fn inline<'a>(of: &'a mut Table, name: &str, section: Option<&Section>, key: &Key) -> &'a mut Table {
    let examples = section.into_iter().flat_map(|s| s.examples);
    let mut examples =
        examples.map(|e| format!("x = {e}").parse::<Table>().expect("an example")["x"].clone());
    let first = examples.clone().next().filter(|_| name == "robust");
    let found = examples.find(|e| e.get(key.name).is_some());
    let found = found.or(first).unwrap_or_else(|| Table::new().into());
    of.insert(name.to_owned(), found);
    table(of, name)
}
