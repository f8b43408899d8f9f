//! The Newton step of a contact whose force does not simply act across the centreline. Twin of `shaders/newton.wgsl`.

use super::super::pack::Packed;
use super::full::settled;
use super::sweep::State;
use super::tables::{Tables, dot};
use crate::{Effects, Tap, rule::limits::*};

pub struct Bent<P, const N: usize> {
    pub y: [P; N],
    /// y⁻³ at the nodes.
    pub density: [P; N],
    /// η at the nodes.
    pub heights: [P; N],
    pub w_force: P,
    pub h_force: P,
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
    /// c less the arc to which the contact has rolled; 0 unless it rolls.
    pub ahead: P,
}

/// Derivative of the rod's angle by one of the unknowns.
pub struct Turned<P, const N: usize> {
    pub nodes: [P; N],
    pub base: P,
}

/// Turn by a unit of W at a fixed shape.
#[inline(always)]
fn unit_force<P: Packed, const N: usize>(
    effects: &Effects,
    tap: &Tap<P>,
    bent: &Bent<P, N>,
    lever: P,
    pivot: P,
) -> P {
    if effects.stick { lever } else { lever + tap.ratio * bent.contact_radius * pivot }
}

/// Turn by a unit of c, or of H of a sticking contact, at a fixed shape.
#[inline(always)]
fn unit_other<P: Packed, const N: usize>(effects: &Effects, bent: &Bent<P, N>, pivot: P) -> P {
    (if effects.stick { bent.contact_radius } else { bent.w_force }) * pivot
}

pub struct Step<P> {
    /// Steps of w and of z (or k).
    pub steps: [P; 2],
    pub noise: [P; 2],
    /// Step of z of a rolling contact; 0 otherwise.
    pub rolled: P,
    /// Determinant of the Jacobian: its sign changes at a fold of the path from the unloaded rod.
    pub fold: P,
}

/// The step of w and of z (or k) from the residuals of V × R(β)Z₀ = 0 and (V² − Z₀²)/2 = 0, and from their `noise`. A unit of W, c or H turns the rod
/// by ∂ψ(s), which moves V by −∫sin ψ ∂ψ ds and ∫cos ψ ∂ψ ds.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub fn step<P: Packed, const N: usize>(
    tables: &Tables<P::Scalar, N>,
    effects: &Effects,
    passes: u32,
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
    let n = tables.nodes::<false>();
    let spread = two * m * g4 * ig2;
    let (mut sines, mut cosines) = ([zero; N], [zero; N]);
    // Moment over y⁻⁵ that a unit of H, where it is an unknown, adds through η.
    let mut raised = [zero; N];
    for i in 0..n {
        let y2 = bent.y[i] * bent.y[i];
        let angle = state.angle[i];
        let weight = bent.density[i] * ds;
        sines[i] = weight * (angle - tables.x_minus_sin(angle));
        cosines[i] = weight * (one - tables.one_minus_cos(angle));
        if effects.stick {
            raised[i] = bent.heights[i] * (y2 * y2 * bent.y[i]);
        }
    }
    let mut first = Turned { nodes: [zero; N], base: zero };
    let mut second = Turned { nodes: [zero; N], base: zero };
    // By c, where it is a third unknown.
    let mut third = Turned { nodes: [zero; N], base: zero };
    for i in 0..n {
        let y2 = bent.y[i] * bent.y[i];
        let reach = P::splat(tables.points[i]) * (one + bent.y[i]);
        let lever = m * m * g4 * of(1.0 / 6.0) * reach * reach * y2.mul_add(two, one);
        let pivot = m * g4 * ig2 * of(1.0 / 3.0) * reach * y2.mul_add(y2 + one, one);
        first.nodes[i] = unit_force(effects, tap, bent, lever, pivot);
        second.nodes[i] = unit_other(effects, bent, pivot);
        if effects.stick {
            second.nodes[i] = second.nodes[i] + spread * dot(n, &tables.integral[i], &raised);
        }
        if effects.rolls {
            third.nodes[i] = bent.w_force * pivot;
        }
    }
    let lever = c * c * g4 * of(1.0 / 6.0) * g2.mul_add(two, one);
    let pivot = c * (one + g2 + g2 * g2) * g4 * ig2 * of(1.0 / 3.0);
    first.base = unit_force(effects, tap, bent, lever, pivot);
    second.base = unit_other(effects, bent, pivot);
    if effects.stick {
        second.base = second.base + spread * dot(n, &tables.weights, &raised);
    }
    if effects.rolls {
        third.base = bent.w_force * pivot;
        if passes > 0 {
            let none = Turned { nodes: [zero; N], base: zero };
            [_, third] =
                settled(tables, passes, state, bent, [spread, ds], [&sines, &cosines], [none, third]);
        }
    }
    if passes > 0 {
        [first, second] =
            settled(tables, passes, state, bent, [spread, ds], [&sines, &cosines], [first, second]);
    }
    let (base1, base2) = (first.base, second.base);
    let (mut turn1, mut climb1, mut turn2, mut climb2) = (zero, zero, zero, zero);
    for i in 0..n {
        let weight = P::splat(tables.weights[i]);
        let (sine, cosine) = (weight * sines[i], weight * cosines[i]);
        turn1 = turn1 + sine * first.nodes[i];
        climb1 = climb1 + cosine * first.nodes[i];
        turn2 = turn2 + sine * second.nodes[i];
        climb2 = climb2 + cosine * second.nodes[i];
    }
    let stretch = if effects.extension { of(0.25) * tap.radius * tap.radius * c * ig2 } else { zero };
    let slack = if effects.shear { tap.shear * c * ig2 } else { zero };
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
    let row1 = |v: [P; 2], base: P| v[0] * toward[1] - v[1] * toward[0] + base * along_both;
    let row2 = |v: [P; 2]| vx * v[0] + vy * v[1];
    let unit2 = if effects.stick { tap.force } else { one };
    let (m11, m12) = (tap.force * row1(move1, base1), unit2 * row1(move2, base2));
    let (m21, m22) = (tap.force * row2(move1), unit2 * row2(move2));
    if effects.rolls {
        // c follows the turn of the contact: its row of the step, z + ρ cos α ψ, is solved for z.
        let (mut turn3, mut climb3) = (zero, zero);
        for i in 0..n {
            let weight = P::splat(tables.weights[i]);
            turn3 = turn3 + weight * sines[i] * third.nodes[i];
            climb3 = climb3 + weight * cosines[i] * third.nodes[i];
        }
        let move3 = [
            one - turn3 - tap.hub * sine_b * third.base,
            climb3 - tap.slope + tap.hub * cosine_b * third.base,
        ];
        let own = one + tap.ratio * third.base;
        let rows = [[m11, m12, row1(move3, third.base)], [m21, m22, row2(move3)]];
        let turns = [tap.ratio * tap.force * base1 / own, tap.ratio * unit2 * base2 / own];
        return rolling(rows, turns, [across, along, bent.ahead / own], noise, own);
    }
    Step::new([[m11, m12], [m21, m22]], [across, along], noise)
}

impl<P: Packed> Step<P> {
    #[inline(always)]
    fn new([[m11, m12], [m21, m22]]: [[P; 2]; 2], [across, along]: [P; 2], noise: [P; 2]) -> Self {
        let det = m11 * m22 - m12 * m21;
        let id = P::of(1.0) / det;
        let size = id.abs();
        Self {
            steps: [(m22 * across - m12 * along) * id, (m11 * along - m21 * across) * id],
            noise: [
                (m22.abs() * noise[0] + m12.abs() * noise[1]) * size,
                (m11.abs() * noise[1] + m21.abs() * noise[0]) * size,
            ],
            rolled: P::of(0.0),
            fold: det,
        }
    }
}

/// The step of w, k and z of a rolling contact: `rows` of the closure; `turns`: changes of z per unit of w and of k; the residuals, the third divided
/// by `own`, by which z turns the contact back.
#[inline(always)]
fn rolling<P: Packed>(
    rows: [[P; 3]; 2],
    turns: [P; 2],
    [across, along, ahead]: [P; 3],
    noise: [P; 2],
    own: P,
) -> Step<P> {
    let [[m11, m12, m13], [m21, m22, m23]] = rows;
    let (across, along) = (across - m13 * ahead, along - m23 * ahead);
    let (m11, m12) = (m11 - m13 * turns[0], m12 - m13 * turns[1]);
    let (m21, m22) = (m21 - m23 * turns[0], m22 - m23 * turns[1]);
    let step = Step::new([[m11, m12], [m21, m22]], [across, along], noise);
    let rolled = ahead - turns[0] * step.steps[0] - turns[1] * step.steps[1];
    Step { rolled, fold: step.fold * own, ..step }
}
