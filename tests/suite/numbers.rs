//! Ranks in their order, the time that a run has left, and numbers that others have published: points, quantiles, sums, minima.

use std::time::{Duration, Instant};

use vibrissa::combinations::Combinations;
use vibrissa::excerpt::Excerpt;
use vibrissa::kernel::gpu::check::{drawn, key};
use vibrissa::progress::Progress;
use vibrissa::reduce::{Spread, Sweeps, percentile};
use vibrissa::report::quantity::told_apart;
use vibrissa::scene::sampler::{MAX_DIMENSIONS, Sampler};
use vibrissa::scene::{Axis, Channels, Listed, Signal, Tuple};
use vibrissa::status::Status;
use vibrissa::sweep::ordered;
use vibrissa_cli::progress::{Shown, line};

#[test]
fn numbers_are_ordered_as_values_are() {
    let values =
        [f64::NEG_INFINITY, -1.0, -f64::MIN_POSITIVE, -0.0, 0.0, 1e-300, 1.0, f64::INFINITY, f64::NAN];
    assert!(values.windows(2).all(|w| w[0].total_cmp(&w[1]).is_lt() && ordered(w[0]) < ordered(w[1])));
}

#[test]
fn the_time_left_after_a_resume_is_told_by_the_taps_of_this_run() {
    let mut shown = Shown::Lines { start: Instant::now(), last: Instant::now(), before: 0 };
    shown.begin(900_000);
    let Shown::Lines { before, .. } = shown else { panic!("not lines") };
    let told = line((901_000, 1_000_000), 901_000 - before, Duration::from_secs(1));
    assert_eq!(told, "901 000 of 1 000 000 taps, 1 000 taps/s, 99 s left");
    let fast = line((868_901, 33_000_000), 868_901, Duration::from_micros(200));
    assert_eq!(fast, "868 901 of 33 000 000 taps, 4.3e9 taps/s, 0.0074 s left");
    assert_eq!(line((0, 12_640), 0, Duration::from_secs(1)), "0 of 12 640 taps");
}

/// `scipy.stats.qmc.Sobol(24, scramble=False, bits=32)`, whose point n is our point n ^ (n >> 1); and
/// the first of the known answers of Random123.
#[test]
fn points_are_those_of_scipy_and_random123() {
    let of = |n: u32| (0..24).map(|j| Sampler::Sobol.coordinate(0, j, n ^ (n >> 1))).collect::<Vec<_>>();
    for line in include_str!("../data/sobol.txt").lines() {
        let numbers: Vec<u32> = line.split(' ').map(|x| x.parse().unwrap()).collect();
        assert_eq!(of(numbers[0]), numbers[1..]);
    }
    let random = [0, 1, 2, 3].map(|j| Sampler::Random.coordinate(0, j, 0));
    assert_eq!(random, [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
    for (seed, j) in [1, 1 << 32].into_iter().flat_map(|seed| (0..MAX_DIMENSIONS).map(move |j| (seed, j))) {
        let mut strata: Vec<u32> = (0..256).map(|i| Sampler::Sobol.coordinate(seed, j, i) >> 24).collect();
        strata.sort_unstable();
        assert!(strata.into_iter().eq(0..256), "seed {seed}, dimension {j}");
    }
}

#[test]
fn ranks_means_and_spreads_are_exact() {
    let of = |n| [50, 99].map(|percent| percentile(n, percent));
    assert_eq!([1, 2, 51, 100, 101, 700].map(of), [[0, 0], [0, 1], [25, 50], [49, 98], [50, 99], [349, 692]]);
    let [mut sweeps, mut other] = [Sweeps::default(); 2];
    sweeps.push(2.0);
    other.push(5.0);
    sweeps.merge(&other);
    assert_eq!((sweeps.taps, sweeps.mean(), sweeps.most()), (2, 3.5, 5.0));
    let mut spread = Spread::default();
    (0..10).for_each(|k| spread.push(1.0 + 1e-9 * f64::from(k)));
    assert!((spread.sd().unwrap() / (1e-9 * (82.5f64 / 9.0).sqrt()) - 1.0).abs() < 1e-6);
}

/// A matrix that is no covariance has none.
#[test]
fn white_noise_has_the_covariance_undone() {
    let of = |c: &[f64]| Channels::of(&[Signal::Moment, Signal::Force], Some(c.to_vec()));
    let channels = of(&[4.0, 1.0, 1.0, 9.0]).unwrap();
    let normal = [0.3, -1.2, 0.0, 0.0, 0.0, 0.0];
    let back = channels.white(&channels.noise(&normal), &normal);
    assert!((0..2).all(|k| (back[k] - normal[k]).abs() < 1e-14));
    assert!(of(&[1.0, 2.0, 2.0, 1.0]).is_none() && of(&[1.0, 1.0, 1.0, 1.0]).is_none());
}

#[test]
fn steps_are_the_decimal_numbers_one_expects() {
    let of = |axis: Result<Axis, _>| axis.unwrap().iter().collect::<Vec<f64>>();
    let tenths: Vec<f64> = (5..101).map(|i| format!("{}.{}", i / 10, i % 10).parse().unwrap()).collect();
    assert_eq!(of(Axis::step(0.5, 10.0, 0.1)), tenths);
    assert_eq!(of(Axis::steps(0.5, 10.0, 96)), tenths);
    assert_eq!(of(Axis::step(1.0, 2.0, 0.4)), [1.0, 1.4, 1.8]);
    assert_eq!((of(Axis::step(0.0, 1.0, 1.0 / 3.0))[3], of(Axis::step(0.1, 0.7, 0.1)).len()), (1.0, 7));
    let log = of(Axis::log_steps(0.1, 10.0, 3));
    assert!((log[0], log[2]) == (0.1, 10.0) && (log[1] - 1.0).abs() < 1e-15);
}

#[test]
fn what_belongs_together_is_counted_once() {
    let row = |d, tilt, a, drive| Tuple { D: 10.0, d, tilt, a, drive, ..Tuple::default() };
    let rows = [
        row(7.0, 0.0, 20.0, 1.0),
        row(4.0, 0.0, 20.0, 1.0),
        row(7.0, -0.0, 30.0, 1.0),
        row(7.0, 5.0, 20.0, 2.0),
    ];
    let listed: Listed = rows.into_iter().chain([Tuple { x_ss: -0.0, ..rows[1] }]).collect();
    let groups = listed.groups();
    assert_eq!((&groups.designs[..], &groups.strokes[..]), (&[0, 1, 0, 0, 1][..], &[0, 1, 0, 2, 1][..]));
    assert_eq!((&groups.distances[..], groups.counts), (&[0, 1, 2, 3, 1][..], [2, 3, 4]));
    let mut all = Combinations::default();
    let both = Status::STRAIN_LIMIT | Status::AMBIGUOUS;
    let noted = [(Status::OK, 3), (both, 2), (Status::STRAIN_LIMIT, 1), (both, 1), (Status::NO_ROOT, 0)];
    noted.into_iter().for_each(|(status, taps)| all.note(status, taps));
    assert_eq!(all.told(|n| n.to_string()), "3 ok, 1 strain_limit, 3 strain_limit+ambiguous");
}

/// Of those that are compared, whatever stands beside them.
#[test]
fn a_tap_is_drawn_whatever_stands_beside_it() {
    let tap = |i: u32| [1.0 + f64::from(i % 317), 0.1 + f64::from(i / 317)];
    let taps: Vec<[f64; 2]> = (0..100_000).map(tap).collect();
    let of = |taps: &[[f64; 2]]| {
        let places = drawn(taps.len(), |_| true, |i| key(&taps[i]), |i| taps[i][1]);
        places.into_iter().map(|i| taps[i].map(f64::to_bits)).collect::<Vec<_>>()
    };
    let whole = of(&taps);
    assert!(
        (60..160).contains(&whole.len())
            && [0, 99_999].iter().all(|i| whole.contains(&taps[*i].map(f64::to_bits)))
    );
    for parts in [2, 3, 7] {
        let cut: Vec<_> = taps.chunks(taps.len().div_ceil(parts)).flat_map(of).collect();
        assert!(whole.iter().all(|tap| cut.contains(tap)), "in {parts} parts");
    }
}

#[test]
fn a_mistake_is_marked_and_values_are_told_apart() {
    let text = "[whisker]\r\nD = 10\r\nd\t= -4\r\nL_a = 50\r\n";
    let at = text.find("-4").unwrap();
    let Excerpt { text, span, above } = Excerpt::new(text, at..at + 2);
    assert_eq!((text.as_str(), &text[span], above), ("D = 10\nd = -4\nL_a = 50", "-4", 1));
    let long = format!("a = 1\n{}bad{}", "x".repeat(200_000), "y".repeat(200_000));
    let far = Excerpt::new(&long, 200_006..200_009);
    assert!(far.text.len() < 300 && &far.text[far.span] == "bad");
    assert_eq!(told_apart("theta_deg", &[1.0, 1.0 + f64::EPSILON])[1], "θ = 1.0000000000000002°");
}
