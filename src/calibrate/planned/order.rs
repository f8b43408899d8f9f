//! In which order the taps of a plan are done, so that a drift is no curve and a run no position.

use vibrissa_learned::plan::Tap;

use crate::scene::sampler::Sampler;

/// Zero readings at a time.
const ZEROS: usize = 2;
/// Most taps between zero readings.
const BETWEEN: usize = 12;

/// One line of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Run, from 0.
    pub run: usize,
    /// Place of the distance.
    pub distance: usize,
    /// Place of the drive; `None` of a zero reading.
    pub drive: Option<usize>,
}

/// The lines of all runs: positions in a random order, each visited once in a run, in every other run backwards, so that a steady drift
/// is none of positions; drives at a position in a random order; zeros at both ends and between.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tap_is_there_once_with_zeros_around() {
        let taps: Vec<Tap> = (0..2)
            .flat_map(|run| (0..9).flat_map(move |i| [[i, 0, run], [i, 2, run], [i, 2, run]]))
            .collect();
        let rows = rows(&taps, 2, 5);
        let mut found: Vec<Tap> = rows.iter().filter_map(|r| Some([r.distance, r.drive?, r.run])).collect();
        let mut wanted = taps.clone();
        found.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(found, wanted);
        let mut since = 0;
        for pair in rows.windows(2) {
            since = if pair[0].drive.is_none() { 0 } else { since + 1 };
            assert!(since <= BETWEEN && (pair[0].run == pair[1].run || pair[0].drive.is_none()));
        }
        assert!(rows[0].drive.is_none() && rows[rows.len() - 1].drive.is_none());
    }
}
