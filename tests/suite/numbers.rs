//! What everything computes with: numbers as text, quadrature, roots, means, least squares.

use std::time::{Duration, Instant};

use nalgebra::{DMatrix, DVector};
use vibrissa::census::bench::{Times, repeat};
use vibrissa::command::{grouped, rough};
use vibrissa::digits::short;
use vibrissa::sweep::ordered;
use vibrissa::optimise::quadratic::{Quadratic, Stencil, step};
use vibrissa::physics::chebyshev::{basis, coefficients, matrix, placed, points, scaled, series};
use vibrissa::physics::inverse::bracketed;
use vibrissa::physics::nodes::{Nodes, legendre};
use vibrissa::progress::Progress;
use vibrissa::reduce::{Spread, Sweeps, percentile};
use vibrissa::report::calibrate::normal_within;
use vibrissa_cli::progress::{Shown, line};
use vibrissa_core::normal::quantile;
use vibrissa_learned::algebra::least::{FREE, by_values, solve, values};

#[test]
fn short_numbers_keep_four_digits() {
    assert_eq!([short(0.0), short(1.25e-7), short(12345.6)], ["0", "1.250e-7", "12346"]);
}

#[test]
fn quantiles_of_the_normal_distribution() {
    let known = [
        (0.5, 0.0),
        (1.349_898_031_630_094_5e-3, -3.0),
        (0.975, 1.959_963_984_540_054),
        (0.25, -0.674_489_750_196_081_7),
        (0.9999, 3.719_016_485_455_709),
    ];
    for (p, z) in known {
        assert!((quantile(p) - z).abs() < 4e-15 * (1.0 + f64::abs(z)), "{p}: {}", quantile(p));
    }
}

#[test]
fn a_smooth_function_is_rebuilt_with_its_slope() {
    let range = [2.0, 5.0];
    let values: Vec<f64> = points(20).iter().map(|x| placed(range, *x).ln()).collect();
    let c = coefficients(&values);
    for v in [2.0, 2.7, 4.1, 5.0f64] {
        let (value, slope) = series(&c, scaled(range, v));
        assert!((value - v.ln()).abs() < 1e-13 && (slope / 1.5 - 1.0 / v).abs() < 1e-11, "{v}");
        let by_basis: f64 = basis(20, scaled(range, v)).iter().zip(&c).map(|(t, c)| t * c).sum();
        assert!((by_basis - value).abs() < 1e-14);
    }
    for (row, c) in matrix(20).iter().zip(&c) {
        assert!((row.iter().zip(&values).map(|(m, v)| m * v).sum::<f64>() - c).abs() < 1e-14);
    }
}

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

#[test]
fn rules_are_exact_for_polynomials() {
    for n in [2, 4, 6, 8, 10, 12, 16, 20, 28] {
        let t = Nodes::new(n);
        for degree in 0..2 * n {
            let sum: f64 = (0..n).map(|i| t.weights[i] * t.points[i].powi(degree as i32)).sum();
            assert!((sum - 1.0 / (degree + 1) as f64).abs() < 1e-14, "n {n} degree {degree}");
        }
        for degree in 0..n {
            for i in 0..n {
                let got: f64 = (0..n).map(|j| t.integral[i][j] * t.points[j].powi(degree as i32)).sum();
                let want = t.points[i].powi(degree as i32 + 1) / (degree + 1) as f64;
                assert!((got - want).abs() < 1e-14, "n {n} degree {degree} row {i}");
            }
        }
    }
}

#[test]
fn legendre_coefficients_rebuild_the_function() {
    let t = Nodes::new(12);
    let values: Vec<f64> = t.points.iter().map(|w| (1.5 * w).exp()).collect();
    let c: Vec<f64> =
        t.legendre.iter().map(|row| row.iter().zip(&values).map(|(a, y)| a * y).sum()).collect();
    let w = 0.3;
    let sum: f64 = legendre(11, 2.0 * w - 1.0).iter().zip(&c).map(|(p, c)| p * c).sum();
    assert!((sum - (1.5f64 * w).exp()).abs() < 1e-13);
}

#[test]
fn percentiles_are_nearest_ranks() {
    let of = |n| [50, 99].map(|percent| percentile(n, percent));
    assert_eq!((of(1), of(2), of(51)), ([0, 0], [0, 1], [25, 50]));
    assert_eq!((of(100), of(101), of(200), of(700)), ([49, 98], [50, 99], [99, 197], [349, 692]));
}

#[test]
fn the_mean_of_sweeps_is_of_the_taps_that_spent_them() {
    let mut sweeps = Sweeps::default();
    assert_eq!((sweeps.mean(), sweeps.most()), (0.0, 0.0));
    sweeps.push(2.0);
    let mut other = Sweeps::default();
    other.push(5.0);
    sweeps.merge(&other);
    assert_eq!((sweeps.taps, sweeps.mean(), sweeps.most()), (2, 3.5, 5.0));
}

#[test]
fn tiny_spread_on_a_large_mean_survives() {
    let mut s = Spread::default();
    for k in 0..10 {
        s.push(1.0 + 1e-9 * f64::from(k));
    }
    let exact = 1e-9 * (82.5f64 / 9.0).sqrt();
    assert!((s.sd().unwrap() / exact - 1.0).abs() < 1e-6);
}

/// Rosenbrock's valley.
fn valley(x: &[f64]) -> Option<Vec<f64>> {
    Some(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]])
}

#[test]
fn the_end_of_a_valley_and_the_best_of_its_bounds_are_found() {
    // Differences leave 1e-10 of a slope; at x = 0.5 the best y is 0.25, and 0.3 of the bounds that begin there.
    let free = [FREE; 2];
    for (start, bounds, best) in [
        (-1.2, free, [1.0, 1.0]),
        (-1.2, [[-2.0, 0.5], [-5.0, 5.0]], [0.5, 0.25]),
        (0.2, [[-2.0, 0.5], [0.3, 5.0]], [0.5, 0.3]),
    ] {
        let m = by_values(&valley, &[start, 1.0], &[1e-5, 1e-5], &bounds, 1e-14).unwrap();
        assert!((0..2).all(|i| (m.at[i] - best[i]).abs() < 1e-9), "{:?} is not {best:?}", m.at);
    }
    let rank = by_values(&|x| Some(vec![x[0] - 1.0]), &[0.0, 0.0], &[1e-5, 1e-5], &free, 1e-14);
    assert!(rank.is_none());
    assert!(by_values(&|_| None, &[0.0], &[1e-5], &free, 1e-14).is_none());
}

#[test]
fn units_do_not_matter_and_what_is_not_determined_is_told() {
    let n = DMatrix::from_row_slice(2, 2, &[4e12, 1.0, 1.0, 1e-12]);
    let x = DVector::from_column_slice(&[3e-6, 5e6]);
    let (found, inverse) = solve(&n, &(&n * &x)).unwrap();
    assert!((found - &x).component_div(&x).amax() < 1e-12);
    assert!((&n * inverse - DMatrix::identity(2, 2)).map(|e| e * 1e-12).amax() < 1e-12);
    assert!(solve(&DMatrix::from_element(2, 2, 1.0), &DVector::zeros(2)).is_none());
    assert!(solve(&DMatrix::from_element(1, 1, f64::NAN), &DVector::zeros(1)).is_none());
    assert!(solve(&DMatrix::zeros(1, 1), &DVector::zeros(1)).is_none());
}

#[test]
fn what_is_no_number_has_none() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(values(DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 3.0, bad, 5.0, 6.0]), true).is_none());
    }
    assert!(values(DMatrix::zeros(0, 2), true).is_none());
    let svd = values(DMatrix::from_row_slice(3, 2, &[3.0, 0.0, 0.0, 4.0, 0.0, 0.0]), true).unwrap();
    assert!(
        (svd.singular_values.max() - 4.0).abs() < 1e-14 && (svd.singular_values.min() - 3.0).abs() < 1e-14
    );
    assert!(values(DMatrix::zeros(3, 2), false).is_some_and(|s| s.singular_values.max() == 0.0));
    // Whatever the sizes: an answer or none.
    let _ = values(DMatrix::from_row_slice(3, 2, &[1e300, 1e-300, f64::MAX, -f64::MAX, 5e-324, 0.0]), true);
}

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
