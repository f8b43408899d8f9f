//! Full Newton: the response of the rod's lag to the unknowns, which a step at a fixed shape leaves out. For the last rung, on the CPU only.

use super::super::pack::Packed;
use super::newton::{Bent, Turned};
use super::sweep::State;
use super::tables::{Tables, dot};

/// Input of [`follow`]: W, H, the factor of the lag, and at the nodes y⁵, sin ψ ds and cos ψ ds.
struct Rod<'a, P, const N: usize> {
    w_force: P,
    h_force: P,
    spread: P,
    fifth: [P; N],
    sines: &'a [P; N],
    cosines: &'a [P; N],
}

/// Turns of the rod by a unit of each unknown when its lag follows, from those at a fixed shape. A unit of W also takes away moment through Δξ.
/// `spread` is the factor of the lag; `sines` and `cosines` are sin ψ ds and cos ψ ds at the nodes.
#[inline(always)]
pub fn settled<P: Packed, const N: usize>(
    tables: &Tables<P::Scalar, N>,
    passes: u32,
    state: &State<P, N>,
    bent: &Bent<P, N>,
    [spread, ds]: [P; 2],
    [sines, cosines]: [&[P; N]; 2],
    [mut first, second]: [Turned<P, N>; 2],
) -> [Turned<P, N>; 2] {
    let n = tables.nodes::<false>();
    let zero = P::of(0.0);
    let mut rod =
        Rod { w_force: bent.w_force, h_force: bent.h_force, spread, fifth: [zero; N], sines, cosines };
    let mut drawn = [zero; N];
    for i in 0..n {
        let y2 = bent.y[i] * bent.y[i];
        rod.fifth[i] = y2 * y2 * bent.y[i];
        drawn[i] = ds * dot(n, &tables.integral[i], &state.shortening) * rod.fifth[i];
    }
    for i in 0..n {
        first.nodes[i] = first.nodes[i] - spread * dot(n, &tables.integral[i], &drawn);
    }
    first.base = first.base - spread * dot(n, &tables.weights, &drawn);
    [follow(tables, passes, &rod, first), follow(tables, passes, &rod, second)]
}

/// Turn of the rod when its lag follows: `fixed`, at a fixed shape, changes the moment by H ∂η − W ∂Δξ (a Volterra equation, iterated).
#[inline(always)]
fn follow<P: Packed, const N: usize>(
    tables: &Tables<P::Scalar, N>,
    passes: u32,
    rod: &Rod<'_, P, N>,
    fixed: Turned<P, N>,
) -> Turned<P, N> {
    let n = tables.nodes::<false>();
    let zero = P::of(0.0);
    let Turned { mut nodes, mut base } = fixed;
    for _ in 0..passes {
        let (mut pulled, mut bending) = ([zero; N], [zero; N]);
        for i in 0..n {
            pulled[i] = (rod.h_force * rod.cosines[i] - rod.w_force * rod.sines[i]) * nodes[i];
        }
        for i in 0..n {
            bending[i] = dot(n, &tables.integral[i], &pulled) * rod.fifth[i];
        }
        for i in 0..n {
            nodes[i] = fixed.nodes[i] + rod.spread * dot(n, &tables.integral[i], &bending);
        }
        base = fixed.base + rod.spread * dot(n, &tables.weights, &bending);
    }
    Turned { nodes, base }
}
