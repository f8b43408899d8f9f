//! What is computed around the models: searches on quadratics, order of ranks, times, numbers as text.

use std::time::{Duration, Instant};

use vibrissa::census::bench::{Times, repeat};
use vibrissa::command::{grouped, rough};
use vibrissa::optimise::quadratic::{Quadratic, Stencil, step};
use vibrissa::progress::Progress;
use vibrissa::report::calibrate::normal_within;
use vibrissa::sweep::ordered;
use vibrissa_cli::progress::{Shown, line};

#[test]
fn a_quadratic_is_read_exactly_also_at_bounds() {
    let truth = Quadratic {
        value: 0.7,
        slope: vec![1.0, -2.0, 0.3],
        curvature: vec![2.0, 0.5, -1.0, 0.5, 3.0, 0.2, -1.0, 0.2, -4.0],
    };
    for u in [[0.5, 0.5, 0.5], [0.0, 1.0, 0.99], [1.0, 0.003, 0.0]] {
        let stencil = Stencil::new(&u, 0.01);
        let values: Vec<f64> = stencil
            .places
            .iter()
            .map(|x| truth.at(&x.iter().zip(u).map(|(x, u)| x - u).collect::<Vec<_>>()))
            .collect();
        let model = stencil.model(&values);
        for (a, b) in
            model.slope.iter().chain(&model.curvature).zip(truth.slope.iter().chain(&truth.curvature))
        {
            assert!((a - b).abs() < 1e-9, "{model:?}");
        }
    }
}

#[test]
fn steps_keep_to_bounds_and_limits() {
    // min (x − 2)² + (y − 1)² in the unit box around 0 with x² + y² ≤ 1 and x + y ≤ 1.2.
    let goal = Quadratic { value: 5.0, slope: vec![-4.0, -2.0], curvature: vec![2.0, 0.0, 0.0, 2.0] };
    let disc = Quadratic { value: -1.0, slope: vec![0.0, 0.0], curvature: vec![2.0, 0.0, 0.0, 2.0] };
    let edge = Quadratic { value: -1.2, slope: vec![1.0, 1.0], curvature: vec![0.0; 4] };
    let one: &[f64] = &[1.0, 1.0];
    let near = |p: &[f64], want: [f64; 2]| {
        assert!(p.iter().zip(want).all(|(p, w)| (p - w).abs() < 1e-8), "{p:?} for {want:?}");
    };
    near(&step(&goal, &[], [&[-1.0, -1.0], one]), [1.0, 1.0]);
    near(&step(&goal, std::slice::from_ref(&disc), [&[-1.0, -1.0], one]), [0.8f64.sqrt(), 0.2f64.sqrt()]);
    let both = (0.6 + 0.14f64.sqrt(), 0.6 - 0.14f64.sqrt());
    near(&step(&goal, &[disc.clone(), edge], [&[-1.0, -1.0], one]), [both.0, both.1]);
    // Limits that cannot be kept in the box are violated as little as can be.
    let far = Quadratic { value: 3.0, slope: vec![-1.0, 0.0], curvature: vec![0.0; 4] };
    assert!((step(&goal, &[far], [&[-1.0, -1.0], one])[0] - 1.0).abs() < 1e-9);
    // A saddle ends at a bound.
    let saddle = Quadratic { value: 0.0, slope: vec![0.1, 0.0], curvature: vec![2.0, 0.0, 0.0, -2.0] };
    let p = step(&saddle, &[], [&[-1.0, -1.0], one]);
    assert!((p[0] + 0.05).abs() < 1e-9, "{p:?}");
}

#[test]
fn digits_stand_in_threes() {
    let pairs = [(0, "0"), (33, "33"), (999, "999"), (10_000, "10 000"), (1_234_567, "1 234 567")];
    pairs.into_iter().for_each(|(n, text)| assert_eq!(grouped(n), text));
}

#[test]
fn two_digits_are_enough() {
    let pairs = [
        (0.0123, "0.012"),
        (0.0, "0"),
        (2.66, "2.7"),
        (12.64, "13"),
        (868_901.0, "870 000"),
        (4.33e9, "4.3e9"),
    ];
    pairs.into_iter().for_each(|(x, text)| assert_eq!(rough(x), text));
}

#[test]
fn numbers_are_ordered_as_values_are() {
    let values =
        [f64::NEG_INFINITY, -1.0, -f64::MIN_POSITIVE, -0.0, 0.0, 1e-300, 1.0, f64::INFINITY, f64::NAN];
    assert!(values.windows(2).all(|w| w[0].total_cmp(&w[1]).is_lt() && ordered(w[0]) < ordered(w[1])));
}

#[test]
fn best_median_and_spread_of_as_many_runs_as_asked() {
    let t = Times::of(vec![4.0, 1.0, 2.0, 3.0]).per(1000);
    assert!((t.best - 1e6).abs() < 1e-6 && (t.median - 2.5e6).abs() < 1e-6 && t.spread == Some(1.2));
    assert_eq!(Times::of(vec![3.0]).spread, None);
    let mut n = 0;
    let last = repeat(4, || -> Result<i32, ()> {
        n += 1;
        Ok(n)
    });
    assert_eq!((last.unwrap().0, n), (4, 4));
    assert_eq!(repeat(4, || Err::<(), _>("no")), Err("no"));
}

#[test]
fn the_normal_distribution_is_that_of_tables() {
    for (x, share) in
        [(0.0, 0.0), (1.0, 0.682_689_492_137), (1.96, 0.950_004_209_703_6), (4.0, 0.999_936_657_516)]
    {
        assert!((normal_within(x) - share).abs() < 1e-8, "{x}: {}", normal_within(x));
    }
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
