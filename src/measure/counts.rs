//! Raw counts of 16 bits that begin anew at the end of their range.

/// Counts of the whole range.
const TURN: f64 = 65536.0;

/// How far below zero differences are taken to lie where `lean` is expected of them, a whole number of counts.
pub fn below(lean: f64) -> f64 {
    ((0.5 - 0.4 * lean) * TURN).round()
}

/// The difference of two counts: by the shorter way around, or, where differences of one sign are expected, `lean` = ±1, by the way that
/// leaves nine tenths of the range to that sign.
pub fn wrapped(difference: f64, lean: f64) -> f64 {
    let below = below(lean);
    (difference + below).rem_euclid(TURN) - below
}

/// Where `values` are counts of 16 bits of which some have begun anew: the largest of those. A quarter of the range is then empty, and
/// the way across its end is less than a third of that gap.
pub fn turn(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    let (first, last) = (*all.first()?, *all.last()?);
    let counts = (0.0..TURN).contains(&first) && last < TURN || first >= -0.5 * TURN && last < 0.5 * TURN;
    let widest = all.windows(2).max_by(|v, w| (v[1] - v[0]).total_cmp(&(w[1] - w[0])))?;
    let gap = widest[1] - widest[0];
    let across = first + TURN - last;
    (counts && gap > 0.25 * TURN && across < gap / 3.0).then_some(widest[0])
}

/// A count that may have begun anew, beyond the range.
pub fn unwrapped(value: f64, turn: Option<f64>) -> f64 {
    if turn.is_some_and(|t| value <= t) { value + TURN } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_that_begin_anew_are_told() {
        let signal: Vec<f64> = (0..40).map(|k| 50_000.0 + 900.0 * f64::from(k)).collect();
        let counted = |x: &f64| x.rem_euclid(65536.0);
        let at = turn(signal.iter().map(counted));
        for x in &signal {
            assert_eq!(unwrapped(counted(x), at), *x);
        }
        assert_eq!(wrapped(300.0 - 65000.0, 0.0), 836.0);
        assert_eq!([wrapped(-12.0, 0.0), wrapped(-12.0, 1.0), wrapped(12.0, -1.0)], [-12.0, -12.0, 12.0]);
        assert_eq!([wrapped(58_000.0, 1.0), wrapped(7_536.0, -1.0)], [58_000.0, -58_000.0]);
        // Two sides of a sensor, a range that is filled, numbers that are no counts.
        assert_eq!(turn([10_000.0, 25_000.0, 41_000.0, 55_000.0].into_iter()), None);
        assert_eq!(turn((0..60).map(|k| 1000.0 * f64::from(k))), None);
        assert_eq!(turn([1.0, 90_000.0].into_iter()), None);
        assert_eq!(turn([f64::NAN].into_iter()), None);
    }
}
