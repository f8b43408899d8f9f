//! Strains alone: of many upright taps of whiskers of their own, and by the closed form.

use super::outcome::{is_behind, off_gauge, signed};
use super::{Evaluator, Method};
use crate::design::{amount, is_tap, is_whisker};
use crate::error::SolveError;
use crate::kernel::{self, Effects, Solution, Tap, frames::Framed};
use crate::physics::linear::{StrainCurve, shear_length2};
use crate::physics::taper::Taper;
use crate::scene::{Clamp, Contact, Geometry, Setup, Signal, Tuple};

impl Evaluator<'_> {
    /// Strains of `framed`, to the bits of [`Self::run`], and the places of those left out: taps that are not framed, and those of which the kernel
    /// alone cannot tell.
    pub fn strains(&mut self, framed: &Framed, out: &mut [f64]) -> Result<Vec<usize>, SolveError> {
        self.go_on()?;
        let Method::Fast { solver, rungs, tolerance } = &mut self.method else {
            return Ok((0..out.len()).collect());
        };
        let Framed { columns: [_, _, _, x1, _, a, _], taps, whole } = framed;
        let (those, mut open): (Vec<usize>, Vec<usize>) = (0..out.len()).partition(|&i| whole[i]);
        let taps = match open.as_slice() {
            [] => taps,
            _ => {
                self.taps.clear();
                self.taps.extend(those.iter().map(|&i| taps[i]));
                &self.taps
            }
        };
        let model = &self.setup.model;
        let effects = Effects::new(model, self.setup.gauge.side, model.contact == Contact::Stick);
        kernel::solve(solver.as_mut(), effects, rungs, *tolerance, taps, &mut self.solutions)?;
        for ((&i, tap), solution) in those.iter().zip(taps).zip(&self.solutions) {
            if solution.is_told(*tolerance) && !solution.ended() {
                out[i] = strain(self.setup, (x1[i], a[i]), tap, solution);
            } else {
                open.push(i);
            }
        }
        Ok(open)
    }
}

/// Strain of an upright tap of one gauge that begins at `x1`, mm, from its kernel's answer.
fn strain(setup: &Setup, (x1, a): (f64, f64), tap: &Tap<f64>, solution: &Solution<f64>) -> f64 {
    let arc = a * (1.0 + tap.moved(solution));
    if is_behind(arc) {
        return f64::NAN;
    }
    signed(setup, if off_gauge(x1, a, arc) { 0.0 } else { tap.strain(solution) })
}

/// Whether [`closed`] knows the strains of `setup`: those of a cone in linear theory, read by one gauge.
pub fn is_closed(setup: &Setup) -> bool {
    let plain = setup.built.is_none() && setup.gauge.foil.is_none() && setup.rigs.is_none();
    let one = setup.signal == Signal::Strain && setup.channels.is_none() && !setup.gauge.second;
    setup.model.geometry == Geometry::Linear && setup.model.clamp == Clamp::Rigid && plain && one
}

/// The strain of the tap `t` by the closed form alone, to the bits of an outcome's; none where the pole is not upright.
pub fn closed(setup: &Setup, t: &Tuple) -> Option<f64> {
    if !t.direction().is_upright() {
        return None;
    }
    let taper = Taper::new(t.D, t.d, t.L_a);
    let gauge = taper.gauge(t.x_ss, t.l);
    if !(is_whisker(t) && gauge[0] < gauge[1] && is_tap(setup.drive, t) && t.a > 0.0) {
        return Some(f64::NAN);
    }
    let shear = if setup.model.shear { shear_length2(&taper, setup.model.nu) } else { 0.0 };
    let strain = amount(setup.drive, t.drive)
        * StrainCurve::new(taper, gauge, setup.hub, setup.drive, shear).value(t.a);
    Some(signed(setup, if off_gauge(gauge[0], t.a, t.a) { 0.0 } else { strain }))
}
