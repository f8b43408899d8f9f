//! Counts status words for a run of neighbouring distances at once where a bound shows that all have the same word.

use super::between::{Between, MOST_CHARTS};
use super::dispatch::part;
use super::rows::{Row, Rows};
use super::tally::{Tally, times};
use super::words::certain;
use super::{LANES, Lanes, Ranker, Scratch};
use crate::between;
use crate::kernel::cpu::Packed;
use crate::reduce::range;

/// Orders over the distances that are bounded group by group; higher ones are small, and count with their largest value.
const TOLD_APART: usize = 8;

const SAFE: f64 = 2e-6;

#[derive(Debug)]
pub(super) struct Neighbours {
    count: usize,
    weights: Vec<[f32; NEIGHBOURS]>,
    /// The nearest and the farthest distance of the group: 1/a, 1/mm, and its place among all.
    ends: [(f32, usize); 2],
    /// Middle and half-width of the range of each polynomial over the distances.
    basis: [[f32; 2]; TOLD_APART],
}

impl Neighbours {
    pub fn of(of: &between::Between, distances: &[f64]) -> Vec<Self> {
        let some = |from: usize| {
            let these = from..distances.len().min(from + NEIGHBOURS);
            let (a, basis, weights) =
                (&distances[these.clone()], &of.basis[these.clone()], &of.weights[these]);
            let end = |a: f64| ((1.0 / a) as f32, distances.iter().position(|one| *one == a).unwrap_or(from));
            let of_order = |k: usize| {
                let [lo, hi] = range(basis.iter().map(|t| t.get(k).copied().unwrap_or(0.0)));
                [(0.5 * (lo + hi)) as f32, (0.5 * (hi - lo) + SAFE) as f32]
            };
            let of_chart = |i: usize| std::array::from_fn(|n| weights.get(n).map_or(0.0, |w| w[i] as f32));
            Self {
                count: a.len(),
                weights: (0..of.mean.len()).map(of_chart).collect(),
                ends: range(a.iter().copied()).map(end),
                basis: std::array::from_fn(of_order),
            }
        };
        (0..distances.len()).step_by(NEIGHBOURS).map(some).collect()
    }
}

impl Rows {
    /// Adds the words of all distances at each design's drive if no contact can slip off and no reading is far from its calibration; else false.
    #[inline(always)]
    pub fn count_together(
        &self,
        ranker: &Ranker,
        row: &Row,
        scratch: &Scratch,
        tally: &mut Tally<'_>,
    ) -> bool {
        let Some(between) = &ranker.between else { return false };
        if ranker.by.is_some() || !self.still || !self.is_usual() {
            return false;
        }
        let of = Lanes::of;
        let (zero, one) = (of(0.0), of(1.0));
        let (limit, words, peak) = (self.passed.limit, &self.design.words, self.design.peak);
        let bounds = ([words.low, words.high, words.peak], words.unseen);
        let (strains, kappa) = (&scratch.taps.strain[..], &scratch.charts.kappa[..]);
        let calibration = row.power.mul_add(self.mean[0], one);
        let mut coefficients = [zero; MOST_CHARTS];
        let coefficients = between.over_distances(kappa, &mut coefficients);
        let mut rest = of(SAFE);
        for c in coefficients.iter().skip(TOLD_APART) {
            rest = rest + c.abs();
        }
        let (mut places, mut waiting) = ([Place::default(); PLACES], 0);
        for (n, group) in between.neighbours.iter().enumerate() {
            let (mut middle, mut around) = (zero, rest);
            for (c, [mid, half]) in coefficients.iter().zip(&group.basis) {
                middle = c.mul_add(Lanes::splat(*mid), middle);
                around = c.abs().mul_add(Lanes::splat(*half), around);
            }
            middle = row.power.mul_add(middle, one);
            around = row.power.mul_add(around, of(SAFE));
            let k = [middle - around, middle + around];
            // f rises up to its peak, and falls from there.
            let [near, far] = group.ends.map(|(inverse, _)| Lanes::splat(inverse));
            let (at_near, at_far) = (strains[group.ends[0].1], strains[group.ends[1].1]);
            let highest = at_near.max(at_far);
            let highest = far.if_less(peak, peak.if_less(near, words.peak.max(highest), highest), highest);
            let f = [at_near.min(at_far) * of(1.0 - SAFE), highest * of(1.0 + SAFE)];
            let least = f[0] * calibration / k[1];
            let results = certain(bounds, [least, zero.if_less(k[0], f[1] * calibration / k[0], of(1e30))]);
            let above = (limit * k[1]).if_less(f[0] * row.drive, one, zero);
            let below = (limit * k[0]).if_less(f[1] * row.drive, zero, one);
            let sure = (results[0] + results[1] + results[2]).min(above + below);
            tally.add(times(results, of(group.count as f64) * sure), [below, one], 0..1);
            if one.all_at_most(sure) {
                continue;
            }
            for lane in 0..self.live {
                if sure.0[lane] > 0.5 {
                    continue;
                }
                places[waiting] = Place { lane, group: n };
                waiting += 1;
                if waiting == places.len() {
                    part!(self.count_one_by_one(between, row, (strains, kappa, &places), tally));
                    waiting = 0;
                }
            }
        }
        if waiting > 0 {
            let places = &places[..waiting];
            part!(self.count_one_by_one(between, row, (strains, kappa, places), tally));
        }
        true
    }

    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    #[inline(never)]
    fn count_one_by_one(
        &self,
        between: &Between,
        row: &Row,
        (strains, kappa, places): (&[Lanes], &[Lanes], &[Place]),
        tally: &mut Tally<'_>,
    ) {
        let (zero, one) = (Lanes::of(0.0), Lanes::of(1.0));
        let mut f = one;
        for (part, place) in f.0.as_chunks_mut::<NEIGHBOURS>().0.iter_mut().zip(places) {
            let these = strains[place.group * NEIGHBOURS..].iter();
            part.iter_mut().zip(these).for_each(|(f, strain)| *f = strain.0[place.lane]);
        }
        let mut own = zero;
        for (i, value) in kappa.iter().enumerate() {
            let mut weights = zero;
            for (part, place) in weights.0.as_chunks_mut::<NEIGHBOURS>().0.iter_mut().zip(places) {
                *part = between.neighbours[place.group].weights[i];
            }
            own = weights.mul_add(picked(value, places), own);
        }
        let power = picked(&row.power, places);
        // Rounded as in `Rows::count` and `Rows::edges`.
        let q = (picked(&self.mean[0], places) - own) * power * (one / power.mul_add(own, one));
        let results = certain(self.design.words.picked(places).bounds(f), [q; 2]);
        let limit = picked(&self.passed.limit, places);
        let above = (limit * (one + power * own)).if_less(f * picked(&row.drive, places), one, zero);
        let below = one - above;
        for (taps, share) in tally.taps.iter_mut().zip(results) {
            for (sum, worn) in taps.iter_mut().zip([share * below, share * above]) {
                for (q, Place { lane, group }) in places.iter().enumerate() {
                    for at in q * NEIGHBOURS..q * NEIGHBOURS + between.neighbours[*group].count {
                        sum.0[*lane] += worn.0[at];
                    }
                }
            }
        }
    }
}

pub(super) const NEIGHBOURS: usize = 8;

pub(super) const PLACES: usize = LANES / NEIGHBOURS;

#[derive(Clone, Copy, Default)]
pub(super) struct Place {
    pub lane: usize,
    pub group: usize,
}

/// The values that `x` has in the lanes of `places`, each repeated for all of its neighbours.
#[inline(always)]
pub(super) fn picked(x: &Lanes, places: &[Place]) -> Lanes {
    let mut all = Lanes::of(0.0);
    for (part, place) in all.0.as_chunks_mut::<NEIGHBOURS>().0.iter_mut().zip(places) {
        *part = [x.0[place.lane]; NEIGHBOURS];
    }
    all
}
