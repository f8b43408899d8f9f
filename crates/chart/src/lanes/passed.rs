//! The share of the strain that a gauge's foil passes on.

use super::{Lanes, Ranker};
use crate::kernel::cpu::Packed;
use crate::physics::{solid::Bonded, taper::Taper};
use crate::scene::Tuple;

/// Foil share of each design, and limits in terms of all of the strain, which charts read.
pub(super) struct Passed {
    /// Share that the foil passes on; 1 without a foil.
    pub share: Lanes,
    /// The strain limit, so scaled.
    pub limit: Lanes,
    /// K − 1 for the distances, if given, so scaled.
    pub fixed: Option<Lanes>,
}

impl Passed {
    #[inline(always)]
    pub fn new(ranker: &Ranker, tuples: &[Tuple]) -> Self {
        let (limit, fixed) = (Lanes::splat(ranker.strain_limit), ranker.fixed.map(Lanes::splat));
        let mut passed = Self { share: Lanes::of(1.0), limit, fixed };
        let Some(foil) = &ranker.scope.setup.gauge.foil else { return passed };
        let modulus = ranker.scope.setup.model.material.e0();
        for (lane, t) in tuples.iter().enumerate() {
            let taper = Taper::new(t.D, t.d, t.L_a);
            let share = Bonded::new(foil, &taper, taper.gauge(t.x_ss, t.l), modulus).transfer;
            let own = foil.strain_limit.map_or(f32::INFINITY, |own| (own / share) as f32);
            passed.share.0[lane] = share as f32;
            passed.limit.0[lane] = ranker.strain_limit.min(own);
            if let (Some(given), Some(fixed)) = (&mut passed.fixed, ranker.fixed) {
                given.0[lane] = (share * (1.0 + f64::from(fixed)) - 1.0) as f32;
            }
        }
        passed
    }
}
