//! What the taps of a plan cannot tell apart, and which tap would.

use nalgebra::{DMatrix, DVector};
use vibrissa_learned::plan::{Rig as Spread, Tap};

use crate::estimator::model::exact::{Exact, Parameter};
use crate::estimator::model::parameter::width;
use crate::measure::Rig;
use crate::scene::Drive;

/// Two numbers are not told apart where the correlation of their errors is beyond this.
const ALIKE: f64 = 0.95;
/// A number is not determined where its error stays above this share of what it could be off by.
const UNDETERMINED: f64 = 0.3;
/// Taps that are tried beside those of the plan: distances, and drives.
const TRIED: [usize; 2] = [25, 12];

/// A number of the whisker that the taps do not tell, because another one has the same effect or because it has hardly any.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// Its name.
    pub name: &'static str,
    /// The one that has the same effect, where there is one.
    pub other: Option<&'static str>,
    /// Correlation of their errors; of the one with which it is largest.
    pub correlation: f64,
    /// Error of the number, one standard deviation, and its unit.
    pub error: (f64, &'static str),
    /// Distance (mm) and drive of the tap that would tell most, and the error after it is done as often as there are taps now.
    pub tap: Option<([f64; 2], f64)>,
}

/// Numbers of a whisker that a calibration may have to tell.
pub fn parameters(rig: &Rig) -> Vec<Parameter> {
    let values = crate::estimator::model::exact::spec_values(&rig.setup);
    let known = |p: &Parameter| values[*p as usize].is_finite();
    let of_whisker = [Parameter::Mu, Parameter::Clamp, Parameter::Root];
    let of_rig = [Parameter::Factor, Parameter::DriveOffset, Parameter::DistanceOffset];
    of_rig.into_iter().chain(of_whisker.into_iter().filter(known)).chain([Parameter::Zero]).collect()
}

/// Numbers that `taps` at these distances (mm) and drives do not tell, of the model of a whisker with [`parameters`] as those that are fitted; first
/// those whose error goes most with that of another one. `allowed` says whether the rig may tap at a (mm) by a drive.
pub fn apart(
    kind: Drive,
    exact: &Exact,
    taps: &[Tap],
    [distances, drives]: [&[f64]; 2],
    noise: &Spread,
    allowed: &dyn Fn(f64, f64) -> bool,
) -> Vec<Apart> {
    let values = exact.values;
    let ends = [drives[0], drives[drives.len() - 1]];
    let middle = exact.expected((distances[0] * distances[distances.len() - 1]).sqrt(), ends[1]);
    let widths: Vec<f64> = exact.fitted.iter().map(|p| width(*p, &values, ends, [middle, 0.0])).collect();
    let row = |a: f64, u: f64| {
        let slope = exact.slope(a, u) * a * noise.position;
        let signal = exact.expected(a, u);
        let variance = noise.noise.powi(2) + (noise.relative * signal).powi(2) + slope * slope;
        let scaled = exact.gradient(a, u).into_iter().zip(&widths).map(|(g, w)| g * w / variance.sqrt());
        DVector::from_vec(scaled.collect())
    };
    let n = exact.fitted.len();
    // A zero that is read is known; every number is at most as unknown as it could be off.
    let mut information = DMatrix::identity(n, n);
    let zeros = taps.len().div_ceil(6).max(2) as f64;
    information[(n - 1, n - 1)] += zeros * (widths[n - 1] / noise.noise).powi(2);
    for [i, j, _] in taps {
        let g = row(distances[*i], drives[*j]);
        information += &g * g.transpose();
    }
    let Some(covariance) = information.clone().try_inverse() else { return Vec::new() };
    let correlation = |c: &DMatrix<f64>, i: usize, k: usize| c[(i, k)] / (c[(i, i)] * c[(k, k)]).sqrt();
    let name = |p: Parameter| if p == Parameter::Factor { "gain" } else { p.name(kind) };
    let mut found = Vec::new();
    for k in 1..n - 1 {
        let with = (0..n).filter(|i| *i != k).max_by(|i, j| {
            correlation(&covariance, *i, k).abs().total_cmp(&correlation(&covariance, *j, k).abs())
        });
        let Some(with) = with else { continue };
        let alike = correlation(&covariance, with, k);
        let share = covariance[(k, k)].sqrt();
        // What the taps determine well needs no other one, however its error goes with that of another number.
        if share < UNDETERMINED {
            continue;
        }
        let unit = exact.fitted[k].unit(kind);
        let after = |[a, u]: [f64; 2]| {
            let g = row(a, u);
            let more = &information + &g * g.transpose() * taps.len() as f64;
            more.try_inverse().map_or(f64::INFINITY, |c| c[(k, k)].sqrt())
        };
        let best =
            tried(exact, ends, allowed).into_iter().map(|t| (t, after(t))).min_by(|p, q| p.1.total_cmp(&q.1));
        found.push(Apart {
            name: name(exact.fitted[k]),
            other: (alike.abs() > ALIKE).then(|| name(exact.fitted[with])),
            correlation: alike,
            error: (share * widths[k], unit),
            tap: best.filter(|b| b.1 < 0.9 * share).map(|(t, s)| (t, s * widths[k])),
        });
    }
    found.sort_by(|p, q| q.correlation.abs().total_cmp(&p.correlation.abs()));
    found
}

/// Taps that the whisker allows, also beyond the ranges of the spec.
fn tried(exact: &Exact, [first, last]: [f64; 2], allowed: &dyn Fn(f64, f64) -> bool) -> Vec<[f64; 2]> {
    let [near, far] = exact.reach();
    let [lo, hi] = [0.5 * first, (1.0 + 0.1) * last];
    let grid = |[lo, hi]: [f64; 2], n: usize| (0..n).map(move |k| lo + (hi - lo) * k as f64 / (n - 1) as f64);
    let all = grid([near, far], TRIED[0]).flat_map(|a| grid([lo, hi], TRIED[1]).map(move |u| [a, u]));
    all.filter(|[a, u]| allowed(*a, *u) && exact.slope(*a, *u).is_finite()).collect()
}
