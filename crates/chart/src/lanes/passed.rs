//! What the foil of a gauge passes on of the strain.

use super::{Lanes, Tables};
use crate::kernel::cpu::Packed;
use crate::physics::{solid::Bonded, taper::Taper};
use crate::scene::Tuple;

/// What the foil of a gauge passes on, as the readings that a chart knows have it: all of the strain.
pub(super) struct Passed {
    /// Lanes: readings of a chart are so many times too large. 1 without a foil.
    pub share: Lanes,
    /// Their largest value.
    pub limit: Lanes,
    /// K − 1 with which distances are told, where it is given.
    pub fixed: Option<Lanes>,
}

impl Passed {
    /// Of the designs `tuples`.
    #[inline(always)]
    pub fn new(tables: &Tables, tuples: &[Tuple]) -> Self {
        let (limit, fixed) = (Lanes::splat(tables.strain_limit), tables.fixed.map(Lanes::splat));
        let mut passed = Self { share: Lanes::of(1.0), limit, fixed };
        let Some(foil) = &tables.foil else { return passed };
        for (lane, t) in tuples.iter().enumerate() {
            let taper = Taper::new(t.D, t.d, t.L_a);
            let share = Bonded::new(foil, &taper, taper.gauge(t.x_ss, t.l), tables.modulus).transfer;
            let own = foil.strain_limit.map_or(f32::INFINITY, |own| (own / share) as f32);
            passed.share.0[lane] = share as f32;
            passed.limit.0[lane] = tables.strain_limit.min(own);
            if let (Some(given), Some(fixed)) = (&mut passed.fixed, tables.fixed) {
                given.0[lane] = (share * (1.0 + f64::from(fixed)) - 1.0) as f32;
            }
        }
        passed
    }
}
