//! `verify.csv` and its `run.json`: the census of backends against the reference. Columns are known here.

use serde_json::{Value, json};

use super::{Figures, Line, QUANTITIES};
use crate::backend::Backend;
use crate::error::Error;
use crate::scene::{self, Drive, Spec};
use crate::sink::csv::Text;
use crate::sink::folder::{Folder, hash};
use crate::sink::run_json::{self, in_force, material_fit};
use crate::sink::table::Field;

/// Columns of `verify.csv`. Errors are relative; the tuple is the tap with the largest strain error, `status` its words.
pub const COLUMNS: [&str; 37] = [
    "configuration",
    "backend",
    "precision",
    "adapter",
    "bound",
    "taps",
    "compared",
    "neither",
    "unsolved",
    "unanswered",
    "differ",
    "referred",
    "strain_error_worst",
    "strain_error_median",
    "strain_error_p99",
    "strain_over",
    "K_error_worst",
    "K_over",
    "force_error_worst",
    "force_over",
    "arc_error_worst",
    "arc_over",
    "sweeps_mean",
    "sweeps_max",
    "D_mm",
    "d_mm",
    "L_a_mm",
    "x_ss_mm",
    "l_mm",
    "a_mm",
    "tilt_deg",
    "lean_deg",
    "theta_deg",
    "delta_mm",
    "verdict",
    "other_words",
    "status",
];

/// `ok`, or what is wrong, joined by +.
pub fn verdict(line: &Line) -> String {
    let faults = line.faults();
    if faults.is_empty() { "ok".to_owned() } else { faults.join("+") }
}

/// What reference and backend say of the tap on which they are furthest apart; empty where they always agree.
pub fn other_words(line: &Line) -> String {
    line.odd.map_or(String::new(), |(_, expected, found)| format!("{found} (reference: {expected})"))
}

/// Writes `verify.csv`.
pub fn write(folder: &mut Folder, lines: &[Line], backends: &[Backend]) -> Result<(), Error> {
    folder.put("verify.csv", &table(lines, backends)?)
}

/// The census as `verify.csv`.
///
/// # Errors
/// None of a whole census.
pub fn table(lines: &[Line], backends: &[Backend]) -> Result<Vec<u8>, Error> {
    let mut text = Text::default();
    text.header(&COLUMNS)?;
    for line in lines {
        text.row(&mut fields(line, &backends[line.place]))?;
    }
    Ok(text.into_bytes())
}

fn fields(line: &Line, backend: &Backend) -> Vec<Field> {
    let count = |n: usize| Field::Count(n as u64);
    let value = |k: usize, f: fn(&Figures) -> f64| Field::from(line.errors[k].as_ref().map(f));
    let over = |k: usize| count(line.errors[k].map_or(0, |f| f.over));
    let mut fields = vec![
        Field::Text(line.configuration.clone()),
        Field::Word(backend.name),
        Field::Word(backend.precision),
        Field::Text(backend.adapter.clone().unwrap_or_default()),
        Field::Number(line.bound),
    ];
    fields.extend(
        [line.taps, line.compared, line.neither, line.unsolved, line.unanswered, line.differ, line.referred]
            .map(count),
    );
    fields.extend([value(0, |f| f.worst), value(0, |f| f.median), value(0, |f| f.p99), over(0)]);
    fields.extend((1..QUANTITIES.len()).flat_map(|k| [value(k, |f| f.worst), over(k)]));
    fields.extend([line.sweeps.0, line.sweeps.1].map(Field::Number));
    let mut at = [f64::NAN; 1 + scene::COLUMNS];
    if let Some((tuple, _)) = &line.at {
        let [before @ .., drive] = tuple.to_array();
        at[..before.len()].copy_from_slice(&before);
        at[before.len() + usize::from(line.drive == Drive::Displacement)] = drive;
    }
    fields.extend(at.map(Field::Number));
    fields.push(Field::Text(verdict(line)));
    fields.push(Field::Text(other_words(line)));
    fields.push(match line.at {
        Some((_, status)) => Field::Status(status),
        None => Field::Word(""),
    });
    fields
}

/// What was verified, for `run.json`.
#[derive(Debug)]
pub struct Verified<'a> {
    /// The spec, if there was one.
    pub spec: Option<&'a Spec>,
    /// Random taps of each configuration.
    pub samples: u32,
    /// Seed of the random taps.
    pub seed: u64,
    /// Backends, in the order of [`Line::place`].
    pub backends: &'a [Backend],
    /// The census.
    pub lines: &'a [Line],
    /// Taps that were solved everywhere, of how many, where a signal ended the run before all were.
    pub stopped: Option<[u64; 2]>,
    /// Start of the command to last byte, s.
    pub seconds: f64,
}

/// Identity of the built-in configurations as a result.
pub const BUILT_IN: &str = "";

/// Sums over the census.
pub fn counts(lines: &[Line]) -> Value {
    let sum = |f: fn(&Line) -> usize| lines.iter().map(f).sum::<usize>();
    json!({
        "comparisons": sum(|l| l.taps),
        "compared": sum(|l| l.compared),
        "neither": sum(|l| l.neither),
        "unsolved": sum(|l| l.unsolved),
        "referred": sum(|l| l.referred),
        "unanswered": sum(|l| l.unanswered),
        "differ": sum(|l| l.differ),
        "strain_over": sum(|l| l.errors[0].map_or(0, |f| f.over)),
        "lines": lines.len(),
        "broken_lines": sum(|l| usize::from(!l.faults().is_empty())),
    })
}

/// One line of the census as JSON, by the names of the columns.
pub fn line_json(line: &Line, backend: &Backend) -> Value {
    COLUMNS.into_iter().map(str::to_owned).zip(fields(line, backend).into_iter().map(Value::from)).collect()
}

/// The whole of `run.json`.
pub fn document(v: &Verified<'_>) -> Value {
    let (name, text) = v.spec.map_or(("verify", BUILT_IN), |s| (&s.name, &s.text));
    run_json::document(
        "verify",
        json!({ "name": name, "hash": hash(text), "text": text }),
        json!({
            "in_force": v.spec.map(in_force),
            "material_fit": v.spec.map(|s| material_fit(s, None)),
            "warnings": v.spec.map_or(&[][..], |s| &s.warnings),
            "samples": v.samples,
            "seed": v.seed,
            "backends": v.backends,
            "counts": counts(v.lines),
            "stopped": v.stopped.map(|[taps, of]| json!({ "taps": taps, "of": of })),
            "census": v.lines.iter().map(|l| line_json(l, &v.backends[l.place])).collect::<Vec<_>>(),
            "seconds": { "total": v.seconds },
        }),
    )
}
