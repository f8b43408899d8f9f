//! Scores candidates: all candidates × robust samples × distances form one batch of the backend.

use std::sync::Arc;

use rayon::prelude::*;

use super::judge::{Distances, Judge, Taps};
use super::score::deviations;
use super::{Found, Score, Variables, report};
use crate::backend::{Backend, Choice};
use crate::chart::between;
use crate::chart::ranges::Wanted;
use crate::chart::ranker::Ranker;
use crate::chart::reader::{LEAST_TAPS, Reader, directions};
use crate::curve::{self, Ask, Reach, both};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Evaluator, Method, Referral, Task};
use crate::plan::Layout;
use crate::scene::{Calibrated, Column, Direction, Quantity, Search, Setup, Theory, Tuple};
use crate::statistics::{DriveRow, Told};

/// Taps per batch. Between batches a stop and the time are checked.
pub(super) fn batch(backend: &Backend) -> usize {
    match backend.name {
        "gpu" => 1 << 18,
        "reference" => 1 << 6,
        _ => 1 << 11,
    }
}

/// A candidate with exact curves counts as this many in a batch.
const CURVE: usize = 4;

/// Relative error of the reference: of its integration and of its root finding.
const REFERENCE: f64 = 1e-12;

const READ: usize = 1 << 16;

pub struct Scorer<'a> {
    pub evaluator: Evaluator<'a>,
    /// What it refers to the reference.
    pub referral: Referral,
    pub(super) judge: Judge<'a>,
    pub(super) batch: usize,
    /// Reads whole rows from charts instead of solving taps.
    pub(super) rows: Option<Arc<Ranker>>,
}

impl<'a> Scorer<'a> {
    pub fn new(setup: &'a Setup, layout: &Layout, search: &'a Search, method: Method) -> Self {
        let distances = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
        let samples = search.robust.as_ref().map_or(0, |r| r.samples);
        let deviations = deviations(search.seed, samples);
        let evaluator = Evaluator::new(setup, method);
        let margin = evaluator.tolerance().max(REFERENCE);
        let judge = Judge { setup, search, distances, reach: layout.reach(), deviations, margin };
        Self { evaluator, referral: Referral::ALL, judge, batch: 1 << 18, rows: None }
    }

    pub fn taps(&self) -> usize {
        let samples = self.judge.deviations.len();
        let again = if self.judge.blind() { samples } else { 0 };
        (1 + samples + again) * self.judge.distances.len()
    }

    pub fn scores(&mut self, points: &[Tuple]) -> Result<Vec<Score>, Error> {
        self.scores_while(points, &|| true)
    }

    /// Like [`Self::scores`], until `on` returns false; then the scores of the first points.
    pub fn scores_while(&mut self, points: &[Tuple], on: &dyn Fn() -> bool) -> Result<Vec<Score>, Error> {
        let mut scores = Vec::with_capacity(points.len());
        let more = if self.judge.setup.estimate.theory == Theory::Exact { CURVE } else { 1 };
        let batch = if self.rows.is_some() { READ.max(self.batch) } else { self.batch };
        for part in points.chunks((batch / (more * self.taps())).max(1)) {
            if !on() {
                break;
            }
            scores.extend(self.batch(part)?);
        }
        Ok(scores)
    }

    pub fn nominal(&mut self, points: &[Tuple], on: &dyn Fn() -> bool) -> Result<Vec<Score>, Error> {
        let deviations = std::mem::take(&mut self.judge.deviations);
        let scores = self.scores_while(points, on);
        self.judge.deviations = deviations;
        scores
    }

    pub fn sticking(&mut self, point: &Tuple) -> Result<Vec<bool>, Error> {
        let design = [Design::new(self.judge.setup, *point)];
        let tasks = self.judge.tasks(&design);
        let taps = self.evaluator.run_referring(&design, &tasks, self.referral)?;
        Ok(taps.iter().map(|tap| tap.sticking).collect())
    }

    /// Row and score of the nominal `whisker` at each of `drives`.
    pub fn along(&mut self, whisker: &Tuple, drives: &[f64]) -> Result<Vec<(DriveRow, Score)>, Error> {
        let deviations = std::mem::take(&mut self.judge.deviations);
        let points: Vec<Tuple> = drives.iter().map(|&drive| Tuple { drive, ..*whisker }).collect();
        let parts = points.chunks((self.batch / self.judge.distances.len()).max(1));
        let row = |judge: &Judge<'a>, designs: &[Design], taps: Taps<'_>, told: Distances<'_>| {
            let row = judge.reduce(&designs[0], (taps.0, told.1), Told::by(told.0, 0), None);
            (row, judge.score(designs, taps, told))
        };
        let all: Result<Vec<_>, Error> = parts.map(|part| self.solved(part, true, row)).collect();
        self.judge.deviations = deviations;
        Ok(all?.concat())
    }

    pub fn design(&mut self, Found { point, score }: Found) -> Result<report::Design, Error> {
        let unit = report::unit(self.judge.setup, &point);
        let row = self.along(&point, &[point.drive])?[0].0;
        Ok(report::Design { point, row, score, unit })
    }

    fn read(&mut self, reader: &Ranker, points: &[Tuple]) -> Result<Vec<Score>, Error> {
        let (judge, n) = (&self.judge, self.judge.distances.len());
        let whiskers = 1 + judge.deviations.len();
        let whisker = |w: usize| judge.whisker(&points[w / whiskers], w % whiskers);
        let tuples: Vec<Tuple> = (0..points.len() * whiskers).into_par_iter().map(whisker).collect();
        let found = reader.figures(&tuples);
        let told = |w: usize| found[w].as_ref().map(|figures| judge.score_of_chart(&tuples[w], figures));
        let mut scores: Vec<Option<Score>> = (0..tuples.len()).into_par_iter().map(told).collect();
        let open: Vec<usize> = (0..tuples.len()).filter(|&w| scores[w].is_none()).collect();
        let designs: Vec<Design> = open.par_iter().map(|&w| Design::new(judge.setup, tuples[w])).collect();
        let tasks = judge.tasks(&designs);
        let taps = self.evaluator.run_referring(&designs, &tasks, self.referral)?;
        let solved = |d: usize| judge.score(&designs[d..=d], (&taps[d * n..(d + 1) * n], &[]), (&[], &[]));
        let solved: Vec<Score> = (0..designs.len()).into_par_iter().map(solved).collect();
        open.into_iter().zip(solved).for_each(|(w, score)| scores[w] = Some(score));
        let scores: Vec<Score> = scores.into_iter().map(|s| s.unwrap_or(Score::NOTHING)).collect();
        Ok(scores.par_chunks(whiskers).map(|scores| judge.gather(scores)).collect())
    }

    fn batch(&mut self, points: &[Tuple]) -> Result<Vec<Score>, Error> {
        match self.rows.clone() {
            Some(reader) => self.read(&reader, points),
            None => self.solved(points, false, Judge::score),
        }
    }

    /// Calls `told` with the solved whiskers of each of `points`. `kept`: the points are drives of one whisker, and all their taps are solved, none is read
    /// from charts.
    fn solved<T: Send>(
        &mut self,
        points: &[Tuple],
        kept: bool,
        told: impl Fn(&Judge<'a>, &[Design], Taps<'_>, Distances<'_>) -> T + Sync,
    ) -> Result<Vec<T>, Error> {
        let judge = &self.judge;
        let whiskers = 1 + judge.deviations.len();
        let n = judge.distances.len();
        let known = points.first().filter(|_| kept).map(|point| judge.design(point, 0));
        let design = |w: usize| match &known {
            Some(known) => Design { tuple: points[w], ..known.clone() },
            None => judge.design(&points[w / whiskers], w % whiskers),
        };
        let designs: Vec<Design> = (0..points.len() * whiskers).into_par_iter().map(design).collect();
        let tasks = judge.tasks(&designs);
        let taps = match kept {
            true => self.evaluator.run_referring(&designs, &tasks, self.referral)?,
            false => self.evaluator.read(&designs, &tasks, self.referral)?,
        };
        let sampled = |t: &&Task| judge.blind() && !(t.design as usize).is_multiple_of(whiskers);
        let calibrating = tasks.iter().filter(sampled).map(|t| Task { direction: Direction::UPRIGHT, ..*t });
        let asked: Vec<Task> = calibrating.collect();
        let upright = match asked.is_empty() {
            true => Vec::new(),
            false => self.evaluator.read(&designs, &asked, self.referral)?,
        };
        let ask = |(w, design): (usize, &Design)| {
            let direction = design.tuple.direction();
            let reach = match kept {
                true => Reach::of(direction, judge.reach),
                false => judge.reach_of(w % whiskers, direction)?,
            };
            Some(Ask { design: w as u32, drive: design.tuple.drive, reach })
        };
        let asks: Vec<Ask> = designs.iter().enumerate().filter_map(ask).collect();
        let (curves, _) = curve::solve(judge.setup, (&mut self.evaluator, self.referral), &designs, &asks)?;
        let mut own = vec![None; if curves.is_empty() { 0 } else { designs.len() }];
        asks.iter().zip(curves).for_each(|(ask, curve)| own[ask.design as usize] = curve);
        let ask = |t: usize| judge.ask(&designs, whiskers, tasks[t], &taps[t]);
        let asks: Vec<both::Ask> = (0..tasks.len()).into_par_iter().map(ask).collect();
        let (both, _) = both::both(judge.setup, (&mut self.evaluator, self.referral), &designs, &asks)?;
        let one = |p: usize| {
            let (first, last) = (p * whiskers, (p + 1) * whiskers);
            let both = both.get(first * n..last * n).unwrap_or_default();
            let own = own.get(first..last).unwrap_or_default();
            let again = (last - first - 1) * n;
            let upright = upright.get(p * again..(p + 1) * again).unwrap_or_default();
            told(judge, &designs[first..last], (&taps[first * n..last * n], upright), (own, both))
        };
        Ok((0..points.len()).into_par_iter().map(one).collect())
    }
}

/// Charts cover this many standard deviations of the samples; the few beyond are solved.
const SPREAD: f64 = 3.5;

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
    /// The same scorer with charts, if charts are possible and save time; and whether it has them.
    pub(super) fn charted(
        mut self,
        layout: &Layout,
        wanted: &Wanted,
        choice: &Choice,
    ) -> Result<(Self, bool), Error> {
        let Judge { setup, search, ref distances, .. } = self.judge;
        let robust = search.robust.as_ref();
        let samples = robust.map_or(0, |r| r.samples) as u64;
        let taps = search.budget.evaluations.map(|n| n.saturating_mul((1 + samples) * layout.n_distances));
        let few = layout.n_distances > between::MOST || taps.is_some_and(|taps| taps < LEAST_TAPS);
        // Charts need a fixed direction and a fixed rig.
        let still = setup.rigs.is_none() && !robust.is_some_and(|r| r.tilts() || !r.properties.is_empty());
        let Some((tolerance, directions)) =
            choice.chart_tolerance().zip(directions(layout)).filter(|_| still && !few)
        else {
            return Ok((self, false));
        };
        let planar = layout.is_upright() && !setup.gauge.second;
        // Readings that are converted with another whisker's calibration are reduced from taps.
        let own = robust.is_none_or(|r| r.calibrated == Calibrated::Each);
        if own && planar {
            self.rows = Ranker::of_rows(setup, distances, wanted, tolerance)?.map(Arc::new);
        }
        if self.rows.is_some() {
            return Ok((self, true));
        }
        let taps = Reader::new(setup, (distances, &directions), wanted, tolerance)?.map(Arc::new);
        let any = taps.is_some();
        Ok((Self { evaluator: self.evaluator.reading(taps), ..self }, any))
    }
}
