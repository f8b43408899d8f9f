//! Distances between charts.

use vibrissa_chart::between::{Between, nodes};

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
