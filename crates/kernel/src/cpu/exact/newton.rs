//! The Newton step of a contact whose force does not simply act across the centreline. Twin of `shaders/newton.wgsl`.

use super::super::pack::Packed;
use super::sweep::State;
use super::tables::Tables;
use crate::{Effects, Tap, rule::limits::*};

pub struct Bent<P, const N: usize> {
    pub y: [P; N],
    /// y⁻³ at the nodes.
    pub density: [P; N],
    pub w_force: P,
    pub contact_radius: P,
    /// c − 1.
    pub x: P,
    /// ψ at the base.
    pub base: P,
    /// V, from the motor's axis to the pole centre.
    pub pole: [P; 2],
    /// Z₀.
    pub centre: [P; 2],
    /// 1 − cos β.
    pub cosine: P,
    /// β − sin β.
    pub sine: P,
}

pub struct Step<P> {
    /// Steps of w and of z.
    pub steps: [P; 2],
    pub noise: [P; 2],
    /// Determinant of the Jacobian: its sign changes at a fold of the path from the unloaded rod.
    pub fold: P,
}

/// The step of w and of z from the residuals of V × R(β)Z₀ = 0 and (V² − Z₀²)/2 = 0, and from their `noise`. A unit of W or c turns the rod by ∂ψ(s), which
/// moves V by −∫sin ψ ∂ψ ds and ∫cos ψ ∂ψ ds.
#[inline(always)]
pub fn step<P: Packed, const N: usize>(
    tables: &Tables<P::Scalar, N>,
    effects: &Effects,
    tap: &Tap<P>,
    state: &State<P, N>,
    bent: &Bent<P, N>,
    [across, along]: [P; 2],
    noise: [P; 2],
) -> Step<P> {
    let of = P::of;
    let (zero, one, two) = (of(0.0), of(1.0), of(2.0));
    let c = one + bent.x;
    let g2 = (tap.rest - tap.taper * bent.x).max(of(APEX) * tap.rest);
    let m = c / (one + g2.sqrt());
    let ig2 = one / g2;
    let (g4, ds) = (ig2 * ig2, two * g2 * m);
    let (mut turn1, mut climb1, mut turn2, mut climb2) = (zero, zero, zero, zero);
    for i in 0..tables.nodes::<false>() {
        let angle = state.angle[i];
        let weight = bent.density[i] * ds;
        let sine = weight * (angle - tables.x_minus_sin(angle));
        let cosine = weight * (one - tables.one_minus_cos(angle));
        let y2 = bent.y[i] * bent.y[i];
        let reach = P::splat(tables.points[i]) * (one + bent.y[i]);
        let lever = m * m * g4 * of(1.0 / 6.0) * reach * reach * y2.mul_add(two, one);
        let pivot = m * g4 * ig2 * of(1.0 / 3.0) * reach * y2.mul_add(y2 + one, one);
        let first = lever + tap.ratio * bent.contact_radius * pivot;
        let second = bent.w_force * pivot;
        let weight = P::splat(tables.weights[i]);
        let (sine, cosine) = (weight * sine, weight * cosine);
        turn1 = turn1 + sine * first;
        climb1 = climb1 + cosine * first;
        turn2 = turn2 + sine * second;
        climb2 = climb2 + cosine * second;
    }
    let lever = c * c * g4 * of(1.0 / 6.0) * g2.mul_add(two, one);
    let pivot = c * (one + g2 + g2 * g2) * g4 * ig2 * of(1.0 / 3.0);
    let (base1, base2) = (lever + tap.ratio * bent.contact_radius * pivot, bent.w_force * pivot);
    let stretch = if effects.extension { of(0.25) * tap.radius * tap.radius * c * ig2 } else { zero };
    let slack = if effects.shear { tap.shear * c * ig2 } else { zero };
    let (sine_b, cosine_b) =
        (bent.base - tables.x_minus_sin(bent.base), one - tables.one_minus_cos(bent.base));
    let move1 =
        [tap.ratio * stretch - turn1 - tap.hub * sine_b * base1, climb1 - slack + tap.hub * cosine_b * base1];
    let move2 = [one - turn2 - tap.hub * sine_b * base2, climb2 - tap.slope + tap.hub * cosine_b * base2];
    let beta_sine = bent.base - tap.angle - bent.sine;
    let beta_cosine = one - bent.cosine;
    let [x0, y0] = bent.centre;
    let toward = [x0 * beta_cosine - y0 * beta_sine, x0 * beta_sine + y0 * beta_cosine];
    let [vx, vy] = bent.pole;
    let along_both = vx * toward[0] + vy * toward[1];
    let row1 = |v: [P; 2], base: P| v[0] * toward[1] - v[1] * toward[0] + base * along_both;
    let row2 = |v: [P; 2]| vx * v[0] + vy * v[1];
    let (m11, m12) = (tap.force * row1(move1, base1), row1(move2, base2));
    let (m21, m22) = (tap.force * row2(move1), row2(move2));
    let det = m11 * m22 - m12 * m21;
    let id = one / det;
    let size = id.abs();
    Step {
        steps: [(m22 * across - m12 * along) * id, (m11 * along - m21 * across) * id],
        noise: [
            (m22.abs() * noise[0] + m12.abs() * noise[1]) * size,
            (m11.abs() * noise[1] + m21.abs() * noise[0]) * size,
        ],
        fold: det,
    }
}
