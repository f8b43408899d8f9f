//! Taps of one object, as sums over ln a.

use std::collections::BTreeSet;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::{FREE, JUDGED, Joint, NEAR, NONE, SECOND, Tap, Told, WINDOW};
use crate::invert::{FINE, POINTS, lagrange, quantiles};
use crate::{curve::Weighted, evidence::ln_det};

/// Taps of one object so far.
#[derive(Debug, Clone)]
pub struct Object<'a> {
    joint: &'a Joint,
    /// True for taps of a run of the calibration.
    same_run: bool,
    /// The last taps, which [`Self::apart`] compares.
    pub taps: Vec<Tap>,
    /// Number of taps.
    pub count: usize,
    /// Zero whose error is the last shared number.
    zero: Option<u64>,
    of_zero: f64,
    /// Shift of the base at the first tap, mm ([`Tap::shift`]); the grid is in distances from there.
    pub frame: f64,
    shifts: [f64; 2],
    points: Vec<(DMatrix<f64>, DVector<f64>, f64)>,
}

impl<'a> Object<'a> {
    /// Object before its first tap; `same_run` if its taps are of a run of the calibration.
    pub fn new(joint: &'a Joint, same_run: bool) -> Self {
        let n = joint.of_run.len() + 1;
        let points = vec![(DMatrix::identity(n, n), DVector::zeros(n), 0.0); POINTS];
        let (taps, count, zero, of_zero, frame, shifts) = (Vec::new(), 0, None, 0.0, 0.0, [0.0; 2]);
        Self { joint, same_run, taps, count, zero, of_zero, frame, shifts, points }
    }

    /// Adds `tap`.
    pub fn add(&mut self, mut tap: Tap) {
        if self.count == 0 {
            self.frame = tap.shift;
        }
        tap.shift -= self.frame;
        self.shifts = [self.shifts[0].min(tap.shift), self.shifts[1].max(tap.shift)];
        self.weigh(tap, 1.0);
        (self.count, self.of_zero) = (self.count + 1, tap.of_zero);
        if self.taps.len() == JUDGED {
            self.taps.remove(0);
        }
        self.taps.push(tap);
    }

    /// Least and largest distance from the base over the taps, for the reported distance `a`, mm.
    pub fn seen(&self, a: f64) -> [f64; 2] {
        [self.shifts[1], self.shifts[0]].map(|shift| a - self.frame - shift)
    }

    fn weigh(&mut self, tap: Tap, times: f64) {
        if self.zero.replace(tap.zero).is_some_and(|zero| zero != tap.zero) {
            // Integrates the error of the last zero out, so that this one can use its number.
            self.points.iter_mut().for_each(|(a, b, c)| *c += integrate(a, b, b.len() - 1));
        }
        let slice = self.joint.shifted(tap.u, tap.shift, self.same_run, 0..POINTS);
        let width = self.joint.width();
        let mut shared = DVector::zeros(width - 1);
        for (point, (a, b, c)) in slice.chunks(width).zip(&mut self.points) {
            let (r, d) = (tap.y - point[0], point[1]);
            shared.rows_mut(0, width - 2).copy_from_slice(&point[2..]);
            shared[width - 2] = tap.of_zero.sqrt();
            a.ger(times / d, &shared, &shared, 1.0);
            b.axpy(times * r / d, &shared, 1.0);
            // The mean of this number of taps.
            *c += times * r * r / d + d.ln();
        }
    }

    /// By how much the shared numbers, as the taps tell them at point `k`, move a tap that has these; it stands above the last zero.
    fn moved(&self, k: usize, shared: &[f64]) -> f64 {
        let (a, b, _) = &self.points[k];
        let solved = a.clone().cholesky().map_or(DVector::zeros(b.len()), |factor| factor.solve(b));
        let of_zero = self.of_zero.sqrt();
        solved.iter().zip(shared.iter().chain([&of_zero])).map(|(s, x)| s * x).sum()
    }

    fn heights(&self) -> Vec<f64> {
        let joint = self.joint;
        let height = |(k, (a, b, c)): (usize, &(DMatrix<f64>, DVector<f64>, f64))| {
            let Some(factor) = a.clone().cholesky() else { return f64::NEG_INFINITY };
            joint.prior(joint.x(k), self.shifts) - 0.5 * (c - b.dot(&factor.solve(b)) + ln_det(&factor))
        };
        self.points.iter().enumerate().map(height).collect()
    }

    /// Distance from all taps; `None` if no distance is likely, or the most likely one is at an end of the range.
    pub fn told(&self) -> Option<Told> {
        let (joint, heights) = (self.joint, self.heights());
        let modes = modes(joint, &heights);
        let mode = modes.iter().find(|mode| mode.share >= SECOND)?;
        // At an end of the search range beyond the calibrated distances the maximum lies farther out.
        let ([_, step], [first, last, _], x) = (joint.inverse.grid, joint.inverse.ends, mode.at);
        let [near, far] = [x - joint.x(0), joint.x(POINTS - 1) - x];
        if near < 0.5 * step && x < first - step || far < 0.5 * step && x > last + step {
            return None;
        }
        let others = modes.iter().filter(|other| other.at != mode.at && other.share >= SECOND);
        let near = others.max_by(|a, b| a.share.total_cmp(&b.share)).map(|other| other.at.exp() + self.frame);
        let between = |other: &Mode| 0.5 * (other.at + mode.at);
        let lower = modes.iter().filter(|m| m.at < mode.at).map(between).fold(joint.x(0), f64::max);
        let upper = modes.iter().filter(|m| m.at > mode.at).map(between).fold(joint.x(POINTS - 1), f64::min);
        let [from, to] = [(mode.at - WINDOW * mode.sd).max(lower), (mode.at + WINDOW * mode.sd).min(upper)];
        let step = (to - from) / (FINE - 1) as f64;
        let fine: [f64; FINE] = std::array::from_fn(|k| at(joint, &heights, from + step * k as f64));
        let top = fine.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let density = fine.map(|x| (x - top).exp());
        let [least, lo, a, hi, most] = quantiles(&density, from, step).map(f64::exp);
        let [a, least, most] = [a, least, most].map(|a| a + self.frame);
        let told = Told { a, sigma: 0.5 * (hi - lo), ends: [least, most], near };
        (told.a.is_finite() && told.sigma > 0.0).then_some(told)
    }

    /// The last taps linearised at `a` (mm), distance and repeated zeros as shared numbers: (residual, variance, shared numbers), A's factor, b.
    #[allow(clippy::type_complexity)]
    fn linear(&self, a: f64) -> Option<(Vec<(f64, f64, DVector<f64>)>, Cholesky<f64, Dyn>, DVector<f64>)> {
        let x = (a - self.frame).ln();
        // A zero of several taps is one shared number; that of a single tap is noise.
        let many = |zero: u64| self.taps.iter().filter(|tap| tap.zero == zero).count() > 1;
        let zeros: BTreeSet<u64> = self.taps.iter().map(|tap| tap.zero).filter(|zero| many(*zero)).collect();
        let n = self.joint.of_run.len() + 1 + zeros.len();
        let of_tap = |tap: &Tap| {
            let (r, d, mut shared) = self.joint.local(tap, x, self.same_run);
            let own = zeros.iter().position(|zero| *zero == tap.zero);
            shared.extend((0..zeros.len()).map(|k| if own == Some(k) { tap.of_zero.sqrt() } else { 0.0 }));
            (r, if own.is_some() { d } else { d + tap.of_zero }, DVector::from_vec(shared))
        };
        let local: Vec<(f64, f64, DVector<f64>)> = self.taps.iter().map(of_tap).collect();
        let (mut a, mut b) = (DMatrix::identity(n, n), DVector::zeros(n));
        for (r, d, shared) in &local {
            a.ger(1.0 / d, shared, shared, 1.0);
            b.axpy(r / d, shared, 1.0);
        }
        Some((local, a.cholesky()?, b))
    }

    /// The last taps with their weights in the estimate of ln a at the distance `a`, mm.
    pub fn weights(&self, a: f64) -> Option<Vec<Weighted>> {
        let (local, factor, b) = self.linear(a)?;
        let distance = self.joint.of_run.len();
        let row = factor.solve(&DVector::from_fn(b.len(), |k, _| if k == distance { FREE } else { 0.0 }));
        let of = |((r, d, shared), tap): (&(f64, f64, DVector<f64>), &Tap)| {
            [row.dot(shared) / d, tap.y - r, shared[distance] / FREE, 0.0]
        };
        Some(local.iter().zip(&self.taps).map(of).collect())
    }

    /// Outlier among the last taps for a free distance near `a` (mm): taps since it, and deviation in standard deviations. `None` for one tap.
    pub fn apart(&self, a: f64) -> Option<(usize, f64)> {
        if self.taps.len() < 2 {
            return None;
        }
        let (local, factor, b) = self.linear(a)?;
        let solved = factor.solve(&b);
        let off = |(r, d, shared): &(f64, f64, DVector<f64>)| {
            let known = 1.0 - shared.dot(&factor.solve(shared)) / d;
            (r - shared.dot(&solved)) / (d * known.max(1e-12)).sqrt()
        };
        let offs = local.iter().map(off).enumerate();
        let (k, most) = offs.max_by(|(_, p), (_, q)| p.abs().total_cmp(&q.abs()))?;
        Some((self.taps.len() - 1 - k, most))
    }
}

/// Integrates number `k` out of A and b and resets it to its prior; returns the addition to c.
pub fn integrate(a: &mut DMatrix<f64>, b: &mut DVector<f64>, k: usize) -> f64 {
    let (own, of) = (a[(k, k)], b[k]);
    let column = a.column(k).into_owned();
    a.ger(-1.0 / own, &column, &column, 1.0);
    b.axpy(-of / own, &column, 1.0);
    a.row_mut(k).fill(0.0);
    a.column_mut(k).fill(0.0);
    (a[(k, k)], b[k]) = (1.0, 0.0);
    own.ln() - of * of / own
}

fn spread_of(joint: &Joint, heights: &[f64]) -> f64 {
    let highest = (0..POINTS).max_by(|i, k| heights[*i].total_cmp(&heights[*k])).unwrap_or(0);
    let wide = top_of(joint, heights, highest).1 >= NARROW * joint.inverse.grid[1];
    let modes = if wide { Vec::new() } else { modes(joint, heights) };
    if !wide && modes.iter().all(|mode| mode.sd < NARROW * joint.inverse.grid[1]) {
        let mean = modes.iter().map(|m| m.share * m.at.exp()).sum::<f64>();
        let square = |m: &Mode| m.share * ((m.sd * m.at.exp()).powi(2) + (m.at.exp() - mean).powi(2));
        return modes.iter().map(square).sum::<f64>().sqrt();
    }
    let top = heights[highest];
    let heard = heights.iter().map(|h| density(*h, top)).enumerate().filter(|(_, p)| *p > 0.0);
    deviation(&heard.map(|(k, p)| (joint.x(k).exp(), p)).collect::<Vec<_>>())
}

/// Standard deviation of weighted values.
fn deviation(all: &[(f64, f64)]) -> f64 {
    let mass: f64 = all.iter().map(|p| p.1).sum();
    let mean = all.iter().map(|p| p.0 * p.1).sum::<f64>() / mass;
    (all.iter().map(|p| (p.0 - mean).powi(2) * p.1).sum::<f64>() / mass).sqrt()
}

/// Nodes in ln a that represent a posterior, with their shares.
fn likely(joint: &Joint, heights: &[f64]) -> Vec<(f64, f64)> {
    let modes = modes(joint, heights);
    let narrow = |mode: &&Mode| mode.sd < NARROW * joint.inverse.grid[1];
    if modes.iter().all(|mode| narrow(&mode)) {
        let each = |mode: &Mode| NODES.map(|(off, share)| (mode.at + off * mode.sd, mode.share * share));
        return modes.iter().filter(|mode| mode.share >= 0.5 * SECOND).flat_map(each).collect();
    }
    let top = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let masses: Vec<f64> = heights.iter().map(|h| (h - top).exp()).collect();
    let total: f64 = masses.iter().sum();
    let (mut below, mut next, mut all) = (0.0, 0, Vec::new());
    for (k, mass) in masses.iter().enumerate() {
        below += mass / total;
        while next < PLACES && below >= (next as f64 + 0.5) / PLACES as f64 {
            all.push((joint.x(k), 1.0 / PLACES as f64));
            next += 1;
        }
    }
    all
}

const PLACES: usize = 9;

/// Gauss-Hermite nodes and weights for a standard normal number.
const NODES: [(f64, f64); 3] =
    [(-1.732_050_807_568_877_2, 1.0 / 6.0), (0.0, 2.0 / 3.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];

const NOTHING: f64 = 60.0;

/// Modes with fewer steps per standard deviation are described by a parabola, wider ones by all their points.
const NARROW: f64 = 2.0;

fn at(joint: &Joint, heights: &[f64], x: f64) -> f64 {
    let (k, t) = joint.place(x);
    lagrange::<NEAR>(t).iter().zip(&heights[k..]).map(|(w, h)| w * h).sum()
}

fn top_of(joint: &Joint, heights: &[f64], k: usize) -> (f64, f64, f64) {
    let step = joint.inverse.grid[1];
    // A parabola is exact for a linear signal, however narrow the mode.
    let m = k.clamp(1, POINTS - 2);
    let [p, q, r] = [m - 1, m, m + 1].map(|i| heights[i]);
    let (slope, bend) = (0.5 * (r - p), 2.0 * q - p - r);
    let t = if bend > 0.0 { (slope / bend).clamp(-1.0, 1.0) } else { k as f64 - m as f64 };
    let sd = if bend > 0.0 { step / bend.sqrt() } else { f64::INFINITY };
    (joint.x(m) + t * step, sd, q + slope * t - 0.5 * bend * t * t)
}

/// Mode of a posterior over ln a: its maximum, its standard deviation, and its share of the mass.
struct Mode {
    at: f64,
    sd: f64,
    share: f64,
}

fn modes(joint: &Joint, heights: &[f64]) -> Vec<Mode> {
    let step = joint.inverse.grid[1];
    let last = POINTS - 1;
    let higher =
        |k: usize, other: usize| heights[k] > heights[other] || heights[k] == heights[other] && k < other;
    let tops = (0..POINTS).filter(|&k| (k == 0 || higher(k, k - 1)) && (k == last || higher(k, k + 1)));
    let found: Vec<(f64, f64, f64)> =
        tops.map(|k| top_of(joint, heights, k)).filter(|m| m.2.is_finite()).collect();
    let top = found.iter().map(|m| m.2).fold(f64::NEG_INFINITY, f64::max);
    let mut all = Vec::new();
    for (i, &(x, sd, height)) in found.iter().enumerate() {
        let lower = if i > 0 { 0.5 * (x + found[i - 1].0) } else { joint.x(0) };
        let upper = found.get(i + 1).map_or(joint.x(last), |next| 0.5 * (x + next.0));
        let (sd, share) = if sd < NARROW * step {
            (sd, (height - top).exp() * sd * (2.0 * std::f64::consts::PI).sqrt())
        } else {
            let own = (0..POINTS).map(|k| (joint.x(k), density(heights[k], top)));
            let own: Vec<_> = own.filter(|(x, _)| (lower..=upper).contains(x)).collect();
            let sd = Some(deviation(&own)).filter(|sd| *sd > 0.0);
            (sd.unwrap_or(step), own.iter().map(|p| p.1).sum::<f64>() * step)
        };
        all.push(Mode { at: x, sd, share });
    }
    let total: f64 = all.iter().map(|mode| mode.share).sum();
    all.iter_mut().for_each(|mode| mode.share /= total);
    all.retain(|mode| mode.share > NONE);
    all.reverse();
    all
}

fn density(height: f64, top: f64) -> f64 {
    if height > top - NOTHING { (height - top).exp() } else { 0.0 }
}

/// State of an object before one more tap, and what that would bring: what is known after it, if it gives the signal that is most likely where the object
/// may be. n more taps at one drive count as their mean; the information in their scatter is neglected.
pub struct Outlook<'a> {
    object: &'a Object<'a>,
    /// RMS deviation from the mean of the present posterior, mm.
    pub spread: f64,
    /// Nodes in ln a that represent the posterior, from the base of the first tap, with their shares.
    pub likely: Vec<(f64, f64)>,
}

impl<'a> Outlook<'a> {
    /// State after the taps of `object`; the next taps are of the same run or of none.
    pub fn new(object: &'a Object<'a>) -> Self {
        let heights = object.heights();
        let (spread, likely) = (spread_of(object.joint, &heights), likely(object.joint, &heights));
        Self { object, spread, likely }
    }

    /// Expected [`Self::spread`] after `times` more taps at drive `u`, with the base shifted by `shift` mm from the first tap.
    pub fn after(&self, u: f64, shift: f64, times: f64) -> f64 {
        let joint = self.object.joint;
        let (mut sum, mut total) = (0.0, 0.0);
        for (x, share) in &self.likely {
            let y = joint.signal(u, joint.seen(*x, shift)) + self.beside(*x, u, shift);
            let mut then = self.object.clone();
            // Above the last zero.
            let zero = then.zero.unwrap_or_default();
            then.weigh(Tap { u, y, of_zero: then.of_zero, zero, shift }, times);
            sum += share * spread_of(joint, &then.heights());
            total += share;
        }
        sum / total
    }

    /// By how much the shared numbers, as the taps so far tell them, move the next tap if the object is at ln a = x.
    fn beside(&self, x: f64, u: f64, shift: f64) -> f64 {
        let joint = self.object.joint;
        let (first, t) = joint.place(x);
        let slice = joint.shifted(u, shift, self.object.same_run, first..first + NEAR);
        let points = slice.chunks(joint.width()).zip(first..);
        let moved = points.map(|(point, k)| self.object.moved(k, &point[2..]));
        lagrange::<NEAR>(t).iter().zip(moved).map(|(w, e)| w * e).sum()
    }
}
