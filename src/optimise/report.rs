//! Results of a finished search, as JSON and tables.

use serde_json::{Value, json};

use super::best::Other;
use super::blame::why;
use super::front::Front;
use super::score::{Limit, Score};
use super::sensitivity::{CONFIDENCE, Pair, Sensitivity, Share, Shares};
use super::session::{Ended, Step};
use super::variables::value;
use crate::backend::Backend;
use crate::error::Error;
use crate::scene::search::{Objective, Quantity, Search};
use crate::scene::{Column, Property, Setup, Spec, Tuple};
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::table::AtDrive;
use crate::sink::values::Field;
use crate::statistics::DriveRow;

#[derive(Debug, Clone, Copy)]
pub struct Design {
    pub point: Tuple,
    pub row: DriveRow,
    pub score: Score,
    /// Factor of K in the tables: 1, or the elongation length, mm.
    pub unit: f64,
}

impl Design {
    pub fn at_drive(&self) -> AtDrive {
        AtDrive { design: self.point, row: self.row.figures(), unit: self.unit }
    }
}

#[derive(Debug)]
pub struct Report {
    pub best: Design,
    pub value: f64,
    pub ended: Ended,
    pub starts: u32,
    pub evaluations: u64,
    pub taps_each: usize,
    /// Seconds: total, and of the search alone.
    pub seconds: [f64; 2],
    pub chart: Option<f64>,
    /// `model_error` of `run.json`, if effects could be left off, and the same in a few lines of text.
    pub model_error: Option<(Value, String)>,
    pub at_bounds: Vec<(Quantity, &'static str)>,
    pub binding: Vec<Limit>,
    /// The best design by the other estimator; `None` without distances, with two gauges, or after a stop.
    pub other: Option<Other>,
    pub sensitivity: Sensitivity,
    pub front: Option<Front>,
    /// Backends of the swarm and of the polish, which computes the figures.
    pub backends: [Backend; 2],
    pub history: Vec<Step>,
}

pub(crate) fn unit(setup: &Setup, point: &Tuple) -> f64 {
    crate::design::Design::new(setup, *point).elongation(setup).unwrap_or(1.0)
}

pub fn names(objective: Objective) -> Vec<&'static str> {
    let front = (objective == Objective::Pareto).then_some("pareto.csv");
    ["best.toml", "history.csv", "sensitivity.csv"].into_iter().chain(front).collect()
}

pub fn tables(spec: &Spec, report: &Report) -> Result<Vec<Frame>, Error> {
    let mut all = vec![history(spec, report)?, sensitivity(spec, report)?];
    if let Some(front) = &report.front {
        all.push(pareto(spec, &front.points)?);
    }
    Ok(all)
}

pub fn counts(report: &Report) -> Value {
    json!({
        "evaluations": report.evaluations,
        "evaluations_sensitivity": report.sensitivity.evaluations,
        "taps": report.evaluations * report.taps_each as u64,
        "starts": report.starts,
    })
}

pub fn seconds(report: &Report) -> Value {
    let mut seconds = json!({ "total": report.seconds[0], "search": report.seconds[1], "evaluations_per_second": report.evaluations as f64 / report.seconds[1].max(1e-9) });
    if let Some(chart) = report.chart {
        seconds["chart"] = chart.into();
    }
    seconds
}

pub fn row(spec: &Spec, design: &Design) -> Value {
    design.at_drive().json(&spec.study.setup)
}

pub fn key(setup: &Setup, column: Column) -> &'static str {
    Quantity::Column(column).name(setup.drive)
}

pub fn result(spec: &Spec, search: &Search, report: &Report) -> Value {
    let s = &report.sensitivity;
    let pair = |p: &Pair| json!({ "K_sd": p[0], "total_rms_mm": p[1] });
    let local: Value =
        s.local.iter().map(|(c, p)| (c.name(spec.study.setup.drive).to_owned(), pair(p))).collect();
    let bounds: Value = report
        .at_bounds
        .iter()
        .map(|(q, end)| (q.name(spec.study.setup.drive).to_owned(), json!(end)))
        .collect();
    let mut value = json!({
        "objective": search.objective.word(),
        "value": report.value,
        "best": row(spec, &report.best),
        "at_bounds": bounds,
        "binding_limits": report.binding.iter().map(|l| l.word()).collect::<Vec<_>>(),
        "why": why(&spec.study.setup, search, report),
        "ended_by": report.ended.word(),
        "estimator": spec.study.setup.estimate.theory.estimator(),
        "other": report.other.as_ref().map(|o| other(&spec.study.setup, o)),
        "sensitivity": {
            "elasticity": local, "sobol": shares(&spec.study.setup, s), "scale": SCALE, "confidence": CONFIDENCE,
            "samples": s.samples, "samples_complete": { "K_sd": s.complete[0], "total_rms_mm": s.complete[1] },
        },
    });
    if let Some(robust) = &search.robust {
        let [sd, total, _] = report.best.score.figures;
        value["robust"] = json!({ "samples": robust.samples, "K_sd": sd, "total_rms_mm": total });
    }
    if let Some(front) = &report.front {
        value["front"] = json!({
            "points": front.points.len(),
            "hypervolume": front.hypervolume,
            "reference": { "K_sd": front.reference[0], "total_rms_mm": front.reference[1] },
            "spread": front.spread,
            "rows": front.points.iter().map(|d| row(spec, d)).collect::<Vec<_>>(),
        });
    }
    value
}

pub const SCALE: &str = "ln";

fn shares(setup: &Setup, s: &Sensitivity) -> Value {
    let both = |found: &[Option<Shares>; 2], of: &dyn Fn(&Shares) -> Value| {
        let [sd, total] = found.each_ref().map(|f| f.as_ref().map(of));
        json!({ "K_sd": sd, "total_rms_mm": total })
    };
    let variable = |(c, found): &(Quantity, [Option<Shares>; 2])| {
        let value = json!({
            "first": both(found, &|s| json!(s.first.value)), "first_interval": both(found, &|s| json!(s.first.interval)),
            "total": both(found, &|s| json!(s.total.value)), "total_interval": both(found, &|s| json!(s.total.interval)),
        });
        (c.name(setup.drive).to_owned(), value)
    };
    s.global.iter().map(variable).collect()
}

fn other(setup: &Setup, other: &Other) -> Value {
    let figures = |d: &Design| {
        let row = d.row.figures();
        json!({
            setup.drive.column(): d.point.drive, "total_rms_mm": Some(d.score.figures[1]).filter(|t| t.is_finite()),
            "error_rms_mm": row.error_rms, "noise_rms_mm": row.noise_rms, "status": row.status.to_string(),
        })
    };
    json!({
        "estimator": other.theory.estimator(), "here": figures(&other.here), "best": other.best.as_ref().map(figures),
    })
}

fn history(spec: &Spec, report: &Report) -> Result<Frame, Error> {
    let setup = &spec.study.setup;
    let properties: &[Property] = setup.rigs.as_ref().map_or(&[], |rigs| &rigs.properties);
    let mut table = heading("history").frame_for(setup);
    let last = report.history.len().saturating_sub(1);
    for (i, step) in report.history.iter().enumerate() {
        // Only steps with a better result are listed, and the last.
        if i > 0 && i < last && report.history[i - 1].best.point == step.best.point {
            continue;
        }
        let (p, s) = (&step.best.point, &step.best.score);
        let mut row: Vec<Field> =
            vec![step.evaluations.into(), u64::from(step.start).into(), step.stage.word().into()];
        let [sd, total, weighted] = s.figures;
        row.extend([p.D, p.d, p.L_a, p.x_ss, p.l].map(Field::Number));
        row.extend(properties.iter().map(|q| Field::Number(value(setup, p, Quantity::Property(*q)))));
        row.extend([p.drive, sd, total, weighted, s.violation()].map(Field::Number));
        table.row(row)?;
    }
    Ok(table)
}

fn sensitivity(spec: &Spec, report: &Report) -> Result<Frame, Error> {
    let s = &report.sensitivity;
    let mut table = heading("sensitivity").frame(&[]);
    for &(quantity, local) in &s.local {
        let found = s.global.iter().find(|(c, _)| *c == quantity).map_or([None; 2], |(_, found)| *found);
        let each: Vec<Option<Share>> =
            found.iter().flat_map(|f| [f.map(|f| f.first), f.map(|f| f.total)]).collect();
        let mut fields: Vec<Field> = vec![quantity.name(spec.study.setup.drive).into()];
        fields.extend(local.map(Field::from));
        fields.extend(each.iter().map(|share| Field::from(share.map(|s| s.value))));
        let ends = each.iter().flat_map(|share| [0, 1].map(|end| share.map(|s| s.interval[end])));
        fields.extend(ends.map(Field::from));
        fields.push(if each.iter().any(Option::is_some) { SCALE } else { "" }.into());
        table.row(fields)?;
    }
    Ok(table)
}

fn pareto(spec: &Spec, points: &[Design]) -> Result<Frame, Error> {
    let setup = &spec.study.setup;
    let (columns, mut table) = (AtDrive::chosen(setup), heading("pareto").frame_for(setup));
    points.iter().try_for_each(|d| table.row(columns.fields(&d.at_drive())))?;
    Ok(table)
}
