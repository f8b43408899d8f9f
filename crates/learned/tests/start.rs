//! What a fit begins with, against data of which the truth is known: laws, steps, labels, tails.

use nalgebra::{DMatrix, DVector};

use vibrissa_learned::base::power;
use vibrissa_learned::curve::Tails;
use vibrissa_learned::least::{FREE, by_values, solve, values};
use vibrissa_learned::rows::{Row, cells, contradicted, position, quantum};

#[test]
fn a_power_law_is_found_with_its_constant_and_the_end_of_a_cone() {
    let of = |value: &dyn Fn(f64, f64) -> f64| -> Vec<[f64; 3]> {
        (10..30)
            .flat_map(|a| (1..5).map(move |u| (f64::from(a), f64::from(u))))
            .map(|(a, u)| [a, u, value(a, u)])
            .collect()
    };
    for (zero, known) in [(3.0, None), (0.0, Some(0.0))] {
        let mut taps = of(&|a, u| zero + 40.0 * u.powf(1.1) * a.powf(-1.3));
        taps[7][2] += 0.5 * (taps[7][2] - zero);
        let found = power(&taps, known, true).unwrap();
        assert!((found.power.p - 1.1).abs() < 0.01 && (found.power.q - 1.3).abs() < 0.02, "{found:?}");
        assert!((found.zero - zero).abs() < 0.2, "{found:?}");
    }
    let cone = |end: f64| {
        let taps = of(&|a, u| 40.0 * u * (1.0 / a - end) * (1.0 + 1e-3 * (9.0 * a + u).sin()));
        power(&taps, Some(0.0), true).unwrap().power
    };
    let found = cone(1.0 / 45.0);
    assert!((found.end * 45.0 - 1.0).abs() < 0.02 && found.q == 1.0, "{found:?}");
    assert_eq!(cone(0.0).end, 0.0);
}

#[test]
fn the_step_of_few_readings_is_that_of_the_converter() {
    let readings = [12.0, 17.0, 30.0, 31.0, 77.0].map(|k| k * 0.00488 + 0.3);
    assert!((quantum(&readings) / 0.00488 - 1.0).abs() < 1e-6);
    assert!((quantum(&[12.0, 18.0, 30.0, 96.0]) - 6.0).abs() < 1e-9);
    assert!(quantum(&[0.0, 1.0, 2f64.sqrt(), 3f64.sqrt()]) < 1e-4);
}

#[test]
fn labels_contradict_each_other_beyond_noise_and_are_set_better_than_positions_are_apart() {
    let of = |labels: &[f64], drives: usize, noise: f64| {
        let of = |k: usize| (labels[k / 5], 20.0 + 10.0 * (k / 5) as f64, (k % drives) as f64);
        let row = |k: usize| Row {
            a: of(k).0,
            u: 1.0 + of(k).2,
            y: (1.0 + noise * (7.0 * k as f64).sin()) / of(k).1,
            run: 0,
            t: 0.0,
        };
        let rows: Vec<Row> = (0..5 * labels.len()).map(row).collect();
        cells(&rows, &(0..rows.len()).collect::<Vec<_>>(), false)
    };
    let (right, swapped) = ([20.0, 30.0, 40.0, 50.0], [20.0, 30.0, 50.0, 40.0]);
    assert_eq!((contradicted(&of(&right, 1, 0.01)), contradicted(&of(&swapped, 1, 0.5))), (None, None));
    assert!((contradicted(&of(&swapped, 1, 0.01)).unwrap() - 1.25f64.ln()).abs() < 1e-12);
    // Two standard deviations are a fifth of the 7 % between these, 1 % of close ones.
    for (labels, two) in [([117.0, 126.0, 135.0, 144.0], 0.2 * 0.0692), ([30.0, 30.1, 30.3, 30.4], 0.01)] {
        let found = position(&of(&labels, 2, 0.0), false, None);
        assert!(((found.median + 2.0 * found.above).exp() / two - 1.0).abs() < 1e-2, "{found:?}");
    }
}

/// Quantiles of Student's distribution at 0.975 and at one σ: of 4 degrees of freedom 2.7764 and 1.1416, of 6 2.4469 and 1.0906.
#[test]
fn tails_are_longer_the_less_the_variances_are_known() {
    for (doubt, longer) in [(0.0, 1.0), (1.0, 1.1448), (1e9, 1.2408)] {
        let mut tails = Tails::default();
        tails.0[0][0] = doubt;
        let found = tails.longer([2.0, 0.0, 0.0, 0.0, 0.0, 0.0], 2.0);
        assert!((found / longer - 1.0).abs() < 3e-3, "{doubt}: {found}");
        assert_eq!(tails.longer([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], 2.0), 1.0);
    }
}

#[test]
fn least_squares_end_in_the_valley_and_say_what_is_not_determined() {
    // Rosenbrock's valley. At x = 0.5 the best y is 0.25, and 0.3 of the bounds that begin there.
    let valley = |x: &[f64]| Some(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]);
    for (start, bounds, best) in [
        (-1.2, [FREE; 2], [1.0, 1.0]),
        (-1.2, [[-2.0, 0.5], [-5.0, 5.0]], [0.5, 0.25]),
        (0.2, [[-2.0, 0.5], [0.3, 5.0]], [0.5, 0.3]),
    ] {
        let m = by_values(&valley, &[start, 1.0], &[1e-5; 2], &bounds, 1e-14).unwrap();
        assert!((0..2).all(|i| (m.at[i] - best[i]).abs() < 1e-9), "{:?} is not {best:?}", m.at);
    }
    assert!(by_values(&|x| Some(vec![x[0] - 1.0]), &[0.0; 2], &[1e-5; 2], &[FREE; 2], 1e-14).is_none());
    // Units do not matter.
    let n = DMatrix::from_row_slice(2, 2, &[4e12, 1.0, 1.0, 1e-12]);
    let x = DVector::from_column_slice(&[3e-6, 5e6]);
    let (found, inverse) = solve(&n, &(&n * &x)).unwrap();
    assert!((found - &x).component_div(&x).amax() < 1e-12);
    assert!((&n * inverse - DMatrix::identity(2, 2)).map(|e| e * 1e-12).amax() < 1e-12);
    assert!(solve(&DMatrix::from_element(2, 2, 1.0), &DVector::zeros(2)).is_none());
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(solve(&DMatrix::from_element(1, 1, bad), &DVector::zeros(1)).is_none());
        assert!(values(DMatrix::from_row_slice(2, 2, &[1.0, bad, 5.0, 6.0]), true).is_none());
    }
    assert!(values(DMatrix::zeros(0, 2), true).is_none());
    let _ = values(DMatrix::from_row_slice(2, 2, &[1e300, 1e-300, f64::MAX, -f64::MAX]), true);
}
