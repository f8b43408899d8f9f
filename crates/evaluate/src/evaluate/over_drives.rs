//! Taps of one distance over many drives: solved at some of them, read at the others.

use rayon::prelude::*;

use super::solve::Solved;
use super::{Counted, Evaluator, Task, built, frame, solid};
use crate::design::Design;
use crate::kernel::drives::DriveAxis;
use crate::scene::Setup;

impl Evaluator<'_> {
    /// Outcomes of taps that come in runs of one distance over all of `drives`, and how many taps were solved. A run whose
    /// solutions are smooth over the drive is read from a few of them; the others are solved drive by drive.
    pub fn run_over_drives(&mut self, designs: &[Design], tasks: &[Task], drives: &[f64]) -> Counted {
        let one =
            &mut |one: &mut Evaluator<'_>, tasks: &[Task]| one.over_drives_alike(designs, tasks, drives);
        let (outcomes, count) = self.by_kind(designs, tasks, one)?;
        Ok((self.mend(designs, tasks, outcomes)?, count))
    }

    /// The same of designs with rigs of one kind, not yet mended.
    fn over_drives_alike(&mut self, designs: &[Design], tasks: &[Task], drives: &[f64]) -> Counted {
        let setup = self.setup;
        let told = solid::asked(setup) || setup.asks_wrench() || built::asked(setup);
        if self.needs_no_kernel(tasks) || told || tasks.iter().any(|task| task.is_spatial(setup)) {
            return Ok((self.run_alike(designs, tasks)?, tasks.len() as u64));
        }
        let ways = DriveAxis::ways(drives);
        let tolerance = self.tolerance();
        let mut solved: Vec<Option<Solved>> = vec![None; tasks.len()];
        let mut open: Vec<usize> = (0..tasks.len() / drives.len()).collect();
        let mut count = 0;
        for way in &ways {
            let at = |r: usize, drive: f64| Task { drive, ..tasks[r * drives.len()] };
            let nodes: Vec<Task> =
                open.iter().flat_map(|&r| way.nodes.iter().map(move |&x| at(r, x))).collect();
            let found = self.solutions(designs, &nodes)?;
            count += nodes.len() as u64;
            let read = |(&r, found): (&usize, &[Option<Solved>])| {
                let tasks = &tasks[r * drives.len()..(r + 1) * drives.len()];
                (r, over_drives(setup, designs, tasks, way, found, tolerance))
            };
            let runs: Vec<_> = open.par_iter().zip(found.par_chunks(way.nodes.len())).map(read).collect();
            open.clear();
            for (r, run) in runs {
                match run {
                    Some(run) => {
                        for (place, s) in solved[r * drives.len()..].iter_mut().zip(run) {
                            *place = Some(s);
                        }
                    }
                    None => open.push(r),
                }
            }
        }
        let rest: Vec<usize> = open.iter().flat_map(|&r| r * drives.len()..(r + 1) * drives.len()).collect();
        let again: Vec<Task> = rest.iter().map(|&i| tasks[i]).collect();
        count += again.len() as u64;
        for (&i, s) in rest.iter().zip(self.solutions(designs, &again)?) {
            solved[i] = s;
        }
        Ok((self.outcomes(designs, tasks, &solved, None)?, count))
    }
}

/// A run of taps over the drives of `way`, from the solutions `found` at its nodes; `None` where they are not all of one kind, and good,
/// and smooth.
fn over_drives(
    setup: &Setup,
    designs: &[Design],
    tasks: &[Task],
    way: &DriveAxis,
    found: &[Option<Solved>],
    tolerance: f64,
) -> Option<Vec<Solved>> {
    let grip = found[0].as_ref()?.grip;
    let usable = |s: &Option<Solved>| {
        s.as_ref().filter(|s| s.grip == grip && s.solution.within(tolerance)).map(|s| s.solution)
    };
    let nodes: Option<Vec<_>> = found.iter().map(usable).collect();
    let solutions = way.spread(&nodes?, tolerance)?;
    let one = |(task, solution)| {
        let frame = frame(setup, &designs[tasks[0].design as usize], task, grip)?;
        Some(Solved { frame, solution, grip, sweeps: 0.0, interpolated: true, plane: None, seen: None })
    };
    tasks.iter().zip(solutions).map(one).collect()
}
