//! Which taps of a batch are compared with the CPU.

use rayon::prelude::*;

use super::dispatch::GRAIN;

/// One of so many taps is drawn.
const EVERY: u64 = 1024;

/// Taps that are drawn at least of a batch that has them.
const LEAST: usize = 32;

/// A number that is spread evenly over `u64`, of the numbers of a tap alone: a tap is drawn or not whatever stands beside it.
pub fn key(numbers: &[f64]) -> u64 {
    let mix = |h: u64, x: &f64| (h ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    numbers.iter().fold(0, mix).wrapping_mul(0xbf58_476d_1ce4_e5b9)
}

/// What is drawn of some taps.
#[derive(Default)]
struct Drawn {
    places: Vec<usize>,
    /// Smallest and largest drive, and where.
    ends: Option<[(f64, usize); 2]>,
}

impl Drawn {
    fn with(mut self, other: Self) -> Self {
        self.places.extend(other.places);
        let of = |(x, i): (f64, usize), (y, k): (f64, usize)| x.total_cmp(&y).then(i.cmp(&k));
        self.ends = match (self.ends, other.ends) {
            (Some([a, b]), Some([c, d])) => {
                Some([if of(a, c).is_le() { a } else { c }, if of(b, d).is_ge() { b } else { d }])
            }
            (one, None) => one,
            (None, one) => one,
        };
        self
    }
}

/// Places of the taps to compare among the first `count`, of those that are `told`: one in 1024 by its `key`, those of the lowest keys where these are few, and
/// those of the smallest and the largest `drive`.
pub fn drawn(
    count: usize,
    told: impl Fn(usize) -> bool + Sync,
    key: impl Fn(usize) -> u64 + Sync,
    drive: impl Fn(usize) -> f64 + Sync,
) -> Vec<usize> {
    let all = || (0..count).into_par_iter().with_min_len(GRAIN).filter(|&i| told(i));
    let one = |mut drawn: Drawn, i: usize| {
        if key(i) < u64::MAX / EVERY {
            drawn.places.push(i);
        }
        drawn.with(Drawn { places: Vec::new(), ends: Some([(drive(i), i); 2]) })
    };
    let Drawn { mut places, ends } = all().fold(Drawn::default, one).reduce(Drawn::default, Drawn::with);
    if places.len() < LEAST {
        let mut keys: Vec<(u64, usize)> = all().map(|i| (key(i), i)).collect();
        keys.sort_unstable();
        places = keys.into_iter().take(LEAST).map(|(_, i)| i).collect();
    }
    places.extend(ends.iter().flatten().map(|(_, i)| i));
    places.sort_unstable();
    places.dedup();
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tap_is_drawn_whatever_stands_beside_it() {
        let taps: Vec<[f64; 2]> =
            (0..100_000).map(|i| [1.0 + f64::from(i % 317), 0.1 + f64::from(i / 317)]).collect();
        let of = |taps: &[[f64; 2]]| {
            let places = drawn(taps.len(), |_| true, |i| key(&taps[i]), |i| taps[i][1]);
            places.into_iter().map(|i| taps[i].map(f64::to_bits)).collect::<Vec<_>>()
        };
        let whole = of(&taps);
        assert!((60..160).contains(&whole.len()), "{}", whole.len());
        for place in [0, taps.len() - 1] {
            assert!(whole.contains(&taps[place].map(f64::to_bits)), "no smallest or largest drive");
        }
        for parts in [2, 3, 7] {
            let cut: Vec<_> = taps.chunks(taps.len().div_ceil(parts)).flat_map(of).collect();
            let missing = whole.iter().filter(|tap| !cut.contains(tap)).count();
            assert_eq!(missing, 0, "in {parts} parts");
        }
        assert_eq!(of(&taps[..20]).len(), 20);
        assert!(of(&[]).is_empty());
    }
}
