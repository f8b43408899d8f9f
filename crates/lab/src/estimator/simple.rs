//! The simple estimators. `paper`: the closed form f and one K̄ per drive (model §4): f(â) = K̄ |ε|/θ. `curve`: a smooth, monotone fit of distance over
//! signal and drive, from the data alone.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::polynomial::{Form, Point, Polynomial};
use super::{Answers, Found, Known, between, held_out::Side, known, positive, taps::Cell};
use crate::scene::{Drive, Theory};
use crate::{
    measure::Rig,
    physics::{driven::Driven, inverse::Inverse},
    status::Status,
};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct FactorRecord {
    /// RMS error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    pub K: Vec<f64>,
    pub K_variance: Vec<f64>,
    /// Error on distances left out beyond the noise, per drive.
    pub bias_mm: Vec<f64>,
}

impl FactorRecord {
    /// K̄ and the variance of its logarithm per drive, from the `wanted` cells; `None` if a drive has none.
    pub fn of(side: &Side<'_>, wanted: impl Fn(&Cell) -> bool) -> Option<Self> {
        let curve = side.rig.curve(Theory::EulerBernoulli, side.rig.setup.hub);
        let size = |drive: f64| Driven::of_users(side.rig.setup.drive, drive).size();
        let spec = side.rig.shared().theory.curve();
        let mut sums = vec![(0.0, 0.0, 0usize); side.drives.len()];
        for c in side.cells.iter().filter(|c| wanted(c)) {
            // The cell's mean of θ f uses the theory of the spec.
            let linear = if *spec == curve { c.linear } else { size(c.drive) * curve.value(c.a) };
            let sum = &mut sums[c.j];
            sum.0 += linear / c.signal;
            sum.1 += side.noise * side.noise * c.share / (c.signal * c.signal);
            sum.2 += 1;
        }
        let k = sums.iter().map(|s| s.0 / s.2 as f64).collect();
        let variance = sums.iter().map(|s| s.1 / (s.2 * s.2) as f64).collect();
        let record = Self { held_out_rms_mm: None, K: k, K_variance: variance, bias_mm: Vec::new() };
        sums.iter().all(|s| s.2 > 0).then_some(record)
    }

    /// True if there is a valid factor for each of `drives`.
    pub fn is_sound(&self, drives: usize) -> bool {
        [&self.K, &self.K_variance].iter().all(|all| all.len() == drives)
            && positive(&self.K)
            && known(&self.K_variance)
    }
}

#[derive(Debug, Clone)]
pub struct Paper {
    inverse: Inverse,
    kind: Drive,
    drives: Vec<f64>,
    factors: FactorRecord,
}

impl Paper {
    /// f of the whisker of `rig`, with `factors` at `drives`, ascending.
    pub fn new(rig: &Rig, drives: &[f64], factors: FactorRecord) -> Self {
        let inverse = Inverse::new(rig.curve(Theory::EulerBernoulli, rig.setup.hub));
        Self { inverse, kind: rig.setup.drive, drives: drives.to_vec(), factors }
    }

    pub fn without(side: &Side<'_>, gone: &Range<usize>) -> Option<Self> {
        let factors = FactorRecord::of(side, |c| !gone.contains(&c.i))?;
        Some(Self::new(side.rig, side.drives, factors))
    }
}

impl Answers for Paper {
    fn find(&self, drive: f64, reading: f64, _: Known) -> Result<Found, Status> {
        let k = between(&self.drives, &self.factors.K, drive);
        let size = Driven::of_users(self.kind, drive).size();
        let roots = self.inverse.roots(k * reading / size).ok_or(Status::NO_ROOT)?;
        let slope = size * self.inverse.curve().slope(roots.far) / k;
        let variance = reading * reading * between(&self.drives, &self.factors.K_variance, drive);
        // A distance on the near side may belong to one beyond the calibration.
        let near = roots.near.or(roots.unseen.then_some(roots.far));
        Ok(Found::root(roots.far, near, slope, variance))
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        Driven::of_users(self.kind, drive).size() * self.inverse.curve().value(a)
            / between(&self.drives, &self.factors.K, drive)
    }

    fn variance(&self, a: f64, drive: f64, _: bool) -> f64 {
        self.expected(a, drive).powi(2) * between(&self.drives, &self.factors.K_variance, drive)
    }
}

/// Range beyond the positions, in shares of the last step: for answers, and for a position left out, which may be the last.
const BEYOND: [f64; 2] = [0.5, 4.0];
/// Up to this many taps, each counts with its own labels; with more, cells count with their means.
const EACH: usize = 1000;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SmoothRecord {
    /// RMS error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// Error on distances left out beyond the noise, per drive.
    pub bias_mm: Vec<f64>,
    pub fit: Polynomial,
}

/// Form for all positions of `side`; it also serves with positions left out, so that the same form is judged and used.
pub fn form(side: &Side<'_>) -> Option<Form> {
    Polynomial::choose(&points(side, None))
}

/// The curve through all positions of `side`, or without some.
pub fn curve(side: &Side<'_>, form: Form, gone: Option<&Range<usize>>) -> Option<Polynomial> {
    Polynomial::through(&points(side, gone), form, BEYOND[usize::from(gone.is_some())])
}

fn points(side: &Side<'_>, without: Option<&Range<usize>>) -> Vec<Point> {
    let kept = || side.cells.iter().filter(|c| without.is_none_or(|gone| !gone.contains(&c.i)));
    let point = |position, a, drive, signal, n| Point { a, drive, signal, position, n };
    if kept().map(|c| c.taps.len()).sum::<usize>() > EACH {
        return kept().map(|c| point(c.i, c.a, c.drive, c.signal, c.n())).collect();
    }
    let each = |c| move |k: &usize| (c, &side.taps[*k]);
    let taps = kept().flat_map(|c: &Cell| c.taps.iter().map(each(c.i)));
    taps.map(|(i, t)| point(i, t.a, t.drive, t.signal.abs(), 1.0)).collect()
}
