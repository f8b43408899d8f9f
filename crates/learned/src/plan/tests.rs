//! The planner on a power law.

use super::*;

fn curve(a: f64, u: f64) -> f64 {
    1e-2 * u.powf(1.02) * (30.0 / a).powf(2.2)
}

fn planner(positions: usize) -> Planner {
    let distances: Vec<f64> = (0..13).map(|k| 20.0 + 2.0 * f64::from(k)).collect();
    let rig = Rig { noise: 1e-4, relative: 1e-3, position: 1e-3, visit: 1e-5, gain: 2e-3, zero: 1e-4 };
    let ask = Ask {
        curve: &(std::sync::Arc::new(curve) as Whisker),
        distances: &distances,
        drives: &[1.0, 2.0, 4.0],
        allowed: &|_, _| true,
        runs: 2,
        positions,
        rig,
    };
    Planner::new(&ask).unwrap()
}

#[test]
fn taps_are_taken_and_given_back() {
    let mut p = planner(99);
    let before = p.clone();
    (0..6).for_each(|_| p.grow());
    let sigma = p.sigma();
    assert!(sigma < before.sigma() && sigma > p.floor());
    assert!((p.with(p.chosen()).sigma() / sigma - 1.0).abs() < 1e-9);
    (0..6).for_each(|_| p.shrink());
    assert!((p.sigma() / before.sigma() - 1.0).abs() < 1e-6, "{} {}", p.sigma(), before.sigma());
}

#[test]
fn no_other_pair_is_better_by_two_per_cent() {
    let mut p = planner(99);
    (0..4).for_each(|_| p.grow());
    p.exchange();
    let (chosen, best) = (p.chosen(), p.sigma());
    let all = p.taps.clone();
    let mut least = f64::INFINITY;
    for k in 0..4 {
        for l in k + 1..4 {
            let rest: Vec<Tap> = (0..4).filter(|i| *i != k && *i != l).map(|i| chosen[i]).collect();
            let base = p.with(rest);
            for t in &all {
                let with = base.with(base.chosen().into_iter().chain([*t]));
                for u in &all {
                    let place = with.taps.iter().position(|x| x == u).unwrap();
                    least = least.min(with.floor + with.variance() - with.gain(place));
                }
            }
        }
    }
    assert!(best < 1.02 * least.sqrt(), "{best} {}", least.sqrt());
}

#[test]
fn fewer_positions_are_kept_to() {
    let mut p = planner(4);
    (0..24).for_each(|_| p.grow());
    p.exchange();
    let mut used: Vec<usize> = p.chosen().iter().map(|t| t[0]).collect();
    used.sort_unstable();
    used.dedup();
    assert!(used.len() == 4 && p.len() == 24, "{used:?}");
}
