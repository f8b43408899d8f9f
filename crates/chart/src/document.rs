//! Charts as a JSON document, for pages and robots.

use serde_json::{Value, json};

use super::axis::Quantity;
use super::build::Built;
use super::distance::{DistanceChart, FUNCTIONS};
use super::series::{Row, Series};
use crate::evaluate::beside_linear;
use crate::scene::{Drive, Setup};

const FORMAT: u32 = 2;

/// `charts` of `setup`. A function at quantities q is driveᵉ Σ c T_i(x_drive) T_j(x_length) T_k(x_D) T_m(x_τ) T_n(x_place) over the terms of its
/// branch, x = (2y − y_lo − y_hi)/(y_hi − y_lo), y(q) the variable of its axis; 0 where an axis has one value. The strain is that at a point; `gauge`
/// has the points of a gauge and their weights ([`super::gauge`]). A second gauge adds three functions over a separate box, each to be added to its
/// value of linear theory; ε₂ is that at a point too. With a foil x is the middle of a gauge, whose reading is the strain times the share T that the
/// foil passes on ([`crate::physics::solid::Bonded`]).
pub fn document(setup: &Setup, charts: &[DistanceChart]) -> Value {
    let drive = if setup.drive == Drive::Angle { "theta_rad" } else { "delta_over_a" };
    let upright = charts.iter().all(|chart| chart.direction.is_upright());
    let names = match setup.gauge.foil {
        None => [
            "strain_over_theory_less_1_times_1_less_x_over_a",
            "arc_over_a_less_1",
            "force_over_linear_less_1",
        ],
        Some(_) => [
            "skin_strain_over_theory_less_1_times_1_less_x_over_a",
            "arc_over_a_less_1_times_1_less_x_over_a",
            "force_over_linear_less_1_times_1_less_x_over_a",
        ],
    };
    let mut all = json!({
        "vibrissa_chart": FORMAT,
        "version": env!("CARGO_PKG_VERSION"),
        "drive": drive,
        "hub_mm": setup.hub,
        "functions": names,
        "variables": { "linear": "q", "square": "q^2", "root": "(1 - q)^(-1/2)", "inverse": "1/(1 - q)", "fourth": "q^(1/4)" },
        "charts": charts.iter().map(|chart| one(chart, upright)).collect::<Vec<_>>(),
    });
    if setup.gauge.second {
        all["beside"] =
            json!(["strain_2_over_theory_times_1_less_x_over_a", "azimuth_rad", "slide_over_path"]);
    }
    all
}

fn one(chart: &DistanceChart, upright: bool) -> Value {
    let branch = |k: usize| json!({ "T_over_P": chart.ratios.get(k), "errors": chart.branches[k].errors, "series": series(&chart.branches[k]) });
    let mut one = json!({
        "a_mm": chart.a,
        "power": chart.power,
        "strain_error": chart.error,
        "axes": axes(chart),
        "gauge": { "largest_width_over_a": chart.gauges.width, "points": chart.gauges.points },
        "branches": (0..chart.branches.len()).map(branch).collect::<Vec<_>>(),
    });
    if let Some(weight) = &chart.weight {
        one["weight"] = json!(weight);
    }
    if !upright {
        (one["tilt_deg"], one["lean_deg"]) = (chart.direction.tilt.into(), chart.direction.lean.into());
    }
    if let (Some(built), Some(beside)) = (&chart.beside, chart.beside()) {
        let linear = beside_linear(chart.direction);
        one["beside"] = json!({ "linear": linear, "axes": axes(&beside), "errors": built.errors, "series": series(built) });
    }
    one
}

fn axes(chart: &DistanceChart) -> Value {
    let axis = |quantity: Quantity| {
        let axis = &chart.axes()[quantity as usize];
        json!({ "quantity": quantity.word(), "variable": axis.map, "range": axis.range })
    };
    json!(Quantity::ALL.map(axis))
}

fn series(built: &Built<FUNCTIONS>) -> Value {
    json!(built.series.iter().map(terms).collect::<Vec<Value>>())
}

fn terms(series: &Series) -> Value {
    json!(series.rows.iter().map(|row: &Row| json!([row.orders, row.coefficients])).collect::<Vec<_>>())
}
