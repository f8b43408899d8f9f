//! Distances and charts in single precision, and the polynomials of taps at a chart.

use super::dispatch::part;
use super::read::{self, Basis, Flat, Products, Values};
use super::{Lanes, ORDERS, affine, narrow};
use crate::axis::{AXES, Axis, Map, Quantity};
use crate::build::{Built, check};
use crate::distance::{DistanceChart, FUNCTIONS, Function};
use crate::kernel::cpu::Packed;
use crate::physics::chebyshev::basis;
use crate::scene::Drive;
use crate::weight::Weight;

/// Points that decide to which side most taps slide.
const SIDES: usize = 64;

#[derive(Debug)]
pub(super) struct Distance {
    pub a: f32,
    pub inverse: f32,
}

#[derive(Debug)]
pub(super) struct Charted {
    pub a: f32,
    pub inverse: f32,
    pub gauge: Vec<[f32; 2]>,
    /// Factor of the chart's functions for the drive's power in mm.
    pub scale: f32,
    pub affine: [[f32; 2]; AXES],
    pub maps: [Map; AXES],
    pub at_points: Vec<[f32; ORDERS]>,
    pub products: Products,
    pub functions: [Vec<Flat>; FUNCTIONS],
    weight: Option<Weight>,
    /// Bound on c/a − 1 over driveᵉ in the chart.
    pub most_arc: f32,
    /// Error bounds of strain and arc for terms that were left out.
    pub missed: [f32; 2],
    /// Sign of the arc where its branch holds; 0 where there is only one branch.
    pub slides: f32,
}

/// Weight of a point, for whiskers other than cones of one material, at D/a, τa and x/a; `variable` is that of the place.
#[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
#[inline(never)]
fn own_weight(weights: &Weight, at: [Lanes; 3], variable: Lanes) -> Lanes {
    weights.at(at, variable, Lanes::of, power)
}

#[inline(always)]
fn power(mut x: Lanes, n: f64) -> Lanes {
    for x in &mut x.0 {
        *x = x.powf(n as f32);
    }
    x
}

impl Charted {
    /// `drives`: those at the points of series over the drive.
    pub fn new(chart: &DistanceChart, kind: Drive, drives: &[f64]) -> Self {
        let axes = chart.axes();
        let affine = |axis: &Axis| if axis.is_point() { [0.0; 2] } else { affine(axis.ends()) };
        let per_mm = if kind == Drive::Displacement { 1.0 / chart.a } else { 1.0 };
        let all = [Function::Strain, Function::Arc, Function::Force];
        let scale = per_mm.powi(chart.power);
        let mut products = Products::default();
        let place = |drive: &f64| axes[Quantity::Drive as usize].place(drive * per_mm);
        let centred = chart.gauges.centred;
        let room = if centred { 1.0 - axes[Quantity::Place as usize].range[1] } else { 1.0 };
        let arc = |b: &Built<FUNCTIONS>| (b.series[Function::Arc as usize].bound() * scale / room) as f32;
        let point = |f: Function| f == Function::Strain || centred;
        Self {
            weight: chart.weight.clone(),
            a: chart.a as f32,
            inverse: (1.0 / chart.a) as f32,
            gauge: chart.gauges.points.iter().map(|point| point.map(|x| x as f32)).collect(),
            scale: scale as f32,
            affine: axes.each_ref().map(affine),
            maps: axes.each_ref().map(|axis| axis.map),
            at_points: drives.iter().map(|d| narrow(&basis(ORDERS, place(d)))).collect(),
            functions: all
                .map(|f| products.add(chart.branches.iter().map(|b| &b.series[f as usize]), point(f))),
            products,
            most_arc: chart.branches.iter().map(arc).fold(0.0, f32::max),
            missed: [0.0; 2],
            slides: 0.0,
        }
    }

    /// The largest terms of `chart`, to `error` at the largest drives. A contact that chooses slides to the side to which most taps do.
    pub fn roughly(chart: &DistanceChart, exact: &Self, kind: Drive, error: f64) -> Self {
        let axes = chart.axes();
        let drive = axes[Quantity::Drive as usize].range[1];
        let place = 1.0 - axes[Quantity::Place as usize].range[1];
        let share = |function: Function| {
            let point = function == Function::Strain || chart.gauges.centred;
            error / drive.powi(chart.power) * if point { place } else { 1.0 }
        };
        let last = chart.branches.len() - 1;
        let arc = |branch: usize, x: [f64; AXES]| chart.branches[branch].series[Function::Arc as usize].at(x);
        let points = || (0..SIDES).map(|i| check(i, &axes.map(|axis| axis.is_point())));
        let outwards = points().filter(|x| arc(last, *x) >= 0.0).count();
        let inwards = points().filter(|x| arc(0, *x) <= 0.0).count();
        let (side, slides) = if outwards >= inwards { (last, 1.0) } else { (0, -1.0) };
        let mut rough = chart.clone();
        rough.branches = vec![chart.branches[side].clone()];
        let mut missed = [Function::Strain, Function::Arc].map(|function| {
            let series = &mut rough.branches[0].series[function as usize];
            let (kept, missed) = series.largest(share(function));
            *series = kept;
            (missed * f64::from(exact.scale)) as f32
        });
        if chart.gauges.centred {
            missed[1] /= place as f32;
        }
        Self {
            missed,
            slides: if last > 0 { slides } else { 0.0 },
            most_arc: exact.most_arc,
            ..Self::new(&rough, kind, &[])
        }
    }

    /// Chebyshev polynomials at the drive (with `OWN`), D/a and τa, and gauge means of those over x/a, for functions up to `last`.
    #[inline(always)]
    pub fn polynomials<const OWN: bool>(
        &self,
        [drive, near, base, taper, far]: &[Lanes; AXES],
        last: Function,
        basis: &mut Basis,
        products: &mut Values,
    ) {
        let need = &self.products.needs[last as usize];
        let sizes = &need.sizes;
        basis[1][0] = Lanes::of(1.0);
        if OWN {
            read::polynomials(self.variable(0, *drive), sizes[0], &mut basis[0]);
        }
        read::polynomials(self.variable(2, *base), sizes[2], &mut basis[2]);
        read::polynomials(self.variable(3, *taper), sizes[3], &mut basis[3]);
        self.fold([*near, *far], [*base, *taper], (&mut basis[4], sizes[4]), &mut *products.points);
        self.products.fill::<OWN>(need, basis, products);
    }

    #[inline(always)]
    fn variable(&self, k: usize, q: Lanes) -> Lanes {
        let one = Lanes::of(1.0);
        let y = match self.maps[k] {
            Map::Linear => q,
            Map::Square => q * q,
            Map::Root => (one / (one - q)).sqrt(),
            Map::Inverse => one / (one - q),
            Map::Fourth => q.sqrt().sqrt(),
        };
        let [scale, shift] = self.affine[k];
        y.mul_add(Lanes::splat(scale), Lanes::splat(shift))
    }

    /// Means over a gauge of the polynomials over x/a, so that they give its δ (see [`crate::gauge`]).
    #[inline(always)]
    fn fold(
        &self,
        [near, far]: [Lanes; 2],
        [base, p]: [Lanes; 2],
        (into, size): (&mut [Lanes], usize),
        points: &mut [[Lanes; 4]],
    ) {
        let of = Lanes::of;
        let (one, width) = (of(1.0), far - near);
        let (mut total, mut whole, mut first) = (of(0.0), of(0.0), of(0.0));
        // Per point: its weight, 1 − s and (1 − p s)³, then twice its variable and two neighbouring polynomials. All points advance together.
        let count = self.gauge.len().min(points.len());
        let points = &mut points[..count];
        for (point, [place, weight]) in points.iter_mut().zip(&self.gauge) {
            let s = width.mul_add(Lanes::splat(*place), near);
            let (u, x) = (one - p * s, self.variable(4, s));
            let cube = u * u * u;
            let weight = match &self.weight {
                None => Lanes::splat(*weight),
                Some(weights) => Lanes::splat(*weight) * part!(own_weight(weights, [base, p, s], x)),
            };
            *point = [weight, one - s, cube, x];
        }
        if self.weight.is_none() {
            match &mut *points {
                [a, b] => {
                    [a[0], b[0]] = [a[0] * b[2], b[0] * a[2]];
                }
                points => points.iter_mut().for_each(|point| point[0] = point[0] / point[2]),
            }
        }
        for [weight, room, before, x] in points.iter_mut() {
            total = weight.mul_add(*room, total);
            whole = whole + *weight;
            first = weight.mul_add(*x, first);
            (*room, *before) = (*x + *x, one);
        }
        let share = one / total;
        into[0] = whole * share;
        into[1] = first * share;
        for value in into.iter_mut().take(size).skip(2) {
            let mut sum = of(0.0);
            for [weight, twice, last, this] in points.iter_mut() {
                (*last, *this) = (*this, *twice * *this - *last);
                sum = weight.mul_add(*this, sum);
            }
            *value = sum * share;
        }
    }
}
