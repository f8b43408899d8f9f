//! `explore`: one HTML page with sliders over the ranges of a spec, from one chart of all distances.
//!
//! In units of the contact distance a, a tap has five numbers: drive (θ in rad, or δ/a), r₀/a (or ρ/a), D/a, τa, and the place x/a of the strain. One
//! chart over these has every distance and the strain along the whisker; a gauge's strain is a mean over x. Coulomb friction takes several charts.
//! `domain`: ranges; `taps`: solver, and comparison of the chart with solved taps; `along`: chart; [`page`]: the page.

mod along;
mod domain;
pub mod page;
mod taps;

use crate::error::{Error, InputError};
use crate::physics::solid::is_solid;
use crate::scene::{Contact, Geometry, Setup, Spec, Theory};
use along::Along;
use domain::Domain;
use taps::Census;

/// Numbers of ratios T/P between −μ and μ that are tried with friction.
const RATIOS: [usize; 2] = [3, 5];

/// Default of the largest relative strain error, that of single precision.
pub const TOLERANCE: f64 = 1e-5;

/// Larger defaults, tried in turn if the model is not smooth enough.
const LOOSER: [f64; 3] = [3e-5, 1e-4, 1e-3];

/// Range of tolerances that a chart of some thousand terms can reach.
const ALLOWED: [f64; 2] = [1e-7, 1e-3];

/// `tolerance`, or an error if it is out of range.
pub fn sound(tolerance: f64) -> Result<f64, InputError> {
    if (ALLOWED[0]..=ALLOWED[1]).contains(&tolerance) {
        return Ok(tolerance);
    }
    let e = InputError::new("this is not a tolerance of a page's chart").key("tolerance").value(tolerance);
    Err(e.allowed(format!("{:e} to {:e}", ALLOWED[0], ALLOWED[1])))
}

/// Keys of whiskers other than cones.
const BUILT: [&str; 7] = [
    "whisker.profile",
    "whisker.exponent",
    "whisker.bore",
    "whisker.core",
    "whisker.curvature",
    "whisker.curvature_slope",
    "whisker.root",
];

/// Chart and sliders of a page.
#[derive(Debug, Clone)]
pub struct Baked {
    /// Ranges and starting point of its sliders.
    pub domain: Domain,
    /// The chart.
    pub chart: Along,
    /// Errors of the chart at whiskers of the domain.
    pub census: Census,
}

/// Theory of the distances on a page of `setup`; Euler–Bernoulli for `exact`, since a page does not invert the model.
pub fn theory(setup: &Setup) -> Theory {
    match setup.estimate.theory {
        Theory::Exact => Theory::EulerBernoulli,
        formula => formula,
    }
}

/// A remark for the user about a page of `setup`.
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

/// [`bake`] to the tolerance `asked`, else to the least of [`TOLERANCE`] and larger ones that a chart reaches; returns it too.
pub fn bake_asked(spec: &Spec, asked: Option<f64>) -> Result<(Baked, f64), Error> {
    let first = sound(asked.unwrap_or(TOLERANCE))?;
    let failed = match bake(spec, first) {
        Ok(baked) => return Ok((baked, first)),
        Err(failed) => failed,
    };
    let larger = LOOSER.into_iter().filter(|_| asked.is_none());
    larger.into_iter().find_map(|e| Some((bake(spec, e).ok()?, e))).ok_or(failed)
}

/// The chart of the model of `spec` over its domain, with the largest relative strain error `strain`.
///
/// # Errors
/// A spec without ranges; a model without such a chart, or not smooth over the ranges. The error names key and allowed values.
pub fn bake(spec: &Spec, strain: f64) -> Result<Baked, Error> {
    let setup = &spec.study.setup;
    let refuse = |message: &str, key: &str, value: String, allowed: &str| {
        Err(Error::from(InputError::new(message).key(key).value(value).allowed(allowed)))
    };
    // The first of `keys` that the spec sets to another value than `off`.
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
        let (value, allowed) =
            (format!("{} channels", all.rows.len()), "\"strain\", \"moment\" or \"force\"");
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
