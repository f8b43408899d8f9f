//! One sentence on what limits the best design.

use super::report::Report;
use super::score::Limit;
use super::variables::value;
use crate::scene::search::{Objective, Search};
use crate::scene::{Setup, Theory};

/// The bias for people: a model that inverts its own strains has none by construction.
pub fn bias(theory: Theory, value: Option<f64>, number: &dyn Fn(Option<f64>) -> String) -> String {
    match (theory, value) {
        (Theory::Exact, Some(0.0)) => "0 by construction".into(),
        _ => number(value),
    }
}

/// What ends the way to something better.
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
    let row = &report.best.row;
    if let (true, Some(error), Some(noise)) =
        (search.objective != Objective::Sd, row.error_rms(), row.noise_rms())
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
