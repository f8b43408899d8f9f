//! A gauge as a weighted mean over Gauss–Legendre points of the skin: its strain over θ f is 1 + Σ ω_g δ(x_g)/Σ ω_g, weighted with the theory's
//! strain, at a point ~ (1 − s)/(1 − ps)³, s = x/a, p = τa, or as in [`crate::weight`]. A chart holds (1 − s) δ; under a foil, which stiffens the
//! rod, whole grids of one length by their middle.

use super::axis::{AXES, Quantity};
use super::distance::{DistanceChart, Function, room};
use crate::kernel::nodes::gauss;
use crate::scene::Setup;

const POINTS: [usize; 6] = [1, 2, 3, 4, 6, 8];

/// Points of the reference mean.
const EXACT: usize = 20;

/// Places of a gauge that a chart must hold: its ends; with a foil, its middle.
pub fn asked(setup: &Setup, [x1, x2]: [f64; 2]) -> [f64; 2] {
    match setup.gauge.foil {
        None => [x1, x2],
        Some(_) => [0.5 * (x1 + x2); 2],
    }
}

/// Gauges up to a width, and their quadrature points.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Largest (x2 − x1)/a.
    pub width: f64,
    /// Place between x1 (0) and x2 (1), and weight, of each point.
    pub points: Vec<[f64; 2]>,
    /// True if gauges are charted by their middle; arc and force then depend on it as the strain does.
    pub centred: bool,
}

impl Rule {
    fn new(width: f64, n: usize) -> Self {
        let (places, weights) = gauss(n);
        Self {
            width,
            centred: false,
            points: places.into_iter().zip(weights).map(|(place, weight)| [place, weight]).collect(),
        }
    }

    /// Grids charted by their middle.
    pub fn middle(width: f64) -> Self {
        Self { width, points: vec![[0.5, 1.0]], centred: true }
    }

    /// The fewest points that give the mean over gauges of `width` to `error`; `None` if eight are too few. Compares gauges at both ends and in the
    /// middle of the chart's points, at the corners of the other quantities.
    pub fn fewest(chart: &DistanceChart, width: f64, error: f64) -> Option<Self> {
        let exact = Self::new(width, EXACT);
        let ends = |quantity: Quantity| chart.axes()[quantity as usize].range;
        let [first, last] = ends(Quantity::Place);
        let width = width.min(last - first);
        let far = last - width;
        let mut gauges = Vec::new();
        for drive in ends(Quantity::Drive) {
            for base in ends(Quantity::Base) {
                for taper in ends(Quantity::Taper) {
                    gauges.extend(
                        [first, 0.5 * (first + far), far].map(|x| ([drive, 0.0, base, taper, x], x + width)),
                    );
                }
            }
        }
        let wanted: Vec<Vec<f64>> = gauges.iter().map(|(q, end)| exact.means(chart, q, *end)).collect();
        let close = |rule: &Self| {
            gauges.iter().zip(&wanted).all(|((q, end), wanted)| {
                rule.means(chart, q, *end).iter().zip(wanted).all(|(x, y)| (x - y).abs() <= error)
            })
        };
        POINTS.into_iter().map(|n| Self::new(exact.width, n)).find(close)
    }

    /// δ by each branch of `chart` of a gauge from the place of `q` to x/a = `end`.
    fn means(&self, chart: &DistanceChart, q: &[f64; AXES], end: f64) -> Vec<f64> {
        let [base, taper, place] = [Quantity::Base, Quantity::Taper, Quantity::Place].map(|q| q as usize);
        let scale = q[Quantity::Drive as usize].powi(chart.power);
        let (mut sums, mut total) = (vec![0.0; chart.branches.len()], 0.0);
        for [share, weight] in &self.points {
            let mut at = *q;
            at[place] += share * (end - q[place]);
            let x: [f64; AXES] = std::array::from_fn(|k| chart.axes()[k].place(at[k]));
            let weight = weight
                * match &chart.weight {
                    None => (1.0 - q[taper] * at[place]).powi(-3),
                    Some(own) => own.at([q[base], q[taper], at[place]], x[place], |x| x, f64::powf),
                };
            for (sum, branch) in sums.iter_mut().zip(&chart.branches) {
                *sum += weight * scale * branch.series[Function::Strain as usize].at(x);
            }
            total += weight * room(&at);
        }
        sums.into_iter().map(|sum| sum / total).collect()
    }
}
