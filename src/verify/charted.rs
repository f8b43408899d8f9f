//! The chart that ranks designs, against the reference: the strains that its rows are made of.

use super::Case;
use super::census::{Census, Line};
use super::places::Place;
use crate::chart::ranker::Ranker;
use crate::design::{Design, amount};
use crate::evaluate::Outcome;
use crate::kernel::ranking::{Case as Reading, Charts};
use crate::scene::Tuple;

/// The line of the chart that `place` ranks the designs of `case` with, if it does, on these taps and their designs. Taps that the
/// chart leaves to the kernel are counted as `neither`.
pub(super) fn line(
    case: &Case,
    place: &Place,
    at: (usize, f64),
    (tuples, designs): (&[Tuple], &[Design]),
    expected: &[Outcome],
) -> Option<Line> {
    let study = case.study.as_ref()?;
    let layout = study.space.layout()?;
    let ranker = Ranker::new(study, &layout, place.chart_tolerance()?).ok().flatten()?;
    let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
    let read = |i: usize| {
        let distance = distances.iter().position(|a| *a == tuples[i].a)?;
        let easy = ranker.case(&tuples[i]) == Reading::Easy && expected[i].strain.is_finite();
        easy.then_some((i, (tuples[i], distance)))
    };
    let (places, taps): (Vec<usize>, Vec<(Tuple, usize)>) = (0..tuples.len()).filter_map(read).unzip();
    let mut errors = vec![None; tuples.len()];
    for (i, deviation) in places.into_iter().zip(ranker.deviations(&taps)) {
        let linear = amount(case.setup.drive, tuples[i].drive);
        let shared = designs[i].shared.as_ref()?;
        let least = 1e-3 * shared.peak * linear;
        let exact = expected[i].strain;
        let found = expected[i].strain_linear / (1.0 + deviation);
        errors[i] = Some((found - exact).abs() / exact.abs().max(least));
    }
    let mut census = Census::default();
    errors.into_iter().for_each(|error| census.push_strain(error));
    let name = format!("{} chart", case.name);
    Some(census.close(&name, (case.setup.drive, false), at, tuples, (expected, expected)))
}
