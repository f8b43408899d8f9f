//! One whisker over many drives: its taps solved once for rows and scores.

use super::evaluate::Scorer;
use super::score::Score;
use crate::curve::{self, Ask, Curve, Reach, both};
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::Task;
use crate::scene::Tuple;
use crate::statistics::{DriveRow, Told};

impl Scorer<'_> {
    /// Designs rows and scores of `whisker` at `drives`, degrees or mm.
    ///
    /// # Errors
    /// A backend that fails.
    pub fn along(&mut self, whisker: &Tuple, drives: &[f64]) -> Result<Vec<(DriveRow, Score)>, Error> {
        if !self.judge.deviations.is_empty() {
            let points: Vec<Tuple> = drives.iter().map(|&drive| Tuple { drive, ..*whisker }).collect();
            return Ok(self.rows(&points)?.into_iter().zip(self.scores(&points)?).collect());
        }
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
