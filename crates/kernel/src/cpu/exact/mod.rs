//! The exact rod (model §3): collocation in deviation form. Twin of `shaders/{exact,sweep,newton,gauge}.wgsl`: same functions and names.
//!
//! Unit of length is the contact distance, of force EI₀/a². In the frame of the contact, with its axis along the whisker, W is the force across and H
//! the force along the whisker, ψ the angle against the contact, c the contact arc and g² = 1 − τc. With w ∈ [0, 1] from contact to base, `y = 1 − (1
//! − g)w` and m = c/(1 + g) (so that (1 − τs)^(−1/2) = y/g is linear in w and nothing divides by τ):
//!
//! - ds = 2 g² m y⁻³ dw; the angles that W and H R_c alone would give are closed forms of w;
//! - Δξ = ∫(1 − (1 + e₀) cos ψ + γ sin ψ) ds shortens the lever arm c − s, η = ∫((1 + e₀) sin ψ + γ cos ψ) ds is the height;
//! - ψ = closed form − Δψ, Δψ = ∫(WΔξ − Hη − Mχ)/(1 − τs)⁴ ds, M the whole moment and χ the excess of the section law;
//! - N = H cos ψ − W sin ψ gives e₀ (off: 0 in the kinematics), Q = −H sin ψ − W cos ψ gives γ.
//!
//! Closure: V, from the motor's axis to the pole centre, must be Z₀ = (X₀, Y₀) turned by β = ψ_b − θ. With V = Z₀ + v it is V × R(β) Z₀ = 0 and X₀
//! v_x + Y₀ v_y + v²/2 = ζ. The part linear in W, H, x = c − 1 is a closed form at c = 1 (see `crate::onset`); its solution W₀,
//! H₀, x₀ comes with the tap. Iterated is the deviation W = W₀(1 + w), H = H₀ + W₀k, x = x₀ + z, from residuals in which every term is a small
//! correction: changes of closed forms with c are composed as growth factors (a + b + ab), 1 − cos and ψ − sin are series, so that K − 1 keeps its
//! relative precision in f32 for any small tap.
//!
//! One sweep evaluates all this from the last state and ends with a Newton step for (w, z), for (w, k) of a sticking contact, or for (w, k, z) of one
//! that rolls on a pole, x = ρ cos α (ϑ − ψ_b), whose Jacobian then includes the geometric stiffness. The iteration contracts by about θ² per sweep
//! at small angles and by 3 at 60°. It diverges where the force along a fine tip bends it as much as the force across: there the last rung lets the
//! lag settle over a few sweeps, which always converge for given forces (a Volterra equation), and its Jacobian includes the lag's response.

mod full;
mod gauge;
mod newton;
mod sweep;
mod tables;

use super::pack::{Packed, Scalar};
use crate::{Effects, Rule, Solution, Tap, rule::limits::*};
use gauge::{gauge, sensitivity, shares};
use sweep::{State, sweep};
pub use tables::{Tables, dot, series};

/// Change of the strain by changes of the two unknowns. A function: closures called twice lack the caller's instruction set.
#[inline(always)]
fn shows<P: Packed>(stick: bool, felt: [P; 2], moved: P, [force, other]: [P; 2]) -> P {
    if stick {
        return felt[0] * force.abs() + felt[1] * other.abs();
    }
    force.abs() + felt[0] * moved * other.abs()
}

/// Solves a pack of taps. `PLAIN`: all effects are off, at compile time.
#[inline(always)]
pub fn taps<P: Packed, const N: usize, const PLAIN: bool>(
    tables: &Tables<P::Scalar, N>,
    rule: &Rule,
    effects: &Effects,
    tolerance: f64,
    tap: &Tap<P>,
) -> Solution<P> {
    let of = P::of;
    let zero = of(0.0);
    let mut state = State {
        force: zero,
        along: zero,
        arc: zero,
        lag: [zero; N],
        angle: [zero; N],
        shortening: [zero; N],
        climb: [zero; N],
        bending: [zero; N],
        extra: [zero; N],
        steps: [zero; 2],
        noise: [zero; 2],
        rolled: zero,
        fold: of(1.0),
        base: zero,
        load: zero,
        beyond: zero,
    };
    let (mut error, mut last, mut rate, mut sweeps, mut rounded) = (of(1.0), of(1.0), zero, zero, zero);
    let stop = of(rule.stop(effects) * tolerance);
    let least = Rule::least(effects, tolerance);
    let [across, along, strains] = if PLAIN { [of(1.0); 3] } else { shares(effects, tap) };
    let (stick, felt) = (!PLAIN && effects.stick, [across, along]);
    let mut done = zero;
    for step in 1..=rule.sweeps {
        let before = state.clone();
        let stepping = step % rule.settle() == 0;
        sweep::<P, N, PLAIN>(tables, effects, rule, stepping, tap, &mut state);
        // A lane that is done keeps its state, so that no tap depends on its neighbours.
        state.keep(tables.nodes::<PLAIN>(), done, &before);
        if !stepping {
            continue;
        }
        let moved = sensitivity(!PLAIN && effects.offset, tap, tap.arc + state.arc);
        let mut change = shows(stick, felt, moved, state.steps);
        if !PLAIN && effects.rolls {
            change = change + across * moved * state.rolled.abs();
        }
        // Remaining error if the contraction continues: change · ρ/(1 − ρ). One good sweep is half believed.
        let expected = rate * last;
        let next =
            (change / last).max(of(0.5) * rate).min(of(rule.largest_rate())).max(of(rule.smallest_rate()));
        let open = |now, old| zero.if_less(done, old, now);
        rate = open(next, rate);
        last = open(change.max(of(TINY)), last);
        sweeps = sweeps + open(of(rule.settle().into()), zero);
        // A step may be small by chance where the two unknowns oscillate, or the lever grows during the iteration.
        let wary = change.max(of(CHANCE) * expected);
        let believed = match () {
            () if !PLAIN && (effects.offset || rule.full) => wary,
            () => (of(GROWN) * tap.near).if_less(tap.near + state.arc, wary, change),
        };
        error = open(believed * rate / (of(1.0) - rate), error);
        rounded = open(shows(stick, felt, moved, state.noise), rounded);
        if step >= least {
            done = stop.if_less(error, done, of(1.0));
            if of(1.0).all_at_most(done) {
                break;
            }
        }
    }
    if let Some(chart_error) = tables.chart_error() {
        // Errors of the section law show in the strains, and in the arc through the force and the angle.
        let x = tap.arc + state.arc;
        let turned = if effects.offset { tap.angle } else { tap.angle * tap.angle };
        let moved = across * (sensitivity(effects.offset, tap, x) - of(1.0)) * (x.abs() + turned);
        error = error + (strains + moved) * of(chart_error);
    }
    if PLAIN {
        let x = state.arc.abs() * of(ARC_ROUNDINGS * P::Scalar::ROUNDING);
        rounded =
            state.force.abs() * of(ROUNDINGS * P::Scalar::ROUNDING) + sensitivity(false, tap, state.arc) * x;
    }
    gauge::<P, N, PLAIN>(tables, rule, effects, tap, &state, [error, rounded, across], sweeps)
}
