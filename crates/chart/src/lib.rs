//! Taps of any model as smooth functions, in place of solving each.
//!
//! At one contact distance the strain at a point of the skin depends on the drive, D/a, τa and x/a ([`axis::Quantity`]); a gauge is a mean of points
//! ([`gauge`]). δ = ε/(θ f) − 1 = 1/K − 1, the arc and the force are smooth in them ([`function::Function`], [`distance::DistanceChart`]): sparse
//! Chebyshev series through some thousand taps solved in f64 where they matter ([`adaptive`]), checked at separate points ([`build`]). δ is charted
//! over the power of the drive with which it vanishes, so that SD(K) keeps its relative precision.
//!
//! Coulomb friction puts a kink where sticking ends. But sliding solutions at a given T/P are smooth, also in T/P, and a sticking contact is the one
//! whose arc does not move: charts at a few T/P between −μ and μ hold all branches, and [`lanes`] picks one.
//!
//! A [`ranker::Ranker`] ranks sweeps and reads rows for searches, a [`reader::Reader`] reads single taps, [`document`] writes charts as JSON.

use vibrissa_core::{design, error, estimate, physics, reduce, scene, status};
use vibrissa_evaluate::{evaluate, progress, statistics};
use vibrissa_kernel as kernel;

pub mod adaptive;
pub mod axis;
pub mod between;
pub mod build;
pub mod distance;
pub mod document;
pub mod function;
pub mod gauge;
pub mod lanes;
mod maker;
pub mod ranges;
pub mod ranker;
pub mod reader;
pub mod scope;
pub mod series;
pub mod taps;
pub mod weight;

use std::sync::atomic::AtomicBool;

use crate::error::{Error, InputError};
use crate::scene::{Contact, Direction, Layout, Study};

/// Default tolerance of a chart: that of single precision.
pub const TOLERANCE: f64 = 1e-5;

fn refused(what: &str, key: &str, allowed: &str) -> InputError {
    InputError::new(what).key(key).allowed(allowed)
}

fn layout(study: &Study) -> Result<Layout, InputError> {
    let list =
        || refused("a chart needs ranges, not a list of tuples", "tuples", "[whisker], [gauge] and [tap]");
    study.space.layout().ok_or_else(list)
}

/// The distances of `study`, mm, and the directions of its poles: each pair has its chart.
/// Errors: tuples that are listed; more than 64 charts; poles whose direction is sampled with their design.
pub fn places(study: &Study) -> Result<(Vec<f64>, Vec<Direction>), InputError> {
    let layout = layout(study)?;
    let Some(directions) = reader::directions(&layout) else {
        let what = "each direction has its chart, and these are sampled with the designs";
        return Err(refused(what, "tap.tilt", "tilt and lean as numbers, lists or ranges of their own"));
    };
    let charts = layout.n_distances * directions.len() as u64;
    if charts > reader::MOST_DISTANCES as u64 {
        let (what, key) = match directions.len() {
            1 => ("each distance has its chart", "tap.a"),
            _ => ("each distance and direction has its chart", "tap.tilt"),
        };
        return Err(refused(what, key, "64 at most").value(charts));
    }
    Ok(((0..layout.n_distances).map(|i| layout.distance(i)).collect(), directions))
}

/// The charts of `study` over its ranges, their strain accurate to a tenth of `tolerance`.
/// Errors: as [`places`]; a model without any chart; a backend that fails; `stop`, set from outside.
pub fn of_study(
    study: &Study,
    tolerance: f64,
    stop: &AtomicBool,
) -> Result<Vec<distance::DistanceChart>, Error> {
    let wanted = ranges::Wanted::of(&layout(study)?);
    let (distances, directions) = places(study)?;
    let found = reader::charts(&study.setup, (&distances, &directions), &wanted, (tolerance, stop))?;
    if found.is_empty() {
        let model = &study.setup.model;
        let frictionless = matches!(model.contact, Contact::Frictionless | Contact::Coulomb(0.0));
        if !frictionless && (study.setup.gauge.second || directions.iter().any(|d| !d.is_upright())) {
            let why = "tilted poles, and two gauges, have charts of frictionless contacts only";
            return Err(refused(why, "model.contact", "\"frictionless\"; upright poles and one gauge").into());
        }
        if !frictionless && model.pole_radius > 0.0 {
            let why = "whether a contact rolls on a pole or slides has no chart";
            return Err(refused(why, "model.contact", "\"frictionless\", or pole_radius = 0").into());
        }
        let why = "no distance has a chart: the geometry is linear, no gauge ends before a contact, or the model is not smooth there";
        return Err(
            refused(why, "model", "an exact model, contacts beyond 1.12 times the end of a gauge").into()
        );
    }
    Ok(found)
}
