//! Distance and force of a contact from several channels (model §7), and the standard deviation of the distance.
//! A contact at a with g times the force of linear theory reads y = g v(a), v_j = θ s_j(a)/K̄_j; (a, g) minimise (y − g v)ᵀ C⁻¹ (y − g v),
//! with C the covariance of normal noise. The drive is not needed: with a moment and a force â is their lever.

use std::sync::{Arc, OnceLock};

use crate::estimate::Estimated;
use crate::physics::{driven::Driven, linear::StrainCurve};
use crate::scene::channels::{Channels, PerChannel};
use crate::status::Status;

const GRID: usize = 64;

const NEAREST: f64 = 1.0 / 64.0;

/// The search ends this far past the tip, over L_a; errors of a calibration may place a contact there.
const PAST: f64 = 1.2;

const STEP: f64 = 1e-4;

const ROUNDS: usize = 40;
const STILL: f64 = 1e-12;

/// Another distance fits as well within this excess of the squared misfit, in noise units: one standard deviation.
const ALIKE: f64 = 1.0;

/// Linear theory of a whisker's channels.
#[derive(Debug, Clone)]
pub struct Contact {
    /// Channels of the sensor.
    pub channels: Arc<Channels>,
    /// 1 for a gauge on the contact side, −1 on the far side.
    sign: f64,
    modulus: f64,
    /// Range of the search, mm.
    reach: [f64; 2],
    grid: OnceLock<Vec<PerChannel>>,
}

impl Contact {
    /// `near` and `length`: start of the gauge and length of the whisker, mm; `sign`: that of the strain.
    pub fn new(
        channels: Arc<Channels>,
        curve: &StrainCurve,
        [near, length]: [f64; 2],
        modulus: f64,
        sign: f64,
    ) -> Self {
        let apex = if curve.taper.tau > 0.0 { 0.99 / curve.taper.tau } else { f64::INFINITY };
        let far = if curve.is_plain() { apex.min(PAST * length) } else { PAST * length };
        // A contact before the gauge has no strain, and any distance fits it.
        let near = if channels.read_strain() { near.max(NEAREST * far) } else { NEAREST * far };
        Self { channels, sign, modulus, reach: [near, far], grid: OnceLock::new() }
    }

    /// s(a): readings of the channels per unit of drive.
    pub fn linear(&self, curve: &StrainCurve, a: f64) -> PerChannel {
        let strain = if self.channels.read_strain() { self.sign * curve.value(a) } else { 0.0 };
        self.channels.read(curve.wrench(self.modulus, a), strain)
    }

    fn place(&self, k: usize) -> f64 {
        let [near, far] = self.reach;
        near * (far / near).powf(k as f64 / (GRID - 1) as f64)
    }

    /// Distance and force of `readings` of a tap, `driven`, with the calibration `k`; a second `interesting` distance is ambiguous.
    pub fn estimate(
        &self,
        curve: &StrainCurve,
        k: &PerChannel,
        readings: &PerChannel,
        driven: Driven,
        interesting: impl Fn(f64) -> bool,
    ) -> Estimated {
        let white = |x: &PerChannel| self.channels.white(x, readings);
        let scaled = |s: &PerChannel| white(&std::array::from_fn(|j| driven.size() * s[j] / k[j]));
        let at = |a: f64| scaled(&self.linear(curve, a));
        let y = white(readings);
        // (vᵀy)²/vᵀv: the part of yᵀy that the best force explains; 0 if the force would pull.
        let explained = |v: &PerChannel| {
            let along = dot(v, &y).max(0.0);
            along * along / dot(v, v).max(f64::MIN_POSITIVE)
        };
        let grid = self.grid.get_or_init(|| (0..GRID).map(|k| self.linear(curve, self.place(k))).collect());
        let values: Vec<f64> = grid.iter().map(|s| explained(&scaled(s))).collect();
        let peak = |k: usize| {
            let beside = |m: Option<usize>| m.and_then(|m| values.get(m)).is_none_or(|v| *v <= values[k]);
            beside(k.checked_sub(1)) && beside(Some(k + 1)) && values[k] > 0.0
        };
        let refined = |k: usize| self.refine(&at, &y, k);
        let mut found: Vec<(f64, Fit)> = (0..GRID).filter(|&k| peak(k)).filter_map(refined).collect();
        found.sort_by(|(_, one), (_, other)| one.misfit.total_cmp(&other.misfit));
        let Some((a, fit)) = found.first().copied() else { return Estimated::NO_ROOT };
        let noisy = self.channels.covariance.is_some();
        let apart = |b: f64| (b - a).abs() > 1e-3 * a;
        let twice =
            noisy && found.iter().any(|(b, f)| f.misfit - fit.misfit < ALIKE && apart(*b) && interesting(*b));
        Estimated {
            distance: a,
            sigma: if noisy { fit.sigma } else { 0.0 },
            force: fit.share * driven.size() * curve.force(self.modulus, a),
            status: if twice { Status::AMBIGUOUS } else { Status::OK },
        }
    }

    /// `None` if the best distance near grid place `k` lies at an end of the range.
    fn refine(&self, at: &impl Fn(f64) -> PerChannel, y: &PerChannel, k: usize) -> Option<(f64, Fit)> {
        let [low, high] = [self.place(k.saturating_sub(1)), self.place((k + 1).min(GRID - 1))];
        let mut a = self.place(k);
        for _ in 0..ROUNDS {
            let v = at(a);
            let [above, below] = [at(a * (1.0 + STEP)), at(a * (1.0 - STEP))];
            let slope: PerChannel = std::array::from_fn(|j| (above[j] - below[j]) / (2.0 * STEP * a));
            let (vv, vs, ss) = (dot(&v, &v), dot(&v, &slope), dot(&slope, &slope));
            let share = dot(&v, y) / vv;
            let rest: PerChannel = std::array::from_fn(|j| y[j] - share * v[j]);
            let told = ss - vs * vs / vv;
            let tells = told > 1e-12 * ss && share > 0.0;
            if !tells {
                return None;
            }
            let step = (dot(&slope, &rest) - vs / vv * dot(&v, &rest)) / (share * told);
            let next = (a + step).clamp(low, high);
            let fit = Fit { misfit: dot(&rest, &rest), share, sigma: 1.0 / (share * told.sqrt()) };
            if (next - a).abs() <= STILL * a {
                let inside = a > self.reach[0] * (1.0 + 1e-9) && a < self.reach[1] * (1.0 - 1e-9);
                return inside.then_some((a, fit));
            }
            a = next;
        }
        None
    }
}

#[derive(Clone, Copy)]
struct Fit {
    misfit: f64,
    share: f64,
    sigma: f64,
}

fn dot(x: &PerChannel, y: &PerChannel) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}
