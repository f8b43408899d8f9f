//! Suspect rows: generalised extreme studentized deviates (Rosner 1983) on deleted residuals.

use std::collections::BTreeMap;

use vibrissa_core::normal::quantile;

use crate::fit::{Fault, Fit, From, Task, fit, start};
use crate::rows::cells;
use vibrissa_core::reduce::range;

/// False-alarm rate: a clean set of rows loses one with this probability.
const CHANCE: f64 = 0.01;
/// Least deviation of a suspect, as a share of its signal: real noise has longer tails than a normal distribution.
const LEAST: f64 = 0.03;
/// Fewest positions for which one can be suspect.
const ENOUGH: usize = 7;
/// The first and last position are checked if they have this many times fewer rows than the median.
const FEWER: usize = 4;
/// Rows off by more than this multiple of their signal, and of the usual one, are excluded before any fit.
const GROSS: f64 = 30.0;
/// Up to this many rows, the likeliest suspects are tried one by one: among few rows, a wrong one inflates the noise that hides it.
const FEW: usize = 60;
const TRIED: usize = 6;
/// ln of the prior probability that a row is wrong, with any signal within the range.
const WRONG: f64 = -9.2;
/// Misplaced decimal point: fewest other positions, largest factor by which a position may truly lie beyond them, ln of the prior probability.
const OTHERS: usize = 3;
const BEYOND: f64 = 2.5;
const MOVED: f64 = -4.6;
const MOST: f64 = 0.2;

/// A row left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suspect {
    /// Index of the row.
    pub place: usize,
    /// Measured − expected signal.
    pub off: f64,
    /// Expected signal above the zero.
    pub expected: f64,
}

/// Fits the rows at `places` and excludes, one by one, those that contradict the rest.
pub fn sound(task: &Task, places: &[usize]) -> Result<(Fit, Vec<Suspect>), Fault> {
    let mut found = gross(task, places)?;
    found.extend(slipped(task, &without(places, &found)));
    let mut kept = without(places, &found);
    let mut last = fit(task, &kept, From::Nowhere, true)?;
    while (found.len() as f64) < MOST * places.len() as f64 {
        let freedom = (last.freedom - 1.0).max(1.0);
        let wrong = match off_most(task, &last).first() {
            Some((suspect, t)) if is_rare(*t, freedom, kept.len()) => vec![*suspect],
            _ => hidden(task, &last, &kept),
        };
        if wrong.is_empty() {
            break;
        }
        let left = without(&kept, &wrong);
        let Ok(next) = fit(task, &left, From::Near(&last), false) else { break };
        found.extend(wrong);
        (last, kept) = (next, left);
    }
    if let Some(rows) = position(task, &last, &kept) {
        kept = without(&kept, &rows);
        found.extend(rows);
    }
    if !found.is_empty() {
        last = fit(task, &kept, From::Nowhere, true)?;
    }
    Ok((last, found))
}

/// Rows in another unit: so far from the base of the curve, scaled to most rows, that noise cannot explain them.
fn gross(task: &Task, places: &[usize]) -> Result<Vec<Suspect>, Fault> {
    let start = start(task, &cells(&task.rows, places, false), From::Nowhere)?;
    let [unit, zero, base_unit] = start.numbers;
    let suspect = |place: &usize| {
        let row = &task.rows[*place];
        let expected = if row.touches() { unit / base_unit * start.base.value(row.a, row.u) } else { 0.0 };
        let off = row.y - zero - expected;
        (off.abs() > GROSS * expected.max(unit)).then_some(Suspect { place: *place, off, expected })
    };
    let found: Vec<Suspect> = places.iter().filter_map(suspect).collect();
    Ok(if found.len() as f64 <= MOST * places.len() as f64 { found } else { Vec::new() })
}

/// Wrong rows among few: exclusion raises the evidence by more than the prior costs. Sets are tried, because wrong rows hide each other as noise.
fn hidden(task: &Task, whole: &Fit, kept: &[usize]) -> Vec<Suspect> {
    if kept.len() > FEW || whole.freedom < 3.0 {
        return Vec::new();
    }
    let [least, largest] = range(kept.iter().map(|k| task.rows[*k].y));
    let all: Vec<Suspect> = off_most(task, whole).into_iter().map(|s| s.0).collect();
    let gain = |wrong: &[Suspect]| {
        let next = fit(task, &without(kept, wrong), From::Nowhere, false).ok()?;
        let found: Vec<Suspect> = wrong.iter().map(|s| judged(task, &next, s.place, 1.0)).collect();
        let n = wrong.len() as f64;
        Some((found, next.evidence + n * (WRONG - (largest - least).ln()) - whole.evidence))
    };
    let best = |sets: &mut dyn Iterator<Item = &[Suspect]>| {
        let best = sets.filter_map(gain).max_by(|p, q| p.1.total_cmp(&q.1));
        best.filter(|best| best.1 > 0.0).map(|best| best.0)
    };
    let most = ((MOST * kept.len() as f64) as usize).min(TRIED).min(all.len());
    let one = best(&mut all[..TRIED.min(all.len())].chunks(1));
    let mut found = one.or_else(|| best(&mut (2..=most).map(|n| &all[..n]))).unwrap_or_default();
    found.retain(|s| s.off.abs() > LEAST * s.expected.abs());
    found
}

fn without(places: &[usize], wrong: &[Suspect]) -> Vec<usize> {
    places.iter().copied().filter(|k| !wrong.iter().any(|s| s.place == *k)).collect()
}

/// Deviation of a row from `fit`, which excludes it, at its label times `factor`.
fn judged(task: &Task, fit: &Fit, place: usize, factor: f64) -> Suspect {
    let row = &task.rows[place];
    let tap = || fit.curve.expected(&fit.base, factor * row.a, row.u, true).signal;
    let expected = if row.touches() { tap() } else { 0.0 };
    Suspect { place, off: row.y - fit.curve.zero()[0] - expected, expected }
}

/// Rows off by more than [`LEAST`] with their deviation in standard deviations, largest first.
fn off_most(task: &Task, fit: &Fit) -> Vec<(Suspect, f64)> {
    let mut all: Vec<(Suspect, f64)> = Vec::new();
    for (i, cell) in fit.cells.iter().enumerate() {
        for &place in &cell.rows {
            let (expected, row) = (fit.expected[i], &task.rows[place]);
            let (off, sd) = (row.y - expected, fit.deleted[i]);
            let t = off.abs() / sd;
            let expected = expected - fit.zeros[i];
            let signal = expected.abs().max(if row.touches() { 0.0 } else { fit.curve.unit });
            if off.abs() > LEAST * signal {
                all.push((Suspect { place, off, expected }, t));
            }
        }
    }
    all.sort_by(|p, q| q.1.total_cmp(&p.1));
    all
}

/// Rows of a position that contradicts the curve: the worst one, or an end with far fewer rows. Positions with many rows were meant.
fn position(task: &Task, last: &Fit, kept: &[usize]) -> Option<Vec<Suspect>> {
    let positions = positions(task, kept);
    if positions.len() < ENOUGH {
        return None;
    }
    let few = |rows: &&Vec<usize>| rows.len() <= 3 && (rows.len() as f64) < LEAST * kept.len() as f64;
    let miss = |rows: &[usize]| off(task, last, rows, 1.0)[0].abs();
    let spread = last.curve.spread.position.sqrt() >= LEAST;
    let worst = positions.values().max_by(|p, q| miss(p).total_cmp(&miss(q))).filter(|_| spread);
    let mut counts: Vec<usize> = positions.values().map(Vec::len).collect();
    counts.sort_unstable();
    let fewer = |rows: &&Vec<usize>| FEWER * rows.len() <= counts[counts.len() / 2];
    let ends = [positions.values().next(), positions.values().next_back()];
    let ends = ends.into_iter().flatten().filter(fewer);
    worst.into_iter().chain(ends).filter(few).find_map(|rows| unlike(task, rows, kept, positions.len()))
}

fn positions(task: &Task, kept: &[usize]) -> BTreeMap<i64, Vec<usize>> {
    let label = |k: &usize| (task.rows[*k].a.ln() * 1e9).round() as i64;
    let mut positions: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    let taps = kept.iter().filter(|k| task.rows[**k].touches());
    taps.for_each(|k| positions.entry(label(k)).or_default().push(*k));
    positions
}

/// Rows of the first or last position if its label needs the decimal point moved by one place: their signals are much likelier there.
fn slipped(task: &Task, kept: &[usize]) -> Vec<Suspect> {
    let positions = positions(task, kept);
    let all: Vec<(f64, &Vec<usize>)> = positions.values().map(|rows| (task.rows[rows[0]].a, rows)).collect();
    let tried = [0, all.len().saturating_sub(1)].into_iter().filter(|_| all.len() > OTHERS).find_map(|end| {
        let (label, rows) = all[end];
        let others = all.iter().enumerate().filter(|(i, _)| *i != end);
        let [least, most] = range(others.map(|(_, (a, _))| *a));
        let factor = if end == 0 { 10.0 } else { 0.1 };
        let there = factor * label;
        if label > least && label < most || there < least / BEYOND || there > most * BEYOND {
            return None;
        }
        let left: Vec<usize> = kept.iter().copied().filter(|k| !rows.contains(k)).collect();
        let next = fit(task, &left, From::Nowhere, false).ok()?;
        let ln = |factor: f64| {
            let [share, sd] = off(task, &next, rows, factor);
            let size = rows.iter().map(|k| judged(task, &next, *k, factor).expected.abs()).sum::<f64>();
            -0.5 * (share / sd).powi(2) - (sd * size).ln()
        };
        let suspect = |k: &usize| judged(task, &next, *k, 1.0);
        (ln(factor) - ln(1.0) + MOVED > 0.0).then(|| rows.iter().map(suspect).collect())
    });
    tried.unwrap_or_default()
}

/// Joint relative deviation of `rows` from `fit` at their labels times `factor`, and its standard deviation.
fn off(task: &Task, fit: &Fit, rows: &[usize], factor: f64) -> [f64; 2] {
    let n = rows.len() as f64;
    let of = |k: &usize| {
        let row = &task.rows[*k];
        let e = fit.curve.expected(&fit.base, factor * row.a, row.u, false);
        let (off, size) = (row.y - fit.curve.zero - e.signal, e.signal.abs());
        (off / size, (e.of_curve + e.of_position + e.of_run + e.of_noise / n) / (size * size))
    };
    let all: Vec<(f64, f64)> = rows.iter().map(of).collect();
    [all.iter().map(|x| x.0).sum::<f64>() / n, (all.iter().map(|x| x.1).sum::<f64>() / n).sqrt()]
}

/// `rows` as suspects if a fit of all others contradicts them; `positions` is the number of positions tested.
fn unlike(task: &Task, rows: &[usize], kept: &[usize], positions: usize) -> Option<Vec<Suspect>> {
    let left: Vec<usize> = kept.iter().copied().filter(|k| !rows.contains(k)).collect();
    let next = fit(task, &left, From::Nowhere, true).ok()?;
    let [share, sd] = off(task, &next, rows, 1.0);
    let rare = is_rare(share.abs() / sd, (positions as f64 - 5.0).max(1.0), positions);
    let suspect = |k: &usize| {
        let Suspect { expected, .. } = judged(task, &next, *k, 1.0);
        Suspect { place: *k, off: share * expected, expected }
    };
    (rare && share.abs() > LEAST).then(|| rows.iter().map(suspect).collect())
}

/// True if the largest of `n` Student deviates exceeds `t` with probability below [`CHANCE`] (normal approximation of Wallace 1959).
fn is_rare(t: f64, freedom: f64, n: usize) -> bool {
    let normal =
        (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * (freedom * (1.0 + t * t / freedom).ln()).sqrt();
    normal > -quantile(CHANCE / (2.0 * n as f64))
}
