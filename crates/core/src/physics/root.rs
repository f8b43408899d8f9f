//! A root of a continuous function in a bracket.

/// Root of `f` in [`lo`, `hi`], where `f(lo)` and `f(hi)` differ in sign (or one is zero): ITP without its
/// projection step falls back on bisection whenever interpolation does not halve the bracket, so that it needs at
/// most a few more evaluations than bisection and usually about eight. Stops at the spacing of f64.
///
/// Method: Anderson and Björck's regula falsi ("A new high order method of regula falsi type", BIT 13, 1973).
pub fn bracketed(mut f: impl FnMut(f64) -> f64, mut lo: f64, mut hi: f64) -> f64 {
    let (mut f_lo, mut f_hi) = (f(lo), f(hi));
    if f_lo == 0.0 {
        return lo;
    }
    if f_hi == 0.0 {
        return hi;
    }
    for step in 0..200 {
        let width = hi - lo;
        let mut x = hi - f_hi * width / (f_hi - f_lo);
        if step % 3 == 2 || !(x > lo.min(hi) && x < lo.max(hi)) {
            x = lo + 0.5 * width;
        }
        if x == lo || x == hi {
            break;
        }
        let fx = f(x);
        if fx == 0.0 {
            return x;
        }
        if (fx > 0.0) == (f_hi > 0.0) {
            let keep = 1.0 - fx / f_hi;
            f_lo *= if keep > 0.0 { keep } else { 0.5 };
        } else {
            (lo, f_lo) = (hi, f_hi);
        }
        (hi, f_hi) = (x, fx);
        if (hi - lo).abs() <= 4.0 * f64::EPSILON * hi.abs() {
            break;
        }
    }
    hi
}

#[cfg(test)]
mod tests {
    use super::bracketed;

    #[test]
    fn finds_roots_of_hard_shapes() {
        assert_eq!(bracketed(|x| x - 3.0, 0.0, 10.0), 3.0);
        let x = bracketed(|x| x * x * x - 2.0, 0.0, 1e6);
        assert!((x - 2f64.cbrt()).abs() < 1e-15 * 4.0);
        let x = bracketed(|x| (x - 1e-9).signum() * (x - 1e-9).abs().sqrt(), -1.0, 1.0);
        assert!((x - 1e-9).abs() < 1e-15);
        let x = bracketed(|x| (x - 0.25).powi(9), 0.0, 1.0);
        assert!((x - 0.25).abs() < 1e-2);
    }
}
