//! What the candidates of swarms are read from, and over which ranges.

use std::sync::Arc;

use super::evaluate::{Readers, Scorer};
use super::score::Score;
use super::variables::Variables;
use crate::backend::Choice;
use crate::chart::between;
use crate::chart::ranges::Wanted;
use crate::chart::reader::RowReader;
use crate::chart::reader::{LEAST_TAPS, Reader, directions};
use crate::curve;
use crate::curve::{Ask, Curve, Reach, both};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::Task;
use crate::plan::Layout;
use crate::scene::search::{Calibrated, Quantity, Search};
use crate::scene::{Column, Setup, Tuple};
use crate::statistics::{DriveRow, Told};

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
        let variable = variables.list.iter().find(|v| v.quantity == Quantity::Column(column));
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

impl Scorer<'_> {
    /// Designs rows and scores of the nominal `whisker` at `drives`, degrees or mm.
    pub fn along(&mut self, whisker: &Tuple, drives: &[f64]) -> Result<Vec<(DriveRow, Score)>, Error> {
        let mut all = Vec::with_capacity(drives.len());
        for part in drives.chunks((self.batch / self.judge.distances.len()).max(1)) {
            all.extend(self.along_some(whisker, part)?);
        }
        Ok(all)
    }

    /// The same at as many drives as go to the backend together.
    fn along_some(&mut self, whisker: &Tuple, drives: &[f64]) -> Result<Vec<(DriveRow, Score)>, Error> {
        let (setup, reach, direction) = (self.judge.setup, self.judge.reach, whisker.direction());
        let n = self.judge.distances.len();
        let design = Design::new(setup, *whisker);
        let at = |drive: f64| Design { tuple: Tuple { drive, ..*whisker }, ..design.clone() };
        let designs: Vec<Design> = drives.iter().map(|drive| at(*drive)).collect();
        let task = |a: f64, drive: f64| Task::of(0, &Tuple { a, drive, ..*whisker });
        let distances = &self.judge.distances;
        // Drive by drive, as a row has them.
        let tasks: Vec<Task> =
            drives.iter().flat_map(|&drive| distances.iter().map(move |&a| task(a, drive))).collect();
        let one = std::slice::from_ref(&design);
        let taps = self.evaluator.run(one, &tasks)?;
        let own = self.curves(one, drives, Some(Reach::of(direction, reach)))?;
        let scored = self.judge.reach_of(0, direction);
        let of_scores = if scored == Some(Reach::of(direction, reach)) {
            None
        } else {
            Some(self.curves(one, drives, scored)?)
        };
        let asks: Vec<both::Ask> =
            tasks.iter().zip(&taps).map(|(task, tap)| both::Ask::own(setup, *task, tap, reach)).collect();
        let (both, _) = both::both(setup, &mut self.evaluator, one, &asks)?;
        let one = |j: usize| {
            let (design, taps) = (&designs[j], &taps[j * n..(j + 1) * n]);
            let both = both.get(j * n..(j + 1) * n).unwrap_or_default();
            let row = self.judge.reduce(design, (taps, both), Told::by(&own, j), None);
            let own = of_scores.as_ref().unwrap_or(&own).get(j..=j).unwrap_or_default();
            (row, self.judge.score(std::slice::from_ref(design), (taps, &[]), (own, both)))
        };
        Ok((0..drives.len()).map(one).collect())
    }

    /// The model's own curves at `drives` where distances are told by it; none without a `reach`.
    fn curves(
        &mut self,
        design: &[Design],
        drives: &[f64],
        reach: Option<Reach>,
    ) -> Result<Vec<Option<Curve>>, Error> {
        let Some(reach) = reach else { return Ok(Vec::new()) };
        let asks: Vec<Ask> = drives.iter().map(|&drive| Ask { design: 0, drive, reach }).collect();
        Ok(curve::solve(self.judge.setup, &mut self.evaluator, design, &asks)?.0)
    }
}
