//! Compares a page's answers with solved taps, at whiskers of its domain away from the chart's points.

use super::along::{Along, linear};
use super::domain::Domain;
use super::taps::f64_method;
use crate::census::Taps;
use crate::design::{amount, is_whisker};
use crate::error::SolveError;
use crate::scene::{Setup, Tuple};

const WHISKERS: usize = 600;

#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Census {
    pub taps: usize,
    /// Number of taps outside the chart.
    pub outside: usize,
    /// Largest relative error of the signal: strain, moment or force.
    pub strain: f64,
    /// Largest error of s/(θ f) − 1 relative to it, or to 1e-7 if it is smaller; s is the signal, f the linear limit of the model.
    pub deviation: f64,
}

impl Census {
    pub fn take(setup: &Setup, domain: &Domain, chart: &Along) -> Result<Self, SolveError> {
        let mut census = Self::default();
        for hub in hubs(domain) {
            let own = setup.clone().hub(hub);
            let mut taps = Vec::new();
            for i in 0..WHISKERS / hubs(domain).len() {
                let t = whisker(domain, i, hub);
                if !is_whisker(&t) || t.a > t.L_a {
                    continue;
                }
                match chart.signal(setup, hub, &t, amount(setup.drive, t.drive)) {
                    Some(delta) => taps.push((t, delta)),
                    None => census.outside += 1,
                }
            }
            let tuples: Vec<Tuple> = taps.iter().map(|(t, _)| *t).collect();
            let found = Taps::of(&own, &tuples).answers(f64_method(&own, 1e-10))?;
            for ((t, delta), o) in taps.iter().zip(&found).filter(|(_, o)| o.strain.is_finite()) {
                // K − 1 refers to the estimator's theory; convert it to the linear limit in closed form.
                let theory = o.strain_linear.abs();
                let limit = amount(setup.drive, t.drive) * linear(setup, hub, t);
                let ratio = if theory == limit { 1.0 } else { theory / limit };
                let known = ((ratio - 1.0) - o.deviation) / (1.0 + o.deviation);
                let error = (delta - known).abs();
                census.taps += 1;
                census.strain = census.strain.max(error / (1.0 + known));
                census.deviation = census.deviation.max(error / known.abs().max(1e-7));
            }
        }
        Ok(census)
    }
}

fn hubs(domain: &Domain) -> Vec<f64> {
    let [lo, hi] = domain.hub;
    if hi > lo { [0.0, 0.37, 1.0].map(|x| lo + x * (hi - lo)).to_vec() } else { vec![lo] }
}

/// Whisker `i` of `domain`, by a low-discrepancy sequence (Weyl).
fn whisker(domain: &Domain, i: usize, hub: f64) -> Tuple {
    // Powers of 1/x, x the root of x⁸ = x + 1.
    const ROOT: f64 = 1.096_981_557_798_560_7;
    let at =
        |k: i32, [lo, hi]: [f64; 2]| lo + (hi - lo) * (0.5 + hub + (i + 1) as f64 * ROOT.powi(-k)).fract();
    Tuple {
        D: at(1, domain.D),
        d: at(2, domain.d),
        L_a: at(3, domain.L_a),
        x_ss: at(4, domain.x_ss),
        l: at(5, domain.l),
        a: at(6, domain.a),
        drive: at(7, domain.drive),
        ..Tuple::default()
    }
}
