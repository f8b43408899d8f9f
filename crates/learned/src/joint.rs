//! Several taps of one object: one posterior of its distance.
//!
//! What one calibration and one run move, they move in all taps of an object. With these shared numbers s ~ N(0, 1) a signal at the distance a is
//! y_i = m_i(a) + l_i(a)·s + e_i, e_i ~ N(0, d_i), so that at each of the points in ln a all taps together are told by A = 1 + Σ l lᵀ/d,
//! b = Σ l (y − m)/d and c = Σ (y − m)²/d + ln d:
//!
//! −2 ln p(y | a) = c − bᵀ A⁻¹ b + ln det A.
//!
//! A, b and c are sums, so that a tap more costs the same after a thousand as after one. The product of single posteriors would count what is shared
//! once for each tap, and be too sure.

use nalgebra::{DMatrix, DVector};

use crate::base::Base;
use crate::curve::{Curve, OF_RUN};
use crate::invert::{FINE, Inverse, POINTS, QUANTILES, prior, quantile};

/// Shared numbers that move no signal by more than this share of its variance count as noise.
const SMALL: f64 = 1e-4;
/// Standard deviations on either side of a mode that are looked at.
const WINDOW: f64 = 6.0;
/// Points of the polynomial between points.
const NEAR: usize = 6;
/// Taps at most among which one that contradicts the others is looked for.
const JUDGED: usize = 256;
/// Standard deviation in ln a that is as good as none: the distance is free where taps are compared.
const FREE: f64 = 10.0;
/// Mass below which a mode is none.
const NONE: f64 = 1e-9;
/// Mass below which another mode is no answer.
pub const SECOND: f64 = 0.05;

/// Signals of taps and what moves them, over ln a, at some drives.
#[derive(Debug, Clone)]
pub struct Joint {
    inverse: Inverse,
    /// Of each node and point: signal/u, variance of noise/u², shared numbers/u.
    table: Vec<Vec<f64>>,
    /// Which of the shared numbers are those of a new run.
    of_run: Vec<bool>,
}

/// One tap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tap {
    /// The drive.
    pub u: f64,
    /// The signal.
    pub y: f64,
    /// Variance that its own zero brings.
    pub of_zero: f64,
    /// Which zero that is: taps above the same one share its error.
    pub zero: u64,
}

/// A distance that is likely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// ln a at its highest.
    pub at: f64,
    /// Standard deviation in ln a there.
    pub sd: f64,
    /// Its share of the posterior.
    pub share: f64,
}

/// What the taps of an object tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// The distance, mm: the median of the mode that is answered.
    pub a: f64,
    /// Half of its 68 % interval, mm.
    pub sigma: f64,
    /// Another distance that fits, mm.
    pub near: Option<f64>,
}

/// The taps of one object so far.
#[derive(Debug, Clone)]
pub struct Object {
    taps: Vec<Tap>,
    count: usize,
    /// The zero whose error is the last shared number.
    zero: Option<u64>,
    /// A, b and c at each point.
    points: Vec<(DMatrix<f64>, DVector<f64>, f64)>,
}

impl Joint {
    /// Of `curve` over its base, at the points of `inverse`, which is of the same.
    pub fn new(curve: &Curve, base: &Base<'_>, tared: bool, inverse: &Inverse) -> Self {
        let [from, step] = inverse.grid;
        let width = 2 + curve.shared();
        let mut table: Vec<Vec<f64>> = Vec::new();
        for u in inverse.nodes.iter().map(|u| u.exp()) {
            let mut all = Vec::with_capacity(POINTS * width);
            for k in 0..POINTS {
                let mut shared = Vec::with_capacity(width);
                let a = (from + step * k as f64).exp();
                let [signal, noise] = curve.moved(base, (a, u - inverse.offset), tared, &mut shared);
                all.extend([signal / u, noise / (u * u)]);
                all.extend(shared.iter().map(|x| x / u));
            }
            table.push(all);
        }
        let n = curve.shared();
        let mut joint =
            Self { inverse: inverse.clone(), table, of_run: (0..n).map(|k| k + OF_RUN >= n).collect() };
        joint.continued();
        joint.prune();
        joint
    }

    fn width(&self) -> usize {
        2 + self.of_run.len()
    }

    /// Where the base has no value at a node, the signal is that which [`Inverse`] continues to, and what moves it that of the nearest node.
    fn continued(&mut self) {
        let width = self.width();
        for k in 0..POINTS {
            let at = k * width..(k + 1) * width;
            let whole = |row: &Vec<f64>| row[at.clone()].iter().all(|x| x.is_finite());
            let known: Vec<usize> = (0..self.table.len()).filter(|j| whole(&self.table[*j])).collect();
            for j in (0..self.table.len()).filter(|j| !known.contains(j)) {
                let nearest = known.iter().min_by_key(|i| i.abs_diff(j));
                let mut values = match nearest {
                    Some(i) => self.table[*i][at.clone()].to_vec(),
                    None => vec![0.0; width],
                };
                values[0] = self.inverse.table[j][k][0];
                self.table[j][at.clone()].copy_from_slice(&values);
            }
        }
    }

    /// Counts shared numbers that move little as noise.
    fn prune(&mut self) {
        let (width, n) = (self.width(), self.of_run.len());
        let mut largest = vec![0.0_f64; n];
        for point in self.table.iter().flat_map(|row| row.chunks(width)) {
            let all = point[1] + point[2..].iter().map(|x| x * x).sum::<f64>();
            for (most, x) in largest.iter_mut().zip(&point[2..]) {
                *most = most.max(if all > 0.0 { x * x / all } else { 0.0 });
            }
        }
        let kept: Vec<usize> = (0..n).filter(|k| largest[*k] > SMALL).collect();
        for row in &mut self.table {
            let fewer = row.chunks(width).flat_map(|point| {
                let gone = (0..n).filter(|k| !kept.contains(k)).map(|k| point[2 + k].powi(2)).sum::<f64>();
                let own = kept.iter().map(|k| point[2 + k]);
                [point[0], point[1] + gone].into_iter().chain(own).collect::<Vec<f64>>()
            });
            *row = fewer.collect();
        }
        self.of_run = kept.iter().map(|k| self.of_run[*k]).collect();
    }

    /// Signal, variance of its noise, and shared numbers of the tap `u` at the points `from` and those after it; of a known run where `same_run`.
    fn slice(&self, u: f64, same_run: bool, points: std::ops::Range<usize>) -> Vec<f64> {
        let u = u + self.inverse.offset;
        let (width, weights) = (self.width(), self.inverse.weights(u));
        let mut all = vec![0.0; points.len() * width];
        for (w, row) in weights.iter().zip(&self.table) {
            let row = &row[points.start * width..points.end * width];
            all.iter_mut().zip(row).for_each(|(sum, x)| *sum += w * x);
        }
        for point in all.chunks_mut(width) {
            point[0] *= u;
            point[1] = (point[1] * u * u).max(f64::MIN_POSITIVE);
            for (x, of_run) in point[2..].iter_mut().zip(&self.of_run) {
                *x *= if *of_run && same_run { 0.0 } else { u };
            }
        }
        all
    }

    fn x(&self, k: usize) -> f64 {
        self.inverse.grid[0] + self.inverse.grid[1] * k as f64
    }

    /// ln of the prior at ln a = x, flat in mm.
    fn prior(&self, x: f64) -> f64 {
        prior(self.inverse.ends, x).ln() + x
    }
}

impl Object {
    /// Of no tap.
    pub fn new(joint: &Joint) -> Self {
        let n = joint.of_run.len() + 1;
        let point = (DMatrix::identity(n, n), DVector::zeros(n), 0.0);
        Self { taps: Vec::new(), count: 0, zero: None, points: vec![point; POINTS] }
    }

    /// Taps so far.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Adds `tap`; of a known run where `same_run`.
    pub fn add(&mut self, joint: &Joint, tap: Tap, same_run: bool) {
        self.weigh(joint, tap, same_run, 1.0);
        self.count += 1;
        if self.taps.len() == JUDGED {
            self.taps.remove(0);
        }
        self.taps.push(tap);
    }

    /// Ends what is shared by taps above one zero: its error is integrated over, and the number is free for that of another one.
    fn let_zero_go(&mut self) {
        for (a, b, c) in &mut self.points {
            let last = b.len() - 1;
            let (own, of) = (a[(last, last)], b[last]);
            let column = a.column(last).into_owned();
            a.ger(-1.0 / own, &column, &column, 1.0);
            b.axpy(-of / own, &column, 1.0);
            *c += own.ln() - of * of / own;
            a.row_mut(last).fill(0.0);
            a.column_mut(last).fill(0.0);
            (a[(last, last)], b[last]) = (1.0, 0.0);
        }
    }

    /// Adds `times` taps like `tap` to the sums.
    fn weigh(&mut self, joint: &Joint, tap: Tap, same_run: bool, times: f64) {
        if self.zero.replace(tap.zero).is_some_and(|zero| zero != tap.zero) {
            self.let_zero_go();
        }
        let slice = joint.slice(tap.u, same_run, 0..POINTS);
        let width = joint.width();
        let mut shared = DVector::zeros(width - 1);
        for (point, (a, b, c)) in slice.chunks(width).zip(&mut self.points) {
            let (r, d) = (tap.y - point[0], point[1]);
            shared.rows_mut(0, width - 2).copy_from_slice(&point[2..]);
            // Taps above one zero share its error.
            shared[width - 2] = tap.of_zero.sqrt();
            a.ger(times / d, &shared, &shared, 1.0);
            b.axpy(times * r / d, &shared, 1.0);
            *c += times * (r * r / d + d.ln());
        }
    }

    /// ln of the posterior at each point.
    fn heights(&self, joint: &Joint) -> Vec<f64> {
        let height = |(k, (a, b, c)): (usize, &(DMatrix<f64>, DVector<f64>, f64))| {
            let Some(factor) = a.clone().cholesky() else { return f64::NEG_INFINITY };
            let ln_det = 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
            joint.prior(joint.x(k)) - 0.5 * (c - b.dot(&factor.solve(b)) + ln_det)
        };
        self.points.iter().enumerate().map(height).collect()
    }

    /// Distances that are likely, the farthest first.
    pub fn modes(&self, joint: &Joint) -> Vec<Mode> {
        modes(joint, &self.heights(joint))
    }

    /// What all taps tell; `None` where nothing is likely.
    pub fn told(&self, joint: &Joint) -> Option<Told> {
        let heights = self.heights(joint);
        let modes = modes(joint, &heights);
        let mode = modes.iter().find(|mode| mode.share >= SECOND)?;
        let others = modes.iter().filter(|other| other.at != mode.at && other.share >= SECOND);
        let near = others.max_by(|a, b| a.share.total_cmp(&b.share)).map(|other| other.at.exp());
        // Up to half of the way to its neighbours.
        let between = |other: &Mode| 0.5 * (other.at + mode.at);
        let lower = modes.iter().filter(|m| m.at < mode.at).map(between).fold(joint.x(0), f64::max);
        let upper = modes.iter().filter(|m| m.at > mode.at).map(between).fold(joint.x(POINTS - 1), f64::min);
        let [from, to] = [(mode.at - WINDOW * mode.sd).max(lower), (mode.at + WINDOW * mode.sd).min(upper)];
        let step = (to - from) / (FINE - 1) as f64;
        let fine: [f64; FINE] = std::array::from_fn(|k| at(joint, &heights, from + step * k as f64));
        let top = fine.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let density = fine.map(|x| (x - top).exp());
        let [lo, middle, hi] = QUANTILES.map(|share| quantile(&density, from, step, share));
        let told = Told { a: middle.exp(), sigma: 0.5 * (hi.exp() - lo.exp()), near };
        (told.a.is_finite() && told.sigma > 0.0).then_some(told)
    }

    /// Expected root mean square deviation from the mean of the posterior, mm.
    pub fn spread(&self, joint: &Joint) -> f64 {
        let heights = self.heights(joint);
        let modes = modes(joint, &heights);
        let step = joint.inverse.grid[1];
        if modes.iter().all(|mode| mode.sd < 2.0 * step) {
            return spread(&modes);
        }
        let top = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let all: Vec<(f64, f64)> =
            heights.iter().enumerate().map(|(k, h)| (joint.x(k).exp(), (h - top).exp())).collect();
        let mass: f64 = all.iter().map(|p| p.1).sum();
        let mean = all.iter().map(|p| p.0 * p.1).sum::<f64>() / mass;
        (all.iter().map(|p| (p.0 - mean).powi(2) * p.1).sum::<f64>() / mass).sqrt()
    }

    /// Of the last taps the one that is farthest from what the others say at ln a = x, the distance free: how long ago it was, and by how many
    /// standard deviations it is off; `None` of one tap.
    pub fn apart(&self, joint: &Joint, x: f64, same_run: bool) -> Option<(usize, f64)> {
        if self.taps.len() < 2 {
            return None;
        }
        // Each zero that several taps have is one more number that they share; that of a single tap is noise.
        let many = |zero: u64| self.taps.iter().filter(|tap| tap.zero == zero).count() > 1;
        let mut zeros: Vec<u64> = self.taps.iter().map(|tap| tap.zero).filter(|zero| many(*zero)).collect();
        zeros.sort_unstable();
        zeros.dedup();
        let n = joint.of_run.len() + 1 + zeros.len();
        let of_tap = |tap: &Tap| {
            let (r, d, mut shared) = joint.local(tap, x, same_run);
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
        let factor = a.cholesky()?;
        let solved = factor.solve(&b);
        let off = |(r, d, shared): &(f64, f64, DVector<f64>)| {
            let known = 1.0 - shared.dot(&factor.solve(shared)) / d;
            (r - shared.dot(&solved)) / (d * known.max(1e-12)).sqrt()
        };
        let offs = local.iter().map(off).enumerate();
        let (k, most) = offs.max_by(|(_, p), (_, q)| p.abs().total_cmp(&q.abs()))?;
        Some((self.taps.len() - 1 - k, most))
    }

    /// Number of taps that [`Self::apart`] compares.
    pub fn compared(&self) -> usize {
        self.taps.len()
    }

    /// The expected [`Self::spread`] after `times` more taps by the drive `u`, over what is likely now.
    pub fn after(&self, joint: &Joint, u: f64, same_run: bool, times: f64) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (x, share) in self.likely(joint) {
            let mut then = self.clone();
            then.weigh(
                joint,
                Tap { u, y: joint.signal(u, x), of_zero: 0.0, zero: self.zero.unwrap_or(0) },
                same_run,
                times,
            );
            sum += share * then.spread(joint);
            total += share;
        }
        sum / total
    }

    /// Places in ln a that stand for the posterior, with their shares.
    pub fn likely(&self, joint: &Joint) -> Vec<(f64, f64)> {
        let heights = self.heights(joint);
        let modes = modes(joint, &heights);
        let narrow = |mode: &&Mode| mode.sd < 2.0 * joint.inverse.grid[1];
        if modes.iter().all(|mode| narrow(&mode)) {
            let each = |mode: &Mode| NODES.map(|(off, share)| (mode.at + off * mode.sd, mode.share * share));
            return modes.iter().filter(|mode| mode.share >= 0.5 * SECOND).flat_map(each).collect();
        }
        // Places of equal mass.
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
}

/// Places that stand for a wide posterior.
const PLACES: usize = 9;

/// Nodes and weights of Gauss and Hermite's rule for a standard normal number.
const NODES: [(f64, f64); 3] =
    [(-1.732_050_807_568_877_2, 1.0 / 6.0), (0.0, 2.0 / 3.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];

impl Joint {
    /// The first of [`NEAR`] points around ln a = x, and how far beyond it, in steps.
    fn place(&self, x: f64) -> (usize, f64) {
        let s = ((x - self.inverse.grid[0]) / self.inverse.grid[1]).clamp(0.0, (POINTS - 1) as f64);
        let k = (s as usize + 1).saturating_sub(NEAR / 2).min(POINTS - NEAR);
        (k, s - k as f64)
    }

    /// Residual, variance of its noise, and shared numbers of `tap` at ln a = x, the last of them the distance.
    fn local(&self, tap: &Tap, x: f64, same_run: bool) -> (f64, f64, Vec<f64>) {
        let (k, t) = self.place(x);
        let slice = self.slice(tap.u, same_run, k..k + NEAR);
        let width = self.width();
        let (values, slopes) = (lagrange(t), slopes(t));
        let of = |column: usize, weights: &[f64; NEAR]| {
            weights.iter().zip(slice.chunks(width)).map(|(w, point)| w * point[column]).sum::<f64>()
        };
        let mut shared: Vec<f64> = (2..width).map(|column| of(column, &values)).collect();
        shared.push(FREE * of(0, &slopes) / self.inverse.grid[1]);
        (tap.y - of(0, &values), of(1, &values).max(f64::MIN_POSITIVE), shared)
    }

    /// The signal of a tap by the drive `u` at ln a = x.
    pub fn signal(&self, u: f64, x: f64) -> f64 {
        let (k, t) = self.place(x);
        let slice = self.slice(u, true, k..k + NEAR);
        lagrange(t).iter().zip(slice.chunks(self.width())).map(|(w, point)| w * point[0]).sum()
    }
}

/// Weights of the values at 0, 1 … of the polynomial through them, at t.
fn lagrange(t: f64) -> [f64; NEAR] {
    std::array::from_fn(|i| {
        let others = (0..NEAR).filter(|j| *j != i);
        others.map(|j| (t - j as f64) / (i as f64 - j as f64)).product()
    })
}

/// Those of its slope.
fn slopes(t: f64) -> [f64; NEAR] {
    std::array::from_fn(|i| {
        let term = |m: usize| {
            let others = (0..NEAR).filter(|j| *j != i && *j != m);
            others.map(|j| (t - j as f64) / (i as f64 - j as f64)).product::<f64>() / (i as f64 - m as f64)
        };
        (0..NEAR).filter(|m| *m != i).map(term).sum()
    })
}

/// `heights` at ln a = x.
fn at(joint: &Joint, heights: &[f64], x: f64) -> f64 {
    let (k, t) = joint.place(x);
    lagrange(t).iter().zip(&heights[k..]).map(|(w, h)| w * h).sum()
}

fn modes(joint: &Joint, heights: &[f64]) -> Vec<Mode> {
    let step = joint.inverse.grid[1];
    let last = POINTS - 1;
    let higher =
        |k: usize, other: usize| heights[k] > heights[other] || heights[k] == heights[other] && k < other;
    let tops = (0..POINTS).filter(|&k| (k == 0 || higher(k, k - 1)) && (k == last || higher(k, k + 1)));
    let mode = |k: usize| {
        // A parabola through three points is the posterior of a signal that goes straight, however narrow that is.
        let m = k.clamp(1, last - 1);
        let [p, q, r] = [m - 1, m, m + 1].map(|i| heights[i]);
        let (slope, bend) = (0.5 * (r - p), 2.0 * q - p - r);
        let t = if bend > 0.0 { (slope / bend).clamp(-1.0, 1.0) } else { k as f64 - m as f64 };
        let sd = if bend > 0.0 { step / bend.sqrt() } else { f64::INFINITY };
        let x = joint.x(m) + t * step;
        (x, sd, q + slope * t - 0.5 * bend * t * t)
    };
    let found: Vec<(f64, f64, f64)> = tops.map(mode).filter(|m| m.2.is_finite()).collect();
    let top = found.iter().map(|m| m.2).fold(f64::NEG_INFINITY, f64::max);
    // Masses up to half of the way to the neighbours.
    let mut all = Vec::new();
    for (i, &(x, sd, height)) in found.iter().enumerate() {
        let lower = if i > 0 { 0.5 * (x + found[i - 1].0) } else { joint.x(0) };
        let upper = found.get(i + 1).map_or(joint.x(last), |next| 0.5 * (x + next.0));
        let narrow = sd < 2.0 * step;
        let mass = if narrow {
            (height - top).exp() * sd * (2.0 * std::f64::consts::PI).sqrt()
        } else {
            let own = (0..POINTS).filter(|k| (lower..=upper).contains(&joint.x(*k)));
            own.map(|k| (heights[k] - top).exp()).sum::<f64>() * step
        };
        let sd = if narrow { sd } else { wide(joint, heights, (lower, upper), top).unwrap_or(step) };
        all.push(Mode { at: x, sd, share: mass });
    }
    let total: f64 = all.iter().map(|mode| mode.share).sum();
    all.iter_mut().for_each(|mode| mode.share /= total);
    all.retain(|mode| mode.share > NONE);
    all.reverse();
    all
}

/// Standard deviation of the posterior between two places, ln a.
fn wide(joint: &Joint, heights: &[f64], (lower, upper): (f64, f64), top: f64) -> Option<f64> {
    let own: Vec<(f64, f64)> = (0..POINTS)
        .filter(|k| (lower..=upper).contains(&joint.x(*k)))
        .map(|k| (joint.x(k), (heights[k] - top).exp()))
        .collect();
    let mass: f64 = own.iter().map(|p| p.1).sum();
    let mean = own.iter().map(|p| p.0 * p.1).sum::<f64>() / mass;
    let variance = own.iter().map(|p| (p.0 - mean).powi(2) * p.1).sum::<f64>() / mass;
    (variance > 0.0).then(|| variance.sqrt())
}

/// Root mean square deviation from the mean over all modes, mm.
fn spread(modes: &[Mode]) -> f64 {
    let mean = modes.iter().map(|m| m.share * m.at.exp()).sum::<f64>();
    let square = |m: &Mode| m.share * ((m.sd * m.at.exp()).powi(2) + (m.at.exp() - mean).powi(2));
    modes.iter().map(square).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Power;
    use crate::columns::{Scales, Term};
    use crate::curve::Spread;

    /// A sequence of numbers between 0 and 1, and normal ones.
    struct Dice(u64);

    impl Dice {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        }

        fn normal(&mut self) -> f64 {
            let r = (-2.0 * self.uniform().ln()).sqrt();
            r * (2.0 * std::f64::consts::PI * self.uniform()).cos()
        }
    }

    fn curve(spread: Spread) -> Curve {
        let scales = Scales {
            a: [31.7_f64.ln(), (45.0_f64 / 22.4).ln() / 2.0],
            u: [2.5_f64.ln(), 0.7],
            sizes: [32.0, 5.0],
            offset: 0.0,
        };
        Curve {
            unit: 1.0,
            base_unit: 1.0,
            zero: 0.0,
            scales,
            terms: vec![Term::Curve(0, 0), Term::Curve(1, 0)],
            mean: vec![1.0, 0.0],
            deviations: vec![vec![0.01, 0.0], vec![0.0, 0.005]],
            spread,
        }
    }

    const POWER: Power = Power { offset: 0.0, p: 1.0, q: 1.5 };

    #[test]
    fn intervals_of_several_taps_hold_what_they_promise() {
        // Signals are some 0.01; noise is as large as what all taps share.
        let size = 2.5 * 32.0_f64.powf(-1.5);
        let spread = Spread {
            floor: (0.02 * size).powi(2),
            gain: 4e-4,
            zero: (0.01 * size).powi(2),
            ..Spread::default()
        };
        let curve = curve(spread);
        let base = Base::Power(POWER);
        let inverse = Inverse::new(&curve, &base, false, [0.0, f64::INFINITY]);
        let joint = Joint::new(&curve, &base, false, &inverse);
        let [near, far] = [0, 1].map(|k| {
            let [middle, half] = curve.scales.a;
            if k == 0 { (middle - half).exp() } else { (middle + half).exp() }
        });
        let mut dice = Dice(7);
        for n in [1, 2, 5, 16] {
            const OBJECTS: usize = 1500;
            let (mut inside, mut beyond, mut squares, mut sigmas) = (0, 0, 0.0, 0.0);
            for _ in 0..OBJECTS {
                let a: f64 = near + (far - near) * dice.uniform();
                let [c0, c1, gain, zero] = std::array::from_fn(|_| dice.normal());
                let x = curve.scales.place(a, 2.5)[0];
                let factor = 1.0 + 0.01 * c0 + 0.005 * c1 * x + 0.02 * gain;
                let mut object = Object::new(&joint);
                for _ in 0..n {
                    let u = 1.3 + 3.5 * dice.uniform();
                    let y = POWER.value(a, u) * factor + size * (0.01 * zero + 0.02 * dice.normal());
                    object.add(&joint, Tap { u, y, of_zero: 0.0, zero: 0 }, false);
                }
                let told = object.told(&joint).unwrap();
                let z = (told.a - a) / told.sigma;
                inside += usize::from(z.abs() < 1.0);
                beyond += usize::from(z.abs() > 3.0);
                squares += (told.a - a).powi(2);
                sigmas += told.sigma.powi(2);
            }
            // 99 % of a binomial: 1 500 objects within 1 σ ± 3.1 %.
            let share = inside as f64 / OBJECTS as f64;
            assert!((share - 0.683).abs() < 0.031, "{n} taps: {share} within one sigma");
            assert!(beyond <= 13, "{n} taps: {beyond} beyond three");
            let ratio = (squares / sigmas).sqrt();
            assert!((ratio - 1.0).abs() < 0.08, "{n} taps: errors are {ratio} of sigma");
        }
    }

    #[test]
    fn the_tap_that_contradicts_the_others_is_named() {
        let spread = Spread { floor: 1e-8, gain: 1e-4, ..Spread::default() };
        let curve = curve(spread);
        let base = Base::Power(POWER);
        let inverse = Inverse::new(&curve, &base, true, [0.0, f64::INFINITY]);
        let joint = Joint::new(&curve, &base, true, &inverse);
        let mut object = Object::new(&joint);
        let mut dice = Dice(3);
        for k in 0..6 {
            let u = 1.5 + 0.5 * f64::from(k);
            let wrong = if k == 2 { 1.2 } else { 1.0 };
            let y = wrong * POWER.value(30.0, u) + 1e-4 * dice.normal();
            object.add(&joint, Tap { u, y, of_zero: 0.0, zero: 0 }, false);
        }
        let told = object.told(&joint).unwrap();
        let (ago, by) = object.apart(&joint, told.a.ln(), false).unwrap();
        assert_eq!(5 - ago, 2, "{by}");
        assert!(by > 5.0, "{by}");
    }

    #[test]
    fn one_tap_says_what_it_says_alone() {
        let size = 2.5 * 32.0_f64.powf(-1.5);
        let curve = curve(Spread { floor: (0.005 * size).powi(2), gain: 1e-4, ..Spread::default() });
        let base = Base::Power(POWER);
        let inverse = Inverse::new(&curve, &base, true, [0.0, f64::INFINITY]);
        let joint = Joint::new(&curve, &base, true, &inverse);
        for a in [25.0, 32.0, 41.0] {
            let y = POWER.value(a, 3.0);
            let mut object = Object::new(&joint);
            object.add(&joint, Tap { u: 3.0, y, of_zero: 0.0, zero: 0 }, false);
            let (told, alone) = (object.told(&joint).unwrap(), inverse.at(3.0, false).find(y, 0.0).unwrap());
            assert!((told.a - alone.a).abs() < 0.05 * alone.sigma, "{told:?} {alone:?}");
            assert!((told.sigma / alone.sigma - 1.0).abs() < 0.03, "{told:?} {alone:?}");
        }
    }
}
