//! Even grids, with which a plan is compared.

use vibrissa_learned::plan::Planner;

use super::MOST;

/// Even grids: some of the drives, evenly apart with both ends, at 2, 3 … positions evenly apart with both ends; in each run, or the positions
/// in one run after the other. Of each size the best one, where it is better than all smaller ones.
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
        all.push((grid.len(), grid.sigma()));
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
