//! Several taps of one object: one posterior of its distance.
//!
//! With the numbers s ~ N(0, 1) that taps of one calibration and run share, a signal at the distance a is y_i = m_i(a) + l_i(a)·s + e_i, with
//! e_i ~ N(0, d_i). At each point in ln a, A = 1 + Σ l lᵀ/d, b = Σ l (y − m)/d and c = Σ (y − m)²/d + ln d give
//! −2 ln p(y | a) = c − bᵀ A⁻¹ b + ln det A. Each tap costs the same. A product of single posteriors would count shared errors once per tap.

mod course;
mod object;
mod posterior;

pub use course::{Course, Stroke, Told as ToldCourse};
pub use object::{Object, Outlook, integrate};
pub use posterior::simplex;

use std::ops::Range;

use crate::base::Base;
use crate::curve::{Curve, OF_RUN, Offset};
use crate::invert::{Inverse, blend, lagrange, place, prior, slopes, tabled};

const SMALL: f64 = 1e-4;
const WINDOW: f64 = 6.0;
const NEAR: usize = 6;
const JUDGED: usize = 256;
/// Prior standard deviation in ln a of a free distance, when taps are compared.
const FREE: f64 = 10.0;
const IMPOSSIBLE: f64 = -1e4;
const NONE: f64 = 1e-9;
const SECOND: f64 = 0.05;

/// Signals of taps and their shared errors, tabulated over ln a at some drives.
#[derive(Debug, Clone)]
pub struct Joint {
    inverse: Inverse,
    /// At each node and point: signal/u, variance of noise/u², shared numbers/u.
    table: Vec<Vec<f64>>,
    of_run: Vec<bool>,
    rest: Vec<f64>,
    offset: Offset,
}

/// One tap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tap {
    /// Drive of the tap.
    pub u: f64,
    /// Signal of the tap.
    pub y: f64,
    /// Variance of its zero.
    pub of_zero: f64,
    /// Identifier of its zero: taps with the same zero share its error.
    pub zero: u64,
    /// Shift of the base towards the object, from the origin of the reported distance, mm.
    pub shift: f64,
}

/// Result of the taps of an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// Distance, mm: median of the reported mode.
    pub a: f64,
    /// Half of its 68 % interval, mm.
    pub sigma: f64,
    /// 95 % interval for known variances, mm.
    pub ends: [f64; 2],
    /// Another distance that fits, mm.
    pub near: Option<f64>,
}

impl Joint {
    /// Table for taps of `curve` over its base on the grid of `inverse`, which belongs to the same curve. For `strokes` all numbers above the
    /// independent noise stay shared, since proportional noise is common to the readings of a stroke.
    pub fn new(curve: &Curve, base: &Base, tared: bool, inverse: &Inverse, strokes: bool) -> Self {
        let n = curve.shared();
        let of = |a: f64, u: f64| {
            let mut shared = Vec::with_capacity(n);
            let [signal, noise] = curve.moved(base, (a, u - inverse.offset), tared, &mut shared);
            [signal / u, noise / (u * u)].into_iter().chain(shared.iter().map(|x| x / u)).collect()
        };
        let (table, rest) = (tabled(&inverse.nodes, inverse.grid, of), curve.rest(tared));
        let (floor, of_run) = (rest[1], (0..n).map(|k| k + OF_RUN >= n).collect());
        let mut joint = Self { inverse: inverse.clone(), table, of_run, rest, offset: curve.offset(base) };
        let whole = |point: &[f64]| point[1] + point[2..].iter().map(|x| x * x).sum::<f64>();
        joint.prune(|point, u| if strokes { floor / (u * u) } else { whole(point) });
        joint
    }

    fn width(&self) -> usize {
        2 + self.of_run.len()
    }

    /// Counts shared numbers as noise if their part of the variance `of` a point (over u²) is small everywhere.
    fn prune(&mut self, of: impl Fn(&[f64], f64) -> f64) {
        let (width, n) = (self.width(), self.of_run.len());
        let mut largest = vec![0.0_f64; n];
        for (row, u) in self.table.iter().zip(&self.inverse.nodes) {
            for point in row.chunks(width) {
                let all = of(point, u.exp());
                for (most, x) in largest.iter_mut().zip(&point[2..]) {
                    *most = most.max(if *x != 0.0 { x * x / all } else { 0.0 });
                }
            }
        }
        let kept: Vec<usize> = (0..n).filter(|k| largest[*k] > SMALL).collect();
        let fewer = |point: &[f64]| {
            let gone = (0..n).filter(|k| !kept.contains(k)).map(|k| point[2 + k].powi(2)).sum::<f64>();
            let own = kept.iter().map(|k| point[2 + k]);
            [point[0], point[1] + gone].into_iter().chain(own).collect::<Vec<f64>>()
        };
        for row in &mut self.table {
            *row = row.chunks(width).flat_map(fewer).collect();
        }
        self.rest = fewer(&self.rest);
        let Offset { moved, own, .. } = &mut self.offset;
        let gone = (0..n).filter(|k| !kept.contains(k)).map(|k| moved[k].powi(2)).sum::<f64>();
        *own = (*own * *own + gone).sqrt();
        *moved = kept.iter().map(|k| moved[*k]).collect();
        self.of_run = kept.iter().map(|k| self.of_run[*k]).collect();
    }

    /// [`Self::slice`] for a base shifted by `shift` mm towards the object; beyond the grid the last point is repeated.
    fn shifted(&self, u: f64, shift: f64, same_run: bool, points: Range<usize>) -> Vec<f64> {
        if shift == 0.0 {
            return self.slice(u, same_run, points);
        }
        let places: Vec<(usize, f64)> = points.map(|k| self.place(self.seen(self.x(k), shift))).collect();
        let [first, last] = [places.first(), places.last()].map(|place| place.map_or(0, |(k, _)| *k));
        let (width, all) = (self.width(), self.slice(u, same_run, first..last + NEAR));
        let moved = |(k, t): (usize, f64)| {
            let mut point = blend(&lagrange::<NEAR>(t), all[(k - first) * width..].chunks(width), width);
            point[1] = point[1].max(f64::MIN_POSITIVE);
            point
        };
        places.into_iter().flat_map(moved).collect()
    }

    /// ln distance from a base shifted by `shift` mm towards the object; x is ln a from the origin.
    fn seen(&self, x: f64, shift: f64) -> f64 {
        if shift == 0.0 { x } else { (x.exp() - shift).max(f64::MIN_POSITIVE).ln() }
    }

    fn slice(&self, u: f64, same_run: bool, points: Range<usize>) -> Vec<f64> {
        let u = u + self.inverse.offset;
        let width = self.width();
        let mut all = self.inverse.between(&self.table, u, points.start * width..points.end * width);
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

    /// ln prior at ln a = x, flat in mm; `shifts` are the least and largest shift of the base, mm.
    fn prior(&self, x: f64, shifts: [f64; 2]) -> f64 {
        let within = |shift: f64| prior(self.inverse.ends, self.seen(x, shift)).ln().max(IMPOSSIBLE);
        let [least, largest] = shifts.map(within);
        (if shifts[0] == shifts[1] { least } else { least + largest }) + x
    }

    fn place(&self, x: f64) -> (usize, f64) {
        place::<NEAR>(self.inverse.grid, x)
    }

    /// Residual, variance of its noise and shared numbers of `tap` at ln a = x; the last shared number is the distance.
    fn local(&self, tap: &Tap, x: f64, same_run: bool) -> (f64, f64, Vec<f64>) {
        let seen = self.seen(x, tap.shift);
        let (k, t) = self.place(seen);
        let slice = self.slice(tap.u, same_run, k..k + NEAR);
        let width = self.width();
        let [values, slopes] =
            [lagrange::<NEAR>(t), slopes(t)].map(|weights| blend(&weights, slice.chunks(width), width));
        let mut shared = values[2..].to_vec();
        shared.push(FREE * (x - seen).exp() * slopes[0] / self.inverse.grid[1]);
        (tap.y - values[0], values[1].max(f64::MIN_POSITIVE), shared)
    }

    /// Signal of a tap at drive `u` and ln a = x.
    pub fn signal(&self, u: f64, x: f64) -> f64 {
        let (k, t) = self.place(x);
        let slice = self.slice(u, true, k..k + NEAR);
        blend(&lagrange::<NEAR>(t), slice.chunks(self.width()), 1)[0]
    }
}

/// Relative change of the signal by an uncertain number of the object, on an even grid of ln a and drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Nuisance {
    /// First and last ln a; first and last drive.
    pub ends: [[f64; 2]; 2],
    /// Count of ln a values.
    pub rows: usize,
    /// Mean change and its standard deviation, row by row in ln a.
    pub changes: Vec<[f64; 2]>,
}

impl Nuisance {
    /// Mean change at ln a = x and drive `u` with its standard deviation, bilinear; beyond the grid from its edge.
    pub fn at(&self, x: f64, u: f64) -> [f64; 2] {
        let columns = self.changes.len() / self.rows;
        let place = |v: f64, [first, last]: [f64; 2], n: usize| {
            let share = if last > first { (v - first) / (last - first) } else { 0.0 };
            let s = share.clamp(0.0, 1.0) * (n - 1) as f64;
            let k = (s as usize).min(n.saturating_sub(2));
            (k, s - k as f64)
        };
        let ((i, s), (j, t)) = (place(x, self.ends[0], self.rows), place(u, self.ends[1], columns));
        let value = |i: usize, j: usize| self.changes[i.min(self.rows - 1) * columns + j.min(columns - 1)];
        std::array::from_fn(|k| {
            let along = |i: usize| (1.0 - t) * value(i, j)[k] + t * value(i, j + 1)[k];
            (1.0 - s) * along(i) + s * along(i + 1)
        })
    }
}
