//! Ranks designs, a pack at a time: a first look by rough charts, then in full where that does not decide.

use super::dispatch::by_lanes;
use super::rows::Rows;
use super::{Found, LANES, Ranker, Scratch};
use crate::scene::{Per, Tuple};

impl Ranker {
    /// Rows of the designs `ks`, all easy, that rank below `bound`; [`LANES`] at a time.
    pub(crate) fn rank(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        by_lanes!(self.has, self.rank_lanes(ks, tuples, bound, found));
    }

    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    fn rank_lanes(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        let (mut scratch, mut rows) = (Scratch::new(self), Rows::new());
        if self.apart {
            for (k, tuple) in ks.iter().zip(tuples) {
                self.rank_apart(*k, tuple, bound, (&mut rows, &mut scratch), found);
            }
            return;
        }
        let places = [0; LANES];
        let left = self.look((ks, tuples), bound, (&mut rows, &mut scratch), found);
        for left in left.chunks(LANES) {
            let n = left.len();
            let own: [usize; LANES] = std::array::from_fn(|lane| left[if lane < n { lane } else { 0 }]);
            let (ks, tuples) = (own.map(|at| ks[at]), own.map(|at| tuples[at]));
            if self.angles.is_empty() {
                rows.fill::<true, false>((self, &self.charts), n, &tuples, &mut scratch);
                rows.count_and_rank::<true>(self, (&ks[..n], &places), (bound, None), &mut scratch, found);
            } else {
                rows.fill::<false, false>((self, &self.charts), n, &tuples, &mut scratch);
                rows.count_and_rank::<false>(self, (&ks[..n], &places), (bound, None), &mut scratch, found);
            }
        }
    }

    /// A first look at designs that each have a drive: the places of those that rough charts do not decide, or that may rank below `bound`.
    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    fn look(
        &self,
        (ks, tuples): (&[u64], &[Tuple]),
        bound: f32,
        (rows, scratch): (&mut Rows, &mut Scratch),
        found: &mut Found,
    ) -> Vec<usize> {
        let (mut left, mut from) = (Vec::with_capacity(ks.len()), 0);
        // Stops where it decides too few designs to pay.
        while !self.rough.is_empty() && bound.is_finite() && from < ks.len() && 2 * left.len() <= from {
            let to = (from + LANES).min(ks.len());
            let before = left.len();
            rows.fill::<true, false>((self, &self.rough), to - from, &tuples[from..to], scratch);
            let asked = (&ks[from..to], &[0; LANES]);
            rows.count_and_rank::<true>(self, asked, (bound, Some(&mut left)), scratch, found);
            left[before..].iter_mut().for_each(|at| *at += from);
            from = to;
        }
        left.extend(from..ks.len());
        left
    }

    #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
    fn rank_apart(
        &self,
        k: u64,
        tuple: &Tuple,
        bound: f32,
        (rows, scratch): (&mut Rows, &mut Scratch),
        found: &mut Found,
    ) {
        let mut all = Found::default();
        for angles in self.angles.chunks(LANES) {
            let mut tuples = [*tuple; LANES];
            let mut places = [0; LANES];
            for ((tuple, place), angle) in tuples.iter_mut().zip(&mut places).zip(angles) {
                (tuple.drive, *place) = (angle.asked, angle.place);
            }
            let (ks, n) = ([k; LANES], angles.len());
            rows.fill::<true, false>((self, &self.charts), n, &tuples[..n], scratch);
            rows.count_and_rank::<true>(self, (&ks[..n], &places), (bound, None), scratch, &mut all);
            if !all.hard.is_empty() {
                found.hard.push(k);
                return;
            }
        }
        if self.scope.output.per == Per::Design {
            all.complete = all.complete.min(1);
            all.rows.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
            all.rows.truncate(1);
        }
        found.merge(all);
    }
}
