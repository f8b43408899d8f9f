//! The JSON Schema of specs, from the same table as the reference: `vibrissa schema`.

use serde_json::{Map, Value, json};

use crate::design::MOST;
use crate::scene::Interval;
use crate::spec::keys::{Form, Key, Section, section, sections};

pub fn text() -> String {
    format!("{:#}\n", document())
}

/// Draft 7, which editors support.
pub fn document() -> Value {
    let mut defs = Map::new();
    let mut properties = properties(section(""), &mut defs);
    properties.extend(sections().map(|section| (section.name.to_owned(), table(section, &mut defs))));
    let mut all = json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Spec of vibrissa",
        "description": "A whisker, its sensor, its taps and what to do with them: lengths in mm, angles in degrees, moduli in MPa, forces in N.",
        "type": "object",
        "additionalProperties": false,
        "properties": properties,
        "allOf": needs(),
    });
    all["$defs"] = defs.into();
    all
}

/// Required keys of a spec without a list of taps and without a search.
fn needs() -> Value {
    let has = |keys: &[&str]| json!({ "required": keys });
    let of = |section: &str, rule: Value| json!({ "required": [section], "properties": { section: rule } });
    let listed_or_searched = json!({ "anyOf": [has(&["tuples"]), has(&["optimise"])] });
    let whisker = of("whisker", json!({ "anyOf": [has(&["D", "d", "L_a"]), has(&["profile"])] }));
    let strain = json!({ "properties": { "sensor": { "properties": { "signal": { "const": "strain" } } } } });
    let gauge = of("gauge", has(&["x_ss", "l"]));
    json!([
        { "if": listed_or_searched, "else": whisker },
        { "if": { "anyOf": [listed_or_searched, { "not": strain }] }, "else": gauge },
    ])
}

fn table(section: &Section, defs: &mut Map<String, Value>) -> Value {
    let properties = properties(section, defs);
    let required: Vec<&str> = section.keys.iter().filter(|k| always(section, k)).map(|k| k.name).collect();
    let mut all = json!({ "type": "object", "description": section.about, "additionalProperties": false, "properties": properties });
    if !required.is_empty() {
        all["required"] = json!(required);
    }
    all
}

fn properties(section: &Section, defs: &mut Map<String, Value>) -> Map<String, Value> {
    let mut properties = Map::new();
    for key in &section.keys {
        let value = property(key, defs);
        if let Some((outer, inner)) = key.name.split_once('.') {
            nested(&mut properties, outer, inner, &value);
        }
        if matches!(key.name, "k_theta" | "k_y" | "k_x") && section.name.starts_with("optimise") {
            nested(&mut properties, "root", key.name, &value);
        }
        properties.insert(key.name.to_owned(), value);
    }
    properties
}

/// Adds `value` also to the inline table that may replace it.
fn nested(properties: &mut Map<String, Value>, outer: &str, inner: &str, value: &Value) {
    let empty = || json!({ "type": "object", "additionalProperties": false, "properties": {} });
    properties.entry(outer).or_insert_with(empty)["properties"][inner] = value.clone();
}

/// True if a table always needs this key. For whisker, gauge and taps this depends on the rest of the spec, for a search on the command.
fn always(section: &Section, key: &Key) -> bool {
    let varies = ["whisker", "gauge", "tap", "axis", "optimise"].contains(&section.name);
    !varies && (section.name == "tuples" || key.if_absent() == "required")
}

fn property(key: &Key, defs: &mut Map<String, Value>) -> Value {
    let unit = if key.unit.is_empty() { String::new() } else { format!(" ({})", key.unit) };
    let note = if key.note.is_empty() { String::new() } else { format!(" {}.", key.note) };
    let (what, allowed, absent) = (key.what, key.allowed(), key.if_absent());
    let absent = absent.trim_matches('`');
    let about = format!("{what}{unit}.{note} Allowed: {allowed}. Default: {absent}.");
    let form = value_of(&key.form, defs);
    // In draft 7, keywords next to `$ref` are ignored.
    let mut value = if form.get("$ref").is_some() { json!({ "allOf": [form] }) } else { form };
    value["description"] = about.into();
    let read = |text: &str| -> Option<Value> {
        let table: toml::Table = format!("x = {text}").parse().ok()?;
        serde_json::to_value(&table["x"]).ok()
    };
    if let Some(usual) = key.default.and_then(|_| read(absent)) {
        value["default"] = usual;
    }
    if let Some(example) = read(key.example) {
        value["examples"] = json!([example]);
    }
    value
}

fn value_of(form: &Form, defs: &mut Map<String, Value>) -> Value {
    let within = |least: f64| json!({ "type": "number", "minimum": least, "maximum": MOST });
    match form {
        Form::Flag => json!({ "type": "boolean" }),
        Form::Text => json!({ "type": "string", "pattern": "\\S" }),
        Form::Whole(min, max) => json!({ "type": "integer", "minimum": min, "maximum": max }),
        Form::Number(range) => number(range),
        Form::Axis(range) => axis(range, defs),
        Form::Ends(range) => array(number(range), 2, Some(2)),
        Form::Numbers(n) => array(within(-MOST), *n, Some(*n)),
        Form::Words(words) => json!({ "type": "string", "enum": words }),
        Form::Several(words) => {
            let mut value = array(json!({ "type": "string", "enum": words }), 2, None);
            value["uniqueItems"] = json!(true);
            value
        }
        Form::Matrix(least, most) => array(array(json!({ "type": "number" }), 2, None), *least, Some(*most)),
        Form::Pairs => array(array(within(0.0), 2, Some(2)), 2, None),
        Form::Tables(name) => array(table(section(name), defs), 1, None),
        Form::Table(name, least, most) => {
            let mut value = table(section(name), defs);
            value["minProperties"] = json!(least);
            value["maxProperties"] = json!(most);
            value
        }
        Form::Any(forms) => {
            json!({ "anyOf": forms.iter().map(|form| value_of(form, defs)).collect::<Vec<_>>() })
        }
    }
}

fn array(items: Value, least: usize, most: Option<usize>) -> Value {
    let mut all = json!({ "type": "array", "items": items, "minItems": least });
    if let Some(most) = most {
        all["maxItems"] = json!(most);
    }
    all
}

fn number(range: &Interval) -> Value {
    let [low, high] = range.ends;
    let [lower, upper] = range.open.map(|open| if open { "exclusiveM" } else { "m" });
    json!({ "type": "number", format!("{lower}inimum"): low, format!("{upper}aximum"): high })
}

/// A number, a list, a range or samples; each range of numbers is defined once.
fn axis(range: &Interval, defs: &mut Map<String, Value>) -> Value {
    let [low, high] = range.ends;
    let [lower, upper] = range.open.map(|open| if open { "beyond" } else { "from" });
    let name = format!("axis_{lower}_{low}_to_{upper}_{high}");
    if !defs.contains_key(&name) {
        let one = number(range);
        let table = |keys: &[&str], required: &[&str]| {
            let of = |key: &&str| {
                let known = section("axis").key(key).expect("a key of an axis");
                let mut value = property(known, &mut Map::new());
                let bounds = one.as_object().filter(|_| ["from", "min", "max"].contains(key));
                bounds.zip(value.as_object_mut()).into_iter().for_each(|(of, all)| all.extend(of.clone()));
                ((*key).to_owned(), value)
            };
            let properties: Map<String, Value> = keys.iter().map(of).collect();
            json!({ "type": "object", "additionalProperties": false, "properties": properties, "required": required })
        };
        let mut stepped = table(&["from", "to", "step", "scale"], &["from", "to", "step"]);
        stepped["properties"]["scale"] = json!({ "const": "linear" });
        let forms = json!([
            one,
            array(one.clone(), 1, None),
            table(&["from", "to", "steps", "scale"], &["from", "to", "steps"]),
            stepped,
            table(&["min", "max", "samples", "sampler", "seed", "scale"], &["min", "max", "samples"]),
        ]);
        defs.insert(name.clone(), json!({ "anyOf": forms }));
    }
    json!({ "$ref": format!("#/$defs/{name}") })
}
