//! The share of the strain of a chart that a gauge reads: less than all under a foil, and at a tilted pole.

use super::{Lanes, Ranker};
use crate::design;
use crate::kernel::cpu::Packed;
use crate::physics::{solid::Bonded, taper::Taper};
use crate::scene::Tuple;

/// Share of each design, and limits in terms of the strain that charts read.
pub(super) struct Passed {
    /// The share that the foil passes on, times cos² β of a pole of tilt β; 1 without a foil at an upright pole.
    pub share: Lanes,
    /// The strain limit, so scaled.
    pub limit: Lanes,
    /// K − 1 for the distances, if given, so scaled.
    pub fixed: Option<Lanes>,
}

impl Passed {
    #[inline(always)]
    pub fn new(ranker: &Ranker, tuples: &[Tuple]) -> Self {
        let setup = &ranker.scope.setup;
        let tilted = design::tilted(ranker.scope.direction)[1];
        let fixed = |share: f64| ranker.fixed.map(|given| (share * (1.0 + f64::from(given)) - 1.0) as f32);
        let mut passed = Self {
            share: Lanes::splat(tilted as f32),
            limit: Lanes::splat(ranker.strain_limit / tilted as f32),
            fixed: fixed(tilted).map(Lanes::splat),
        };
        let Some(foil) = &setup.gauge.foil else { return passed };
        for (lane, t) in tuples.iter().enumerate() {
            let taper = Taper::new(t.D, t.d, t.L_a);
            let of_foil =
                Bonded::new(foil, &taper, taper.gauge(t.x_ss, t.l), setup.model.material.e0()).transfer;
            let own = foil.strain_limit.map_or(f32::INFINITY, |own| (own / of_foil) as f32);
            passed.share.0[lane] = (tilted * of_foil) as f32;
            passed.limit.0[lane] = ranker.strain_limit.min(own) / tilted as f32;
            if let (Some(all), Some(fixed)) = (&mut passed.fixed, fixed(tilted * of_foil)) {
                all.0[lane] = fixed;
            }
        }
        passed
    }
}
