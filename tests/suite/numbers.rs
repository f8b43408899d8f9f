//! Order of ranks, and the remaining time of a run.

use std::time::{Duration, Instant};

use vibrissa::progress::Progress;
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
