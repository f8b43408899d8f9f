//! Points and polynomials of charts, and distances between charts. From outside: the crate need not be compiled twice.

use vibrissa_chart::adaptive::{MOST, newton, point, to_chebyshev};
use vibrissa_chart::between::{Between, nodes};
use vibrissa_core::physics::chebyshev::series;

#[test]
fn mean_and_squares_over_the_distances_are_forms_of_the_values_at_the_charts() {
    let nodes = nodes([21.0, 48.0], 13);
    let distances: Vec<f64> = (0..200).map(|i| 21.0 + 27.0 * (f64::from(i) / 199.0).powi(2)).collect();
    let between = Between::new(&nodes, &distances, 0.0);
    let f = |a: f64| 1.0 / (1.0 - a / 70.0);
    let values: Vec<f64> = distances.iter().map(|a| f(*a)).collect();
    let mean = values.iter().sum::<f64>() / 200.0;
    let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let known: Vec<f64> = nodes.iter().map(|a| f(*a)).collect();
    let found: f64 = between.mean.iter().zip(&known).map(|(w, v)| w * v).sum();
    assert!((found - mean).abs() < 1e-9 * mean, "{found} {mean}");
    let form: f64 = between
        .squares
        .iter()
        .map(|row| row.iter().zip(&known).map(|(f, v)| f * (v - found)).sum::<f64>().powi(2))
        .sum();
    assert!((form - spread).abs() < 1e-8 * spread, "{form} {spread}");
}

#[test]
fn a_smooth_function_is_rebuilt_and_its_surplus_bounds_what_is_left() {
    let f = |x: f64| 1.0 / (2.5 - x);
    let mut line: Vec<f64> = (0..16).map(|k| f(point(k))).collect();
    for k in 1..line.len() {
        let before: f64 = (0..k).map(|j| line[j] * newton(&[j as u8], &[k as u8])).sum();
        line[k] -= before;
    }
    let last = line[15].abs();
    to_chebyshev(&mut line);
    for i in 0..=100 {
        let x = 0.02 * f64::from(i) - 1.0;
        assert!((series(&line, x).0 - f(x)).abs() < 4.0 * last, "{x}");
    }
}

#[test]
fn newtons_polynomials_stay_below_one() {
    for j in 0..MOST {
        for i in 0..=1000 {
            let x = 0.002 * f64::from(i) - 1.0;
            let value: f64 = (0..j).map(|i| (x - point(i)) / (point(j) - point(i))).product();
            assert!(value.abs() < 1.001, "{j} {x} {value}");
        }
    }
}
