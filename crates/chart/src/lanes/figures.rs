//! All figures of designs rows, each at its design's drive, and the values that a search limits.

use super::dispatch::by_lanes;
use super::estimate::Told;
use super::rows::{MOST, Rows};
use super::tally::{AMBIGUOUS, CLEAR, ROOTLESS, Tally};
use super::{LANES, Lanes, Scratch, Tables};
use crate::kernel::cpu::Packed;
use crate::kernel::ranking::{TOLD, WORN};
use crate::reduce::{Errors, Spread};
use crate::scene::Tuple;
use crate::statistics::DriveRow;
use crate::status::Status;

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

impl Tables {
    /// Figures of easy `tuples`; `None` of rows to be solved. Slipped-off contacts count as if the taper continued, so that figures are smooth.
    pub fn figures(&self, tuples: &[Tuple]) -> Vec<Option<Figures>> {
        by_lanes!(self.figures_lanes(tuples))
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
    fn figures(&self, tables: &Tables, scratch: &Scratch, out: &mut Vec<Option<Figures>>) {
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let taps = &scratch.taps;
        let [drive, power] = self.own;
        let limit = self.passed.limit;
        let mut tally = Tally::new(self.largest.if_less(Lanes::splat(MOST), zero, one));

        let [mut n, mut mean, mut spread] = [zero; 3];
        let [mut strain_max, mut force_max] = [zero; 2];
        let (mut nearest, mut farthest) = (of(1e30), zero);
        for (i, distance) in tables.distances.iter().enumerate() {
            let tap = taps.at(i);
            let a = Lanes::splat(distance.a);
            let deviation = power * tap.kappa[0];
            let strain = tap.strain * drive / (one + deviation);
            let moved = power * tap.arc[0];
            let force = self.linear_force(tables, distance) * (one + power * tap.force);
            n = n + one;
            let apart = tap.kappa[0] - mean;
            mean = mean + apart / n;
            spread = apart.mul_add(tap.kappa[0] - mean, spread);
            (strain_max, force_max) = (strain_max.max(strain), force_max.max(force));
            let arc = a + a * moved;
            (nearest, farthest) = (nearest.min(arc), farthest.max(arc));
        }

        let known = of(1.5).if_less(n, one, zero);
        let (calibration, known) = match self.passed.fixed {
            Some(fixed) => (fixed, one),
            None => (power * mean, known),
        };
        let [mut errors, mut squares, mut largest, mut noises, mut read] = [zero; 5];
        let noise = (one + calibration) * Lanes::splat(tables.noise) / drive / self.passed.share;
        for (i, distance) in tables.distances.iter().enumerate() {
            let tap = taps.at(i);
            let deviation = power * tap.kappa[0];
            let q = (calibration - deviation) / (one + deviation);
            let [low, high, peak] = self.design.words.bounds(tap);
            let told = Told::new(tables, (tap, distance), (q, peak, noise));
            let none = told.none;
            let least = self.design.words.farthest / tap.strain - one;
            let lost = q.if_less(least, one, told.lost);
            let out = q.if_less(self.design.end(distance.a) / tap.strain - one, one, zero);
            let near = known * q.if_less(low, zero, high.if_less(q, zero, one)) * (one - none);
            tally.hard = tally.hard.max(known * (one - none) * lost.max(out * (one - near)));
            let strain = tap.strain * drive / (one + deviation);
            let a = Lanes::splat(distance.a);
            let room = (self.design.length - a) * Lanes::splat(distance.inverse);
            let off = room.if_less(power * tap.arc[0], one, zero);
            let counted = known * (one - none);
            let error = zero - counted * told.error;
            let sigma = counted * told.sigma;
            errors = errors + error;
            squares = error.mul_add(error, squares);
            largest = largest.max(error.abs());
            noises = sigma.mul_add(sigma, noises);
            read = read + counted;
            let rootless = known * none;
            let over = limit.if_less(strain, one, zero);
            let worn = [(one - over) * (one - off), over * (one - off), (one - over) * off, over * off];
            for (told, share) in [(CLEAR, one - rootless.max(near)), (AMBIGUOUS, near), (ROOTLESS, rootless)]
            {
                tally.add(told, share, &worn);
            }
        }

        let highest = self.design.words.peak * drive;
        let peak = one / self.design.peak;
        let power2 = power * power;
        let asked = taps.len() as u64;
        for lane in 0..self.live {
            if tally.is_hard(lane) {
                out.push(None);
                continue;
            }
            let at = |x: &Lanes| f64::from(x.0[lane]);
            let mut status = Status::OK;
            for (told, estimated) in tally.taps.iter().zip(TOLD) {
                for (taps, word) in told.iter().zip(WORN.into_iter().chain([WORN[1] | WORN[2]])) {
                    if taps.0[lane] > 0.0 {
                        status |= estimated | word;
                    }
                }
            }
            let (counted, told) = (n.0[lane] as u64, read.0[lane] as u64);
            let known = known.0[lane] > 0.5;
            // The chart's K is of the strain before the foil: divide by the foil's share.
            let share = at(&self.passed.share);
            let mean = at(&power) * at(&mean);
            let mean = if share == 1.0 { mean } else { (1.0 + mean) / share - 1.0 };
            let row = DriveRow::of(
                [asked, told],
                Spread::of(counted, mean, at(&power2) * at(&spread) / (share * share)),
                [share * at(&strain_max), at(&force_max)],
                [
                    Errors::of(told, [at(&errors), at(&squares), at(&largest)]),
                    Errors::of(told, [f64::NAN, at(&noises), f64::NAN]),
                ],
                known.then(|| (1.0 + at(&calibration)) / share),
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
