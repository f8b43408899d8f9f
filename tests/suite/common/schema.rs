//! Whether the JSON Schema of specs accepts a text: the words of draft 7 that the schema uses.

use std::path::Path;
use std::sync::LazyLock;

use serde_json::Value;
use vibrissa::error::InputError;
use vibrissa::reference::schema;
use vibrissa::sink::folder::hash_file;

static SCHEMA: LazyLock<Value> = LazyLock::new(schema::document);

/// Parts of messages about a single key, which a schema sees too; the others are about several keys, files or the physics.
const STRUCTURAL: &str = "unknown key|unknown section|unknown word|this must be|this value is out of range|this number is too small|newer format|\
    numbers are needed|list is empty|contradict each other|belongs to samples|is missing here|\
    steps (the number of values) or step|needs steps, not step|exactly one material law|is a section|missing from [whisker]|\
    missing from [gauge]|[whisker] with|[gauge] with|missing from [tuples]|number of samples is out of range|\
    no quantity of a whisker is this large|step must be larger than zero|this number is too large|\
    these bounds are out of range|pairs are needed|this is not a foil|a foil needs|a root needs a spring|\
    there is nothing to search over|says neither evaluations nor seconds|this text is empty|is missing (allowed|\
    at least two signals|stands here twice";

/// A spec as the schema sees it; `None` where it is no TOML.
pub fn accepts(text: &str) -> Option<bool> {
    let table: toml::Table = text.parse().ok()?;
    Some(valid(&serde_json::to_value(table).expect("JSON"), &SCHEMA))
}

/// Messages about single keys and about several ones.
/// A noise whose variance is no number is too small; to a schema any above 0 is one.
const EITHER: [&str; 4] =
    ["this is not a range of distances", "no standard deviation is larger", "one of the springs", "0: none"];

/// Fails where the schema judges a `text` in another way than the reader, which said `error`, or accepted it.
#[track_caller]
pub fn agrees(text: &str, error: Option<&InputError>) {
    if let Some(difference) = difference(text, error) {
        panic!("{difference}");
    }
}

/// How the schema and the reader differ, if they do.
pub fn difference(text: &str, error: Option<&InputError>) -> Option<String> {
    let said = error.map(ToString::to_string);
    let has = |parts: &[&str]| said.as_ref().is_some_and(|m| parts.iter().any(|part| m.contains(part)));
    let accepted = accepts(text)?;
    keep(text, accepted);
    let agree = accepted != has(&STRUCTURAL.split('|').collect::<Vec<_>>()) || has(&EITHER);
    (!agree).then(|| format!("the schema accepts this: {accepted}; the reader: {said:?}:\n{text}"))
}

/// Keeps a spec and its verdict, which `tests/schema` compares with that of Python's jsonschema.
fn keep(text: &str, accepted: bool) {
    let verdict = if accepted { "accepted" } else { "refused" };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("specs").join(verdict);
    let name = format!("{}.toml", hash_file(text.as_bytes()).expect("memory"));
    let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(folder.join(name), text));
    written.expect("a folder for specs");
}

fn valid(value: &Value, schema: &Value) -> bool {
    schema.as_object().expect("a schema").iter().all(|(word, rule)| holds(value, schema, word, rule))
}

fn holds(value: &Value, schema: &Value, word: &str, rule: &Value) -> bool {
    let list = || rule.as_array().expect("a list").iter();
    let size = || rule.as_u64().expect("a size") as usize;
    let (array, table, x) = (value.as_array(), value.as_object(), value.as_f64());
    let bound = || rule.as_f64().expect("a number");
    match word {
        "type" => match rule.as_str().expect("a type") {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "boolean" => value.is_boolean(),
            "number" => value.is_number(),
            "integer" => x.is_some_and(|x| x.fract() == 0.0),
            other => panic!("type {other}"),
        },
        "enum" => list().any(|known| known == value),
        "const" => rule == value,
        "minimum" => x.is_none_or(|x| x >= bound()),
        "maximum" => x.is_none_or(|x| x <= bound()),
        "exclusiveMinimum" => x.is_none_or(|x| x > bound()),
        "exclusiveMaximum" => x.is_none_or(|x| x < bound()),
        "pattern" => {
            assert_eq!(rule, "\\S");
            value.as_str().is_none_or(|text| !text.trim().is_empty())
        }
        "items" => array.is_none_or(|a| a.iter().all(|v| valid(v, rule))),
        "uniqueItems" => {
            assert_eq!(rule, true);
            array.is_none_or(|a| a.iter().enumerate().all(|(k, v)| !a[..k].contains(v)))
        }
        "minItems" => array.is_none_or(|a| a.len() >= size()),
        "maxItems" => array.is_none_or(|a| a.len() <= size()),
        "minProperties" => table.is_none_or(|t| t.len() >= size()),
        "maxProperties" => table.is_none_or(|t| t.len() <= size()),
        "required" => table.is_none_or(|t| list().all(|key| t.contains_key(key.as_str().expect("a key")))),
        "properties" => {
            table.is_none_or(|t| t.iter().all(|(key, v)| rule.get(key).is_none_or(|s| valid(v, s))))
        }
        "additionalProperties" => {
            assert_eq!(rule, false);
            table.is_none_or(|t| t.keys().all(|key| schema["properties"].get(key).is_some()))
        }
        "anyOf" => list().any(|s| valid(value, s)),
        "allOf" => list().all(|s| valid(value, s)),
        "not" => !valid(value, rule),
        "if" => {
            let branch = if valid(value, rule) { "then" } else { "else" };
            schema.get(branch).is_none_or(|s| valid(value, s))
        }
        "$ref" => valid(
            value,
            SCHEMA.pointer(rule.as_str().expect("a path").trim_start_matches('#')).expect("a definition"),
        ),
        "then" | "else" | "$schema" | "$defs" | "title" | "description" | "default" | "examples" => true,
        other => panic!("the schema uses {other}"),
    }
}
