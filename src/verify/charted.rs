//! The chart that ranks designs, against the reference: the strains that its rows are made of.

use super::Case;
use super::census::{Census, Line};
use super::places::Place;
use crate::design::{Design, amount};
use crate::evaluate::Outcome;
use crate::scene::Tuple;
use crate::smooth::{Case as Reading, Scope, Tables};

/// The line of the chart that `place` ranks the designs of `case` with, if it does. Taps that the chart leaves to the kernel are counted
/// as `neither`.
pub(super) fn line(
    case: &Case,
    place: &Place,
    at: (usize, f64),
    designs: &[Design],
    expected: &[Outcome],
) -> Option<Line> {
    let study = case.study.as_ref()?;
    let layout = study.space.layout()?;
    let scope = Scope::new(study, &layout, place.chart_tolerance()?)?;
    let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
    let read = |i: usize| {
        let distance = distances.iter().position(|a| *a == case.tuples[i].a)?;
        let easy = scope.case(&case.tuples[i]) == Reading::Easy && expected[i].strain.is_finite();
        easy.then_some((i, (case.tuples[i], distance)))
    };
    let (places, taps): (Vec<usize>, Vec<(Tuple, usize)>) = (0..case.tuples.len()).filter_map(read).unzip();
    let mut errors = vec![None; case.tuples.len()];
    for (i, deviation) in places.into_iter().zip(Tables::new(&scope).deviations(&taps)) {
        let linear = amount(case.setup.drive, case.tuples[i].drive);
        let shared = designs[i].shared.as_ref()?;
        let least = 1e-3 * shared.peak * linear;
        let exact = expected[i].strain;
        let found = expected[i].strain_linear / (1.0 + deviation);
        errors[i] = Some((found - exact).abs() / exact.abs().max(least));
    }
    let mut census = Census::default();
    errors.into_iter().for_each(|error| census.push_strain(error));
    let name = format!("{} chart", case.name);
    Some(census.close(&name, case.setup.drive, at, &case.tuples, (expected, expected)))
}
