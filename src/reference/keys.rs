//! Keys of a spec, from `keys.toml`.

use super::layout::{EXAMPLE, Entry, Part};
use crate::spec::keys::Form;
use crate::spec::keys::{Key, Section, inline, section, sections};

pub const ABOUT: &str = "A spec is TOML: lengths in mm, angles in degrees, moduli in MPa, forces in N; strain has no unit. Unknown keys are \
    errors, paths are relative to the spec. A key without default is required, or off. *axis*: the key takes a value, a list or an axis. \
    `--plan` prints every value in force.";

pub fn parts() -> Vec<Part> {
    let heads = ["key", "unit", "default", "allowed", EXAMPLE, "meaning"];
    let entries = |s: &'static Section| s.keys.iter().map(|k| entry(s, k));
    let part = |title: String, s: &'static Section| Part::new(title, s.about, &heads, entries(s));
    let top = part("Above all sections".to_owned(), section(""));
    let inline = inline().map(|s| Part {
        examples: s.examples.clone(),
        ..Part::new(s.name, s.about, &["key", "unit", "default", "allowed", "meaning"], entries(s))
    });
    let sections = sections().map(|s| part(format!("[{}]", s.name), s));
    std::iter::once(top).chain(sections).chain(inline).collect()
}

fn entry(section: &Section, key: &Key) -> Entry {
    let note = if key.note.is_empty() { String::new() } else { format!(". {}", key.note) };
    let axis = match &key.form {
        _ if section.name.contains('.') => "",
        Form::Axis(_) => "; axis",
        Form::Any(forms) if forms.iter().any(|form| matches!(form, Form::Axis(_))) => {
            "; a number may be an axis"
        }
        _ => "",
    };
    let mut facts = vec![key.unit.to_owned(), key.if_absent(), key.allowed() + axis];
    if !key.example.is_empty() {
        facts.push(format!("`{} = {}`", key.name, key.example));
    }
    Entry { name: key.name.to_owned(), facts, meaning: format!("{}{note}", key.what) }
}
