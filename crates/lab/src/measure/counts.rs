//! Raw 16-bit counts that wrap around.

use super::{Data, Row};
use crate::reduce::sorted;

const TURN: f64 = 65536.0;

/// Lower end of wrapped differences is −`below`, an integer; `lean` = ±1 if differences of one sign are expected, else 0.
pub fn below(lean: f64) -> f64 {
    ((0.5 - 0.45 * lean) * TURN).round()
}

/// A difference of two counts, wrapped to ±half the range; with `lean` = ±1, 95 % of the range goes to that sign.
pub fn wrapped(difference: f64, lean: f64) -> f64 {
    let below = below(lean);
    (difference + below).rem_euclid(TURN) - below
}

/// Joined neighbours differ by at most this multiple of the mean difference of neighbours of their kind.
const USUAL: f64 = 4.0;
/// Or by this share of the range, if that is larger.
const LITTLE: f64 = 1.0 / 32.0;
/// And by at most this share of their difference before joining.
const CLOSER: f64 = 0.25;

/// Number of the widest gaps that are tried as the place of the wrap.
const GAPS: usize = 32;

/// A count with the distance and drive of its cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count {
    /// Distance and drive, equal in repeats.
    pub at: [f64; 2],
    /// The count.
    pub value: f64,
}

/// The largest wrapped count, if some counts in file order have wrapped: neighbours (repeats, next drive, next distance) more than half the range
/// apart, which joining brings as close as the others. Else zero readings that far from the first drive, if the drive moves the signal towards them;
/// with one drive, if a quarter of the range is empty between them.
pub fn turn(all: &[Count]) -> Option<f64> {
    let values = sorted(all.iter().map(|c| c.value).filter(|x| x.is_finite()));
    let (first, last) = (*values.first()?, *values.last()?);
    let counts = (0.0..TURN).contains(&first) && last < TURN || first >= -0.5 * TURN && last < 0.5 * TURN;
    if !counts {
        return None;
    }
    let (neighbours, rests) = (neighbours(all), rests(all));
    if let Some(turn) = of_sides(all, &neighbours, &values) {
        return Some(turn);
    }
    let apart = |[i, j]: &[usize; 2]| (all[*i].value - all[*j].value).abs();
    let far = |n: &&[usize; 2]| apart(n) > 0.5 * TURN;
    let mut jumps: Vec<&[usize; 2]> = neighbours.iter().flatten().filter(far).collect();
    let mut gaps: Vec<[f64; 2]> = values.windows(2).map(|w| [w[0], w[1]]).collect();
    gaps.sort_by(|v, w| (w[1] - w[0]).total_cmp(&(v[1] - v[0])));
    if jumps.is_empty() {
        let [from, to] = *gaps.first()?;
        let empty = to - from > 0.25 * TURN && first + TURN - last < (to - from) / 3.0;
        let rise = |n: &[[usize; 2]]| n.iter().map(|[i, j]| all[*j].value - all[*i].value).sum::<f64>();
        let with_drive = rise(&neighbours[1]);
        let anew = if with_drive == 0.0 { empty } else { with_drive * rise(&rests) < 0.0 };
        jumps.extend(rests.iter().filter(far).filter(|_| anew));
    }
    let ends = |f: fn(f64, f64) -> f64| jumps.iter().map(move |[i, j]| f(all[*i].value, all[*j].value));
    let (low, high) = (ends(f64::min).reduce(f64::max)?, ends(f64::max).reduce(f64::min)?);
    let path = |turn: f64| {
        let joined = |i: usize| unwrapped(all[i].value, Some(turn));
        neighbours.iter().chain([&rests]).flatten().map(|[i, j]| (joined(*i) - joined(*j)).abs()).sum::<f64>()
    };
    let between = gaps.iter().filter(|[from, to]| *from >= low && *to <= high).take(GAPS);
    let turn = between.map(|g| g[0]).min_by(|t, u| path(*t).total_cmp(&path(*u)))?;
    // A sensor at the end of its range has not wrapped.
    let stands = turn == first && (first == 0.0 || first == -0.5 * TURN || values.get(1) == Some(&first));
    (!stands && neighbours.iter().all(|kind| fit(all, kind, turn))).then_some(turn)
}

/// The largest wrapped count of taps to both sides with a zero near an end of the range: half the range is empty, and with a larger drive (or a
/// smaller distance) counts at the low end rise and counts at the high end, which lie below the zero, fall.
fn of_sides(all: &[Count], neighbours: &[Vec<[usize; 2]>; 3], values: &[f64]) -> Option<f64> {
    let gaps = values.windows(2).max_by(|v, w| (v[1] - v[0]).total_cmp(&(w[1] - w[0])))?;
    let [from, to] = [gaps[0], gaps[1]];
    let rise = |kind: usize, here: &dyn Fn(f64) -> bool| {
        let both = neighbours[kind].iter().map(|[i, j]| (all[*i].value, all[*j].value));
        both.filter(|(v, w)| here(*v) && here(*w)).map(|(v, w)| w - v).sum::<f64>()
    };
    let grows = |here: &dyn Fn(f64) -> bool| match rise(1, here) {
        0.0 => -rise(2, here),
        along => along,
    };
    let apart = to - from > 0.5 * TURN && from < values[0] + 0.5 * TURN;
    (apart && grows(&|v| v <= from) > 0.0 && grows(&|v| v >= to) < 0.0).then_some(from)
}

/// Pairs of neighbouring counts: repeats of a cell, the next drive, the next distance. Readings without contact form one cell.
fn neighbours(all: &[Count]) -> [Vec<[usize; 2]>; 3] {
    let mut cells = std::collections::BTreeMap::<[u64; 2], Vec<usize>>::new();
    let rests = |c: &Count| c.at[1] <= 0.0;
    for (i, c) in all.iter().enumerate().filter(|(_, c)| c.value.is_finite()) {
        let key = if rests(c) { [0; 2] } else { c.at.map(f64::to_bits) };
        cells.entry(key).or_default().push(i);
    }
    let repeats = cells.values().flat_map(|c| c.windows(2).map(|w| [w[0], w[1]])).collect();
    let mut taps: Vec<&Vec<usize>> = cells.values().filter(|c| !rests(&all[c[0]])).collect();
    let mut along = |fixed: usize| {
        let at = |c: &[usize], k: usize| all[c[0]].at[k];
        let order = |p: &[usize], q: &[usize], k: usize| at(p, k).total_cmp(&at(q, k));
        taps.sort_by(|p, q| order(p, q, fixed).then(order(p, q, 1 - fixed)));
        let next = taps.windows(2).filter(|w| order(w[0], w[1], fixed).is_eq());
        next.flat_map(|w| w[0].iter().zip(w[1]).map(|(i, j)| [*i, *j])).collect()
    };
    [repeats, along(0), along(1)]
}

/// Each reading without contact, paired with those of the smallest drive.
fn rests(all: &[Count]) -> Vec<[usize; 2]> {
    let least = all.iter().map(|c| c.at[1]).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    let wanted = |f: &dyn Fn(&Count) -> bool| {
        let here = |i: &usize| f(&all[*i]) && all[*i].value.is_finite();
        (0..all.len()).filter(here).collect::<Vec<_>>()
    };
    let (still, first) = (wanted(&|c| c.at[1] <= 0.0), wanted(&|c| c.at[1] == least));
    still.iter().flat_map(|i| first.iter().take(GAPS).map(|j| [*i, *j])).collect()
}

/// True if pairs across `turn`, once joined, are as close as the other pairs.
fn fit(all: &[Count], neighbours: &[[usize; 2]], turn: f64) -> bool {
    let joined = |i: usize| unwrapped(all[i].value, Some(turn));
    let below = |i: usize| all[i].value <= turn;
    let differ = |value: &dyn Fn(usize) -> f64, across: bool| {
        let here = neighbours.iter().filter(|[i, j]| (below(*i) != below(*j)) == across);
        let (sum, n) = here.fold((0.0, 0.0), |(s, n), [i, j]| (s + (value(*i) - value(*j)).abs(), n + 1.0));
        if n > 0.0 { sum / n } else { 0.0 }
    };
    let [after, before] = [differ(&joined, true), differ(&|i| all[i].value, true)];
    after <= (USUAL * differ(&joined, false)).max(LITTLE * TURN) && after <= CLOSER * before
}

/// Widths of other counters, bits. Converters of fewer bits saturate instead of wrapping.
const BITS: [i32; 2] = [24, 32];
/// Wrapped counts lie within this share of the range at its two ends.
const ENDS: f64 = 0.4;

/// The width of wrapped counts other than 16 bits, with the largest count at the low end and the smallest at the high end of the range. Needs
/// zero readings at one end and most taps at the other.
pub fn of_other_bits(data: &Data) -> Option<(i32, [f64; 2])> {
    if data.unit.signal().is_some() || data.drive.is_none() {
        return None;
    }
    let rows = || data.rows.iter().filter(|r| r.value.is_finite());
    let most = rows().map(|r| r.value).fold(0.0, f64::max);
    let turn = |bits: &i32| 2_f64.powi(*bits);
    let bits = BITS.into_iter().find(|bits| most < turn(bits))?;
    let turn = turn(&bits);
    if !rows().all(|r| r.value >= 0.0 && r.value.fract() == 0.0) {
        return None;
    }
    let at_end = |r: &&Row| r.value > 0.5 * turn;
    let low = rows().filter(|r| !at_end(r)).map(|r| r.value).fold(0.0, f64::max);
    let high = rows().filter(at_end).map(|r| r.value).fold(turn, f64::min);
    let count = |taps, end| rows().filter(|r| (r.drive != 0.0) == taps && at_end(r) == end).count();
    let [rests, taps] = [false, true].map(|taps| [false, true].map(|end| count(taps, end)));
    let empty = low < ENDS * turn && high > (1.0 - ENDS) * turn && low + turn - high < ENDS * turn;
    let apart = (0..2).any(|end| rests[end] == 0 && rests[1 - end] > 0 && taps[end] > taps[1 - end]);
    (empty && apart).then_some((bits, [low, high]))
}

/// Adds the range to a wrapped count.
pub fn unwrapped(value: f64, turn: Option<f64>) -> f64 {
    if turn.is_some_and(|t| value <= t) { value + TURN } else { value }
}
