//! `run.json`: command, spec, timing and outcome of a run.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::combinations::Combinations;
use crate::reduce::Sweeps;
use crate::scene::{Column, Spec, Study};
use crate::{WHISKER, hash};

/// Version of the result format.
pub const FORMAT: u32 = 1;

/// Counters of a running sweep.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Taps evaluated and reduced.
    pub taps: u64,
    /// Taps solved by a kernel or the reference; rows that are kept count again.
    pub solved: u64,
    /// Taps read from charts instead of solved.
    pub interpolated: u64,
    /// Taps that a kernel left unanswered and the reference solved.
    pub referred: u64,
    /// Rows of tuples, designs, distances tables.
    pub rows: [u64; 3],
    /// Taps per combination of status words.
    pub combinations: Combinations,
    /// The chart from which rows were ranked.
    #[serde(skip)]
    pub chart: Option<Value>,
    /// Designs rows among which `top` chose.
    pub complete: Option<u64>,
    /// Designs rows that `top` kept.
    pub kept: Option<u64>,
    /// Kernel sweeps of all solved taps (rows, nodes, chart), with those of earlier parts of the run.
    pub sweeps: Sweeps,
    /// Largest |gauge strain| of the counted taps.
    pub strain: Option<f64>,
}

/// Seconds of a run.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Seconds {
    /// Total until the last byte, with opening the device, making charts and choosing the model.
    pub total: f64,
    /// Finding and opening the device.
    pub open: f64,
    /// Making charts, with refused ones; absent if none was tried.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chart: Option<f64>,
    /// Solving taps and reading charts.
    pub solve: f64,
}

/// The counts as in `run.json` and `--json`.
pub fn counts(c: &Counts) -> Value {
    let mut value = json!({
        "taps": c.taps,
        "solved": c.solved,
        "interpolated": c.interpolated,
        "referred": c.referred,
        "tuples": c.rows[0],
        "designs": c.rows[1],
        "distances": c.rows[2],
        "status": c.combinations.words(),
        "combinations": c.combinations.named(),
        "sweeps_mean": c.sweeps.mean(),
        "sweeps_max": c.sweeps.most(),
    });
    if let Some(chart) = &c.chart {
        value["chart"] = json!(chart);
    }
    if let Some(n) = c.complete {
        value["complete_rows"] = n.into();
        value["kept_rows"] = c.kept.into();
    }
    value
}

/// Every value in force; defaults are marked.
pub fn in_force(spec: &Spec) -> Value {
    let entry = |(key, value, written): &(String, String, bool)| json!({ "key": key, "value": value, "default": !written });
    spec.in_force.iter().map(entry).collect()
}

/// The fit of the material and, after a run, if its data cover the gauge strains; null without a curve.
pub fn material_fit(spec: &Spec, c: Option<&Counts>) -> Value {
    let Some(fit) = &spec.material_fit else { return Value::Null };
    let mut value = json!({
        "file": fit.file,
        "law": "yeoh",
        "points": fit.points,
        "coefficients_MPa": fit.coefficients,
        "rms_MPa": fit.rms,
        "range": fit.range,
    });
    if let Some(c) = c {
        value["largest_gauge_strain"] = json!(c.strain);
        value["within_data_range"] = json!(c.strain.map(|e| fit.covers(e)));
    }
    value
}

/// The spec as in `run.json`.
pub fn spec(spec: &Spec) -> Value {
    json!({ "name": spec.name, "hash": hash(&spec.text), "text": spec.text })
}

/// A whole `run.json`: version and commit, the spec, and `body`.
pub fn document(command: &str, spec: Value, body: Value) -> Value {
    let mut whole = json!({
        "format": FORMAT,
        "command": command,
        "version": env!("CARGO_PKG_VERSION"),
        "commit": crate::COMMIT,
        "spec": spec,
    });
    if let (Some(whole), Value::Object(body)) = (whole.as_object_mut(), body) {
        whole.extend(body);
    }
    whole
}

/// Columns of whisker, rig and direction with several values in `study`.
pub fn varying(study: &Study) -> Vec<&'static str> {
    let (setup, space) = (&study.setup, &study.space);
    let several = |column: Column| space.axis(column).is_none_or(|axis| axis.len() > 1);
    let whisker = Column::ALL.into_iter().zip(WHISKER).filter_map(|(c, name)| several(c).then_some(name));
    let rigs = setup.rigs.iter().flat_map(|rigs| rigs.properties.iter().map(|p| p.about().column));
    let angles = setup.directions.into_iter().zip(["tilt_deg", "lean_deg"]);
    whisker.chain(rigs).chain(angles.filter_map(|(shown, column)| shown.then_some(column))).collect()
}
