//! Strains alone: of many upright taps of different whiskers, and by the closed form.

use super::outcome::{is_behind, off_gauge, signed};
use super::{Evaluator, Input, Method};
use crate::design::{is_tap, is_whisker};
use crate::error::SolveError;
use crate::kernel::{self, Effects, Solution, Tap, frames::Framed};
use crate::physics::linear::{StrainCurve, shear_length2};
use crate::physics::real::{Dual, Real};
use crate::physics::{driven::Driven, number::Number, taper::Taper};
use crate::progress::go_on;
use crate::scene::{Clamp, Contact, Geometry, Property, Setup, Signal, Tuple};

const FEW: usize = 3;

impl Evaluator<'_> {
    /// Strains of `framed`, bit-identical to [`Self::run`], and the places of taps left out: not framed, or not solved by the kernel alone.
    pub fn strains(&mut self, framed: &Framed, out: &mut [f64]) -> Result<Vec<usize>, SolveError> {
        go_on(self.stop)?;
        let Method::Fast { solver, ladder, tolerance } = &mut self.method else {
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
        let rungs = &ladder.rungs;
        let enough = kernel::solve(solver.as_mut(), effects, rungs, *tolerance, taps, &mut self.solutions)?;
        for ((&i, tap), solution) in those.iter().zip(taps).zip(&self.solutions) {
            if solution.is_told(enough) {
                out[i] = strain(self.setup, (x1[i], a[i]), tap, solution);
            } else {
                open.push(i);
            }
        }
        Ok(open)
    }
}

/// Strain of an upright tap of one gauge that begins at `x1`, mm, from its kernel's answer.
fn strain(setup: &Setup, (x1, a): (f64, f64), tap: &Tap, solution: &Solution) -> f64 {
    let arc = a * (1.0 + tap.moved(solution));
    if is_behind(arc) {
        return f64::NAN;
    }
    signed(setup, if off_gauge(x1, a, arc) { 0.0 } else { tap.strain(solution) })
}

/// True if [`closed`] gives the strains of `setup`: those of a cone in linear theory, read by one gauge.
pub fn is_closed(setup: &Setup) -> bool {
    let plain = setup.built.is_none() && setup.gauge.foil.is_none() && setup.rigs.is_none();
    let one = setup.signal == Signal::Strain && setup.channels.is_none() && !setup.gauge.second;
    setup.model.geometry == Geometry::Linear && setup.model.clamp == Clamp::Rigid && plain && one
}

/// The strain of the tap `t` by the closed form, bit-identical to an outcome's; None at a tilted pole.
#[inline]
pub fn closed(setup: &Setup, t: &Tuple) -> Option<f64> {
    if !t.direction().is_upright() {
        return None;
    }
    let [x1, x2] = Taper::new(t.D, t.d, t.L_a).gauge(t.x_ss, t.l);
    if !(is_whisker(t) && x1 < x2 && is_tap(setup.drive, t) && t.a > 0.0) {
        return Some(f64::NAN);
    }
    Some(signed(setup, if off_gauge(x1, t.a, t.a) { 0.0 } else { form(setup, numbers(setup, t)) }))
}

/// The closed form's inputs: D, d, L_a, x_ss, l, a (mm), the drive (rad or mm), the hub and ν.
fn numbers(setup: &Setup, t: &Tuple) -> [f64; 9] {
    let size = Driven::of_users(setup.drive, t.drive).size();
    [t.D, t.d, t.L_a, t.x_ss, t.l, t.a, size, setup.hub, setup.model.nu]
}

/// Strain on the contact side, of a contact beyond the gauge's near end.
#[inline(always)]
#[allow(non_snake_case)]
fn form<T: Real>(setup: &Setup, [D, d, L_a, x_ss, l, a, size, hub, nu]: [T; 9]) -> T {
    let taper = Taper::new(D, d, L_a);
    let shear = if setup.model.shear { shear_length2(&taper, nu) } else { T::of(0.0) };
    let curve = StrainCurve::new(taper, taper.gauge(x_ss, l), hub, setup.drive, shear);
    size * curve.of_cone(T::of(1.0) / a).0
}

/// [`closed`], and the derivatives of that strain by `inputs`, per mm, degree or unit of the key; None also for inputs that are not in the form.
pub fn closed_gradient(setup: &Setup, t: &Tuple, inputs: &[Input], slopes: &mut [f64]) -> Option<f64> {
    let strain = closed(setup, t)?;
    let place = |input: &Input| match *input {
        Input::Tuple(k @ ..=5) => Some((k, 1.0)),
        Input::Tuple(8) => Some((6, Driven::of_users(setup.drive, 1.0).size())),
        Input::Property(Property::Hub) => Some((7, 1.0)),
        Input::Property(Property::Nu) => Some((8, 1.0)),
        _ => None,
    };
    let x1 = t.x_ss;
    for (some, slopes) in inputs.chunks(FEW).zip(slopes.chunks_mut(FEW)) {
        let mut lifted = [Dual::<FEW>::of(0.0); 9];
        for (lifted, x) in lifted.iter_mut().zip(numbers(setup, t)) {
            lifted.value = x;
        }
        for (i, input) in some.iter().enumerate() {
            let (k, unit) = place(input)?;
            lifted[k].slope[i] = unit;
        }
        if strain.is_nan() || off_gauge(x1, t.a, t.a) {
            slopes.fill(strain);
            continue;
        }
        let found = form(setup, lifted).slope;
        slopes.iter_mut().zip(found).for_each(|(slope, found)| *slope = signed(setup, found));
    }
    Some(strain)
}
