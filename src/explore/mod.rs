//! A page to play with: one chart that serves every distance, baked over the ranges of a spec, in one HTML file.
//!
//! With the contact distance a as unit of length a tap knows five numbers: the drive (θ in rad, or δ/a), r₀/a (or ρ/a), D/a, τa, and the
//! place x/a at which the strain is asked. So one chart over scaled ranges holds every distance, and the strain along the whole whisker
//! beside that of any gauge, which is a mean over x. With Coulomb friction several charts hold it, as in [`crate::chart`].
//! `domain` says which ranges, `taps` solves the taps, `along` is the chart, `check` compares what a page would say with taps solved at whiskers of its
//! own, [`document`] writes it all, [`page`] makes the file.

mod along;
mod check;
pub mod document;
mod domain;
pub mod page;
mod taps;

use crate::error::{Error, InputError};
use crate::physics::solid::is_solid;
use crate::scene::{Contact, Geometry, Setup, Spec, Theory};
use along::Along;
use check::Census;
use domain::Domain;

/// Numbers of T/P between −μ and μ that are tried for a contact with friction.
const RATIOS: [usize; 2] = [3, 5];

/// Largest error of the strain, relative, where nothing is said: that of single precision.
pub const TOLERANCE: f64 = 1e-5;

/// Larger ones that are tried in turn where nothing is said and the model is not smooth enough.
const LOOSER: [f64; 3] = [3e-5, 1e-4, 1e-3];

/// Tolerances that a chart of some thousand terms can hold.
const ALLOWED: [f64; 2] = [1e-7, 1e-3];

/// `tolerance`, if a page's chart can hold it.
pub fn sound(tolerance: f64) -> Result<f64, InputError> {
    if (ALLOWED[0]..=ALLOWED[1]).contains(&tolerance) {
        return Ok(tolerance);
    }
    let e = InputError::new("this is not a tolerance of a page's chart").key("tolerance").value(tolerance);
    Err(e.allowed(format!("{:e} to {:e}", ALLOWED[0], ALLOWED[1])))
}

/// Keys of what is no cone.
const BUILT: [&str; 7] = [
    "whisker.profile",
    "whisker.exponent",
    "whisker.bore",
    "whisker.core",
    "whisker.curvature",
    "whisker.curvature_slope",
    "whisker.root",
];

/// What a page reads.
#[derive(Debug, Clone)]
pub struct Baked {
    /// Ranges and starts of its sliders.
    pub domain: Domain,
    /// The chart.
    pub chart: Along,
    /// Its errors at whiskers of the domain.
    pub census: Census,
}

/// The theory that a page of `setup` tells distances by. A page does not invert the model itself: with `exact` it is that of K in every table.
pub fn theory(setup: &Setup) -> Theory {
    match setup.estimate.theory {
        Theory::Exact => Theory::EulerBernoulli,
        formula => formula,
    }
}

/// What should be known of a page of `setup`.
pub fn remark(setup: &Setup) -> Option<String> {
    let (asked, told) = (setup.estimate.theory, theory(setup));
    let text = || {
        let (asked, told) = (asked.word(), told.word());
        format!(
            "a page tells distances by a formula, here {told}; the spec says theory = \"{asked}\", as sweep and tap tell them"
        )
    };
    (asked != told).then(text)
}

/// As [`bake`] to the tolerance that was `asked`, else to the least that a chart holds of [`TOLERANCE`] and a few larger ones; and that tolerance.
pub fn bake_asked(spec: &Spec, asked: Option<f64>) -> Result<(Baked, f64), Error> {
    let first = sound(asked.unwrap_or(TOLERANCE))?;
    let failed = match bake(spec, first) {
        Ok(baked) => return Ok((baked, first)),
        Err(failed) => failed,
    };
    let larger = LOOSER.into_iter().filter(|_| asked.is_none());
    larger.into_iter().find_map(|e| Some((bake(spec, e).ok()?, e))).ok_or(failed)
}

/// The chart of the model of `spec` over its domain; `strain` is the largest error of strain, relative.
///
/// # Errors
/// A spec without ranges, a model that has no chart of this kind, or one that is not smooth over the ranges: each says which key, and what is
/// allowed.
pub fn bake(spec: &Spec, strain: f64) -> Result<Baked, Error> {
    let setup = &spec.study.setup;
    let refuse = |message: &str, key: &str, value: String, allowed: &str| {
        Err(Error::from(InputError::new(message).key(key).value(value).allowed(allowed)))
    };
    // The first of `keys` that the spec writes, and has another value than `off`.
    let written = |keys: &[&'static str], off: &str| {
        let is = |key: &str, (k, value, written): &(String, String, bool)| {
            *written
                && value != off
                && k.strip_prefix(key).is_some_and(|s| s.is_empty() || s.starts_with('.'))
        };
        keys.iter().copied().find(|key| spec.in_force.iter().any(|entry| is(key, entry))).unwrap_or(keys[0])
    };
    if setup.model.geometry == Geometry::Linear {
        return refuse("a page shows the exact rod", "model.geometry", "linear".into(), "exact");
    }
    if setup.model.contact == Contact::Stick {
        let (message, allowed) =
            ("what holds a contact that always sticks has no chart", "frictionless, { coulomb = … }");
        return refuse(message, "model.contact", "stick".into(), allowed);
    }
    let pole = setup.model.pole_radius;
    if matches!(setup.model.contact, Contact::Coulomb(f64::MIN_POSITIVE..)) && pole > 0.0 {
        let message = "what holds a contact that rolls on a pole has no chart";
        return refuse(message, "model.pole_radius", pole.to_string(), "0, or a frictionless contact");
    }
    let Some(layout) = spec.study.space.layout() else {
        let (value, allowed) = ("a file".to_owned(), "[whisker], [gauge] and [tap]");
        return refuse("a page needs ranges, not a list of tuples", "tuples", value, allowed);
    };
    if !layout.is_upright() {
        let (key, value) = (written(&["tap.tilt", "tap.lean"], "0"), "not 0".to_owned());
        return refuse("a page bakes one chart, of upright poles", key, value, "tilt = 0 and lean = 0");
    }
    if setup.gauge.second {
        return refuse("a page shows what one gauge reads", "gauge.second", "true".into(), "false");
    }
    if setup.built.is_some() {
        let (value, allowed) = ("more than a cone".to_owned(), "a cone: D, d, L_a and hub only");
        return refuse("a page shows a cone clamped at its base", written(&BUILT, "0"), value, allowed);
    }
    if let Some(all) = &setup.channels {
        let (value, allowed) = (format!("{} channels", all.len()), "\"strain\", \"moment\" or \"force\"");
        let key = written(&["sensor.signal", "sensor.matrix"], "");
        return refuse("a page shows what one signal tells", key, value, allowed);
    }
    if let Some(foil) = setup.gauge.foil {
        let value = format!("{} N/mm", foil.stiffness);
        return refuse("a page shows what the bare skin reads", "gauge.foil", value, "no foil");
    }
    let domain = Domain::new(setup, &layout)?;
    for ratios in RATIOS {
        let Some(chart) = Along::new(setup, &domain, strain, ratios)? else { break };
        let census = Census::take(setup, &domain, &chart)?;
        if chart.ratios.is_empty() && !is_solid(&setup.model) || census.strain <= strain {
            return Ok(Baked { domain, chart, census });
        }
    }
    let value = format!("a = {:?} mm", domain.a);
    let allowed = "narrower ranges: smaller drives, distances farther from the apex of the whisker";
    refuse("the model is not smooth enough over these ranges for one chart", "tap", value, allowed)
}
