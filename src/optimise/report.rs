//! Results of a finished search, as JSON and tables; and which limits bind, or are violated, and by how much.

use serde_json::{Value, json};

use super::best::Other;
use super::front::Front;
use super::sensitivity::{CONFIDENCE, Pair, Sensitivity, Share, Shares};
use super::session::{quantities, value};
use super::{Ended, Limit, Score, Step};
use crate::backend::Backend;
use crate::error::{Error, InputError};
use crate::scene::{Objective, Quantity, Search, Setup, Spec, Theory, Tuple};
use crate::sink::{AtDrive, Field, Frame, heading};
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
    let front = report.front.as_ref().map(|front| pareto(spec, &front.points));
    [history(spec, report), sensitivity(spec, report)].into_iter().chain(front).collect()
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

pub fn result(spec: &Spec, search: &Search, report: &Report) -> Value {
    let (s, setup) = (&report.sensitivity, &spec.study.setup);
    let name = |q: &Quantity| q.name(setup.drive).to_owned();
    let pair = |p: &Pair| json!({ "K_sd": p[0], "total_rms_mm": p[1] });
    let local: Value = s.local.iter().map(|(q, p)| (name(q), pair(p))).collect();
    let bounds: Value = report.at_bounds.iter().map(|(q, end)| (name(q), json!(end))).collect();
    let mut value = json!({
        "objective": search.objective.word(),
        "value": report.value,
        "best": report.best.at_drive().json(setup),
        "at_bounds": bounds,
        "binding_limits": report.binding.iter().map(|l| l.word()).collect::<Vec<_>>(),
        "why": why(setup, search, report),
        "ended_by": report.ended.word(),
        "estimator": setup.estimate.theory.estimator(),
        "other": report.other.as_ref().map(|o| other(setup, o)),
        "sensitivity": {
            "elasticity": local, "sobol": shares(setup, s), "scale": SCALE, "confidence": CONFIDENCE,
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
            "rows": front.points.iter().map(|d| d.at_drive().json(setup)).collect::<Vec<_>>(),
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
    let mut table = heading("history").frame_for(setup);
    let last = report.history.len().saturating_sub(1);
    for (i, step) in report.history.iter().enumerate() {
        // Only steps with a better result are listed, and the last.
        if i > 0 && i < last && report.history[i - 1].best.point == step.best.point {
            continue;
        }
        let (p, s) = (&step.best.point, &step.best.score);
        let begin = [step.evaluations.into(), u64::from(step.start).into(), step.stage.word().into()];
        let figures = s.figures.into_iter().chain([s.violation()]);
        let numbers = quantities(setup).map(|q| value(setup, p, q)).chain(figures).map(Field::Number);
        table.row(begin.into_iter().chain(numbers))?;
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

pub fn infeasible(setup: &Setup, search: &Search, closest: &Score) -> InputError {
    let first = violated(closest)[0];
    let message =
        format!("no design within the bounds keeps this limit: {}", shortfall(setup, search, closest));
    let more = |most: f64, unit: &str| {
        format!("about {}{unit} or more with everything else as it is", reached(closest, first, most))
    };
    let limits = &search.limits;
    let (key, allowed) = match first {
        Limit::Strain => (limits.strain_key, more(limits.strain, "")),
        Limit::Force => ("optimise.limits.force_N", more(limits.force.unwrap_or(f64::NAN), " N")),
        Limit::Unambiguous => {
            ("optimise.limits.unambiguous", "false, larger distances, or other bounds".into())
        }
        Limit::Tip => ("optimise.limits.tip_not_wider", "false, or other bounds of D and d".into()),
        _ => ("optimise.variables", "wider bounds, other distances, or wider limits".into()),
    };
    InputError::new(message).key(key).allowed(allowed)
}

fn violated(score: &Score) -> Vec<Limit> {
    let mut violated: Vec<Limit> = Limit::ALL.into_iter().filter(|&l| score.limit(l) > 0.0).collect();
    violated.sort_by(|a, b| score.limit(*b).total_cmp(&score.limit(*a)));
    if violated.is_empty() {
        violated.push(Limit::Solved);
    }
    violated
}

pub fn shortfall(setup: &Setup, search: &Search, score: &Score) -> String {
    let phrases: Vec<String> = violated(score).into_iter().map(|l| phrase(setup, search, score, l)).collect();
    phrases.join("; it also breaks another: ")
}

fn phrase(setup: &Setup, search: &Search, score: &Score, limit: Limit) -> String {
    let (value, at) = (score.limit(limit), "at the closest design");
    let times = format!("{:.4} times", 1.0 + value);
    let of = |most: f64, unit: &str| {
        let reached = reached(score, limit, most);
        format!("{reached}{unit} {at}, {:.3} times the limit of {most}{unit}", 1.0 + value)
    };
    match limit {
        Limit::Strain => format!("the gauge strain is {}", of(search.limits.strain, "")),
        Limit::Force => format!("the contact force is {}", of(search.limits.force.unwrap_or(f64::NAN), " N")),
        Limit::Unambiguous if value < 1.0 => {
            let from = setup.estimate.range.map_or("the smallest a".to_owned(), |r| format!("{} mm", r[0]));
            let far = 1.0 / (1.0 - value);
            format!(
                "the peak of the strain curve lies {far:.3} times as far as the range begins ({from}) {at}"
            )
        }
        Limit::Unambiguous => {
            "the strain curve of the closest design has no peak before its range ends".to_owned()
        }
        Limit::Tip => format!("d is {times} D {at}"),
        Limit::Gauge => format!("the gauge ends at {times} L_a"),
        Limit::Reach => format!("the largest a is {times} L_a"),
        Limit::NoStrain => format!("a contact lies at or before the gauge (no_strain) {at}"),
        Limit::Slipped => format!("the contact runs to {times} L_a (slipped_off) {at}"),
        Limit::Root => format!("the largest reading is {times} the peak of the strain curve (no_root) {at}"),
        Limit::Solved => {
            "taps of the closest design have no solution (not_converged or material_limit)".to_owned()
        }
        Limit::Samples => format!(
            "fewer than 90 % of the sampled whiskers keep their limits; the worst of 90 % breaks one by {:.3} %",
            100.0 * value
        ),
    }
}

fn reached(score: &Score, limit: Limit, least: f64) -> f64 {
    // Rounded up, because the user will type it; printed and parsed, so that it is the decimal number.
    let value = (1.0 + score.limit(limit)) * least;
    let digits = 10f64.powi(3 - value.log10().floor() as i32);
    format!("{:.3e}", (value * digits * (1.0 - 1e-9)).ceil() / digits).parse().unwrap_or(value)
}

/// The bias as text: an exact model that inverts its own strains has 0 by construction.
pub fn bias(theory: Theory, value: Option<f64>, number: &dyn Fn(Option<f64>) -> String) -> String {
    match (theory, value) {
        (Theory::Exact, Some(0.0)) => "0 by construction".into(),
        _ => number(value),
    }
}

pub fn why(setup: &Setup, search: &Search, report: &Report) -> String {
    let mut parts: Vec<String> = Vec::new();
    for (quantity, end) in &report.at_bounds {
        let value = value(setup, &report.best.point, *quantity);
        let (name, unit) = (quantity.name(setup.drive), quantity.unit(setup.drive));
        let space = if unit.is_empty() || unit.starts_with([' ', '°']) { "" } else { " " };
        let end = if *end == "min" { "smallest" } else { "largest" };
        parts.push(format!("{name} is at its {end} value, {value}{space}{unit}"));
    }
    let binds = |l: &Limit| match l {
        Limit::Strain => "the strain limit binds",
        Limit::Force => "the force limit binds",
        Limit::Unambiguous => "the distance would become ambiguous",
        Limit::Tip => "the tip would become wider than the base",
        Limit::Slipped => "the contact would slip off",
        Limit::Root => "a reading would have no distance",
        Limit::NoStrain => "a contact would reach the gauge",
        Limit::Samples => "the limits bind in 90 % of the sampled whiskers",
        Limit::Gauge => "the gauge would leave the whisker",
        Limit::Reach => "a contact would leave the whisker",
        Limit::Solved => "the model would have no solution",
    };
    parts.extend(report.binding.iter().map(|l| binds(l).to_owned()));
    let row = report.best.row.figures();
    if let (true, Some(error), Some(noise)) =
        (search.objective != Objective::Sd, row.error_rms, row.noise_rms)
    {
        let larger = if error > noise { "bias" } else { "noise" };
        let mm = |x: Option<f64>| match x.unwrap_or(f64::NAN) {
            x if x.abs() < 1e-3 => format!("{x:.3e} mm"),
            x => format!("{x:.4} mm"),
        };
        let bias = bias(setup.estimate.theory, Some(error), &mm);
        let noise = mm(Some(noise));
        parts.push(format!("{larger} is the larger part of the total (bias {bias}, noise {noise})"));
    }
    if parts.is_empty() {
        return "No bound and no limit binds: the optimum lies inside.".into();
    }
    let mut text = parts.join("; ") + ".";
    if let Some(first) = text.get(..1).map(str::to_uppercase).filter(|_| report.at_bounds.is_empty()) {
        text.replace_range(..1, &first);
    }
    text
}
