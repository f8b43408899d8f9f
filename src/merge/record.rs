//! The run.json of a merged whole: shared entries, sums, and the list of parts.

use std::path::Path;

use serde_json::{Value, json};

use super::part::Part;

const SUMS: [(&str, &str); 12] = [
    ("counts", "taps"),
    ("counts", "solved"),
    ("counts", "interpolated"),
    ("counts", "referred"),
    ("counts", "complete_rows"),
    ("counts", "status"),
    ("counts", "combinations"),
    ("model_error", "taps_by_full_model"),
    ("seconds", "total"),
    ("seconds", "open"),
    ("seconds", "solve"),
    ("seconds", "chart"),
];
const LARGEST: [(&str, &str); 2] = [("counts", "sweeps_max"), ("material_fit", "largest_gauge_strain")];

/// The run.json of the whole, with shared entries from the first part; row counts and the time of the merge are added later.
pub(super) fn whole(parts: &[Part], out: &Path) -> Value {
    let mut run = parts[0].run.clone();
    for (group, key) in SUMS.into_iter().chain(LARGEST) {
        let values = parts.iter().map(|part| &part.run[group][key]).filter(|x| !x.is_null()).cloned();
        let both = if LARGEST.contains(&(group, key)) { larger } else { sum };
        if let Some(all) = values.reduce(|a, b| both(&a, &b)) {
            run[group][key] = all;
        }
    }
    // Mean over the parts, weighted by their solved taps.
    let of = |part: &Part, key: &str| part.run["counts"][key].as_f64().unwrap_or(0.0);
    let solved: f64 = parts.iter().map(|part| of(part, "solved")).sum();
    let spent: f64 = parts.iter().map(|part| of(part, "solved") * of(part, "sweeps_mean")).sum();
    run["counts"]["sweeps_mean"] = (if solved > 0.0 { spent / solved } else { 0.0 }).into();
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
    // Entries of one device stay with its part.
    run["backend"].as_object_mut().map(|backend| backend.shift_remove("device"));
    run["parts"] = parts.iter().map(described).collect();
    run
}

fn larger(a: &Value, b: &Value) -> Value {
    if a.as_f64() < b.as_f64() { b.clone() } else { a.clone() }
}

fn sum(a: &Value, b: &Value) -> Value {
    if let (Some(a), Some(b)) = (a.as_object(), b.as_object()) {
        let mut all = a.clone();
        for (word, n) in b {
            let n = all.get(word).map_or_else(|| n.clone(), |before| sum(before, n));
            all.insert(word.clone(), n);
        }
        all.sort_keys();
        return all.into();
    }
    match (a.as_u64().zip(b.as_u64()), a.as_f64().zip(b.as_f64())) {
        (Some((a, b)), _) => (a + b).into(),
        (_, Some((a, b))) => (a + b).into(),
        _ => Value::Null,
    }
}

fn described(part: &Part) -> Value {
    let (run, folder, shard) = (&part.run, part.folder.display().to_string(), part.shard.to_string());
    let (seconds, files, counts) = (&run["seconds"]["total"], &run["files"], &run["counts"]);
    json!({
        "folder": folder, "part": shard, "designs": run["shard"]["designs"], "backend": run["backend"], "taps": counts["taps"],
        "handed_over": run["handed_over"], "seconds": seconds, "files": files,
    })
}

pub(super) fn timed(run: &mut Value, seconds: f64) {
    let total = run["seconds"]["total"].as_f64().unwrap_or(0.0) + seconds;
    (run["seconds"]["total"], run["seconds"]["merge"]) = (total.into(), seconds.into());
    if let Some(taps) = run["counts"]["taps"].as_f64().filter(|_| !run["taps_per_second"].is_null()) {
        run["taps_per_second"] = (taps / total.max(1e-9)).into();
    }
}
