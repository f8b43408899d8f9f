// Closed forms of the linear theory, dimensionless. Twin of src/kernel/cpu/linear.rs, where the formula is derived.

fn solve(tap: Tap) -> Solution {
    let b1 = 1.0 / fma(tap.taper, tap.near, tap.rest);
    let b2 = 1.0 / max(fma(tap.taper, tap.far, tap.rest), TINY);
    let clear = 0.5 * b1 * b2 * (tap.near * b1 + tap.far * b2);
    let on_gauge = tap.near * tap.near * b1 * b1 / (2.0 * tap.rest * tap.width);
    let lever = select(ZERO, select(clear, on_gauge, tap.far < 0.0), tap.near > 0.0);
    let strain = 1.5 * tap.rest * (1.0 + tap.hub) * lever / (1.0 + tap.shear);
    return Solution(ZERO, ZERO, ZERO, strain, ZERO, ZERO, ZERO);
}
