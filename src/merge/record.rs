//! The run.json of a whole that was merged: what the parts share, what they come to together, and which they are.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::part::Part;
use super::search::seed;
use super::stated::{VALUES, Whole, at};

/// The whole, of which `lead` says what its parts share, but for its rows and the time of the merge.
pub(super) fn whole(parts: &[Part], lead: &Part, out: &Path) -> Value {
    let mut run = lead.run.clone();
    for (key, _, how) in VALUES {
        let values: Vec<&Value> =
            parts.iter().map(|part| at(&part.run, key)).filter(|x| !x.is_null()).collect();
        let all = match how {
            Whole::Sum => values.iter().copied().cloned().reduce(|a, b| sum(&a, &b)),
            Whole::Largest => values.iter().filter_map(|x| x.as_f64()).reduce(f64::max).map(Value::from),
            Whole::Own => None,
        };
        if let (Some((group, key)), Some(all)) = (key.split_once('.'), all) {
            run[group][key] = all;
        }
    }
    if !lead.is_search() {
        // The mean of the parts, each by the taps that were solved for it.
        let of = |part: &Part, key: &str| part.run["counts"][key].as_f64().unwrap_or(0.0);
        let solved: f64 = parts.iter().map(|part| of(part, "solved")).sum();
        let spent: f64 = parts.iter().map(|part| of(part, "solved") * of(part, "sweeps_mean")).sum();
        run["counts"]["sweeps_mean"] = (if solved > 0.0 { spent / solved } else { 0.0 }).into();
    }
    if !run["material_fit"].is_null() {
        let within = |part: &Part| part.run["material_fit"]["within_data_range"] != false;
        run["material_fit"]["within_data_range"] = parts.iter().all(within).into();
    }
    for entry in run["in_force"].as_array_mut().into_iter().flatten().filter(|e| e["key"] == "run.out") {
        entry["value"] = format!("{:?}", out.display().to_string()).into();
    }
    let mut warnings: Vec<&Value> = Vec::new();
    for text in parts.iter().flat_map(|part| part.run["warnings"].as_array().into_iter().flatten()) {
        if !warnings.contains(&text) {
            warnings.push(text);
        }
    }
    run["warnings"] = json!(warnings);
    for key in ["shard", "resumed", "files", "asked", "name", "handed_over"] {
        run.as_object_mut().map(|run| run.shift_remove(key));
    }
    // What one device did is told with its part.
    run["backend"].as_object_mut().map(|backend| backend.shift_remove("device"));
    run["parts"] = parts.iter().map(|part| described(part, std::ptr::eq(part, lead))).collect();
    run
}

/// Both together: counts, numbers, or counts of words.
fn sum(a: &Value, b: &Value) -> Value {
    match (a.as_u64().zip(b.as_u64()), a.as_f64().zip(b.as_f64()), a.as_object().zip(b.as_object())) {
        (Some((a, b)), ..) => (a + b).into(),
        (_, Some((a, b)), _) => (a + b).into(),
        (.., Some((a, b))) => {
            let mut all = a.clone();
            for (word, n) in b {
                let before = all.get(word).unwrap_or(&json!(0)).clone();
                all.insert(word.clone(), sum(&before, n));
            }
            all.sort_keys();
            Value::Object(all)
        }
        _ => Value::Null,
    }
}

/// What the whole says of a part, of which `lead` is true if it says what they share.
fn described(part: &Part, lead: bool) -> Value {
    let run = &part.run;
    let mut all = Map::new();
    let mut put = |key: &str, value: Value| all.insert(key.to_owned(), value);
    put("folder", part.folder.display().to_string().into());
    put("part", part.shard.to_string().into());
    if part.is_search() {
        put("seed", json!(seed(part)));
        put("value", run["result"]["value"].clone());
        put("best", lead.into());
        put("evaluations", run["counts"]["evaluations"].clone());
    } else {
        put("designs", run["shard"]["designs"].clone());
        put("backend", run["backend"].clone());
        put("taps", run["counts"]["taps"].clone());
        put("handed_over", run["handed_over"].clone());
    }
    put("seconds", run["seconds"]["total"].clone());
    put("files", run["files"].clone());
    all.into()
}

/// Adds the `seconds` of the merge.
pub(super) fn timed(run: &mut Value, seconds: f64) {
    let total = run["seconds"]["total"].as_f64().unwrap_or(0.0) + seconds;
    (run["seconds"]["total"], run["seconds"]["merge"]) = (total.into(), seconds.into());
    if let Some(taps) = run["counts"]["taps"].as_f64().filter(|_| !run["taps_per_second"].is_null()) {
        run["taps_per_second"] = (taps / total.max(1e-9)).into();
    }
}
