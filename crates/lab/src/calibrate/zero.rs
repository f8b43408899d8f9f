//! Unread zero of the signal: from the model of one side, or from taps of both sides.
//!
//! Taps of equal size to both sides read y₊ = z + g and y₋ = z − r g: all points (y₊, y₋) lie on the line y₋ = (1 + r) z − r y₊, which meets the
//! diagonal at the zero z. This needs no curve of the whisker.

use crate::estimator::taps::{Cell, Sorted, Tap, grouped};
use crate::estimator::{Opener, Parameter, fit::Task, learned::Learnt, least};
use crate::measure::{Data, Rig, Tared, TaredBy};
use crate::reduce::{median, range, sorted};
use crate::{error::Error, scene::Side};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use vibrissa_learned::{base::power, fit::lowest};

/// Relative accuracy of solved models: smaller offsets count as 0.
const SOLVED: f64 = 3e-7;

/// Zero of one side and its error from a model that fits within the noise; a free curve would take an offset of the drive for one of the signal.
pub(super) fn of_model(
    (rig, taps): (&Rig, &[Tap]),
    (sign, gauge): (f64, Side),
    noise: f64,
    fit: &[Parameter],
    open: Opener<'_>,
) -> Result<Option<[f64; 2]>, Error> {
    let ([distances, _], cells) = grouped(taps, rig, |t| t.is_of(sign));
    let Some(at) = super::extent((rig, open), taps, sign, gauge).filter(|_| distances.len() > 1) else {
        return Ok(None);
    };
    let found = match (Task { at, cells: &cells, noise, sought: true }).fit(fit) {
        Ok(found) if found.undetermined.is_empty() => found,
        Err(why) if !why.is_of_whisker() => return Err(why.into()),
        _ => return Ok(None),
    };
    let rows = found.cells.iter().enumerate().flat_map(|(cell, at)| {
        let Cell { taps: of_cell, .. } = &cells[*at];
        let deviation = found.deviations[cell] * (of_cell.len() as f64).sqrt();
        of_cell.iter().map(move |k| (cell, deviation, &taps[*k]))
    });
    // Measured − expected signal, in standard deviations.
    let off = |sd: f64, t: &Tap| (t.signal.abs() - found.exact.expected(t.a, t.drive)) / sd;
    let rows = rows.map(|(cell, sd, t)| (cell, sd, t, off(sd, t)));
    let rows: Vec<(usize, f64, &Tap, f64)> = rows.filter(|row| row.3.is_finite()).collect();
    // The zero may also drift in the order of the rows.
    let (n, m) = (rows.len(), found.slopes.ncols());
    let middle = rows.iter().map(|r| r.2.place as f64).sum::<f64>() / n as f64;
    let design = DMatrix::from_fn(n, m + 1, |i, j| {
        let (cell, sd, t, _) = rows[i];
        (if j < m { found.slopes[(cell, j)] } else { t.place as f64 - middle }) / sd
    });
    let left = DVector::from_iterator(n, rows.iter().map(|r| r.3));
    let zero = found.exact.fitted.iter().position(|p| *p == Parameter::Zero).filter(|_| n > m + 1);
    let solved = least::solve(&design.tr_mul(&design), &design.tr_mul(&left));
    let Some((k, (step, inverse))) = zero.zip(solved) else { return Ok(None) };
    let rest = left - &design * &step;
    let error = ((rest.norm_squared() / (n - m - 1) as f64).max(1.0) * inverse[(k, k)]).sqrt();
    let constant = [found.exact.values[Parameter::Zero as usize] + step[k], error];
    let squares: f64 = rows.iter().zip(&rest).map(|(r, e)| (e * r.1).powi(2)).sum();
    let within = squares <= noise * noise * (n as f64 + 2.0 * (2.0 * n as f64).sqrt());
    let exact = || rows.iter().zip(&rest).all(|(r, e)| (e * r.1).abs() <= SOLVED * r.2.signal.abs());
    Ok((within || exact()).then_some(constant))
}

/// Zero and its standard error from taps of both sides; `None` for taps of one side.
pub(super) fn between(data: &Data, taps: &[Tap]) -> Option<[f64; 2]> {
    let sound = || taps.iter().filter(|t| t.reason.is_none());
    let told = of_pairs(sound().map(|t| ((data.rows[t.place].run, t.group), t.signal)));
    told.or_else(|| of_laws(&sound().map(|t| [t.group[0], t.group[1], t.signal]).collect::<Vec<_>>()))
}

pub(super) fn tare((data, rig): (&Data, &Rig), rows: &mut Sorted, [value, error]: [f64; 2]) {
    for tap in &mut rows.taps {
        tap.zero += value;
        tap.signal = data.unit.above(tap.signal, value, rig.setup.gauge.factor);
    }
    (rows.tared.from, rows.tared.error) = (TaredBy::Fitted, error);
    rows.tared.value += value;
}

pub(super) fn wandering(data: &Data, rig: &Rig, learnt: &Learnt) -> String {
    let [least, largest] = range(learnt.fit.zeros.iter().copied());
    let (file, moved, unit) = (&data.file, largest - least, data.unit.common());
    let kind = rig.setup.drive.column();
    format!(
        "{file}: no zero was read, and what the curve leaves goes with the order of the lines, as if the zero drifted by {moved:.2e} {unit} over the file; \
         a drift is taken into account. Read the zero now and then (rows with {kind} = 0)"
    )
}

pub(super) fn untared(data: &Data, rig: &Rig, tared: &Tared) -> Option<String> {
    let (kind, unit, file) = (rig.setup.drive.column(), data.unit.common(), &data.file);
    match tared.from {
        TaredBy::Fitted => Some(format!(
            "{file}: no zero was read; the data say that the signal has a constant offset of {:.4e} ± {:.1e} {unit}, which was subtracted, \
             as it will be from readings without a zero of their own. A drift of the zero would do much of that: rows with {kind} = 0 now and \
             then would tell",
            tared.value, tared.error
        )),
        TaredBy::None if tared.error == 0.0 => Some(format!(
            "{file}: no zero was read, and these data cannot tell a constant offset of the signal from a tap: it is taken as tared. Rows \
             with {kind} = 0 say what the sensor shows without contact"
        )),
        _ => None,
    }
}

const FEWEST: usize = 4;
const MOST: f64 = 0.6;
/// Largest ratio of the signals of the two sides.
const RATIO: f64 = 30.0;
/// Largest residual of the line, as a share of the spread of the signals.
const LEFT: f64 = 0.2;
const OFF: f64 = 5.0;
const SLOPES: usize = 60;
/// Allowed curvature of the line, in units of the median gap (covers stretching).
const BENT: f64 = 0.02;
const ROUNDS: usize = 3;
/// Trial shares of the noise variance that do not grow with the signal.
const FLOORS: [f64; 4] = [1.0, 0.3, 0.03, 0.003];

const LOOKED_AT: usize = 120;
const PLACES: usize = 16;
/// Least gain in 2 ln likelihood for two laws instead of one.
const FAR_BETTER: f64 = 40.0;
/// Largest residual of a law, as a share of the spread of its taps.
const FOLLOWED: f64 = 0.25;
/// Error of the zero because a whisker follows no exact power law, as a share of a usual signal.
const NO_LAW: f64 = 0.01;

/// Mean signals of both sides at one distance, drive and run.
#[derive(Debug, Clone, Copy)]
struct Pair {
    high: f64,
    low: f64,
    taps: usize,
}

impl Pair {
    fn gap(&self) -> f64 {
        self.high - self.low
    }

    /// Point between both that stays constant with the gap if the low signal falls by `ratio` as the high one rises.
    fn middle(&self, ratio: f64) -> f64 {
        (self.low + ratio * self.high) / (1.0 + ratio)
    }
}

/// Zero between the signals of both sides and its standard error, from taps ((run, [distance, drive]), signal); `None` for taps of one side.
fn of_pairs(taps: impl Iterator<Item = ((usize, [f64; 2]), f64)>) -> Option<[f64; 2]> {
    let mut cells = BTreeMap::<_, Vec<f64>>::new();
    taps.for_each(|((run, at), signal)| cells.entry((run, at.map(f64::to_bits))).or_default().push(signal));
    let all: usize = cells.values().map(Vec::len).sum();
    let mut pairs: Vec<Pair> = cells.into_values().filter_map(pair).collect();
    let mut ratio = rough(&pairs)?;
    let mut line = Line { zero: middle(&pairs, ratio), ..Line::default() };
    for _ in 0..3 {
        let off = |p: &Pair| (p.middle(ratio) - line.zero).abs();
        let usual = 1.4826 * median(&mut pairs.iter().map(off).collect::<Vec<_>>());
        pairs.retain(|p| off(p) <= OFF * usual);
        ratio = rough(&pairs)?;
        let fits = FLOORS.iter().filter_map(|floor| Line::through(&pairs, ratio, *floor));
        line = fits.min_by(|l, m| l.unlikely.total_cmp(&m.unlikely))?;
    }
    let enough = pairs.iter().map(|p| p.taps).sum::<usize>() as f64 >= MOST * all as f64;
    let sides = (1.0 / RATIO..=RATIO).contains(&ratio) && line.left < LEFT;
    (enough && sides).then_some([line.zero, line.error])
}

/// Zero if both sides were tapped at different places (a, drive, signal): two power laws about it must fit far better than one law above a constant.
fn of_laws(taps: &[[f64; 3]]) -> Option<[f64; 2]> {
    let taps: Vec<[f64; 3]> = taps.iter().copied().step_by(taps.len().div_ceil(LOOKED_AT).max(1)).collect();
    let n = taps.len() as f64;
    let signals = sorted(taps.iter().map(|t| t[2]));
    let different =
        |taps: &[[f64; 3]], k: usize| taps.iter().map(|t| t[k].to_bits()).collect::<BTreeSet<_>>().len();
    // At one drive, two positions in the wrong order look like another side.
    let positions = if different(&taps, 1) > 1 { 2 } else { 3 };
    let left = |zero: f64| {
        let of = |side: f64| -> Vec<[f64; 3]> {
            let above = taps.iter().map(|t| [t[0], t[1], side * (t[2] - zero)]);
            above.filter(|t| t[2] > 0.0).collect()
        };
        let sides = [of(1.0), of(-1.0)];
        if sides.iter().any(|taps| taps.len() < FEWEST || different(taps, 0) < positions) {
            return f64::INFINITY;
        }
        // A law must fit: with taps of one side only, those below a constant fall with the drive.
        let of_law = |taps: &Vec<[f64; 3]>| {
            let mean = taps.iter().map(|t| t[2]).sum::<f64>() / taps.len() as f64;
            let spread = taps.iter().map(|t| (t[2] - mean).powi(2)).sum::<f64>();
            let squares = power(taps, Some(0.0), false).map(|f| f.squares);
            squares.filter(|s| *s < FOLLOWED * spread).unwrap_or(f64::INFINITY)
        };
        sides.iter().map(of_law).sum()
    };
    // The assignment to sides changes only at signals.
    let between = |k: usize| 0.5 * (signals[k - 1] + signals[k]);
    let ends = [FEWEST, signals.len().checked_sub(FEWEST)?];
    let every = (ends[1].checked_sub(ends[0])? / PLACES).max(1);
    let places = (ends[0]..=ends[1]).step_by(every);
    let coarse = places.min_by(|j, k| left(between(*j)).total_cmp(&left(between(*k))))?;
    let near = coarse.saturating_sub(every).max(ends[0])..=(coarse + every).min(ends[1]);
    let at = near.min_by(|j, k| left(between(*j)).total_cmp(&left(between(*k))))?;
    let around = [signals[at - 1], signals[at]];
    let (zero, step) = (lowest(left, around, 1), (around[1] - around[0]) / 64.0);
    let least = left(zero);
    let one_side = |side: f64| {
        let turned: Vec<[f64; 3]> = taps.iter().map(|t| [t[0], t[1], side * t[2]]).collect();
        power(&turned, None, true).map_or(f64::INFINITY, |f| f.squares)
    };
    let alone = one_side(1.0).min(one_side(-1.0));
    let bends = (left(zero - step) + left(zero + step) - 2.0 * least) / (step * step);
    let error = (2.0 * least / ((n - 7.0).max(1.0) * bends)).sqrt();
    let usual = median(&mut taps.iter().map(|t| (t[2] - zero).abs()).collect::<Vec<_>>());
    let told = least.is_finite() && n * (alone / least).ln() > FAR_BETTER;
    let error = if error.is_finite() { error.max(NO_LAW * usual) } else { 0.5 * (around[1] - around[0]) };
    told.then_some([zero, error])
}

fn pair(mut signals: Vec<f64>) -> Option<Pair> {
    signals.sort_by(f64::total_cmp);
    let apart = |k: &usize| signals[*k] - signals[k - 1];
    let at = (1..signals.len()).max_by(|j, k| apart(j).total_cmp(&apart(k)))?;
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    Some(Pair { high: mean(&signals[at..]), low: mean(&signals[..at]), taps: signals.len() })
}

#[derive(Default)]
struct Line {
    zero: f64,
    error: f64,
    /// Residual, as a share of the spread of the signals.
    left: f64,
    unlikely: f64,
}

/// Median slope (Theil-Sen) of −low over high; `None` if not positive.
fn rough(pairs: &[Pair]) -> Option<f64> {
    if pairs.len() < FEWEST {
        return None;
    }
    let some: Vec<&Pair> = pairs.iter().step_by(pairs.len().div_ceil(SLOPES)).collect();
    let between = some.iter().enumerate().flat_map(|(k, p)| some[..k].iter().map(move |q| (p, q)));
    let apart = between.filter(|(p, q)| p.high != q.high);
    let mut slopes: Vec<f64> = apart.map(|(p, q)| (p.low - q.low) / (p.high - q.high)).collect();
    let ratio = -median(&mut slopes);
    (ratio > 0.0).then_some(ratio)
}

fn middle(pairs: &[Pair], ratio: f64) -> f64 {
    median(&mut pairs.iter().map(|p| p.middle(ratio)).collect::<Vec<_>>())
}

impl Line {
    /// Least squares near a line of slope `ratio`, for noise with a constant share `floor`: middle of the signals over gap and squared gap, at gap 0.
    fn through(pairs: &[Pair], ratio: f64, floor: f64) -> Option<Self> {
        let usual = median(&mut pairs.iter().map(Pair::gap).collect::<Vec<_>>());
        let weight = |p: &Pair| 1.0 / (floor + (1.0 - floor) * (p.gap() / usual).powi(2));
        let middle = middle(pairs, ratio);
        let (mut of_gaps, mut of_middles, mut squares) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for p in pairs {
            let (w, g, m) = (weight(p), p.gap() / usual, p.middle(ratio) - middle);
            let row = Vector3::new(1.0, g, g * g);
            of_gaps += w * row * row.transpose();
            of_middles += w * m * row;
            squares += w * m * m;
        }
        let n = pairs.len() as f64;
        let mut variance = squares / n;
        let (mut found, mut inverse) = (Vector3::zeros(), Matrix3::zeros());
        for _ in 0..ROUNDS {
            let bent = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, variance / (BENT * usual).powi(2)));
            inverse = (of_gaps + bent).try_inverse()?;
            found = inverse * of_middles;
            let left = squares - 2.0 * found.dot(&of_middles) + found.dot(&(of_gaps * found));
            variance = left.max(1e-24 * usual * usual) / (n - 2.0);
        }
        let logs: f64 = pairs.iter().map(|p| weight(p).ln()).sum();
        let spread = of_gaps[(2, 2)] / of_gaps[(0, 0)] - (of_gaps[(0, 1)] / of_gaps[(0, 0)]).powi(2);
        let (zero, error) = (middle + found.x, (variance * inverse[(0, 0)]).sqrt());
        let left = (variance * n / of_gaps[(0, 0)] / spread).sqrt() / usual;
        let line = Self { zero, error, left, unlikely: n * variance.ln() - logs };
        (zero.is_finite() && error.is_finite()).then_some(line)
    }
}
