//! Words that several commands say.

use std::path::PathBuf;

use serde_json::Value;

use crate::backend::Backend;
use crate::scene::Spec;

/// Names of files in one line.
pub fn listed(files: &[PathBuf]) -> String {
    files.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// The values in force of `spec`, a line each.
pub fn in_force(spec: &Spec) -> String {
    let line = |(key, value, written): &(String, String, bool)| {
        format!("  {key} = {value}{}\n", if *written { "" } else { "    (default)" })
    };
    spec.in_force.iter().map(line).collect()
}

/// `result` with what was left off in it, where that was asked for.
pub fn with_model_error(mut result: Value, model_error: Option<&(Value, String)>) -> Value {
    if let Some((told, _)) = model_error {
        result["model_error"] = told.clone();
    }
    result
}

/// The backend, why it was taken, its precision and tolerance.
pub fn where_and_why(b: &Backend) -> String {
    let place = match &b.adapter {
        Some(name) => format!("gpu {name}"),
        None => format!("{} with {} threads", b.name, b.threads),
    };
    let tolerance = b.tolerance.map_or(String::new(), |t| format!(", tolerance {t:e}"));
    format!("{place} ({}; {}{tolerance})", b.reason, b.precision)
}

/// A count in groups of three digits: 10 000.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let first = digits.len() % 3;
    let groups: Vec<&str> = std::iter::once(&digits[..first])
        .chain((first..digits.len()).step_by(3).map(|i| &digits[i..i + 3]))
        .filter(|group| !group.is_empty())
        .collect();
    groups.join(" ")
}

/// A rate or a number of bytes, as exactly as anybody reads it: 870 000, 4.3e9.
pub fn rough(x: f64) -> String {
    let two: f64 = format!("{x:.1e}").parse().unwrap_or(x);
    match two {
        _ if two >= 1e9 => format!("{two:.1e}"),
        _ if two >= 10.0 => grouped(two as u64),
        _ => two.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_stand_in_threes() {
        let pairs = [(0, "0"), (33, "33"), (999, "999"), (10_000, "10 000"), (1_234_567, "1 234 567")];
        pairs.into_iter().for_each(|(n, text)| assert_eq!(grouped(n), text));
    }

    #[test]
    fn two_digits_are_enough() {
        let pairs = [
            (0.0123, "0.012"),
            (0.0, "0"),
            (2.66, "2.7"),
            (12.64, "13"),
            (868_901.0, "870 000"),
            (4.33e9, "4.3e9"),
        ];
        pairs.into_iter().for_each(|(x, text)| assert_eq!(rough(x), text));
    }
}
