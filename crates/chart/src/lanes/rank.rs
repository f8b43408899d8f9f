//! Ranks designs, a pack at a time: a first look by rough charts, then in full what that does not tell.

use super::dispatch::{Work, by_lanes, work};
use super::rows::Rows;
use super::{Found, LANES, Lanes, Scratch, Tables};
use crate::scene::{Per, Tuple};

work! {
    /// [`Tables::rank`] for an instruction set.
    Rank: Tables.rank_lanes(ks: &'a [u64], tuples: &'a [Tuple], bound: f32, found: &'a mut Found) -> ()
}

impl Tables {
    /// Rows of the designs `ks`, all easy, that rank below `bound`; [`LANES`] at a time.
    pub fn rank(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        by_lanes(Rank { of: self, ks, tuples, bound, found });
    }

    #[inline(always)]
    fn rank_lanes<const SET: u8>(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        let (mut scratch, mut rows) = (Scratch::<SET>::new(self), Rows::new());
        if self.apart {
            for (k, tuple) in ks.iter().zip(tuples) {
                self.rank_apart(*k, tuple, bound, (&mut rows, &mut scratch), found);
            }
            return;
        }
        let places = [0; LANES];
        let left = self.look::<SET>((ks, tuples), bound, (&mut rows, &mut scratch), found);
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

    /// A first look at designs with drives of their own: the places of those that rough charts do not tell, or that may rank below `bound`.
    #[inline(always)]
    fn look<const SET: u8>(
        &self,
        (ks, tuples): (&[u64], &[Tuple]),
        bound: f32,
        (rows, scratch): (&mut Rows<Lanes<SET>>, &mut Scratch<SET>),
        found: &mut Found,
    ) -> Vec<usize> {
        let (mut left, mut from) = (Vec::with_capacity(ks.len()), 0);
        // Where it tells few designs it is not worth it.
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

    /// Rows of the design `k`, each read at its own drive.
    #[inline(always)]
    fn rank_apart<const SET: u8>(
        &self,
        k: u64,
        tuple: &Tuple,
        bound: f32,
        (rows, scratch): (&mut Rows<Lanes<SET>>, &mut Scratch<SET>),
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
        if self.per == Per::Design {
            all.complete = all.complete.min(1);
            all.rows.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
            all.rows.truncate(1);
        }
        found.merge(all);
    }
}
