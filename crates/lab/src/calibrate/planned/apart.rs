//! Numbers that the taps of a plan cannot separate, and the tap that would.

use nalgebra::{DMatrix, DVector};
use vibrissa_learned::{curve::Spread, plan::Tap};

use crate::estimator::parameter::{spec_values, width};
use crate::estimator::{Exact, Parameter};
use crate::{measure::Rig, scene::Drive};

/// Above this correlation of their errors, two numbers cannot be separated.
const ALIKE: f64 = 0.95;
/// A number is undetermined if its error exceeds this share of its plausible range.
const UNDETERMINED: f64 = 0.3;
const TRIED: [usize; 2] = [25, 12];
/// Place of the offset of the distance among [`parameters`]: the slope by it is that by the distance.
const DISTANCE: usize = 2;

/// A number of the whisker that the taps do not determine: another one has the same effect, or its effect is too small.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// Name of the number.
    pub name: &'static str,
    /// Number with the same effect, if any.
    pub other: Option<&'static str>,
    /// Largest correlation of its error with that of another number.
    pub correlation: f64,
    /// Standard error of the number, and its unit.
    pub error: (f64, &'static str),
    /// Distance (mm) and drive of the best additional tap, and the error after repeating it as often as there are taps.
    pub tap: Option<([f64; 2], f64)>,
}

/// Numbers that a calibration may have to determine.
pub fn parameters(rig: &Rig) -> Vec<Parameter> {
    let values = spec_values(&rig.setup);
    let known = |p: &Parameter| values[*p as usize].is_finite();
    let of_whisker = [Parameter::Mu, Parameter::Clamp, Parameter::Root];
    let of_rig = [Parameter::Factor, Parameter::DriveOffset, Parameter::DistanceOffset];
    of_rig.into_iter().chain(of_whisker.into_iter().filter(known)).chain([Parameter::Zero]).collect()
}

/// Undetermined numbers of a plan whose model fits [`parameters`], highest correlation first; `allowed`(a, drive) limits trial taps.
pub fn apart(
    kind: Drive,
    exact: &Exact,
    taps: &[Tap],
    [distances, drives]: [&[f64]; 2],
    spread: &Spread,
    allowed: &dyn Fn(f64, f64) -> bool,
) -> Vec<Apart> {
    let [noise, relative, position] = [spread.floor, spread.relative, spread.position].map(f64::sqrt);
    let values = exact.values;
    let ends = [drives[0], drives[drives.len() - 1]];
    let middle = exact.expected((distances[0] * distances[distances.len() - 1]).sqrt(), ends[1]);
    let widths: Vec<f64> = exact.fitted.iter().map(|p| width(*p, &values, ends, [middle, 0.0])).collect();
    let row = |a: f64, u: f64| {
        let slopes = exact.gradient(a, u);
        let slope = slopes[DISTANCE] * a * position;
        let signal = exact.expected(a, u);
        let variance = noise.powi(2) + (relative * signal).powi(2) + slope * slope;
        let scaled = slopes.into_iter().zip(&widths).map(|(g, w)| g * w / variance.sqrt());
        DVector::from_vec(scaled.collect())
    };
    let n = exact.fitted.len();
    // A read zero is known; each number has a prior of its plausible width.
    let mut information = DMatrix::identity(n, n);
    let zeros = taps.len().div_ceil(6).max(2) as f64;
    information[(n - 1, n - 1)] += zeros * (widths[n - 1] / noise).powi(2);
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
        // A well-determined number needs no other tap, despite its correlation.
        if share < UNDETERMINED {
            continue;
        }
        let after = |[a, u]: [f64; 2]| {
            let g = row(a, u);
            let more = &information + &g * g.transpose() * taps.len() as f64;
            more.try_inverse().map_or(f64::INFINITY, |c| c[(k, k)].sqrt())
        };
        let best =
            tried(exact, ends, allowed).into_iter().map(|t| (t, after(t))).min_by(|p, q| p.1.total_cmp(&q.1));
        let other = (alike.abs() > ALIKE).then(|| name(exact.fitted[with]));
        let tap = best.filter(|b| b.1 < 0.9 * share).map(|(t, s)| (t, s * widths[k]));
        let (name, error) = (name(exact.fitted[k]), (share * widths[k], exact.fitted[k].unit(kind)));
        found.push(Apart { name, other, correlation: alike, error, tap });
    }
    found.sort_by(|p, q| q.correlation.abs().total_cmp(&p.correlation.abs()));
    found
}

/// Trial taps that the whisker allows, also beyond the ranges of the spec.
fn tried(exact: &Exact, [first, last]: [f64; 2], allowed: &dyn Fn(f64, f64) -> bool) -> Vec<[f64; 2]> {
    let [near, far] = exact.reach();
    let [lo, hi] = [0.5 * first, (1.0 + 0.1) * last];
    let grid = |[lo, hi]: [f64; 2], n: usize| (0..n).map(move |k| lo + (hi - lo) * k as f64 / (n - 1) as f64);
    let all = grid([near, far], TRIED[0]).flat_map(|a| grid([lo, hi], TRIED[1]).map(move |u| [a, u]));
    all.filter(|[a, u]| allowed(*a, *u) && exact.gradient(*a, *u)[DISTANCE].is_finite()).collect()
}
