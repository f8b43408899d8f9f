//! Rows that should not be believed, each with its reason: robust checks before anything is fitted.
//!
//! In order: a sensor at its end stop, repeats that disagree with their own cell, cells that disagree with a smooth surface
//! through all others. The surface is ln(signal/expected) as a low polynomial of 1/a
//! and the drive, fitted by iterated weights (Tukey's biweight from an L1 start); scales are medians.

use std::collections::HashSet;

use nalgebra::{DMatrix, DVector};

use super::Reason;
use crate::estimator::cells::{Cell, Levels, cells};
use crate::estimator::taps::Tap;
use crate::measure::Rig;
use crate::reduce::median;

/// A deviation is suspect beyond so many robust standard deviations.
const FAR: f64 = 6.0;
/// And beyond this share of the signal: no smooth misfit of a model is flagged.
const LEAST: f64 = 0.01;
/// Median absolute deviation to standard deviation of a normal.
const NORMAL: f64 = 1.4826;

/// Scatter about the smooth surface, in the unit of the signal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scatter {
    /// Standard deviation of one reading, if the surface leaves nothing else.
    pub signal: f64,
    /// Whole positions off the surface, mm: their rows are used.
    pub positions: Vec<f64>,
}

/// What a model without any fit expects at (a, drive).
pub type Expected<'a> = dyn Fn(f64, f64) -> f64 + 'a;

/// Flags rows of one side; of `models`, the one from which the data differ most smoothly is what they are compared with.
pub fn flag(taps: &mut [Tap], rig: &Rig, sign: f64, models: &[&Expected<'_>]) -> Scatter {
    let here = |t: &Tap| t.reason.is_none() && t.signal.signum() == sign;
    let levels = |taps: &[Tap], f: fn(&Tap) -> f64| Levels::of(taps.iter().filter(|t| here(t)).map(f));
    let (distances, drives) = (levels(taps, |t| t.group[0]), levels(taps, |t| t.group[1]));
    if distances.is_empty() {
        return Scatter::default();
    }
    saturated(taps, &here, models[0]);
    let all = cells(taps, rig, &distances, &drives, here);
    repeats(taps, &all);
    let all = cells(taps, rig, &distances, &drives, here);
    surface(taps, &all, [&distances, &drives], models)
}

/// Readings that stand at one large value although very different strains are expected: the end stop of the sensor. Two rows are
/// enough at the largest value of all, three below it.
fn saturated(taps: &mut [Tap], here: &dyn Fn(&Tap) -> bool, expected: &Expected<'_>) {
    let mut order: Vec<usize> = (0..taps.len()).filter(|&k| here(&taps[k])).collect();
    order.sort_by(|&i, &j| taps[i].value.total_cmp(&taps[j].value));
    let mut sizes: Vec<f64> = order.iter().map(|&k| taps[k].signal.abs()).collect();
    let large = median(&mut sizes);
    let ends = order.first().zip(order.last()).map(|(&i, &j)| [taps[i].value, taps[j].value]);
    let mut stopped = Vec::new();
    for there in order.chunk_by(|&i, &j| taps[i].value == taps[j].value) {
        let strains = there.iter().map(|&k| expected(taps[k].a, taps[k].drive));
        let (lo, hi) = strains.fold((f64::INFINITY, 0.0f64), |(lo, hi), e| (lo.min(e), hi.max(e)));
        let extreme = ends.is_some_and(|e| e.contains(&taps[there[0]].value));
        let enough = there.len() >= if extreme { 2 } else { 3 };
        if enough && hi > 1.05 * lo && there.iter().all(|&k| taps[k].signal.abs() >= large) {
            stopped.extend_from_slice(there);
        }
    }
    stopped.into_iter().for_each(|k| taps[k].reason = Some(Reason::Saturated));
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
    for (k, d, middle) in off {
        // Noise is as large in all cells; where most repeats are equal, only a share of the signal can tell.
        if d.abs() > FAR * scale && d.abs() > 1e-3 * middle && (scale > 0.0 || d.abs() > LEAST * middle) {
            taps[k].reason = Some(Reason::Repeat(d / middle));
        }
    }
}

/// One term over (u, v), 1/a and the drive scaled to [−1, 1].
type Term = fn(f64, f64) -> f64;

/// A smooth surface through ln(signal/expected).
struct Smooth {
    terms: Vec<Term>,
    scale: [[f64; 2]; 2],
    coefficients: DVector<f64>,
}

impl Smooth {
    fn new(all: &[Cell], [distances, drives]: [&Levels; 2]) -> Self {
        let mut terms: Vec<Term> = vec![|_, _| 1.0];
        let (na, nt, n) = (distances.len(), drives.len(), all.len());
        let candidates: [(bool, Term); 6] = [
            (na >= 4, |u, _| u),
            (nt >= 4, |_, v| v),
            (na >= 6, |u, _| u * u),
            (nt >= 6, |_, v| v * v),
            (na >= 4 && nt >= 4, |u, v| u * v),
            (nt >= 5, |_, v| 1.0 / (1.1 + v)),
        ];
        for (useful, term) in candidates {
            if useful && n >= 3 * (terms.len() + 1) {
                terms.push(term);
            }
        }
        let range = |x: &dyn Fn(&Cell) -> f64| {
            let (lo, hi) =
                all.iter().map(x).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            if hi > lo { [0.5 * (lo + hi), 0.5 * (hi - lo)] } else { [lo, 1.0] }
        };
        let scale = [range(&|c| 1.0 / c.a), range(&|c| c.drive)];
        let coefficients = DVector::zeros(terms.len());
        Self { terms, scale, coefficients }
    }

    fn row(&self, a: f64, drive: f64) -> Vec<f64> {
        let [[u0, du], [v0, dv]] = self.scale;
        let (u, v) = ((1.0 / a - u0) / du, (drive - v0) / dv);
        self.terms.iter().map(|t| t(u, v)).collect()
    }

    fn at(&self, a: f64, drive: f64) -> f64 {
        self.row(a, drive).iter().zip(self.coefficients.iter()).map(|(x, c)| x * c).sum()
    }

    /// Fits ln ratios `r` of cells at `places`.
    fn fit(&mut self, places: &[(f64, f64)], r: &[f64]) {
        let rows: Vec<f64> = places.iter().flat_map(|(a, d)| self.row(*a, *d)).collect();
        let x = DMatrix::from_row_slice(places.len(), self.terms.len(), &rows);
        let r = DVector::from_column_slice(r);
        self.coefficients[0] = median(&mut r.iter().copied().collect::<Vec<_>>());
        for step in 0..40 {
            let e = &r - &x * &self.coefficients;
            let scale = (NORMAL * median(&mut e.iter().map(|e| e.abs()).collect::<Vec<_>>())).max(1e-12);
            let weight = |e: f64| {
                if step < 25 {
                    1.0 / e.abs().max(0.1 * scale)
                } else {
                    (1.0 - (e / (4.685 * scale)).powi(2)).max(0.0).powi(2)
                }
            };
            let w = e.map(weight);
            let wx = DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| w[i] * x[(i, j)]);
            let svd = crate::estimator::singular::values(x.transpose() * &wx, true);
            match svd.map(|svd| svd.solve(&(wx.transpose() * &r), 1e-13)) {
                Some(Ok(c)) if c.iter().all(|c| c.is_finite()) => self.coefficients = c,
                _ => return,
            }
        }
    }
}

/// Cells compared with one model.
struct Compared<'a> {
    smooth: Smooth,
    expected: &'a Expected<'a>,
    /// Of each cell, what it is off: of ln signal, and in the unit of the signal; NaN where the model has no such tap.
    off: Vec<(f64, f64)>,
    /// Robust standard deviations of both.
    scale: [f64; 2],
}

impl<'a> Compared<'a> {
    fn new(signals: &[(&Cell, f64)], levels: [&Levels; 2], expected: &'a Expected<'a>) -> Option<Self> {
        let ratio = |(c, s): &(&Cell, f64)| (s / expected(c.a, c.drive)).ln();
        let known: Vec<(&Cell, f64)> = signals.iter().filter(|s| ratio(s).is_finite()).copied().collect();
        if known.len() < 4 || 2 * known.len() < signals.len() {
            return None;
        }
        let cells: Vec<Cell> = known.iter().map(|(c, _)| (*c).clone()).collect();
        let mut smooth = Smooth::new(&cells, levels);
        let places: Vec<(f64, f64)> = known.iter().map(|(c, _)| (c.a, c.drive)).collect();
        smooth.fit(&places, &known.iter().map(ratio).collect::<Vec<_>>());
        let miss = |signal: &(&Cell, f64)| {
            let (c, s) = *signal;
            let left = ratio(signal) - smooth.at(c.a, c.drive);
            if left.is_finite() { (left, s * -(-left).exp_m1()) } else { (f64::NAN, f64::NAN) }
        };
        let off: Vec<(f64, f64)> = signals.iter().map(miss).collect();
        let scale = |f: fn(&(f64, f64)) -> f64| {
            let mut sizes: Vec<f64> = off.iter().map(|o| f(o).abs()).collect();
            sizes.retain(|x| x.is_finite());
            NORMAL * median(&mut sizes)
        };
        let scale = [scale(|o| o.0), scale(|o| o.1)];
        Some(Self { smooth, expected, off, scale })
    }

    fn fitted(&self, a: f64, drive: f64) -> f64 {
        (self.expected)(a, drive) * self.smooth.at(a, drive).exp()
    }
}

/// Cells that lie off the smooth surface, both relative to the signal and in its unit.
fn surface(taps: &mut [Tap], all: &[Cell], levels: [&Levels; 2], models: &[&Expected<'_>]) -> Scatter {
    let middle = |c: &Cell| median(&mut c.taps.iter().map(|&k| taps[k].signal.abs()).collect::<Vec<_>>());
    // Two repeats that disagree do not say which is wrong: each is judged by itself.
    let alone = |c: &Cell| -> Vec<Cell> {
        let one = |&k: &usize| Cell { taps: vec![k], a: taps[k].a, drive: taps[k].drive, ..c.clone() };
        if c.taps.len() < 3 { c.taps.iter().map(one).collect() } else { vec![c.clone()] }
    };
    let entries: Vec<Cell> = all.iter().flat_map(alone).collect();
    let judged: Vec<(&Cell, f64)> = entries.iter().map(|c| (c, middle(c))).collect();
    if judged.len() < 4 {
        return Scatter::default();
    }
    let compared = models.iter().filter_map(|m| Compared::new(&judged, levels, m));
    let Some(best) = compared.min_by(|p, q| p.scale[0].total_cmp(&q.scale[0])) else {
        return Scatter::default();
    };
    let ([relative, absolute], off, smooth) = (best.scale, &best.off, &best.smooth);
    let fitted = |a: f64, d: f64| best.fitted(a, d);
    let mut flags = Vec::new();
    for ((cell, signal), (r, e)) in judged.iter().zip(off) {
        if r.abs() > LEAST && r.abs() > FAR * relative && e.abs() > FAR * absolute {
            let close = (3.0 * relative).max(3.0 * absolute / signal).max(2e-3);
            let reason = explain(cell, *signal, *r, levels, &fitted, close);
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
    let freedom = good().count().saturating_sub(smooth.terms.len());
    let squares: f64 = good().map(|((c, _), (_, e))| e * e * c.n()).sum();
    let positions = whole(taps, all, levels[0], &flagged);
    let kept = |k: usize| positions.contains(&taps[k].group[0]);
    flags.retain(|(k, reason)| matches!(reason, Reason::Unit(_)) || !kept(*k));
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
