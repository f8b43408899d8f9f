//! The best rows of a pack.

use super::estimate::Floor;
use super::groups::{Group, TOGETHER};
use super::rows::{MOST, Rows};
use super::tally::{Tally, sum};
use super::{Found, LANES, Lanes, Ranker, Scratch};
use crate::kernel::cpu::Packed;
use crate::scene::Per;

/// Safety factor for rounding in a rough look.
const SAFE: f64 = 1.01;

impl Rows {
    /// Lower bound on the spread of K at the drives of `group`, times √(n − 1).
    #[inline(always)]
    fn least_spread(&self, group: &Group, m: usize) -> Lanes {
        let zero = Lanes::of(0.0);
        let (mut sum, mut apart) = (zero, zero);
        let [middle, around] = &group.products;
        for at in 0..m * (m + 1) / 2 {
            sum = self.spread[at].mul_add(Lanes::splat(middle[at]), sum);
            apart = self.spread[at].abs().mul_add(Lanes::splat(around[at]), apart);
        }
        Lanes::splat(group.powers[0]) * (sum - apart).max(zero).sqrt()
    }

    /// Counts the words of all taps and adds the rows below `bound`. A rough look adds undecided lanes, and those that may be below, to `left`.
    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    #[inline(never)]
    pub fn count_and_rank<const OWN: bool>(
        &self,
        ranker: &Ranker,
        (ks, places): (&[u64], &[u32; LANES]),
        (bound, left): (f32, Option<&mut Vec<usize>>),
        scratch: &mut Scratch,
        found: &mut Found,
    ) {
        let of = Lanes::of;
        let (m, drives) = (ranker.orders::<OWN>(), ranker.drives::<OWN>());
        let estimates = ranker.by.is_some();
        let most = Lanes::splat(if OWN { MOST } else { ranker.largest() });
        let mut rootless = std::mem::take(&mut scratch.rootless);
        rootless.clear();
        rootless.resize(if estimates && !OWN { drives } else { 0 }, of(0.0));
        let mut tally = Tally::new(self.largest.if_less(most, of(0.0), of(1.0)), &mut rootless);
        // First drive at which any tap of the design has slipped: from there its rows are not complete.
        let mut complete = of(drives as f64);
        let last = self.row::<OWN>(ranker, drives - 1);
        if !(OWN && self.count_together(ranker, &last, scratch, &mut tally)) {
            if OWN {
                self.read_between::<false>(ranker, scratch);
            }
            let Scratch { taps, edges, .. } = &mut *scratch;
            edges.clear();
            for (i, distance) in ranker.distances.iter().enumerate() {
                let edge = self.edges::<OWN>(ranker, (taps.at(i), distance), &last, &mut tally.hard);
                complete = complete.min(edge[1]);
                edges.push(edge);
            }
            let known = self.calibration_of::<OWN>(ranker, taps, complete);
            for (i, (edge, distance)) in edges.iter().zip(&ranker.distances).enumerate() {
                self.count::<OWN>(ranker, (taps.at(i), distance.a, *edge), (complete, &known), &mut tally);
            }
        }
        let taps = &scratch.taps;

        let scale = if ranker.elongation() { self.design.gauge[1] - self.design.gauge[0] } else { of(1.0) };
        let scale = scale * of((1.0 / (taps.len() as f64 - 1.0)).sqrt()) / self.passed.share;
        let (bound, never) = (Lanes::splat(bound), of(f64::INFINITY));
        let mut best = [never, of(0.0)];
        let mut rows_complete = if OWN && estimates { of(0.0) } else { complete };
        for (j, rootless) in tally.rootless.iter().enumerate() {
            rows_complete = rows_complete - of(j as f64).if_less(complete, *rootless, of(0.0));
        }
        let floor = match ranker.by {
            Some(by) if !OWN && Floor::pays(ranker, by) => Some(Floor::new(ranker, self, taps)),
            _ => None,
        };
        let start = found.rows.len();
        let mut none_below = false;
        for j in 0..drives {
            if !OWN && !estimates {
                if j % TOGETHER == 0 {
                    let group = &ranker.groups[1 + j / TOGETHER];
                    none_below = bound.all_at_most(self.least_spread(group, m) * scale);
                }
                if none_below {
                    continue;
                }
            }
            let place = of(j as f64);
            let mut rank = if let Some(by) = ranker.by {
                let row = self.row::<OWN>(ranker, j);
                if let Some(floor) = &floor {
                    let out =
                        tally.rootless[j].max(tally.hard).max(place.if_less(complete, of(0.0), of(1.0)));
                    let least = of(0.5).if_less(out, never, floor.at(ranker, &row, by));
                    if (bound * bound).all_at_most(least) {
                        continue;
                    }
                }
                let (rank, whole) = self.estimate(ranker, &row, taps, by);
                let whole = place.if_less(complete, whole, of(0.0));
                if OWN {
                    rows_complete = rows_complete + whole;
                }
                of(0.5).if_less(whole, rank, never)
            } else if OWN {
                self.own[1] * self.spread[0].max(of(0.0)).sqrt() * scale
            } else {
                let a = &ranker.angles[j];
                let mut sum = self.spread[0] * Lanes::splat(a.products[0]);
                for at in 1..m * (m + 1) / 2 {
                    sum = self.spread[at].mul_add(Lanes::splat(a.products[at]), sum);
                }
                Lanes::splat(a.stroke.power) * sum.max(of(0.0)).sqrt() * scale
            };
            if !estimates {
                rank = place.if_less(complete, rank, never);
            }
            if left.is_some() {
                // The spread is a norm: its error is at most the norm of the missing terms.
                let least = rank - of(SAFE) * self.own[1] * self.slack[1].sqrt() * scale;
                tally.hard = tally.hard.max(least.if_less(bound, of(1.0), of(0.0)));
            }
            match ranker.scope.output.per {
                Per::Row if bound.all_at_most(rank) => {}
                Per::Row => {
                    for lane in 0..self.live {
                        let place = if OWN { places[lane] } else { ranker.angles[j].place };
                        if rank.0[lane] < bound.0[lane] && !tally.is_hard(lane) {
                            found.rows.push((rank.0[lane], ks[lane], place));
                        }
                    }
                }
                Per::Design => {
                    best[1] = rank.if_less(best[0], place, best[1]);
                    best[0] = rank.min(best[0]);
                }
            }
        }
        let counts = tally.counts(self.live);
        found.words.add(&tally.words(counts));
        found.complete += match ranker.scope.output.per {
            Per::Row => sum(rows_complete * counts),
            Per::Design => sum(of(0.0).if_less(rows_complete, counts, of(0.0))),
        };
        if ranker.scope.output.per == Per::Design && !bound.all_at_most(best[0]) {
            let listed = |lane: &usize| best[0].0[*lane] < bound.0[*lane] && !tally.is_hard(*lane);
            for lane in (0..self.live).filter(listed) {
                let j = best[1].0[lane] as usize;
                let place = if OWN { places[lane] } else { ranker.angles[j].place };
                found.rows.push((best[0].0[lane], ks[lane], place));
            }
        }
        if let Some(left) = left {
            left.extend((0..self.live).filter(|&lane| tally.is_hard(lane)));
        } else if (0..self.live).any(|lane| tally.is_hard(lane)) {
            let mut at = start;
            while at < found.rows.len() {
                let lane = ks.iter().position(|&k| k == found.rows[at].1);
                if lane.is_some_and(|lane| tally.is_hard(lane)) {
                    found.rows.swap_remove(at);
                } else {
                    at += 1;
                }
            }
            found.hard.extend((0..self.live).filter(|&lane| tally.is_hard(lane)).map(|lane| ks[lane]));
        }
        scratch.rootless = rootless;
    }
}
