//! `explore`: one HTML page with sliders over the ranges of a spec, from one chart of all distances.
//!
//! In units of the contact distance a, a tap has five numbers: drive (θ in rad, or δ/a), r₀/a (or ρ/a), D/a, τa, and the place x/a of the strain. One
//! chart over these has every distance and the strain along the whisker; a gauge's strain is a mean over x. Coulomb friction takes several charts.
//! [`Domain`]: ranges of the sliders; `taps`: solver, and comparison of the chart with solved taps; `along`: chart; [`page`]: the page.

mod along;
pub mod page;
mod taps;

use crate::chart::axis::{AXES, FIRST_PLACE};
use crate::chart::ranges::Wanted;
use crate::error::{Error, InputError};
use crate::physics::{driven::Driven, solid::is_solid};
use crate::plan::Layout;
use crate::scene::{Axis, Contact, Drive, Geometry, Setup, Spec, Theory, Tuple};
use along::Along;
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
    let [from, to] = ALLOWED;
    let e = InputError::new("this is not a tolerance of a page's chart").key("tolerance").value(tolerance);
    let holds = (from..=to).contains(&tolerance);
    if holds { Ok(tolerance) } else { Err(e.allowed(format!("{from:e} to {to:e}"))) }
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
    let (one, other) = (told.word(), asked.word());
    let by = format!("a page tells distances by a formula, here {one}");
    (asked != told).then(|| format!("{by}; the spec says theory = \"{other}\", as sweep and tap tell them"))
}

/// [`bake`] to the tolerance `asked`, else to the least of [`TOLERANCE`] and larger ones that a chart reaches; returns it too.
pub fn bake_asked(spec: &Spec, asked: Option<f64>) -> Result<(Baked, f64), Error> {
    let first = sound(asked.unwrap_or(TOLERANCE))?;
    let mut larger = LOOSER.into_iter().filter(|_| asked.is_none());
    bake(spec, first)
        .map(|baked| (baked, first))
        .or_else(|failed| larger.find_map(|e| Some((bake(spec, e).ok()?, e))).ok_or(failed))
}

/// The chart of the model of `spec` over its domain, with the largest relative strain error `strain`.
/// Errors: a spec without ranges; a model without such a chart, or not smooth over the ranges. The error names key and allowed values.
pub fn bake(spec: &Spec, strain: f64) -> Result<Baked, Error> {
    let setup = &spec.study.setup;
    let error = |message: &str, key: &str, value: &str, allowed: &str| {
        Error::from(InputError::new(message).key(key).value(value).allowed(allowed))
    };
    let refuse = |wrong: bool, message: &str, key: &str, value: &str, allowed: &str| {
        if wrong { Err(error(message, key, value, allowed)) } else { Ok(()) }
    };
    // The first of `keys` that the spec sets to another value than `off`.
    let written = |keys: &[&'static str], off: &str| {
        let is = |key: &str, (k, value, written): &(String, String, bool)| {
            let rest = k.strip_prefix(key).filter(|_| *written && value != off);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        keys.iter().copied().find(|key| spec.in_force.iter().any(|entry| is(key, entry))).unwrap_or(keys[0])
    };
    let (model, pole) = (&setup.model, setup.model.pole_radius);
    let linear = model.geometry == Geometry::Linear;
    refuse(linear, "a page shows the exact rod", "model.geometry", "linear", "exact")?;
    let (sticks, message) =
        (model.contact == Contact::Stick, "what holds a contact that always sticks has no chart");
    refuse(sticks, message, "model.contact", "stick", "frictionless, { coulomb = … }")?;
    let rolls = matches!(model.contact, Contact::Coulomb(f64::MIN_POSITIVE..)) && pole > 0.0;
    let (message, allowed) =
        ("what holds a contact that rolls on a pole has no chart", "0, or a frictionless contact");
    refuse(rolls, message, "model.pole_radius", &pole.to_string(), allowed)?;
    let layout = spec.study.space.layout().ok_or_else(|| {
        let message = "a page needs ranges, not a list of tuples";
        error(message, "tuples", "a file", "[whisker], [gauge] and [tap]")
    })?;
    let (message, key) =
        ("a page bakes one chart, of upright poles", written(&["tap.tilt", "tap.lean"], "0"));
    refuse(!layout.is_upright(), message, key, "not 0", "tilt = 0 and lean = 0")?;
    refuse(setup.gauge.second, "a page shows what one gauge reads", "gauge.second", "true", "false")?;
    let (message, key) = ("a page shows a cone clamped at its base", written(&BUILT, "0"));
    refuse(setup.built.is_some(), message, key, "more than a cone", "a cone: D, d, L_a and hub only")?;
    if let Some(all) = &setup.channels {
        let (value, key) = (all.rows.len(), written(&["sensor.signal", "sensor.matrix"], ""));
        let (value, allowed) = (format!("{value} channels"), "\"strain\", \"moment\" or \"force\"");
        return Err(error("a page shows what one signal tells", key, &value, allowed));
    }
    if let Some(foil) = setup.gauge.foil {
        let value = format!("{} N/mm", foil.stiffness);
        return Err(error("a page shows what the bare skin reads", "gauge.foil", &value, "no foil"));
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
    Err(error("the model is not smooth enough over these ranges for one chart", "tap", &value, allowed))
}

/// Largest x/a of the chart; beyond it the page extrapolates the strain.
const LAST_PLACE: f64 = 0.95;

/// Largest τa: the solution is not smooth next to the virtual apex.
const LAST_TAPER: f64 = 0.92;

/// Ranges, lengths in mm, and the start of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    pub whiskers: Wanted,
    /// r₀; a single value with a displacement drive, which it does not affect, and with a pole radius.
    pub hub: [f64; 2],
    pub pole: f64,
    pub a: [f64; 2],
    /// The first design of the spec, at a middle drive.
    pub start: Tuple,
    pub reach: [f64; 2],
    pub distances: u64,
}

/// [lo, hi], or a range of these factors around a single number.
fn around([lo, hi]: [f64; 2], factors: [f64; 2]) -> [f64; 2] {
    if hi > lo { [lo, hi] } else { factors.map(|f| lo * f) }
}

impl Domain {
    /// Domain of the designs of `layout`. Errors: a pole radius together with a hub: the chart has one axis for both.
    #[allow(non_snake_case)]
    pub fn new(setup: &Setup, layout: &Layout) -> Result<Self, InputError> {
        let pole = setup.model.pole_radius;
        let angle = setup.drive == Drive::Angle;
        if pole > 0.0 && setup.hub > 0.0 && angle {
            let error = InputError::new("a page holds a hub or an object with a radius, not both");
            let error = error.key("model.pole_radius").value(pole);
            return Err(error.allowed("0, or hub = 0 in [whisker]"));
        }
        let (asked, reach) = (Wanted::of(layout), layout.reach());
        let mut drive = around(asked.drive, [0.5, 2.0]);
        if angle {
            drive[1] = drive[1].min(60.0).max(asked.drive[1]);
        }
        let (largest, distances) = (asked.D[1], layout.n_distances);
        let [D, d, L_a] = [asked.D, asked.d, asked.L_a].map(|ends| around(ends, [0.8, 1.2]));
        let [mut x_ss, l] = [asked.x_ss, asked.l].map(|ends| around(ends, [0.5, 2.0]));
        if asked.x_ss[1] == 0.0 {
            x_ss = [0.0, 0.5 * largest];
        }
        let whiskers = Wanted { D, d, L_a, x_ss, l, drive };
        let hub = match setup.hub {
            _ if !angle || pole > 0.0 => [0.0; 2],
            0.0 => [0.0, largest],
            hub => [0.0, 2.0 * hub],
        };
        let start = Tuple { drive: middle(layout, asked.drive), ..layout.design(0) };
        Ok(Self { whiskers, hub, pole, a: around(reach, [0.7, 1.4]), start, reach, distances })
    }

    /// The box of the chart: drive, (r₀ or ρ)/a, D/a, τa, x/a.
    pub fn scaled(&self, kind: Drive) -> [[f64; 2]; AXES] {
        let [near, far] = self.a;
        let over_a = |[lo, hi]: [f64; 2]| [lo / far, hi / near];
        let Wanted { D: base, d: tip, L_a: length, drive, .. } = self.whiskers;
        let drive = drive.map(|drive| Driven::of_users(kind, drive).size());
        let reach = [near / length[1], (far / length[0]).min(1.0)];
        let lost = [1.0 - tip[1] / base[0], 1.0 - tip[0] / base[1]];
        let least = lost[0] * if lost[0] < 0.0 { reach[1] } else { reach[0] };
        let most = lost[1] * if lost[1] < 0.0 { reach[0] } else { reach[1] };
        [
            if kind == Drive::Angle { drive } else { over_a(drive) },
            if self.pole > 0.0 { over_a([self.pole; 2]) } else { over_a(self.hub) },
            over_a(base),
            [least.max(-1.0), most.min(LAST_TAPER)],
            [FIRST_PLACE, LAST_PLACE],
        ]
    }
}

fn middle(layout: &Layout, [lo, hi]: [f64; 2]) -> f64 {
    let half = 0.5 * (lo + hi);
    let off = |x: &f64| (x - half).abs();
    let nearest = |axis: &Axis| axis.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(half);
    layout.drives().filter(|axis| axis.len() < 10_000).map_or(half, nearest)
}
