//! Taps at many distances from those at a few charts, and their statistics as forms: see [`crate::between`].

use super::neighbours::Neighbours;
use super::rows::Rows;
use super::tap::Taps;
use super::{Lanes, ORDERS, Ranker};
use crate::between;
use crate::kernel::cpu::Packed;

const TOGETHER: usize = 4;

pub(super) const MOST_CHARTS: usize = 20;
const _: () = assert!(between::NODES[between::NODES.len() - 1] <= MOST_CHARTS);

#[derive(Debug)]
pub(super) struct Between {
    weights: Vec<Vec<[f32; TOGETHER]>>,
    mean: Vec<f32>,
    squares: Vec<Vec<f32>>,
    coefficients: Vec<Vec<f32>>,
    pub neighbours: Vec<Neighbours>,
}

impl Between {
    pub fn new(of: &between::Between, distances: &[f64]) -> Self {
        let narrow = |row: &Vec<f64>| -> Vec<f32> { row.iter().map(|x| *x as f32).collect() };
        let group = |group: &[Vec<f64>]| {
            let weight = |i: usize| std::array::from_fn(|d| group.get(d).map_or(0.0, |w| w[i] as f32));
            (0..of.mean.len()).map(weight).collect()
        };
        Self {
            weights: of.weights.chunks(TOGETHER).map(group).collect(),
            mean: narrow(&of.mean),
            squares: of.squares.iter().map(narrow).collect(),
            coefficients: of.coefficients.iter().map(narrow).collect(),
            neighbours: Neighbours::of(of, distances),
        }
    }

    #[inline(always)]
    pub fn fill<const FORCE: bool>(&self, charts: &Taps, with_arc: bool, taps: &mut Taps) {
        self.spread(&charts.kappa, &mut taps.kappa);
        if with_arc {
            self.spread(&charts.arc, &mut taps.arc);
        } else {
            for arc in &mut taps.arc {
                *arc = Lanes::of(0.0);
            }
        }
        if FORCE {
            self.spread(&charts.force, &mut taps.force);
        }
    }

    #[inline(always)]
    fn spread(&self, values: &[Lanes], into: &mut [Lanes]) {
        let m = values.len() / self.mean.len();
        for (weights, into) in self.weights.iter().zip(into.chunks_mut(TOGETHER * m)) {
            for k in 0..m {
                let mut sums = [Lanes::of(0.0); TOGETHER];
                for (weights, values) in weights.iter().zip(values.chunks_exact(m)) {
                    for (sum, weight) in sums.iter_mut().zip(weights) {
                        *sum = Lanes::splat(*weight).mul_add(values[k], *sum);
                    }
                }
                for (into, sum) in into.chunks_exact_mut(m).zip(sums) {
                    into[k] = sum;
                }
            }
        }
    }

    /// Adds to `into` the coefficients over the distances for `values` at the charts.
    #[inline(always)]
    pub fn over_distances<'a>(&self, values: &[Lanes], into: &'a mut [Lanes; MOST_CHARTS]) -> &'a [Lanes] {
        for (sum, row) in into.iter_mut().zip(&self.coefficients) {
            for (weight, value) in row.iter().zip(values) {
                *sum = Lanes::splat(*weight).mul_add(*value, *sum);
            }
        }
        &into[..self.mean.len()]
    }
}

impl Rows {
    #[inline(always)]
    pub(super) fn push_forms(&mut self, ranker: &Ranker, between: &Between, charts: &Taps) {
        let m = ranker.points;
        for (i, weight) in between.mean.iter().enumerate() {
            let (chart, weight) = (charts.at(i), Lanes::splat(*weight));
            self.largest = self.largest.max(chart.largest);
            for k in 0..m {
                self.mean[k] = weight.mul_add(chart.kappa[k], self.mean[k]);
            }
        }
        for row in &between.squares {
            let mut apart = [Lanes::of(0.0); ORDERS];
            for (i, factor) in row.iter().enumerate() {
                let (chart, factor) = (charts.at(i), Lanes::splat(*factor));
                for k in 0..m {
                    apart[k] = factor.mul_add(chart.kappa[k] - self.mean[k], apart[k]);
                }
            }
            self.spread(&apart, Lanes::of(1.0), m);
        }
    }
}
