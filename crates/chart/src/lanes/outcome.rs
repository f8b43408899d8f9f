//! Single taps read in lanes.

use super::choice::Choice;
use super::dispatch::by_lanes;
use super::read::{Basis, Values};
use super::{Charted, LANES, Lanes, powered};
use crate::axis::AXES;
use crate::distance::{DistanceChart, FUNCTIONS, Function};
use crate::kernel::cpu::{Pack, Packed, Vectors};
use crate::scene::Drive;

/// A tap read from a chart: δ = ε/(θ f) − 1, c/a − 1, and P over that of the linear theory, less 1; and T/(μP), where the contact chooses.
pub type Read = ([f32; FUNCTIONS], f32);

/// Charts of some distances, to be read at single taps.
#[derive(Debug)]
pub struct Readings {
    /// The charts, all of one model.
    pub of: Vec<DistanceChart>,
    charts: Vec<Charted>,
    choice: Choice,
    displaced: bool,
    has: Vectors,
}

impl Readings {
    /// Reads the charts `of` one model.
    pub fn new(of: Vec<DistanceChart>, kind: Drive, has: Vectors) -> Self {
        let charts = of.iter().map(|chart| Charted::new(chart, kind, &[])).collect();
        Self { of, charts, choice: Choice::new(), displaced: kind == Drive::Displacement, has }
    }

    /// Taps at distance `i`; drive (rad or mm), x1/a, D/a, τa and x2/a of each, within its chart.
    pub fn read(&self, i: usize, quantities: &[[f64; AXES]]) -> Vec<Read> {
        by_lanes!(self.has, self.read_lanes(i, quantities))
    }

    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    fn read_lanes(&self, i: usize, quantities: &[[f64; AXES]]) -> Vec<Read> {
        let mut out = Vec::with_capacity(quantities.len());
        let chart = &self.charts[i];
        let of = Lanes::of;
        let mut basis: Basis = [[of(0.0); _]; _];
        let mut products = Values::new([&chart.products].into_iter());
        for part in quantities.chunks(LANES) {
            let mut columns = [[0.0f32; LANES]; AXES];
            for lane in 0..LANES {
                let q = &part[if lane < part.len() { lane } else { 0 }];
                for (column, q) in columns.iter_mut().zip(q) {
                    column[lane] = *q as f32;
                }
            }
            let mut q = columns.map(Pack::new);
            let drive = q[0];
            if self.displaced {
                q[0] = drive * Lanes::splat(chart.inverse);
            }
            chart.polynomials::<true>(&q, Function::Force, &mut basis, &mut products);
            let (functions, share) = self.choice.read::<true>(&chart.functions, true, &products);
            let power = Lanes::splat(chart.scale) * powered(drive, self.of[i].power);
            let [strain, arc, force] = functions;
            let functions = [strain * power, arc * power, force * power];
            out.extend((0..part.len()).map(|lane| (functions.map(|f| f.0[lane]), share.0[lane])));
        }
        out
    }
}
