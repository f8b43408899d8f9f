//! Rows that should not be believed, each with its reason: robust checks before anything is fitted.
//!
//! In order: a sensor at its end stop, repeats that disagree with their own cell, cells that disagree with the smooth surface
//! through all others, alone among their neighbours.

use std::collections::HashSet;

use super::Reason;
use super::surface::{Compared, Expected, FAR, LEAST, NORMAL, judged};
use crate::estimator::cells::{Cell, Levels, cells};
use crate::estimator::taps::Tap;
use crate::measure::Rig;
use crate::measure::group::rounding;
use crate::reduce::median;

/// A model that is not wrong altogether misses a whisker by no more than this share of the signal.
const MISSED: f64 = 0.05;
/// Readings at an end stop fall short of the surface by more than this share of the signal: it is carried on to them.
const SHORT: f64 = 0.03;

/// Scatter about the smooth surface, in the unit of the signal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scatter {
    /// Standard deviation of one reading, if the surface leaves nothing else.
    pub signal: f64,
    /// Whole positions off the surface, mm: their rows are used.
    pub positions: Vec<f64>,
}

/// Flags rows of one side; of `models`, the one from which the data differ most smoothly is what they are compared with.
pub fn flag(taps: &mut [Tap], rig: &Rig, sign: f64, models: &[&Expected<'_>]) -> Scatter {
    let here = |t: &Tap| t.reason.is_none() && t.signal.signum() == sign;
    let levels = |taps: &[Tap], f: fn(&Tap) -> f64| Levels::of(taps.iter().filter(|t| here(t)).map(f));
    let (distances, drives) = (levels(taps, |t| t.group[0]), levels(taps, |t| t.group[1]));
    if distances.is_empty() {
        return Scatter::default();
    }
    let all = cells(taps, rig, &distances, &drives, here);
    for k in saturated(taps, &all, sign, [&distances, &drives], models) {
        taps[k].reason = Some(Reason::Saturated);
    }
    let all = cells(taps, rig, &distances, &drives, here);
    repeats(taps, &all);
    let all = cells(taps, rig, &distances, &drives, here);
    surface(taps, &all, [&distances, &drives], models)
}

/// Rows at the end stop of the sensor: those of the most extreme reading, if the surface through all others is beyond it in two cells
/// or more. A reading that stands for many, of a converter with few steps, is no stop: as much is expected of it.
fn saturated(
    taps: &[Tap],
    all: &[Cell],
    sign: f64,
    levels: [&Levels; 2],
    models: &[&Expected<'_>],
) -> Vec<usize> {
    let values = || taps.iter().map(|t| sign * t.value).filter(|x| x.is_finite());
    let [largest, size] = values().fold([f64::MIN, 0.0], |[x, size], y| [x.max(y), y.abs().max(size)]);
    let at_end = |k: &usize| largest - sign * taps[*k].value <= rounding(size);
    let part = |wanted: bool| {
        let of = |c: &Cell| Cell {
            taps: c.taps.iter().copied().filter(|k| at_end(k) == wanted).collect(),
            ..c.clone()
        };
        all.iter().map(of).filter(|c| !c.taps.is_empty()).collect::<Vec<_>>()
    };
    let ends = part(true);
    if ends.len() < 2 {
        return Vec::new();
    }
    let below = part(false);
    let of = |k: usize, f: fn(&Cell) -> usize| Levels::of(below.iter().map(|c| levels[k].centres[f(c)]));
    let [distances, drives] = [of(0, |c| c.i), of(1, |c| c.j)];
    let Some(surface) = Compared::best(&judged(taps, &below), [&distances, &drives], models) else {
        return Vec::new();
    };
    let short = |c: &&Cell| {
        let (signal, expected) = (taps[c.taps[0]].signal.abs(), surface.fitted(c.a, c.drive));
        let [relative, absolute] = surface.scale;
        (expected / signal).ln() > (FAR * relative).max(SHORT) && expected - signal > FAR * absolute
    };
    if ends.iter().filter(short).count() < 2 {
        return Vec::new();
    }
    ends.into_iter().flat_map(|c| c.taps).collect()
}

/// Rows of cells with three repeats or more that lie off the cell's median.
fn repeats(taps: &mut [Tap], all: &[Cell]) {
    let mut off = Vec::new();
    for cell in all.iter().filter(|c| c.taps.len() >= 3) {
        let mut signals: Vec<f64> = cell.taps.iter().map(|&k| taps[k].signal.abs()).collect();
        let middle = median(&mut signals);
        let small = (cell.n() / (cell.n() - 1.0)).sqrt();
        off.extend(cell.taps.iter().map(|&k| (k, (taps[k].signal.abs() - middle) * small, middle)));
    }
    // In a cell of odd size one tap is the median and says nothing of the spread; where more are equal, that is the spread.
    let odd = all.iter().filter(|c| c.taps.len() >= 3 && c.taps.len() % 2 == 1).count();
    let mut sizes: Vec<f64> = off.iter().map(|(_, d, _)| d.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let scale = NORMAL * median(&mut sizes[odd.min(off.len())..]);
    let step = super::noise::step(taps);
    for (k, d, middle) in off {
        // Noise is as large in all cells; where most repeats are equal, only a share of the signal can tell.
        let far = d.abs() > FAR * scale && d.abs() > 2.0 * step && d.abs() > 1e-3 * middle;
        if far && (scale > 0.0 || d.abs() > LEAST * middle) {
            taps[k].reason = Some(Reason::Repeat(d / middle));
        }
    }
}

/// Whether what is off at the entry `k` is off at repeats of it or beside it too, half as much at least: then not the row is wrong, the
/// model misses the whisker there. A wrong label is wrong at its own distance, or drive, only.
fn borne_out(k: usize, reason: &Reason, judged: &[(Cell, f64)], off: &[(f64, f64)]) -> bool {
    let cell = &judged[k].0;
    let beside = |c: &Cell| c.i.abs_diff(cell.i) <= 1 && c.j.abs_diff(cell.j) <= 1;
    let elsewhere = |c: &Cell| match reason {
        Reason::LooksLikeDistance(_) => c.i != cell.i,
        Reason::LooksLikeDrive(_) => c.j != cell.j,
        _ => matches!(reason, Reason::Off(_)),
    };
    let alike =
        |m: usize| m != k && off[m].0 / off[k].0 >= 0.5 && beside(&judged[m].0) && elsewhere(&judged[m].0);
    let repeated = matches!(reason, Reason::Off(_)) && cell.taps.len() > 1;
    off[k].0.abs() <= MISSED && (repeated || (0..judged.len()).any(alike))
}

/// Cells that lie off the smooth surface, and are alone with it.
fn surface(taps: &mut [Tap], all: &[Cell], levels: [&Levels; 2], models: &[&Expected<'_>]) -> Scatter {
    let judged = judged(taps, all);
    let Some(best) = Compared::best(&judged, levels, models) else { return Scatter::default() };
    let ([relative, absolute], off) = (best.scale, &best.off);
    let fitted = |a: f64, d: f64| best.fitted(a, d);
    let mut flags = Vec::new();
    let mut missed = HashSet::new();
    for (k, ((cell, signal), (r, _))) in judged.iter().zip(off).enumerate() {
        if best.is_far(*r, *signal) {
            let close = (3.0 * relative).max(3.0 * absolute / signal).max(2e-3);
            let reason = explain(cell, *signal, *r, levels, &fitted, close);
            if borne_out(k, &reason, &judged, off) {
                missed.extend(cell.taps.iter().copied());
            }
            flags.extend(cell.taps.iter().map(|&k| (k, reason.clone())));
        }
    }
    // Repeats that disagree with their cell are looked at one by one: they may be at home elsewhere.
    for (k, tap) in taps.iter().enumerate().filter(|(_, t)| matches!(t.reason, Some(Reason::Repeat(_)))) {
        let signal = tap.signal.abs();
        let close = (3.0 * relative).max(6.0 * absolute / signal).max(2e-3);
        let alone = Cell { a: tap.a, drive: tap.drive, ..judged[0].0.clone() };
        let r = (signal / fitted(tap.a, tap.drive)).ln();
        if let at @ (Reason::LooksLikeDistance(_) | Reason::LooksLikeDrive(_) | Reason::Unit(_)) =
            explain(&alone, signal, r, levels, &fitted, close)
        {
            flags.push((k, at));
        }
    }
    let flagged: HashSet<usize> = flags.iter().map(|f| f.0).collect();
    let good =
        || judged.iter().zip(off).filter(|((c, _), (_, e))| e.is_finite() && !flagged.contains(&c.taps[0]));
    let freedom = good().count().saturating_sub(best.terms());
    let squares: f64 = good().map(|((c, _), (_, e))| e * e * c.n()).sum();
    let positions = whole(taps, all, levels[0], &flagged);
    let kept = |k: usize| positions.contains(&taps[k].group[0]);
    flags.retain(|(k, reason)| matches!(reason, Reason::Unit(_)) || !(kept(*k) || missed.contains(k)));
    flags.into_iter().for_each(|(k, reason)| taps[k].reason = Some(reason));
    Scatter { signal: if freedom > 0 { (squares / freedom as f64).sqrt() } else { 0.0 }, positions }
}

/// Positions of which nearly all rows are flagged, three at least: not the rows are wrong but the label, or the rig was another. To leave them
/// out would shrink the range without a word.
fn whole(taps: &[Tap], all: &[Cell], distances: &Levels, flags: &HashSet<usize>) -> Vec<f64> {
    let at = |i: usize| all.iter().filter(move |c| c.i == i).flat_map(|c| c.taps.iter().copied());
    let flagged = |i: usize| at(i).filter(|k| flags.contains(k)).count();
    let whole = |i: &usize| flagged(*i) >= 3 && 5 * flagged(*i) >= 4 * at(*i).count();
    let places = (0..distances.len()).filter(whole);
    places.filter_map(|i| at(i).next()).map(|k| taps[k].group[0]).collect()
}

/// What a cell off the surface by `r` (of ln signal) most likely is.
fn explain(
    cell: &Cell,
    signal: f64,
    r: f64,
    [distances, drives]: [&Levels; 2],
    fitted: &dyn Fn(f64, f64) -> f64,
    close: f64,
) -> Reason {
    let decade = r / std::f64::consts::LN_10;
    if (decade.abs() - 6.0).abs() < 0.5 || (decade.abs() - 3.0).abs() < 0.3 {
        return Reason::Unit(decade.round() as i32);
    }
    let miss = |a: f64, d: f64| (signal / fitted(a, d)).ln().abs();
    let at = |(x, reason): (f64, Reason)| (x, reason);
    let other_a = distances.centres.iter().map(|&a| at((miss(a, cell.drive), Reason::LooksLikeDistance(a))));
    let other_d = drives.centres.iter().map(|&d| at((miss(cell.a, d), Reason::LooksLikeDrive(d))));
    let best = other_a.chain(other_d).min_by(|x, y| x.0.total_cmp(&y.0));
    best.filter(|(miss, _)| *miss < close).map_or(Reason::Off(r.exp_m1()), |(_, reason)| reason)
}
