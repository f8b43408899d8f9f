//! Ranks in their order, and the time that a run has left.

use std::time::{Duration, Instant};

use vibrissa::command::rough;
use vibrissa::progress::Progress;
use vibrissa::sweep::ordered;
use vibrissa_cli::progress::{Shown, line};

#[test]
fn numbers_are_ordered_as_values_are() {
    let values =
        [f64::NEG_INFINITY, -1.0, -f64::MIN_POSITIVE, -0.0, 0.0, 1e-300, 1.0, f64::INFINITY, f64::NAN];
    assert!(values.windows(2).all(|w| w[0].total_cmp(&w[1]).is_lt() && ordered(w[0]) < ordered(w[1])));
}

/// 900 000 taps were done before, 1 000 of 100 000 since, in a second.
#[test]
fn the_time_left_after_a_resume_is_told_by_the_taps_of_this_run() {
    let mut shown = Shown::Lines { start: Instant::now(), last: Instant::now(), before: 0 };
    shown.begin(900_000);
    let Shown::Lines { before, .. } = shown else { panic!("not lines") };
    let told = line((901_000, 1_000_000), 901_000 - before, Duration::from_secs(1));
    assert_eq!(told, format!("901 000 of 1 000 000 taps, {} taps/s, {} s left", rough(1000.0), rough(99.0)));
    assert_eq!(line((900_000, 1_000_000), 0, Duration::from_secs(1)), "900 000 of 1 000 000 taps");
}
