//! The run.json of a whole that was merged: what the parts share, what they come to together, and which they are.

use std::path::Path;

use serde_json::{Value, json};

use super::part::Part;

/// The values in force of the whole.
pub(super) fn in_force(first: &Part, out: &Path) -> Value {
    let mut all = first.run["in_force"].clone();
    for entry in all.as_array_mut().into_iter().flatten().filter(|entry| entry["key"] == "run.out") {
        entry["value"] = format!("{:?}", out.display().to_string()).into();
    }
    all
}

/// Sum of a number of all parts.
fn sum(parts: &[Part], of: impl Fn(&Value) -> &Value) -> Value {
    let values: Vec<&Value> = parts.iter().map(|part| of(&part.run)).collect();
    match values.iter().map(|value| value.as_u64()).sum::<Option<u64>>() {
        Some(n) => n.into(),
        None => values.iter().filter_map(|value| value.as_f64()).sum::<f64>().into(),
    }
}

/// Largest of a number of all parts; null where none has it.
fn largest(parts: &[Part], of: impl Fn(&Value) -> &Value) -> Value {
    parts.iter().filter_map(|part| of(&part.run).as_f64()).reduce(f64::max).map_or(Value::Null, Value::from)
}

/// Taps, rows and words of all parts together.
fn counts(parts: &[Part], (rows, kept): ([u64; 3], Option<u64>)) -> Value {
    let mut counts = parts[0].run["counts"].clone();
    // Parts of an older version do not say which words a tap has together.
    let combined = parts.iter().all(|part| part.run["counts"]["combinations"].is_object());
    for key in ["status"].into_iter().chain(combined.then_some("combinations")) {
        let mut all = serde_json::Map::new();
        for (word, n) in parts.iter().filter_map(|part| part.run["counts"][key].as_object()).flatten() {
            let before = all.get(word).and_then(Value::as_u64).unwrap_or(0);
            all.insert(word.clone(), (before + n.as_u64().unwrap_or(0)).into());
        }
        all.sort_keys();
        counts[key] = Value::Object(all);
    }
    if let Some(counts) = counts.as_object_mut().filter(|_| !combined) {
        counts.shift_remove("combinations");
    }
    for key in ["taps", "solved", "interpolated", "referred"] {
        counts[key] = sum(parts, |run| &run["counts"][key]);
    }
    for (key, n) in ["tuples", "designs", "distances"].into_iter().zip(rows) {
        counts[key] = n.into();
    }
    // The mean of the parts, each by the taps that were solved for it.
    let of = |part: &Part, key: &str| part.run["counts"][key].as_f64().unwrap_or(0.0);
    let solved: f64 = parts.iter().map(|part| of(part, "solved")).sum();
    let spent: f64 = parts.iter().map(|part| of(part, "solved") * of(part, "sweeps_mean")).sum();
    counts["sweeps_mean"] = (if solved > 0.0 { spent / solved } else { 0.0 }).into();
    counts["sweeps_max"] = largest(parts, |run| &run["counts"]["sweeps_max"]);
    if !counts["complete_rows"].is_null() {
        counts["complete_rows"] = sum(parts, |run| &run["counts"]["complete_rows"]);
        counts["kept_rows"] = kept.into();
    }
    counts
}

/// The whole document; its seconds are those of the parts together, and of the merge.
pub(super) fn whole(parts: &[Part], rows: ([u64; 3], Option<u64>), merging: f64, out: &Path) -> Value {
    let mut run = parts[0].run.clone();
    let counts = counts(parts, rows);
    run["in_force"] = in_force(&parts[0], out);
    if let Some(run) = run.as_object_mut() {
        for key in ["shard", "resumed", "files", "asked", "name", "handed_over"] {
            run.shift_remove(key);
        }
    }
    let mut warnings: Vec<&Value> = Vec::new();
    for text in parts.iter().flat_map(|part| part.run["warnings"].as_array().into_iter().flatten()) {
        if !warnings.contains(&text) {
            warnings.push(text);
        }
    }
    run["warnings"] = json!(warnings);
    // What one device did is told with its part.
    if let Some(backend) = run["backend"].as_object_mut() {
        backend.shift_remove("device");
    }
    if !run["material_fit"].is_null() {
        let key = "largest_gauge_strain";
        run["material_fit"][key] = largest(parts, |run| &run["material_fit"][key]);
        let within = |part: &Part| part.run["material_fit"]["within_data_range"] != Value::Bool(false);
        run["material_fit"]["within_data_range"] = parts.iter().all(within).into();
    }
    if !run["model_error"].is_null() {
        run["model_error"]["taps_by_full_model"] =
            sum(parts, |run| &run["model_error"]["taps_by_full_model"]);
    }
    let mut seconds: Value = ["open", "solve"]
        .iter()
        .map(|key| ((*key).to_owned(), sum(parts, |run| &run["seconds"][*key])))
        .collect();
    if parts.iter().any(|part| !part.run["seconds"]["chart"].is_null()) {
        seconds["chart"] = sum(parts, |run| &run["seconds"]["chart"]);
    }
    let total = sum(parts, |run| &run["seconds"]["total"]).as_f64().unwrap_or(0.0) + merging;
    (seconds["total"], seconds["merge"]) = (total.into(), merging.into());
    run["taps_per_second"] = (counts["taps"].as_f64().unwrap_or(0.0) / total.max(1e-9)).into();
    (run["counts"], run["seconds"]) = (counts, seconds);
    let one = |part: &Part| {
        json!({
            "folder": part.folder.display().to_string(),
            "part": part.shard.to_string(),
            "designs": part.run["shard"]["designs"],
            "backend": part.run["backend"],
            "taps": part.run["counts"]["taps"],
            "seconds": part.run["seconds"]["total"],
            "files": part.run["files"],
            "handed_over": part.run["handed_over"],
        })
    };
    run["parts"] = parts.iter().map(one).collect();
    run
}
