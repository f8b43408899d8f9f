//! Values of a planar tap, besides its strain, that a tilted pole needs (model §6). Twin of `shaders/spatial.wgsl`.

use super::super::pack::Packed;
use super::gauge::place;
use super::legendre::{legendre, primitive};
use super::sweep::State;
use super::tables::{Tables, dot};
use crate::{Effects, Tap, rule::limits::*};

pub struct Spatial<P> {
    /// ψ at the base, rad.
    pub base: P,
    /// Mean strain of the centreline over the gauge, over the first-order strain.
    pub axial: P,
}

/// `series`, `climbs` and `angles` are the Legendre series of the shortening, the height and the angle.
#[inline(always)]
pub fn spatial<P: Packed, const N: usize, const PLAIN: bool>(
    tables: &Tables<P::Scalar, N>,
    effects: &Effects,
    tap: &Tap<P>,
    state: &State<P, N>,
    series: &[P; N],
    climbs: &[P; N],
    angles: &[P; N],
) -> Spatial<P> {
    let of = P::of;
    let (zero, one, two) = (of(0.0), of(1.0), of(2.0));
    let n = tables.nodes::<PLAIN>();
    let offset = !PLAIN && effects.offset;
    let extension = !PLAIN && effects.extension;
    let law = !PLAIN && effects.law;
    let x = tap.arc + state.arc;
    let c = one + x;
    let g2 = (tap.rest - tap.taper * x).max(of(APEX) * tap.rest);
    let g = g2.sqrt();
    let m = c / (one + g);
    let k = tap.taper * m;
    let ig2 = one / g2;
    let g4 = ig2 * ig2;
    let w_force = tap.force * (one + state.force);
    let h_force = if offset { tap.along + tap.force * state.along } else { zero };
    let contact_radius = if offset { tap.contact_radius - tap.slope * x } else { zero };

    // The closed forms of the angle less its lag, with the last Newton step in them.
    let mut base = w_force * c * c * g4 * g2.mul_add(two, one) * of(1.0 / 6.0);
    if offset {
        base = base + h_force * contact_radius * c * g4 * ig2 * (one + g2 + g2 * g2) * of(1.0 / 3.0);
    }
    let scale = if PLAIN { of(4.0) * w_force * m * m * g4 } else { two * m * g4 * ig2 };
    base = base - scale * dot(n, &tables.weights, &state.bending);
    if !extension && !law {
        return Spatial { base, axial: zero };
    }

    let (c1, c2) = (tap.near + x, tap.far + x);
    let (u1, u2) = (tap.taper.mul_add(tap.near, tap.rest), tap.taper.mul_add(tap.far, tap.rest));
    let (w1, w2) = (place(c1, u1, c, g).min(one), place(c2, u2, c, g));
    let (mut sum, mut length) = (zero, zero);
    for &(point, weight) in &tables.gauge {
        let w = w2 + (w1 - w2) * P::splat(point);
        let weight = P::splat(weight);
        let y = one - k * w;
        let y2 = y * y;
        let y3 = y2 * y;
        length = length + weight / y3;
        let mut direct = zero;
        if extension {
            let angle = legendre(n, angles, w);
            let (cosine, sine) = (tables.one_minus_cos(angle), angle - tables.x_minus_sin(angle));
            let unit = of(0.25) * tap.radius * tap.radius * y2 * y2 * g4;
            direct = (h_force - h_force * cosine - w_force * sine) * unit;
        }
        if law {
            let mut moment = w_force * two * g2 * m * primitive(n, series, w);
            if offset {
                moment = moment - h_force * two * g2 * m * primitive(n, climbs, w);
            }
            let arm = g2 * m * w * (one + y) / y2;
            let whole = w_force * arm + h_force * contact_radius - moment;
            let b = tap.radius * whole * y3 * y3 * g4 * ig2;
            let [extra, _, _] = tables.section(direct, b.abs());
            direct = direct + extra;
        }
        sum = sum + weight * direct / y3;
    }
    let bent = c2.if_less(zero, c1.max(zero) / tap.width, one);
    Spatial { base, axial: bent * sum / (length * tap.strain) }
}
