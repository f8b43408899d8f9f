//! Recomputes the statistics from tuples.csv by their definitions: which taps count, which fields are empty.

use super::sweeping::{Row, Swept, Table, number};

/// Status words in the order in which they are joined.
const WORDS: &str =
    "invalid_geometry no_strain not_converged material_limit slipped_off strain_limit no_root ambiguous";

/// Relative error allowed where sums are taken in another order.
const ROUNDING: f64 = 1e-9;

fn counts(row: &Row) -> bool {
    !WORDS.split(' ').take(5).any(|word| row["status"].split('+').any(|w| w == word))
}

fn union(rows: &[&Row]) -> String {
    let has = |word: &&str| rows.iter().any(|row| row["status"].split('+').any(|w| w == *word));
    let words: Vec<&str> = WORDS.split(' ').filter(has).collect();
    if words.is_empty() { "ok".to_owned() } else { words.join("+") }
}

#[track_caller]
fn same(row: &Row, column: &str, expected: Option<f64>) {
    let value = number(row, column);
    match (value, expected) {
        (Some(v), Some(e)) => {
            assert!((v - e).abs() <= ROUNDING * e.abs().max(1e-6), "{column}: {v} is not {e} in {row:?}")
        }
        (v, e) => assert_eq!(v, e, "{column} in {row:?}"),
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn rms(values: &[f64]) -> Option<f64> {
    mean(&values.iter().map(|v| v * v).collect::<Vec<_>>()).map(f64::sqrt)
}

fn largest(values: &[f64]) -> Option<f64> {
    values.iter().map(|v| v.abs()).reduce(f64::max)
}

/// Mean and sample standard deviation of K, from K − 1 (in mm: from K).
fn k_statistics(taps: &[&Row], table: &Row) {
    let mm = table.contains_key("K_sd_mm");
    let column = if mm { "K_mm" } else { "K_deviation" };
    let values: Vec<f64> = taps.iter().map(|t| number(t, column).expect("a counting tap has K")).collect();
    let centre = mean(&values);
    let sd = centre
        .filter(|_| values.len() > 1)
        .map(|m| (values.iter().map(|v| (v - m) * (v - m)).sum::<f64>() / (values.len() - 1) as f64).sqrt());
    let name = |n: &str| if mm { format!("{n}_mm") } else { n.to_owned() };
    same(table, &name("K_mean"), centre.map(|m| if mm { m } else { 1.0 + m }));
    same(table, &name("K_sd"), sd);
    assert_eq!(table["n"], values.len().to_string(), "{table:?}");
}

fn of<'a>(tuples: &'a Table, row: &Row, keys: &[&str]) -> Vec<&'a Row> {
    let taps: Vec<&Row> =
        tuples.rows.iter().filter(|t| keys.iter().all(|key| t[*key] == row[*key])).collect();
    assert!(!taps.is_empty(), "no taps of {row:?}");
    taps
}

/// Checks every row of designs.csv and distances.csv against tuples.csv; `given`: the spec sets `[estimate] K`.
pub fn check(swept: &Swept, given: bool) {
    let drive = if swept.tuples.columns.iter().any(|c| c == "delta_mm") { "delta_mm" } else { "theta_deg" };
    let design = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm"];
    for row in &swept.designs.rows {
        let taps = of(&swept.tuples, row, &[&design[..], &[drive]].concat());
        let counting: Vec<&Row> = taps.iter().copied().filter(|t| counts(t)).collect();
        k_statistics(&counting, row);
        let all = |column: &str| counting.iter().map(|t| number(t, column)).collect::<Option<Vec<f64>>>();
        let estimates = (given || counting.len() > 1).then(|| all("error_mm").zip(all("sigma_mm"))).flatten();
        let (errors, noise) = estimates.unwrap_or_default();
        same(row, "error_rms_mm", rms(&errors));
        same(row, "error_max_mm", largest(&errors));
        same(row, "error_mean_mm", mean(&errors));
        same(row, "noise_rms_mm", rms(&noise));
        same(row, "total_rms_mm", rms(&errors).zip(rms(&noise)).map(|(e, n)| e.hypot(n)));
        same(row, "strain_max", largest(&all("strain").expect("strains")));
        same(row, "force_max_N", largest(&all("normal_force_N").expect("forces")));
        assert_eq!(row["status"], union(&taps), "{row:?}");
    }
    for row in &swept.distances.rows {
        let taps = of(&swept.tuples, row, &[&design[..], &["a_mm"]].concat());
        let counting: Vec<&Row> = taps.iter().copied().filter(|t| counts(t)).collect();
        k_statistics(&counting, row);
        assert_eq!(row["status"], union(&taps), "{row:?}");
    }
}
