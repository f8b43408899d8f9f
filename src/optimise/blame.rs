//! Explains infeasible searches: which limit is violated, and by how much.

use super::report::Report;
use super::score::{Limit, Score};
use super::variables::value;
use crate::error::InputError;
use crate::scene::search::{Objective, Search};
use crate::scene::{Setup, Theory};

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
            ("optimise.limits.unambiguous", "false, larger distances, or other bounds".to_owned())
        }
        Limit::Tip => ("optimise.limits.tip_not_wider", "false, or other bounds of D and d".to_owned()),
        _ => ("optimise.variables", "wider bounds, other distances, or wider limits".to_owned()),
    };
    InputError::new(message).key(key).allowed(allowed)
}

fn violated(score: &Score) -> Vec<Limit> {
    let mut violated: Vec<Limit> = Limit::all().filter(|&l| score.limit(l) > 0.0).collect();
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
    let value = score.limit(limit);
    let times = |least: f64, unit: &str| {
        let reached = reached(score, limit, least);
        format!("{reached}{unit} at the closest design, {:.3} times the limit of {least}{unit}", 1.0 + value)
    };
    match limit {
        Limit::Strain => format!("the gauge strain is {}", times(search.limits.strain, "")),
        Limit::Force => {
            format!("the contact force is {}", times(search.limits.force.unwrap_or(f64::NAN), " N"))
        }
        Limit::Unambiguous => {
            let from = setup.estimate.range.map_or("the smallest a".to_owned(), |r| format!("{} mm", r[0]));
            match value {
                v if v < 1.0 => format!(
                    "the peak of the strain curve lies {:.3} times as far as the range begins ({from}) at the closest design",
                    1.0 / (1.0 - v)
                ),
                _ => "the strain curve of the closest design has no peak before its range ends".to_owned(),
            }
        }
        Limit::Tip => format!("d is {:.4} times D at the closest design", 1.0 + value),
        Limit::Gauge => format!("the gauge ends at {:.4} times L_a", 1.0 + value),
        Limit::Reach => format!("the largest a is {:.4} times L_a", 1.0 + value),
        Limit::NoStrain => {
            "a contact lies at or before the gauge (no_strain) at the closest design".to_owned()
        }
        Limit::Slipped => {
            format!("the contact runs to {:.4} times L_a (slipped_off) at the closest design", 1.0 + value)
        }
        Limit::Root => format!(
            "the largest reading is {:.4} times the peak of the strain curve (no_root) at the closest design",
            1.0 + value
        ),
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
