//! Answers of `locate` on one side as a table over drive and reading.
//!
//! A row is one drive; along it readings fall from the strongest with a distance to the weakest. It has up to four parts, between which the answer
//! may jump: the median of a wide posterior near the peak of the signal, the root on the far side, a wide posterior again, the root on the near side.
//! In a part s = √(ln(first/reading)/ln(first/last)) grows from 0 to 1. The table holds the distance and s σ at even s: both are smooth, also at a
//! peak, where σ is infinite. Rows are Chebyshev-Lobatto points of ln drive in strips between calibrated drives, interpolated by polynomials.

use std::{f64::consts::PI, fmt};

use super::size;
use crate::estimator::{Found, Known};
use crate::locate::{Locator, Opened};
use crate::{error::InputError, status::Status};

/// Range of known distances beyond the calibration, in shares of its range. More than half of it beyond counts as outside.
const BEYOND: f64 = 0.55;
/// Ratio of readings in the search for the ends of a row, and maximum of steps.
const STEP: (f64, usize) = (1.02, 400);
/// Readings of a row in the search for its parts.
const LOOKS: usize = 400;
const PARTS: usize = 4;
/// Trial numbers of rows of a strip, and of cells of a part.
const ROWS: [usize; 3] = [3, 5, 9];
const CELLS: [usize; 5] = [32, 64, 128, 256, 512];
/// Numbers of a side above which strips are no longer divided.
const MOST: usize = 40_000;
/// s at which the first node of a part is evaluated: at the peak s = 0 there may be no answer.
pub(super) const FIRST: f64 = 1e-4;
/// Readings of a part at which the error is measured, and first s in the first part: σ is unbounded at the peak.
const TRIED: usize = 121;
const PEAK: f64 = 0.03;
pub(super) const POINTS: usize = 6;
/// Sufficient accuracy; also this share of σ of any distance.
const FINE: Off = Off { distance: 3e-5, sigma: 5e-3, rest: [0.02, 0.1] };
const SHARE: f64 = 1e-3;
/// σ/a above which the error is measured in shares of σ.
const WIDE: f64 = 0.05;

/// A distance, its standard deviation in it, and what is to say of it.
type Told = (Found, Status);

/// True for the median of a wide posterior; true if readings rise with the distance.
fn kind((found, _): Told) -> (bool, bool) {
    (found.wide, !found.wide && found.slope > 0.0)
}

pub(super) struct Side<'a> {
    locator: &'a Locator,
    pub(super) of: &'a Opened,
    pub(super) reach: [f64; 2],
    pub(super) strips: Vec<Strip>,
    pub(super) without: [Status; 2],
}

struct Row {
    /// ln(reading/drive) at the ends of its parts.
    ends: [f64; PARTS + 1],
    /// Interval of s of each part in which a second distance makes it ambiguous.
    ambiguous: [[f64; 2]; PARTS],
}

pub(super) struct Strip {
    pub(super) drives: [f64; 2],
    /// For each row: for each part ln(reading/drive) at its beginning and the ambiguous interval of s; then the last ln(reading/drive).
    pub(super) heads: Vec<Vec<f64>>,
    /// For each row and part: distance and s σ at the ends of its cells.
    pub(super) values: Vec<Vec<Vec<[f64; 2]>>>,
}

/// Largest differences to `locate`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Off {
    /// Difference of a distance, mm, if more than a thousandth of σ.
    pub distance: f64,
    /// Relative difference of σ.
    pub sigma: f64,
    /// Both outside the calibration and where σ/a > 0.05: distance in shares of σ.
    pub rest: [f64; 2],
}

impl Off {
    pub(super) fn or(self, other: Self) -> Self {
        let rest = [0, 1].map(|i| self.rest[i].max(other.rest[i]));
        Self { distance: self.distance.max(other.distance), sigma: self.sigma.max(other.sigma), rest }
    }

    pub(super) fn is_within(self, limit: Self) -> bool {
        let rest = (0..2).all(|i| self.rest[i] <= limit.rest[i]);
        self.distance <= limit.distance && self.sigma <= limit.sigma && rest
    }
}

impl fmt::Display for Off {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [share, sigma, a, b] = [SHARE, self.sigma, self.rest[0], self.rest[1]].map(|x| 100.0 * x);
        if self.distance > 0.0 {
            write!(f, "{:.1e} mm or ", self.distance)?;
        }
        let outside = "outside the calibration, or where sigma is above 5 % of the distance, about";
        write!(
            f,
            "{share} % of sigma in the distance, {sigma:.2} % in sigma; {outside} {a:.1} % of sigma, {b:.1} % in sigma"
        )
    }
}

/// Bisection: last value from `inside` towards `outside` for which `is` holds.
fn border(mut inside: f64, mut outside: f64, is: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        *(if is(middle) { &mut inside } else { &mut outside }) = middle;
    }
    inside
}

fn nodes(n: usize) -> Vec<f64> {
    (0..n).map(|k| if n == 1 { 0.0 } else { -(PI * k as f64 / (n - 1) as f64).cos() }).collect()
}

fn weights(nodes: &[f64], x: f64) -> Vec<f64> {
    let weight = |k: usize| {
        let others = nodes.iter().enumerate().filter(|(j, _)| *j != k);
        others.map(|(_, node)| (x - node) / (nodes[k] - node)).product()
    };
    (0..nodes.len()).map(weight).collect()
}

impl<'a> Side<'a> {
    /// Table of `of` and its largest errors; `length` of the whisker in mm.
    pub(super) fn new(locator: &'a Locator, of: &'a Opened, length: f64) -> Result<(Self, Off), InputError> {
        let [first, last] = of.distances;
        let beyond = BEYOND * (last - first);
        let reach = [
            (first - beyond).max(0.25 * first),
            (last + beyond).max(1.1 * length).max(1.01 * of.interest[1]),
        ];
        let mut side = Self { locator, of, reach, strips: Vec::new(), without: [Status::OK; 2] };
        let middle = of.drives[of.drives.len() / 2];
        let row = side.row(middle)?;
        // A distance beyond the table is outside the calibration.
        let why = |x: f64| {
            let found = locator.on_side(of, middle, side.strain(x.exp() * middle), Known::default());
            found.err().unwrap_or(Status::OUTSIDE_CALIBRATION)
        };
        side.without = [why(row.ends[0] + 1e-6), why(row.ends[PARTS] - 1e-6)];
        let mut off = Off::default();
        let mut open = vec![(0, of.drives.len() - 1)];
        while let Some((i, j)) = open.pop() {
            let (strip, found) = side.strip([of.drives[i], of.drives[j]])?;
            let count: usize = side.strips.iter().map(Strip::count).sum();
            if j > i + 1 && !found.is_within(FINE) && count < MOST {
                open.extend([((i + j) / 2, j), (i, (i + j) / 2)]);
            } else {
                off = off.or(found);
                side.strips.push(strip);
            }
        }
        Ok((side, off))
    }

    fn strain(&self, size: f64) -> f64 {
        self.locator.unit.strain(self.of.sign * size, self.locator.rig.setup.gauge.factor).abs()
    }

    fn told(&self, drive: f64, size: f64) -> Option<Told> {
        let (found, sigma) =
            self.locator.on_side(self.of, drive, self.strain(size), Known::default()).ok()?;
        Some((Found { sigma, ..found }, self.of.doubts(found.a, found.near, sigma)))
    }

    fn row(&self, drive: f64) -> Result<Row, InputError> {
        let told = |x: f64| self.told(drive, x.exp() * drive);
        let ([first, last], [nearest, farthest]) = (self.of.distances, self.reach);
        let is = |x: f64| told(x).is_some_and(|(t, _)| (nearest..=farthest).contains(&t.a));
        let some = (0..=8).map(|k| first * (last / first).powf(f64::from((5 * k + 4) % 9) / 8.0));
        let some =
            some.map(|a| (size(self.locator, self.of.sign, self.of.answers.expected(a, drive)) / drive).ln());
        let none = || InputError::new(format!("no reading has a distance at the drive {drive}"));
        let start = some.into_iter().find(|x| is(*x)).ok_or_else(none)?;
        let end = |step: f64| {
            let inside = |k: usize| start + step * k as f64;
            let outside = (1..STEP.1).find(|k| !is(inside(*k)));
            outside.map_or(inside(STEP.1), |k| border(inside(k - 1), inside(k), is))
        };
        let (top, bottom) = (end(STEP.0.ln()), end(-STEP.0.ln()));
        let place = |k: usize| {
            let s = (k as f64 / LOOKS as f64).clamp(FIRST, 1.0 - 1e-9);
            top - s * s * (top - bottom)
        };
        let kinds: Vec<Option<(bool, bool)>> = (0..=LOOKS).map(|k| told(place(k)).map(kind)).collect();
        let same = |i: usize, j: usize| {
            border(place(i), place(j), |x| told(x).is_some_and(|t| Some(kind(t)) == kinds[i]))
        };
        let narrow = |k: &usize| kinds[*k].is_some_and(|kind| !kind.0);
        let mut ends = [top, bottom, bottom, bottom, bottom];
        if let Some(i) = (0..=LOOKS).find(narrow) {
            let other = |k: &usize| narrow(k) && kinds[*k] != kinds[i];
            let near = (i..=LOOKS).find(other);
            let last = (i..near.unwrap_or(LOOKS + 1)).rev().find(narrow).unwrap_or(i);
            ends[1] = if i > 0 { same(i, i - 1) } else { top };
            ends[2] = if last < LOOKS { same(last, last + 1) } else { bottom };
            ends[3] = near.map_or(bottom, |near| same(near, near - 1));
            if ends[2] - ends[3] < 1e-9 {
                ends[3] = ends[2];
            }
        }
        let mut row = Row { ends, ambiguous: [[1.0, 0.0]; PARTS] };
        for part in 0..PARTS {
            let is = |s: f64| {
                self.at(drive, &row, part, s).is_some_and(|(_, doubts)| doubts.has(Status::AMBIGUOUS))
            };
            let place = |k: usize| (k as f64 / 64.0).clamp(FIRST, 1.0 - 1e-9);
            let all: Vec<usize> = (0..=64).filter(|k| is(place(*k))).collect();
            let (Some(&from), Some(&to)) = (all.first(), all.last()) else { continue };
            row.ambiguous[part] = [
                if from > 0 { border(place(from), place(from - 1), is) } else { -1.0 },
                if to < 64 { border(place(to), place(to + 1), is) } else { 2.0 },
            ];
        }
        Ok(row)
    }

    fn at(&self, drive: f64, row: &Row, part: usize, s: f64) -> Option<Told> {
        let [from, to] = [row.ends[part], row.ends[part + 1]];
        let [top, bottom] = [row.ends[0], row.ends[PARTS]];
        let slack = 1e-10 * (top - bottom);
        let x = (from - s * s * (from - to)).clamp(bottom + slack, top - slack);
        self.told(drive, x.exp() * drive)
    }

    /// Distance and s σ at the ends of `cells` cells of a part.
    fn values(&self, drive: f64, row: &Row, part: usize, cells: usize) -> Vec<[f64; 2]> {
        let at = |s: f64| self.at(drive, row, part, s).map_or([f64::NAN; 2], |(t, _)| [t.a, s * t.sigma]);
        let mut all: Vec<[f64; 2]> =
            (0..=cells).map(|k| at((k as f64 / cells as f64).clamp(FIRST, 1.0 - 1e-9))).collect();
        let w = weights(&[FIRST, 1.0 / cells as f64, 2.0 / cells as f64], 0.0);
        all[0] = [0, 1].map(|i| w.iter().zip(&all).map(|(w, value)| w * value[i]).sum());
        all
    }

    fn strip(&self, drives: [f64; 2]) -> Result<(Strip, Off), InputError> {
        let middle = (drives[0] * drives[1]).sqrt();
        let fine = |drive: f64, cells: usize| -> Result<bool, InputError> {
            Ok(self.off(&self.built([drive; 2], 1, cells)?, drive)?.is_within(FINE))
        };
        // At a jump of the answer, more cells do not help.
        let mut cells = CELLS[2];
        for less in CELLS {
            if fine(drives[0], less)? && fine(drives[1], less)? && fine(middle, less)? {
                cells = less;
                break;
            }
        }
        let one = drives[0] == drives[1];
        let tried: &[usize] = if one { &[1] } else { &ROWS };
        for &rows in tried {
            let strip = self.built(drives, rows, cells)?;
            // Test between the rows, and at and between the calibrated drives, where kinks may be.
            let mut at: Vec<f64> = nodes(2 * rows).iter().map(|x| strip.drive(*x)).collect();
            for w in self.of.drives.windows(2).filter(|w| drives[0] <= w[0] && w[1] <= drives[1]) {
                at.extend([w[0], 0.5 * (w[0] + w[1])]);
            }
            let mut off = Off::default();
            for drive in at {
                off = off.or(self.off(&strip, drive)?);
            }
            if off.is_within(FINE) || rows == tried[tried.len() - 1] {
                return Ok((strip, off));
            }
        }
        unreachable!("some number of rows is the last")
    }

    fn built(&self, drives: [f64; 2], n: usize, cells: usize) -> Result<Strip, InputError> {
        let mut strip = Strip { drives, heads: Vec::new(), values: Vec::new() };
        let at: Vec<f64> = nodes(n).iter().map(|x| strip.drive(*x)).collect();
        let rows = at.iter().map(|drive| self.row(*drive)).collect::<Result<Vec<_>, _>>()?;
        let used = |part: &usize| rows.iter().any(|row| row.ends[*part] > row.ends[part + 1]);
        let parts: Vec<usize> = (0..PARTS).filter(used).collect();
        for (row, drive) in rows.iter().zip(at) {
            let head = |part: &usize| [row.ends[*part], row.ambiguous[*part][0], row.ambiguous[*part][1]];
            strip.heads.push(parts.iter().flat_map(head).chain([row.ends[PARTS]]).collect());
            strip.values.push(parts.iter().map(|part| self.values(drive, row, *part, cells)).collect());
        }
        Ok(strip)
    }

    fn off(&self, strip: &Strip, drive: f64) -> Result<Off, InputError> {
        let [from, to] = strip.drives;
        let x = if from < to { 2.0 * (drive / from).ln() / (to / from).ln() - 1.0 } else { 0.0 };
        let (weights, cells) = (weights(&nodes(strip.heads.len()), x), strip.values[0][0].len() - 1);
        let sum = |i: usize| strip.heads.iter().zip(&weights).map(|(row, w)| w * row[i]).sum();
        let head: Vec<f64> = (0..strip.heads[0].len()).map(sum).collect();
        let mut off = Off::default();
        for part in 0..strip.values[0].len() {
            for k in 0..TRIED {
                let s = ((k * cells / TRIED) as f64 + 0.5) / cells as f64;
                let y = head[3 * part] - s * s * (head[3 * part] - head[3 * part + 3]);
                let measured = part > 0 || s > PEAK;
                let told = self.told(drive, y.exp() * drive);
                let Some((told, doubts)) = told.filter(|_| measured) else { continue };
                let [a, sigma] = strip.at(&weights, part, s);
                let [distance, relative] = [(a - told.a).abs(), (sigma / told.sigma - 1.0).abs()];
                if distance.is_nan() || relative.is_nan() {
                    return Err(InputError::new(format!(
                        "readings without a distance lie among others at the drive {drive}"
                    )));
                }
                let share = distance / told.sigma;
                off = off.or(match doubts.has(Status::OUTSIDE_CALIBRATION) || told.sigma > WIDE * told.a {
                    true => Off { rest: [share, relative], ..Off::default() },
                    false if share > SHARE => Off { distance, sigma: relative, ..Off::default() },
                    false => Off { sigma: relative, ..Off::default() },
                });
            }
        }
        Ok(off)
    }
}

impl Strip {
    fn drive(&self, x: f64) -> f64 {
        let [from, to] = self.drives;
        if from < to { (from * to).sqrt() * (to / from).powf(0.5 * x) } else { from }
    }

    pub(super) fn count(&self) -> usize {
        2 * self.values.iter().flatten().map(Vec::len).sum::<usize>()
    }

    pub(super) fn scale(&self) -> f64 {
        (0.5 * (self.heads[0][0] + self.heads[0][self.heads[0].len() - 1])).exp()
    }

    fn at(&self, rows: &[f64], part: usize, s: f64) -> [f64; 2] {
        let cells = self.values[0][part].len() - 1;
        let first = ((s * cells as f64) as usize).clamp(POINTS / 2 - 1, cells - POINTS / 2) + 1 - POINTS / 2;
        let nodes: [f64; POINTS] = std::array::from_fn(|k| k as f64);
        let weights = weights(&nodes, s * cells as f64 - first as f64);
        let mut sum = [0.0; 2];
        for (row, of_row) in self.values.iter().zip(rows) {
            for ([a, sigma], weight) in row[part][first..].iter().zip(&weights) {
                sum = [sum[0] + of_row * weight * a, sum[1] + of_row * weight * sigma];
            }
        }
        [sum[0], sum[1] / s]
    }
}
