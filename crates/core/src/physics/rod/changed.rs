//! Changes of a rod under a known contact force by distorting sections and a foil (model §8), by steps from its base on.

use std::array::from_fn;

use super::RodProblem;
use super::shoot::{Shooter, Unknowns};
use super::statics::{EndLoad, Whisker};
use crate::physics::real::Vector;
use crate::physics::section::SectionStrain;
use crate::physics::solid::FADES;
use crate::physics::tableau::{A, B, C, STAGES};
use crate::scene::model::Side;

/// Longest steps: under a gauge at the clamp, over D/p, p the rate at which the strain of the skin fades; and elsewhere, over the distance of the
/// object.
const STEPS: [f64; 2] = [0.8, 1.0 / 8.0];

/// Those at tolerances from `COARSE` on, by the classic method of order 4, whose four stages are fewer for short parts.
const LONG_STEPS: [f64; 2] = [0.025 * FADES, 1.0 / 18.0];
const COARSE: f64 = 1e-6;
const FOURTH: [Stage; 4] = [
    (&[], 0.0, 1.0 / 6.0),
    (&[(0, 0.5)], 0.5, 1.0 / 3.0),
    (&[(1, 0.5)], 0.5, 1.0 / 3.0),
    (&[(2, 1.0)], 1.0, 1.0 / 6.0),
];

/// Earlier stages and their weights, place within the step, and weight in the end.
type Stage = (&'static [(usize, f64)], f64, f64);

/// A force on the contact of a plain rod, seen from its base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Borne {
    /// N, along the rod at its base and across.
    pub force: Vector,
    /// A point of its line of action, mm from the base.
    pub through: Vector,
    /// The contact, mm from where the rod begins.
    pub arc: f64,
}

/// The changes of the rod.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Changed {
    /// Change of the mean strain under the gauge, positive as on the contact side, before the foil passes on its share.
    pub strain: f64,
    /// Turn of the base, rad, counterclockwise; its outer part stays.
    pub turn: f64,
    /// Displacement of the base, mm, along the plain rod at its base and across.
    pub place: [f64; 2],
}

impl Changed {
    /// No change.
    pub const NOTHING: Self = Self { strain: 0.0, turn: 0.0, place: [0.0; 2] };
}

impl RodProblem<'_> {
    /// The changes under `borne`, to the `tolerance` of strains; `law` has the strain of a section under N/R² and M/R³, MPa, or leaves it to the
    /// model. `None` where the material ends.
    pub fn changed(
        &self,
        borne: &Borne,
        law: &dyn Fn(f64, f64) -> Option<SectionStrain>,
        tolerance: f64,
    ) -> Option<Changed> {
        let Borne { force, through, arc } = *borne;
        let (held, _) = self.held();
        let mut rod = Shooter::with(&held, Unknowns::Slide(0.0), 1.0).whisker;
        rod.charted = Some(law);
        let (skin, foil, width) = (rod.skin.take(), rod.foil.take(), held.gauge[1] - held.gauge[0]);
        let gauge = held.gauge.map(|x| x.min(arc));
        // In the frame of the base σ is −s.
        let load = EndLoad { arc: 0.0, force, point: through };
        let eighth: [Stage; STAGES] = from_fn(|stage| (A[stage], C[stage], B[stage][0]));
        let ([faded, elsewhere], stages, order): (_, &[Stage], _) =
            if tolerance >= COARSE { (LONG_STEPS, &FOURTH, 4.0) } else { (STEPS, &eighth, 8.0) };
        // The error goes as e^(−px/D) and the step to the power of the order.
        let room = (FADES * self.gauge[0] / self.taper.D / order).exp();
        let (faded, elsewhere) = (faded / FADES * self.taper.D * room, elsewhere * through.x);
        let carry = |rod: &Whisker<'_>, mut y: [f64; 4], [from, to]: [f64; 2]| {
            let within = 0.5 * (from + to);
            let over = gauge[0] < within && within < gauge[1];
            let part = (over, (to - from).abs(), within, rod.bends(within));
            let longest = if over && rod.skin.is_some() { faded.min(elsewhere) } else { elsewhere };
            let n = (part.1 / longest).ceil();
            let h = (from - to) / n;
            for k in 0..n as usize {
                let mut rates = [[0.0; 4]; STAGES];
                for (stage, (shares, place, _)) in stages.iter().enumerate() {
                    let at =
                        from_fn(|i| shares.iter().fold(y[i], |y, (k, share)| y + h * share * rates[*k][i]));
                    rates[stage] = load.slope(rod, part, h * (k as f64 + place) - from, &at)?.rate;
                }
                y = from_fn(|i| {
                    stages.iter().zip(&rates).fold(y[i], |y, ((.., share), rate)| y + h * share * rate[i])
                });
            }
            Some(y)
        };
        let ends = foil.map_or([0.0; 2], |foil| foil.span.map(|x| x.clamp(0.0, arc)));
        let mut places = [0.0, gauge[0], gauge[1], ends[0], ends[1]];
        places.sort_by(f64::total_cmp);
        // Only a chart has a gauge that begins behind the rod.
        let mut y = carry(&rod, [0.0; 4], [0.0, places[0]])?;
        y[3] = 0.0;
        for part in places.windows(2) {
            y = carry(&rod, y, [part[0], part[1]])?;
        }
        let plain = -y[3];
        (rod.skin, rod.foil, y[3]) = (skin, foil, 0.0);
        for part in places.windows(2).rev() {
            y = carry(&rod, y, [part[1], part[0]])?;
        }
        let [turn, along, across, real] = y;
        let sign = if held.side == Side::Far { -1.0 } else { 1.0 };
        let strain = sign * (real - plain) / width;
        // Without a foil the base stays.
        Some(match foil {
            Some(_) => Changed { strain, turn, place: [along, across] },
            None => Changed { strain, ..Changed::NOTHING },
        })
    }
}
