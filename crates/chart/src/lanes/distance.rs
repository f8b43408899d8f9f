//! Distances and charts in single precision, and the polynomials of taps at a chart.

use super::dispatch::{Part, apart};
use super::read::{self, Flat, Products, Values};
use super::{Lanes, ORDERS, affine, wide};
use crate::axis::{AXES, Axis, Map, Quantity};
use crate::build::Built;
use crate::distance::{DistanceChart, FUNCTIONS, Function};
use crate::kernel::cpu::Pack;
use crate::physics::chebyshev::basis;
use crate::scene::Drive;
use crate::weight::Weight;

/// Most points of a gauge.
const MOST_POINTS: usize = 8;

/// A contact distance.
#[derive(Debug)]
pub(super) struct Distance {
    pub a: f32,
    pub inverse: f32,
}

impl Distance {
    /// Of `a` mm.
    pub fn new(a: f64) -> Self {
        Self { a: a as f32, inverse: (1.0 / a) as f32 }
    }
}

/// The chart of a distance.
#[derive(Debug)]
pub(super) struct Charted {
    pub a: f32,
    pub inverse: f32,
    /// Place and weight of the points of a gauge.
    pub gauge: Vec<[f32; 2]>,
    /// What the chart's functions are multiplied by for the drive's power in mm.
    pub scale: f32,
    /// Scale and shift of each variable.
    pub affine: [[f32; 2]; AXES],
    pub maps: [Map; AXES],
    /// Orders over each axis.
    pub sizes: [usize; AXES],
    /// Values of the polynomials over the drive at the points.
    pub at_points: Vec<[f32; ORDERS]>,
    /// Of all its series.
    pub products: Products,
    /// Strain, arc and force of each branch.
    pub branches: Vec<[Flat; FUNCTIONS]>,
    /// What points count of a whisker that is no cone of one material.
    weight: Option<Weight>,
    /// Bound on c/a − 1 over driveᵉ in the chart.
    pub most_arc: f32,
}

/// What points count of a whisker that is no cone of one material.
struct Own<'a, const FMA: bool> {
    weights: &'a Weight,
    at: [Lanes<FMA>; 3],
    variable: Lanes<FMA>,
}

impl<const FMA: bool> Part<FMA> for Own<'_, FMA> {
    type Out = Lanes<FMA>;

    #[inline(always)]
    fn run(self) -> Lanes<FMA> {
        self.weights.at(self.at, self.variable, Lanes::<FMA>::of, power)
    }
}

/// Powers, lane by lane.
#[inline(always)]
fn power<const FMA: bool>(mut x: Lanes<FMA>, n: f64) -> Lanes<FMA> {
    for x in &mut x.0 {
        *x = x.powf(n as f32);
    }
    x
}

impl Charted {
    /// Of `chart`; `drives` those at the points of series over the drive.
    pub fn new(chart: &DistanceChart, kind: Drive, drives: &[f64]) -> Self {
        let axes = chart.axes();
        let affine = |axis: &Axis| if axis.is_point() { [0.0; 2] } else { affine(axis.ends()) };
        let per_mm = if kind == Drive::Displacement { 1.0 / chart.a } else { 1.0 };
        let all = [Function::Strain, Function::Arc, Function::Force];
        let series = || chart.branches.iter().flat_map(|b| all.map(|f| &b.series[f as usize]));
        let sizes: Vec<[usize; AXES]> = series().map(|s| s.sizes()).collect();
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
            sizes: std::array::from_fn(|k| sizes.iter().map(|s| s[k]).max().unwrap_or(1)),
            at_points: drives.iter().map(|d| wide(&basis(ORDERS, place(d)))).collect(),
            branches: chart
                .branches
                .iter()
                .map(|b| all.map(|f| Flat::new(&b.series[f as usize], point(f), &mut products)))
                .collect(),
            products,
            most_arc: chart.branches.iter().map(arc).fold(0.0, f32::max),
        }
    }

    /// Chebyshev polynomials at the drive (with `OWN`), D/a and τa, and the means of those over x/a between the ends of a gauge.
    #[inline(always)]
    pub fn polynomials<const FMA: bool, const OWN: bool>(
        &self,
        [drive, near, base, taper, far]: &[Lanes<FMA>; AXES],
        basis: &mut [Vec<Lanes<FMA>>; AXES],
        products: &mut Values<FMA>,
    ) {
        basis[1][0] = Lanes::<FMA>::of(1.0);
        if OWN {
            read::polynomials(self.variable(0, *drive), self.sizes[0], &mut basis[0]);
        }
        read::polynomials(self.variable(2, *base), self.sizes[2], &mut basis[2]);
        read::polynomials(self.variable(3, *taper), self.sizes[3], &mut basis[3]);
        self.fold([*near, *far], [*base, *taper], &mut basis[4]);
        self.products.fill(basis, products);
    }

    /// The variable of axis `k`, in [−1, 1].
    #[inline(always)]
    fn variable<const FMA: bool>(&self, k: usize, q: Lanes<FMA>) -> Lanes<FMA> {
        let one = Lanes::<FMA>::of(1.0);
        let y = match self.maps[k] {
            Map::Linear => q,
            Map::Square => q * q,
            Map::Root => (one / (one - q)).sqrt(),
            Map::Inverse => one / (one - q),
            Map::Fourth => q.sqrt().sqrt(),
        };
        let [scale, shift] = self.affine[k].map(Pack::splat);
        y.mul_add(scale, shift)
    }

    /// Means over a gauge of the polynomials over x/a, so that they give its δ (see [`crate::gauge`]).
    #[inline(always)]
    fn fold<const FMA: bool>(
        &self,
        [near, far]: [Lanes<FMA>; 2],
        [base, p]: [Lanes<FMA>; 2],
        into: &mut [Lanes<FMA>],
    ) {
        let of = Lanes::<FMA>::of;
        let (one, width) = (of(1.0), far - near);
        let (mut total, mut whole, mut first) = (of(0.0), of(0.0), of(0.0));
        // Of each point: its weight, twice its variable, and two neighbouring polynomials there. All points go on together, so that none
        // waits for its own last product.
        let mut points = [[of(0.0); 4]; MOST_POINTS];
        let points = &mut points[..self.gauge.len().min(MOST_POINTS)];
        for (point, [place, weight]) in points.iter_mut().zip(&self.gauge) {
            let s = width.mul_add(Pack::splat(*place), near);
            let (u, x) = (one - p * s, self.variable(4, s));
            let weight = match &self.weight {
                None => Lanes::<FMA>::splat(*weight) / (u * u * u),
                Some(weights) => {
                    Lanes::<FMA>::splat(*weight) * apart(Own { weights, at: [base, p, s], variable: x })
                }
            };
            total = weight.mul_add(one - s, total);
            whole = whole + weight;
            first = weight.mul_add(x, first);
            *point = [weight, x + x, one, x];
        }
        let share = one / total;
        into[0] = whole * share;
        into[1] = first * share;
        for value in into.iter_mut().take(self.sizes[4]).skip(2) {
            let mut sum = of(0.0);
            for [weight, twice, last, this] in points.iter_mut() {
                (*last, *this) = (*this, *twice * *this - *last);
                sum = weight.mul_add(*this, sum);
            }
            *value = sum * share;
        }
    }
}
