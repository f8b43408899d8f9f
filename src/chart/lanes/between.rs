//! Taps at many distances from those at a few charts, and their statistics as forms: see [`crate::chart::between`].

use super::rows::Rows;
use super::tap::Tap;
use super::{Lanes, ORDERS, Tables};
use crate::chart::between;

/// [`between::Between`] in single precision.
#[derive(Debug)]
pub(super) struct Between {
    weights: Vec<Vec<f32>>,
    mean: Vec<f32>,
    squares: Vec<Vec<f32>>,
}

fn narrow(rows: &[Vec<f64>]) -> Vec<Vec<f32>> {
    rows.iter().map(|row| row.iter().map(|x| *x as f32).collect()).collect()
}

impl Between {
    pub fn new(of: &between::Between) -> Self {
        let mean = of.mean.iter().map(|x| *x as f32).collect();
        Self { weights: narrow(&of.weights), mean, squares: narrow(&of.squares) }
    }

    /// Taps at all distances from those at the charts.
    #[inline(always)]
    pub fn fill<const FMA: bool, const FORCE: bool>(
        &self,
        charts: &[Tap<Lanes<FMA>>],
        (m, with_arc): (usize, bool),
        taps: &mut [Tap<Lanes<FMA>>],
    ) {
        let zero = Lanes::<FMA>::of(0.0);
        for (tap, weights) in taps.iter_mut().zip(&self.weights) {
            tap.force = zero;
            for k in 0..m {
                (tap.kappa[k], tap.arc[k]) = (zero, zero);
            }
            for (chart, weight) in charts.iter().zip(weights) {
                let weight = Lanes::<FMA>::splat(*weight);
                for k in 0..m {
                    tap.kappa[k] = weight.mul_add(chart.kappa[k], tap.kappa[k]);
                }
                if with_arc {
                    for k in 0..m {
                        tap.arc[k] = weight.mul_add(chart.arc[k], tap.arc[k]);
                    }
                }
                if FORCE {
                    tap.force = weight.mul_add(chart.force, tap.force);
                }
            }
        }
    }
}

impl<const FMA: bool> Rows<Lanes<FMA>> {
    /// Takes all distances as forms of the taps at the charts.
    #[inline(always)]
    pub(super) fn push_forms(&mut self, tables: &Tables, between: &Between, charts: &[Tap<Lanes<FMA>>]) {
        let m = tables.points;
        for (chart, weight) in charts.iter().zip(&between.mean) {
            let weight = Lanes::<FMA>::splat(*weight);
            self.largest = self.largest.max(chart.largest);
            for k in 0..m {
                self.mean[k] = weight.mul_add(chart.kappa[k], self.mean[k]);
            }
        }
        for row in &between.squares {
            let mut apart = [Lanes::<FMA>::of(0.0); ORDERS];
            for (chart, factor) in charts.iter().zip(row) {
                let factor = Lanes::<FMA>::splat(*factor);
                for k in 0..m {
                    apart[k] = factor.mul_add(chart.kappa[k] - self.mean[k], apart[k]);
                }
            }
            self.spread(&apart, &apart, m);
        }
    }
}
