//! All figures of designs rows, each at its design's drive, and the values that a search limits.

use rayon::prelude::*;

use super::dispatch::by_lanes;
use super::estimate::Told;
use super::rows::{MOST, Rows};
use super::tally::Tally;
use super::words::certain;
use super::{LANES, Lanes, Ranker, Scratch};
use crate::kernel::cpu::Packed;
use crate::kernel::ranking::{COMBINED, Case, combined};
use crate::reduce::{Errors, Spread};
use crate::scene::Tuple;
use crate::statistics::DriveRow;
use crate::status::Status;

const ROWS_EACH: usize = 1024;

/// Figures of a designs row, from charts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// The row.
    pub row: DriveRow,
    /// Smallest and largest contact arc of all its taps, mm.
    pub arc: [f64; 2],
    /// Distance at which the strain of the theory peaks, mm, and that strain at this drive.
    pub peak: [f64; 2],
}

impl Ranker {
    /// Rows of `tuples`, each at its own drive; `None` of those that must be solved. Slipped-off contacts count as if the taper continued, so that figures
    /// are smooth.
    pub fn figures(&self, tuples: &[Tuple]) -> Vec<Option<Figures>> {
        let part = |tuples: &[Tuple]| {
            let easy: Vec<usize> =
                (0..tuples.len()).filter(|&i| self.case(&tuples[i]) == Case::Easy).collect();
            let these: Vec<Tuple> = easy.iter().map(|&i| tuples[i]).collect();
            let (mut all, found) =
                (vec![None; tuples.len()], by_lanes!(self.has, self.figures_lanes(&these)));
            easy.into_iter().zip(found).for_each(|(i, figures)| all[i] = figures);
            all
        };
        tuples.par_chunks(ROWS_EACH).flat_map_iter(part).collect()
    }

    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    fn figures_lanes(&self, tuples: &[Tuple]) -> Vec<Option<Figures>> {
        let (mut scratch, mut rows) = (Scratch::new(self), Rows::new());
        let mut out = Vec::with_capacity(tuples.len());
        for tuples in tuples.chunks(LANES) {
            rows.fill::<true, true>((self, &self.charts), tuples.len(), tuples, &mut scratch);
            rows.figures(self, &scratch, &mut out);
        }
        out
    }
}

impl Rows {
    #[inline(always)]
    fn figures(&self, ranker: &Ranker, scratch: &Scratch, out: &mut Vec<Option<Figures>>) {
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let (taps, row) = (&scratch.taps, self.row::<true>(ranker, 0));
        let mut tally = Tally::new(self.largest.if_less(Lanes::splat(MOST), zero, one), &mut []);
        let [mut strain_max, mut force_max, mut farthest] = [zero; 3];
        let mut nearest = of(1e30);
        let [mut errors, mut squares, mut largest, mut noises, mut read] = [zero; 5];
        let (noise, words) = (self.noise(ranker, &row), &self.design.words);
        for (i, distance) in ranker.distances.iter().enumerate() {
            let (tap, a) = (taps.at(i), Lanes::splat(distance.a));
            let (moved, q) = (row.power * tap.arc[0], self.miss(&row, tap, 1));
            let strain = tap.strain * row.drive / (one + row.power * tap.kappa[0]);
            let force = self.linear_force(ranker, distance) * (one + row.power * tap.force);
            (strain_max, force_max) = (strain_max.max(strain), force_max.max(force));
            let arc = a + a * moved;
            (nearest, farthest) = (nearest.min(arc), farthest.max(arc));

            let bounds = words.bounds(tap.strain);
            let told = Told::new(ranker, (tap, distance), (q, bounds.0[2], noise));
            let results = certain(bounds, [q; 2]);
            let counted = one - told.none;
            let lost = q.if_less(words.farthest / tap.strain - one, one, told.lost);
            let out = q.if_less(self.design.end(distance.a) / tap.strain - one, one, zero);
            tally.hard = tally.hard.max(counted * lost.max(out * (one - results[1])));
            let (error, sigma) = (zero - counted * told.error, counted * told.sigma);
            errors = errors + error;
            squares = error.mul_add(error, squares);
            largest = largest.max(error.abs());
            noises = sigma.mul_add(sigma, noises);
            read = read + counted;
            let room = (self.design.length - a) * Lanes::splat(distance.inverse);
            let edges = [self.passed.limit.if_less(strain, zero, one), room.if_less(moved, zero, one)];
            tally.add(results, edges, 0..1);
        }

        let highest = words.peak * row.drive;
        let peak = one / self.design.peak;
        let calibration = self.calibration(&row, 1);
        let asked = taps.len() as u64;
        for lane in 0..self.live {
            if tally.is_hard(lane) {
                out.push(None);
                continue;
            }
            let at = |x: &Lanes| f64::from(x.0[lane]);
            let noted = (0..COMBINED).filter(|k| tally.taps[k / 4][k % 4].0[lane] > 0.0);
            let status = noted.fold(Status::OK, |all, k| all | combined(k));
            let told = read.0[lane] as u64;
            // The chart's K is of the strain before the foil: divide by the foil's share.
            let (share, power) = (at(&self.passed.share), at(&row.power));
            let mean = power * at(&self.mean[0]);
            let mean = if share == 1.0 { mean } else { (1.0 + mean) / share - 1.0 };
            let row = DriveRow::of(
                [asked, told],
                Spread::of(asked, mean, power * power * at(&self.spread[0]) / (share * share)),
                [share * at(&strain_max), at(&force_max)],
                [
                    Errors::of(told, [at(&errors), at(&squares), at(&largest)]),
                    Errors::of(told, [f64::NAN, at(&noises), f64::NAN]),
                ],
                Some((1.0 + at(&calibration)) / share),
                status,
            );
            out.push(Some(Figures {
                row,
                arc: [at(&nearest), at(&farthest)],
                peak: [at(&peak), at(&highest)],
            }));
        }
    }
}
