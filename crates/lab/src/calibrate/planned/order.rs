//! Order of the taps of a plan: a drift must not look like a curve, nor a run like a position.

use super::MOST;
use crate::measure::{Rig, Unit};
use crate::{error::InputError, estimator::learned::LearnedRecord, locate::Calibration, scene::Sampler};
use vibrissa_learned::curve::Spread;
use vibrissa_learned::plan::{Planner, Tap};

const ZEROS: usize = 2;
const BETWEEN: usize = 12;

/// Line of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Run, from 0.
    pub run: usize,
    /// Index of the distance.
    pub distance: usize,
    /// Index of the drive; `None` for a zero reading.
    pub drive: Option<usize>,
}

/// Lines of all runs, in random order with zeros between; every other run reverses the positions, so that a steady drift does not look like them.
pub fn rows(taps: &[Tap], runs: usize, seed: u64) -> Vec<Row> {
    let mut positions: Vec<usize> = taps.iter().map(|t| t[0]).collect();
    positions.sort_unstable();
    positions.dedup();
    let drawn = |what: u32, k: usize| Sampler::Random.coordinate(seed, what, k as u32);
    positions.sort_by_key(|i| drawn(0, *i));
    let mut all = Vec::new();
    for run in 0..runs {
        let mut order = positions.clone();
        if run % 2 == 1 {
            order.reverse();
        }
        let mut since = BETWEEN;
        let mut last = None;
        for i in order {
            let here = |(_, t): &(usize, &Tap)| t[0] == i && t[2] == run;
            let mut drives: Vec<(usize, &Tap)> = taps.iter().enumerate().filter(here).collect();
            drives.sort_by_key(|(n, _)| drawn(1, *n));
            for (k, (_, tap)) in drives.into_iter().enumerate() {
                if since >= BETWEEN || (k == 0 && 2 * since >= BETWEEN) {
                    all.extend([Row { run, distance: i, drive: None }; ZEROS]);
                    since = 0;
                }
                all.push(Row { run, distance: i, drive: Some(tap[1]) });
                since += 1;
                last = Some(i);
            }
        }
        if let Some(i) = last {
            all.extend([Row { run, distance: i, drive: None }; ZEROS]);
        }
    }
    all
}

/// Even grids of distances and drives, in each run or divided over the runs; of each size the best one, if better than all smaller ones.
pub fn even(planner: &Planner, distances: &[f64], drives: &[f64], runs: usize) -> Vec<(usize, f64)> {
    let n = distances.len();
    let spread = |k: usize, of: usize, n: usize| if of > 1 { k * (n - 1) / (of - 1) } else { n - 1 };
    let few = drives.len().min(6);
    let kinds = (2..=n).flat_map(|p| (1..=few).flat_map(move |d| [(p, d, true), (p, d, false)]));
    let mut all: Vec<(usize, f64)> = Vec::new();
    for (positions, of_drives, each) in kinds {
        if positions * of_drives * if each { runs } else { 1 } > MOST {
            continue;
        }
        let taps = (0..runs).flat_map(|run| {
            let own = (0..positions).filter(move |k| each || k % runs == run);
            own.flat_map(move |k| {
                let place = spread(k, positions, n);
                (0..of_drives).map(move |j| [place, spread(j, of_drives, drives.len()), run])
            })
        });
        let grid = planner.with(taps);
        all.push((grid.count(), grid.sigma()));
    }
    all.sort_by(|p, q| p.0.cmp(&q.0).then(p.1.total_cmp(&q.1)));
    let mut least = f64::INFINITY;
    all.retain(|(_, sigma)| {
        let better = *sigma < least;
        least = least.min(*sigma);
        better
    });
    all
}

/// Spread of a rig as learned by an earlier calibration; `gain` replaces that of a calibration with one run.
/// Errors: a calibration without `learned`, of another signal, or driven in another way.
pub fn like(calibration: &Calibration, rig: &Rig, gain: f64, label: &str) -> Result<Spread, InputError> {
    let fault = |message: &str, allowed: String| {
        Err(InputError::new(message).at(label, None).key("--like").allowed(allowed))
    };
    let signal = Unit::of_column(&calibration.signal).and_then(Unit::signal);
    if signal != Some(rig.setup.signal) {
        return fault("this calibration is of another signal", format!("one of {}", rig.setup.signal.word()));
    }
    if calibration.rig.setup.drive != rig.setup.drive {
        let allowed = format!("one with {}", rig.setup.drive.column());
        return fault("the whisker of this calibration is driven another way", allowed);
    }
    let Some(LearnedRecord { units, spread, runs, .. }) =
        calibration.sides.first().and_then(|side| side.learned.as_ref())
    else {
        return fault("this calibration was not learned", "a calibration.toml that holds learned".to_owned());
    };
    let [floor, relative, position, visit, of_runs, zero, _] = *spread;
    let [floor, zero] = [floor, zero].map(|x| (x.sqrt() * units[0]).powi(2));
    let [gain, zero] = if *runs > 1 { [of_runs, zero] } else { [gain * gain, floor] };
    Ok(Spread { floor, relative, position, visit, gain, zero, drift: 0.0 })
}
