//! Linear theory of built whiskers in a pack (model §7): f at all distances, and the thresholds of words.
//!
//! A contact at a presses with P per unit of drive and strains a gauge by f = P t·(h J − J₁): h and t are place and direction of the resting axis at
//! the contact, J and J₁ the means of R/EI and of r₀ R/EI over the gauge. With h_x = a + …, f = P (t_x (a J − J₁x) + …), where … is 0 for a straight
//! whisker. P, over D and a second diameter that depends on D, d and L_a, is a series over ln a; R/EI is one over the place.

use std::sync::Arc;

use rayon::prelude::*;

use super::read::{self, Basis};
use super::theory::{Thresholds, Whisker};
use super::{Lanes, Ranker, Scratch, affine};
use crate::adaptive::MOST;
use crate::axis::{AXES, Axis, Map};
use crate::build::{self, Bound, build};
use crate::kernel::cpu::Packed;
use crate::physics::chebyshev::{basis, scaled};
use crate::physics::{body::Body, linear::StrainCurve, linear::shear_length2, taper::Taper};
use crate::ranges::Wanted;
use crate::reduce::range;
use crate::scene::{Setup, Signal, Theory};

/// Errors of series to try, relative to their first function in the middle: sharp tips need the second.
const ERRORS: [f64; 2] = [1e-5, 5e-5];

/// Least distance of the middle of both diameters from a cylinder, relative.
const CYLINDER: f64 = 0.25;

/// Places between the ends of a gauge, and weights of Gauss's mean; first the middle, which has none.
const POINTS: [[f32; 2]; 4] =
    [[0.5, 0.0], [0.112_701_66, 0.277_777_8], [0.5, 0.444_444_45], [0.887_298_35, 0.277_777_8]];

/// Contacts between which the peak of f is found, evenly in ln a; nearest first.
const SAMPLES: usize = 48;

/// Coefficients over the place of some functions, at the diameters of a pack.
pub(super) type Sums = [[Lanes; MOST]; 4];

/// Series of functions over two diameters and a place.
#[derive(Debug, Clone)]
struct Narrow<const F: usize> {
    /// Scales and shifts to [−1, 1], and numbers of orders, of the three.
    affine: [[f32; 2]; 3],
    orders: [usize; 3],
    /// Orders over the diameters, and coefficients over the place.
    rows: [Vec<([usize; 2], Vec<f32>)>; F],
}

/// A contact: its place among the distances and [`Flexed::more`], 1/a, 1/mm, and polynomials over ln a.
type Contact = (usize, f32, Vec<f32>);

/// f of the built whiskers of a sweep.
#[derive(Debug, Clone)]
pub struct Flexed {
    /// Distance of the second diameter from the base, mm.
    length: f32,
    /// R/EI and both components of (r₀ − (s, 0)) R/EI, times E D³ (1 − τs)³, and cos α, over the place s.
    gauge: Narrow<4>,
    /// a² P t_x, a² P (t·h − a t_x) and a² P t_y, over E D⁴, and the contacts, for each range between knots of the whisker.
    pieces: Vec<(Narrow<3>, Vec<Contact>)>,
    /// 1/a of both ends of the range of interest, then of the samples, 1/mm.
    more: [f32; 2 + SAMPLES],
}

impl<const F: usize> Narrow<F> {
    /// Series of `value` over ranges of both diameters and a place.
    fn new(ranges: [[f64; 2]; 3], value: impl Fn([f64; 3]) -> [f64; F] + Sync) -> Option<Self> {
        let [base, tip, place] = ranges;
        let axis = |range| Axis { range, map: Map::Linear, whole: true };
        let axes = [[0.0; 2], [0.0; 2], base, tip, place].map(axis);
        let at = |&[.., base, tip, place]: &[f64; AXES]| value([base, tip, place]);
        let unit = at(&axes.map(|axis| axis.at(0.0)))[0];
        let asked =
            |q: &[f64; AXES]| Some(at(q).map(|x| x / unit)).filter(|all| all.iter().all(|x| x.is_finite()));
        let mut ask = |q: &[[f64; AXES]]| Ok(q.par_iter().map(asked).collect());
        let made = |error| build(axes, &[Bound::of(error); F], (build::MOST, &[]), &mut ask).ok()?;
        let series = ERRORS.into_iter().find_map(made)?.series;
        let sizes = |k: usize| series.iter().map(|series| series.sizes()[k]).max().unwrap_or(1);
        let row = |row: &crate::series::Row| {
            let [.., base, tip] = row.orders;
            ([base, tip], row.coefficients.iter().map(|c| (c * unit) as f32).collect())
        };
        let rows = series.each_ref().map(|series| series.rows.iter().map(row).collect());
        Some(Self { affine: ranges.map(affine), orders: [2, 3, 4].map(sizes), rows })
    }

    /// Coefficients over the place, at both diameters.
    #[inline(always)]
    fn read(&self, diameters: [Lanes; 2], basis: &mut Basis, sums: &mut Sums) {
        for k in 0..2 {
            read::polynomials(mapped(self.affine[k], diameters[k]), self.orders[k], &mut basis[k]);
        }
        for (rows, sums) in self.rows.iter().zip(sums) {
            sums[..self.orders[2]].fill(Lanes::of(0.0));
            for ([i, k], coefficients) in rows {
                let shared = basis[0][*i] * basis[1][*k];
                for (sum, c) in sums.iter_mut().zip(coefficients) {
                    *sum = shared.mul_add(Lanes::splat(*c), *sum);
                }
            }
        }
    }
}

#[inline(always)]
fn mapped([scale, shift]: [f32; 2], x: Lanes) -> Lanes {
    x.mul_add(Lanes::splat(scale), Lanes::splat(shift))
}

impl Flexed {
    /// Whiskers `wanted` of one rig, gauges that end before `last`, contacts at `distances` and at both `ends` of the range of interest, mm.
    /// `None` for cones clamped at their base, if a knot lies within the range of gauges, and if no series is accurate enough.
    pub fn new(setup: &Setup, wanted: &Wanted, distances: &[f64], ends: [f64; 2], last: f64) -> Option<Self> {
        let built = setup.built.as_deref()?;
        let (e0, nu) = (setup.model.material.e0(), setup.model.nu);
        let [near, far] = range(distances.iter().copied());
        let [length, longest] = wanted.L_a.map(|length| length.max(far));
        let ends_of =
            |d: f64| [length, longest].map(|own| wanted.D.map(|base| base - (base - d) / own * length));
        let (base, mut tip) = (wanted.D, range(wanted.d.into_iter().flat_map(ends_of).flatten()));
        // A cylinder in the middle would not depend on the place, and the series would stop at its first order.
        let [middle, of_tip] = [base, tip].map(|[lo, hi]| 0.5 * (lo + hi));
        if (of_tip / middle - 1.0).abs() < CYLINDER {
            tip[1] = 2.0 * (1.0 + CYLINDER) * middle - tip[0];
        }
        let body = |base: f64, tip: f64| Body::new(built, [base, tip, length], e0, nu);
        let contact = |[base, tip, ln]: [f64; 3]| {
            let (body, taper, a) = (Arc::new(body(base, tip)), Taper::new(base, tip, length), ln.exp());
            let with_shear = setup.estimate.theory == Theory::Timoshenko;
            let shear = if with_shear { shear_length2(&taper, nu) } else { 0.0 };
            let curve = StrainCurve::new(taper, [0.0, a], setup.hub, setup.drive, shear);
            let force = a * a / (e0 * base.powi(4)) * curve.built(&body, Signal::Force).force(e0, a);
            let (rest, (sin, cos)) = (body.rest(a), body.rest_angle(a).sin_cos());
            [force * cos, force * (cos * (rest.x - a) + sin * rest.y), force * sin]
        };
        let places = [wanted.x_ss[0], (wanted.x_ss[1] + wanted.l[1]).min(last)];
        let within = 0.5 * (places[0] + places[1]);
        let gauge = |[base, tip, s]: [f64; 3]| {
            let (body, cone) = (body(base, tip), base - (base - tip) / length * s);
            let (section, rest) = (body.section(s, within), body.rest(s));
            let share = e0 * section.radius / section.bending * cone.powi(3);
            [share, share * (rest.x - s), share * rest.y, 1.0 / body.slope(s, within).hypot(1.0)]
        };
        let knots = body(base[0], tip[0]).knots().to_vec();
        if knots.iter().any(|s| places[0] < *s && *s < places[1]) {
            return None;
        }
        let from = 0.5 * near.min(ends[0]);
        let step = (length / from).ln() / (SAMPLES - 1) as f64;
        let samples = (0..SAMPLES).map(|k| from * (step * k as f64).exp());
        let more: Vec<f64> = ends.into_iter().chain(samples).map(|a| a.clamp(from, length)).collect();
        let all: Vec<f64> = distances.iter().chain(&more).copied().collect();
        let inside = knots.into_iter().filter(|s| from < *s && *s < length);
        let ends: Vec<f64> = std::iter::once(from).chain(inside).chain([length]).collect();
        let piece = |(n, ends): (usize, &[f64])| {
            let lns = [ends[0].ln(), ends[1].ln()];
            let series = Narrow::new([base, tip, lns], contact)?;
            let contact = |(place, a): (usize, &f64)| {
                let polynomials = basis(series.orders[2], scaled(lns, a.ln()));
                (place, (1.0 / a) as f32, polynomials.into_iter().map(|t| t as f32).collect())
            };
            let own = |(_, a): &(usize, &f64)| **a <= ends[1] && (n == 0 || **a > ends[0]);
            let contacts = all.iter().enumerate().filter(own).map(contact).collect();
            Some((series, contacts))
        };
        Some(Self {
            length: length as f32,
            gauge: Narrow::new([base, tip, places], gauge)?,
            pieces: ends.windows(2).enumerate().map(piece).collect::<Option<_>>()?,
            more: std::array::from_fn(|k| (1.0 / more[k]) as f32),
        })
    }

    /// Sets f of `design` at each distance, and its peak and thresholds; `grid`: length of the grid, mm.
    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    #[inline(never)]
    pub(super) fn fill(&self, ranker: &Ranker, design: &mut Whisker, grid: Lanes, scratch: &mut Scratch) {
        let (zero, one) = (Lanes::of(0.0), Lanes::of(1.0));
        let Scratch { basis, taps, flexed: sums, .. } = scratch;
        let diameters = [design.diameter, design.diameter * (one - design.tau * Lanes::splat(self.length))];
        self.gauge.read(diameters, basis, sums);
        // The mean over the gauge; its width is found with the slope in its middle.
        let (mut mean, mut width) = ([zero; 4], grid);
        for [share, weight] in POINTS {
            let s = width.mul_add(Lanes::splat(share), design.gauge[0]);
            read::polynomials(mapped(self.gauge.affine[2], s), self.gauge.orders[2], &mut basis[2]);
            let mut values = [zero; 4];
            for k in 0..self.gauge.orders[2] {
                for (value, sums) in values.iter_mut().zip(&**sums) {
                    *value = basis[2][k].mul_add(sums[k], *value);
                }
            }
            if weight == 0.0 {
                width = grid * values[3];
            }
            let cone = one - design.tau * s;
            let weight = design.diameter * Lanes::splat(weight) / (cone * cone * cone);
            values[1] = s.mul_add(values[0], values[1]);
            for (mean, value) in mean.iter_mut().zip(values) {
                *mean = weight.mul_add(value, *mean);
            }
        }
        let mut more = [zero; 2 + SAMPLES];
        let (strain, straight) =
            (&mut taps.strain[..], ranker.scope.setup.built.as_ref().is_none_or(|b| b.is_straight()));
        for (series, contacts) in &self.pieces {
            series.read(diameters, basis, sums);
            let [along, others, across, _] = &mut **sums;
            for k in 0..if straight { 0 } else { series.orders[2] } {
                others[k] = mean[0] * others[k] - mean[2] * across[k];
            }
            for (place, inverse, basis) in contacts {
                let (u, mut force, mut other) = (Lanes::splat(*inverse), zero, zero);
                for (t, c) in basis.iter().zip(&*along) {
                    force = Lanes::splat(*t).mul_add(*c, force);
                }
                for (t, c) in basis.iter().zip(&others[..if straight { 0 } else { MOST }]) {
                    other = Lanes::splat(*t).mul_add(*c, other);
                }
                let f = u * force.mul_add(mean[0] - u * mean[1], u * other);
                match place.checked_sub(strain.len()) {
                    None => strain[*place] = f,
                    Some(k) => more[k] = f,
                }
            }
        }
        self.thresholds(ranker, design, &more);
    }

    /// Peak and thresholds from f at [`Self::more`].
    #[inline(always)]
    fn thresholds(&self, ranker: &Ranker, design: &mut Whisker, f: &[Lanes; 2 + SAMPLES]) {
        let of = Lanes::of;
        let (zero, one, never, half) = (of(0.0), of(1.0), of(1e30), of(0.5));
        let (u, last) = (&self.more, f.len() - 1);
        let (mut highest, mut peak, mut around) = (f[2], Lanes::splat(u[2]), [f[2]; 3]);
        for k in 3..last {
            for (old, new) in around.iter_mut().zip([f[(k - 2).max(2)], f[k - 1], f[k + 1]]) {
                *old = highest.if_less(f[k], new, *old);
            }
            peak = highest.if_less(f[k], Lanes::splat(u[k]), peak);
            highest = highest.max(f[k]);
        }
        // The vertex of the parabola through three samples, and f there with the cubic term of four.
        let [before, left, right] = around;
        let (rise, bend) = (right - left, highest + highest - left - right);
        let share = right.if_less(highest, half * rise / bend.max(of(1e-30)), zero);
        let third = right - before + of(3.0) * (left - highest);
        highest = highest + share * (of(0.25) * rise + of(1.0 / 6.0) * third * (share * share - one));
        peak = peak - peak * share * Lanes::splat((u[2] / u[3]).ln());
        // Whiskers may reach beyond the last sample.
        let tip = one / design.length;
        let slope = (f[last] - f[last - 1]) * Lanes::splat(1.0 / (u[last] - u[last - 1]));
        let end = slope.mul_add(tip - Lanes::splat(u[last]), f[last]).max(zero);
        peak = highest.if_less(end, tip, peak);
        highest = highest.max(end);
        // Beyond the tip of a whisker that widens, f changes as that of its cone.
        let farthest = end * design.strain(ranker, zero) / design.strain(ranker, tip);
        let farthest = design.tau.if_less(zero, farthest, zero);
        design.peak = peak;
        design.words = Thresholds {
            low: Lanes::splat(u[0]).if_less(peak, never, f[0]).max(farthest),
            high: peak.if_less(Lanes::splat(u[1]), f[1], never).min(highest),
            peak: highest,
            farthest: zero,
            ends: [-never; 2],
            unseen: Some([farthest, end]),
        };
    }
}
