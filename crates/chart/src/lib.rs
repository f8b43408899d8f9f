//! One smooth function in place of many taps, for every model.
//!
//! At one contact distance the strain at a point of the skin depends on four numbers, in units of that distance: the drive, D/a, τa and x/a
//! ([`axis::Quantity`]); hub, pole and material are those of the rig, and a gauge is a mean of points ([`gauge`]). δ = ε/(θ f) − 1, which is 1/K − 1, the arc of the contact and its force
//! are smooth functions of them ([`function::Function`], [`distance::DistanceChart`]): sparse Chebyshev series through some thousand taps solved in f64, asked where
//! they matter ([`adaptive`]), checked at points of their own ([`build`]). Where a theory is the limit of the model δ vanishes with the drive, and
//! δ over a power of it is charted, so that SD(K) keeps its relative precision where K → 1.
//!
//! With Coulomb friction the tap has a kink where sticking ends. But the sliding solutions at a given T/P are smooth, also in T/P, and a
//! sticking contact is the one of them whose arc does not move: so charts at a few T/P between −μ and μ hold all branches, and what picks
//! one ([`lanes`]). Compared with a chart of the sticking solution, whose T/P reaches tens on a fine tip, this needs no solve of a sticking contact.
//!
//! Measured (D 8…12, d 2…7, L_a 50, x_ss 3…15, l 1…4 mm, θ 0.5…10°, ten distances 21…48 mm, tolerance 1e-5): practical whisker 3 404
//! coefficients for all distances, 7 867 taps solved, strain error at the checking points 5.9e-7; with Coulomb 0.3 13 713, 31 552, 1.8e-6.
//!
//! A [`ranker::Ranker`] ranks sweeps by them and tells rows for searches, a [`reader::Reader`] reads single taps. What lies outside the charts is
//! solved. `vibrissa chart` writes them as JSON ([`document`]).

use vibrissa_core::{design, error, estimate, physics, reduce, scene, status};
use vibrissa_evaluate::{evaluate, progress, statistics};
use vibrissa_kernel as kernel;

pub mod adaptive;
pub mod axis;
pub mod beside;
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

/// Tolerance of a chart where nothing is said: that of single precision.
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
///
/// # Errors
/// Tuples that are listed; more than 64 charts; poles whose direction is sampled with their design.
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

/// The charts of `study` over its ranges, their strain good to a tenth of `tolerance`.
///
/// # Errors
/// As [`places`]; a model that has no chart anywhere; a backend that fails; `stop`, set from outside.
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
