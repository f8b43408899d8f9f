//! What the candidates of swarms are read from, and over which ranges.

use std::sync::Arc;

use super::evaluate::Readers;
use super::variables::Variables;
use crate::backend::Choice;
use crate::chart::{
    between,
    ranges::Wanted,
    reader::{LEAST_TAPS, Reader, directions},
    rows::RowReader,
};
use crate::error::Error;
use crate::plan::Layout;
use crate::scene::search::{Calibrated, Quantity, Search};
use crate::scene::{Column, Setup};

/// Sampled whiskers lie within so many standard deviations, but for few, which are solved.
const SPREAD: f64 = 3.5;

/// What the candidates of swarms are read from, where charts can and it pays.
pub(super) fn readers(
    setup: &Setup,
    layout: &Layout,
    wanted: &Wanted,
    choice: &Choice,
    search: &Search,
) -> Result<Readers, Error> {
    let samples = search.robust.as_ref().map_or(0, |r| r.samples) as u64;
    let taps = search.budget.evaluations.map(|n| n.saturating_mul((1 + samples) * layout.n_distances));
    let few = layout.n_distances > between::MOST || taps.is_some_and(|taps| taps < LEAST_TAPS);
    // A direction that is sampled has no chart; nor has a rig that varies.
    let still = !search.robust.as_ref().is_some_and(|robust| robust.tilts() || !robust.properties.is_empty())
        && setup.rigs.is_none();
    let Some((tolerance, directions)) =
        choice.chart_tolerance().zip(directions(layout)).filter(|_| still && !few)
    else {
        return Ok(Readers::default());
    };
    let planar = layout.is_upright() && !setup.gauge.second;
    let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
    // Where readings are turned into distances with the calibration of another whisker they are reduced from taps.
    let own = search.robust.as_ref().is_none_or(|r| r.calibrated == Calibrated::Each);
    if own
        && planar
        && let Some(rows) = RowReader::new(setup, &distances, wanted, tolerance)?
    {
        return Ok(Readers { rows: Some(Arc::new(rows)), taps: None });
    }
    let taps = Reader::new(setup, (&distances, &directions), wanted, tolerance)?.map(Arc::new);
    Ok(Readers { rows: None, taps })
}

/// What the numbers of candidates, and of whiskers sampled around them, can be.
pub(super) fn wanted(layout: &Layout, search: &Search, variables: &Variables) -> Wanted {
    let drives = Wanted::of(layout).drive;
    let range = |column: Column| {
        let k = column as usize;
        let variable = variables.list().iter().find(|v| v.quantity == Quantity::Column(column));
        let [lo, hi] = match (variable, column) {
            (Some(v), _) => [v.min, v.max],
            (None, Column::Drive) => drives,
            _ => [layout.design(0).to_array()[k]; 2],
        };
        let sd = search.robust.as_ref().map_or(0.0, |r| r.sd[k]);
        // A drive or a length that is not positive is none.
        let least = if column == Column::GaugePosition { 0.0 } else { 0.05 * lo };
        [(lo - SPREAD * sd).max(least), hi + SPREAD * sd]
    };
    Wanted {
        D: range(Column::BaseDiameter),
        d: range(Column::TipDiameter),
        L_a: range(Column::Length),
        x_ss: range(Column::GaugePosition),
        l: range(Column::GridLength),
        drive: range(Column::Drive),
    }
}
