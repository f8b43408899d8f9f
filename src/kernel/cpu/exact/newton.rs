//! The Newton step of a contact whose force does not simply act across the centreline. Twin of `shaders/newton.wgsl`.

use super::super::pack::{Pack, Scalar};
use super::sweep::State;
use super::tables::{Tables, dot};
use crate::kernel::{Effects, Tap, rule::limits::*};

/// What the Newton step of an offset force needs of the sweep.
pub struct Bent<P, const N: usize> {
    /// y at the nodes.
    pub y: [P; N],
    /// y⁻³ at the nodes.
    pub density: [P; N],
    /// W.
    pub w_force: P,
    /// R_c.
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

/// Steps of w and of z (or k) from the residuals of V × R(β)Z₀ = 0 and (V² − Z₀²)/2 = 0. A unit of W, c or H turns the rod by
/// ψ_p(s), which moves V by −∫sin ψ ψ_p ds and ∫cos ψ ψ_p ds.
#[inline(always)]
pub fn step<T: Scalar, const N: usize, const L: usize, const FMA: bool>(
    tables: &Tables<T, N>,
    effects: &Effects,
    tap: &Tap<Pack<T, L, FMA>>,
    state: &State<Pack<T, L, FMA>, N>,
    bent: &Bent<Pack<T, L, FMA>, N>,
    across: Pack<T, L, FMA>,
    along: Pack<T, L, FMA>,
) -> (Pack<T, L, FMA>, Pack<T, L, FMA>) {
    let of = Pack::<T, L, FMA>::of;
    let (zero, one, two) = (of(0.0), of(1.0), of(2.0));
    let c = one + bent.x;
    let g2 = (tap.rest - tap.taper * bent.x).max(of(APEX) * tap.rest);
    let m = c / (one + g2.sqrt());
    let ig2 = one / g2;
    let (g4, ds) = (ig2 * ig2, two * g2 * m);
    let n = tables.nodes::<false>();
    let mut raised = [zero; N];
    if effects.stick {
        for i in 0..n {
            let y2 = bent.y[i] * bent.y[i];
            raised[i] = state.height[i] * (y2 * y2 * bent.y[i]);
        }
    }
    let spread = two * m * g4 * ig2;
    let (mut turn1, mut climb1, mut turn2, mut climb2) = (zero, zero, zero, zero);
    for i in 0..n {
        let y2 = bent.y[i] * bent.y[i];
        let reach = Pack::splat(tables.points[i]) * (one + bent.y[i]);
        let lever = m * m * g4 * of(1.0 / 6.0) * reach * reach * y2.mul_add(two, one);
        let pivot = m * g4 * ig2 * of(1.0 / 3.0) * reach * y2.mul_add(y2 + one, one);
        let (first, second) = if effects.stick {
            (lever, bent.contact_radius * pivot + spread * dot(n, &tables.integral[i], &raised))
        } else {
            (lever + tap.ratio * bent.contact_radius * pivot, bent.w_force * pivot)
        };
        let angle = state.angle[i];
        let weight = Pack::splat(tables.weights[i]) * bent.density[i] * ds;
        let sine = weight * (angle - tables.x_minus_sin(angle));
        let cosine = weight * (one - tables.one_minus_cos(angle));
        turn1 = turn1 + sine * first;
        climb1 = climb1 + cosine * first;
        turn2 = turn2 + sine * second;
        climb2 = climb2 + cosine * second;
    }
    let lever = c * c * g4 * of(1.0 / 6.0) * g2.mul_add(two, one);
    let pivot = c * (one + g2 + g2 * g2) * g4 * ig2 * of(1.0 / 3.0);
    let stretch = if effects.extension { of(0.25) * tap.radius * tap.radius * c * ig2 } else { zero };
    let slack = if effects.shear { tap.shear * c * ig2 } else { zero };
    let (base1, base2) = if effects.stick {
        (lever, bent.contact_radius * pivot + spread * dot(n, &tables.weights, &raised))
    } else {
        (lever + tap.ratio * bent.contact_radius * pivot, bent.w_force * pivot)
    };
    let (sine_b, cosine_b) =
        (bent.base - tables.x_minus_sin(bent.base), one - tables.one_minus_cos(bent.base));
    let move1 = [
        (if effects.stick { zero } else { tap.ratio * stretch }) - turn1 - tap.hub * sine_b * base1,
        climb1 - slack + tap.hub * cosine_b * base1,
    ];
    let move2 = [
        (if effects.stick { stretch } else { one }) - turn2 - tap.hub * sine_b * base2,
        climb2 - (if effects.stick { zero } else { tap.slope }) + tap.hub * cosine_b * base2,
    ];
    let beta_sine = bent.base - tap.angle - bent.sine;
    let beta_cosine = one - bent.cosine;
    let [x0, y0] = bent.centre;
    let toward = [x0 * beta_cosine - y0 * beta_sine, x0 * beta_sine + y0 * beta_cosine];
    let [vx, vy] = bent.pole;
    let along_both = vx * toward[0] + vy * toward[1];
    let row1 = |v: [Pack<T, L, FMA>; 2], base: Pack<T, L, FMA>| {
        v[0] * toward[1] - v[1] * toward[0] + base * along_both
    };
    let row2 = |v: [Pack<T, L, FMA>; 2]| vx * v[0] + vy * v[1];
    let unit2 = if effects.stick { tap.force } else { one };
    let (m11, m12) = (tap.force * row1(move1, base1), unit2 * row1(move2, base2));
    let (m21, m22) = (tap.force * row2(move1), unit2 * row2(move2));
    let det = m11 * m22 - m12 * m21;
    ((m22 * across - m12 * along) / det, (m11 * along - m21 * across) / det)
}
