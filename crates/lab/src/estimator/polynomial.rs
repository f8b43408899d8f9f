//! Smooth, monotone curve of distance: a polynomial in ln(signal) and the drive, without theory of the whisker.
//! It is fitted to a or ln a; cross-validation over positions chooses this, its degree, and ln drive or drive ([`Polynomial::choose`]).

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::{Answers, Found, Known, least::solve};
use crate::reduce::{range, sorted};
use crate::{measure::Groups, physics::inverse::bracketed, status::Status};

/// Intervals of the range of signals at which the direction of the curve is checked.
const LOOKS: usize = 24;
/// Maximum of drives for this check.
const DRIVES: usize = 32;

const DEGREES: usize = 4;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Form {
    /// Total degree in ln signal and the drive.
    pub degree: usize,
    pub drive_degree: usize,
    /// True if ln a is fitted instead of a.
    pub log_a: bool,
    /// True for ln drive instead of the drive.
    pub log_drive: bool,
}

impl Form {
    fn powers(&self) -> Vec<[i32; 2]> {
        let to = |i: usize| self.drive_degree.min(self.degree.saturating_sub(i));
        (0..=self.degree).flat_map(|i| (0..=to(i)).map(move |j| [i as i32, j as i32])).collect()
    }

    fn all(positions: usize, drives: usize) -> Vec<Self> {
        let forms = |degree: usize| {
            let form = move |(log_a, log_drive)| {
                let drive_degree = degree.min(drives.saturating_sub(1));
                Self { degree, drive_degree, log_a, log_drive }
            };
            [(true, false), (true, true), (false, false), (false, true)].map(form)
        };
        let degrees = 1..=DEGREES.min(positions.saturating_sub(2)).max(1);
        degrees.flat_map(forms).filter(|form| drives > 1 || !form.log_drive).collect()
    }

    fn drive(&self, drive: f64) -> f64 {
        if self.log_drive { drive.ln() } else { drive }
    }

    fn target(&self, a: f64) -> f64 {
        if self.log_a { a.ln() } else { a }
    }

    fn distance(&self, y: f64) -> f64 {
        if self.log_a { y.exp() } else { y }
    }

    fn terms(&self, powers: &[[i32; 2]], scale: [[f64; 2]; 2], x: f64, drive: f64) -> (Vec<f64>, Vec<f64>) {
        let [[x0, dx], [v0, dv]] = scale;
        let (u, v) = ((x - x0) / dx, (self.drive(drive) - v0) / dv);
        let term = |[i, j]: &[i32; 2]| u.powi(*i) * v.powi(*j);
        let slope =
            |[i, j]: &[i32; 2]| if *i == 0 { 0.0 } else { f64::from(*i) * u.powi(i - 1) * v.powi(*j) / dx };
        (powers.iter().map(term).collect(), powers.iter().map(slope).collect())
    }
}

/// Tap: distance in mm, drive, |signal| > 0, and the position that cross-validation leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub a: f64,
    pub drive: f64,
    pub signal: f64,
    pub position: usize,
    /// Number of taps that it represents.
    pub n: f64,
}

type Range = (f64, [f64; 2]);

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polynomial {
    pub form: Form,
    /// Middle and half width of ln signal, and of the drive or its logarithm.
    pub scale: [[f64; 2]; 2],
    /// Coefficients, by exponent of the scaled ln signal, then of the scaled drive.
    pub coefficients: Vec<f64>,
    pub covariance: Vec<Vec<f64>>,
    /// 1 if the distance grows with the signal, −1 if it falls.
    pub sign: f64,
    pub reach: [f64; 2],
}

/// Sums over the points: products of the terms with each other, and in the last column with the target.
struct Sums {
    scale: [[f64; 2]; 2],
    powers: Vec<[i32; 2]>,
    positions: BTreeMap<usize, DMatrix<f64>>,
    all: DMatrix<f64>,
}

impl Sums {
    fn of(points: &[Point], form: Form) -> Self {
        let scale = |f: &dyn Fn(&Point) -> f64| {
            let [lo, hi] = range(points.iter().map(f));
            let half = 0.5 * (hi - lo);
            [0.5 * (lo + hi), if half > 0.0 { half } else { 1.0 }]
        };
        let scale = [scale(&|p| p.signal.ln()), scale(&|p| form.drive(p.drive))];
        let powers = form.powers();
        let none = DMatrix::zeros(powers.len(), powers.len() + 1);
        let mut positions = BTreeMap::new();
        for p in points {
            let x = DVector::from_vec(form.terms(&powers, scale, p.signal.ln(), p.drive).0);
            let sum: &mut DMatrix<f64> = positions.entry(p.position).or_insert_with(|| none.clone());
            sum.ger(p.n, &x, &x.push(form.target(p.a)), 1.0);
        }
        let all = positions.values().fold(none, |all, sum| all + sum);
        Self { scale, powers, positions, all }
    }
}

/// Coefficients of these sums, and the inverse of the matrix of products.
fn solved(sums: DMatrix<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let last = sums.ncols() - 1;
    solve(&sums.columns(0, last).into_owned(), &sums.column(last).into_owned())
}

impl Polynomial {
    /// Best form in cross-validation over positions; `None` if no form is monotone, or there are too few points.
    pub fn choose(points: &[Point]) -> Option<Form> {
        let positions = points.iter().map(|p| p.position).collect::<BTreeSet<usize>>().len();
        // Values of one drive that differ by jitter count as one drive.
        let steps = Groups::of(points.iter().map(|p| p.drive), None, true).centres.len();
        let ranges = ranges(points);
        let tried = |form| Some((form, Self::left_out(points, positions, &ranges, form)?));
        let mut tried: Vec<(Form, Vec<f64>)> =
            Form::all(positions, steps).into_iter().filter_map(tried).collect();
        let mean = |squares: &[f64]| squares.iter().sum::<f64>() / squares.len() as f64;
        tried.sort_by(|(f, x), (g, y)| {
            f.powers().len().cmp(&g.powers().len()).then(mean(x).total_cmp(&mean(y)))
        });
        let best = tried.iter().map(|(_, s)| s).min_by(|x, y| mean(x).total_cmp(&mean(y)))?;
        // The simplest of the forms that are not significantly worse than the best.
        let as_good = |(_, squares): &&(Form, Vec<f64>)| {
            let mut worse = crate::reduce::Spread::default();
            squares.iter().zip(best).for_each(|(s, b)| worse.push(s - b));
            let error = worse.sd().unwrap_or(0.0) / (worse.n as f64).sqrt();
            worse.mean().unwrap_or(0.0) <= error
        };
        Some(tried.iter().find(as_good)?.0)
    }

    /// Curve of `form` through `points`; `None` if not monotone. It answers beyond the positions by `beyond` of the last step between them.
    pub fn through(points: &[Point], form: Form, beyond: f64) -> Option<Self> {
        Self::fit(&Sums::of(points, form), points, &ranges(points), form, beyond)
    }

    /// Mean square error at each position if left out; `None` if the form does not fit the number of drives.
    fn left_out(points: &[Point], positions: usize, ranges: &[Range], form: Form) -> Option<Vec<f64>> {
        let sums = Sums::of(points, form);
        // The whole curve must be monotone, however well it fits.
        Self::fit(&sums, points, ranges, form, 0.0)?;
        if points.len() < sums.powers.len() + 1 || positions < 3 {
            // Too few points for cross-validation: only the simplest form is allowed.
            return (form.degree == 1).then(|| vec![0.0]);
        }
        let left = |(position, m): (&usize, &DMatrix<f64>)| Some((*position, solved(&sums.all - m)?.0));
        let without: BTreeMap<_, _> = sums.positions.iter().map(left).collect::<Option<_>>()?;
        let squares = by_position(points, |p| {
            let (x, _) = form.terms(&sums.powers, sums.scale, p.signal.ln(), p.drive);
            let y: f64 = x.iter().zip(without[&p.position].iter()).map(|(x, c)| x * c).sum();
            (form.distance(y) - p.a).powi(2)
        });
        let squares: Vec<f64> = squares.into_iter().map(|(s, n)| s / n).collect();
        squares.iter().all(|s| s.is_finite()).then_some(squares)
    }

    /// Least squares; `None` if the curve is not monotone over the data, or the data do not determine it.
    fn fit(sums: &Sums, points: &[Point], ranges: &[Range], form: Form, beyond: f64) -> Option<Self> {
        let (c, inverse) = solved(sums.all.clone())?;
        let mean = |k: &usize| {
            let here = || points.iter().filter(|p| p.position == *k).map(|p| p.a);
            here().sum::<f64>() / here().count() as f64
        };
        let a = sorted(sums.positions.keys().map(mean));
        let n = a.len();
        let room = |p: usize, q: usize| if n > 1 { beyond * (a[p] - a[q]).abs() } else { 0.0 };
        let ends = range(points.iter().map(|p| p.a));
        let reach = [ends[0] - room(1 % n, 0), ends[1] + room(n - 1, n.saturating_sub(2))];
        let (scale, reach) = (sums.scale, [reach[0].max(0.0), reach[1]]);
        let (coefficients, covariance) = (c.iter().copied().collect(), Vec::new());
        let mut curve = Self { form, scale, coefficients, covariance, sign: 1.0, reach };
        curve.sign = curve.direction(ranges)?;
        curve.covariance = curve.spread(points, &inverse);
        Some(curve)
    }

    /// True if its values, which a file may hold, are consistent.
    pub fn is_sound(&self) -> bool {
        // The degree of a file may be any number.
        if self.form.degree > 8 {
            return false;
        }
        let n = self.form.powers().len();
        let square = self.covariance.len() == n && self.covariance.iter().all(|row| row.len() == n);
        let mut numbers = self.coefficients.iter().chain(self.covariance.iter().flatten());
        let [from, to] = self.reach;
        self.coefficients.len() == n
            && square
            && numbers.all(|x| x.is_finite())
            && self.scale.iter().all(|s| s[0].is_finite() && s[1] > 0.0 && s[1].is_finite())
            && from >= 0.0
            && from < to
            && to.is_finite()
            && self.sign.abs() == 1.0
    }

    /// Sign of the curve's slope over the data; `None` if it changes.
    fn direction(&self, ranges: &[Range]) -> Option<f64> {
        let mut sign = 0.0;
        for (drive, [lo, hi]) in ranges {
            for k in 0..=LOOKS {
                let slope = self.at(lo + (hi - lo) * k as f64 / LOOKS as f64, *drive)[1];
                if slope == 0.0 || !slope.is_finite() || (sign != 0.0 && slope.signum() != sign) {
                    return None;
                }
                sign = slope.signum();
            }
        }
        (sign != 0.0).then_some(sign)
    }

    /// Covariance of the coefficients, from the larger of the variances of taps and of positions: errors common to a position count once.
    fn spread(&self, points: &[Point], inverse: &DMatrix<f64>) -> Vec<Vec<f64>> {
        let left = |p: &Point| self.form.target(p.a) - self.form.target(self.at(p.signal.ln(), p.drive)[0]);
        let n: f64 = points.iter().map(|p| p.n).sum();
        let m = self.coefficients.len() as f64;
        let of_taps = points.iter().map(|p| p.n * left(p).powi(2)).sum::<f64>() / (n - m).max(1.0);
        let sums = by_position(points, left);
        let used = (self.form.degree + 1) as f64;
        let of_positions =
            sums.iter().map(|(s, n)| s * s / n).sum::<f64>() / (sums.len() as f64 - used).max(1.0);
        let variance = of_taps.max(of_positions);
        inverse.row_iter().map(|row| row.iter().map(|x| variance * x).collect()).collect()
    }

    /// Distance (mm), da/d(ln signal) (mm) and the variance of a from the fit (mm²) where ln(signal) is x.
    fn at(&self, x: f64, drive: f64) -> [f64; 3] {
        let powers = self.form.powers();
        let (terms, slopes) = self.form.terms(&powers, self.scale, x, drive);
        let dot = |t: &[f64]| t.iter().zip(&self.coefficients).map(|(t, c)| t * c).sum::<f64>();
        let (y, dy) = (dot(&terms), dot(&slopes));
        let of_row =
            |(t, row): (&f64, &Vec<f64>)| t * row.iter().zip(&terms).map(|(c, u)| c * u).sum::<f64>();
        let variance: f64 = terms.iter().zip(&self.covariance).map(of_row).sum();
        let a = self.form.distance(y);
        let per = if self.form.log_a { a } else { 1.0 };
        [a, dy * per, variance.max(0.0) * per * per]
    }
}

impl Answers for Polynomial {
    fn find(&self, drive: f64, signal: f64, _: Known) -> Result<Found, Status> {
        let [a, slope, variance] = self.at(signal.ln(), drive);
        if !(self.reach[0]..=self.reach[1]).contains(&a) || slope.signum() != self.sign {
            return Err(Status::OUTSIDE_CALIBRATION);
        }
        let slope = signal / slope;
        Ok(Found::root(a, None, slope, variance * slope * slope))
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        if !(self.reach[0]..=self.reach[1]).contains(&a) {
            return f64::NAN;
        }
        // Search half as far again as the signals of all drives, where the slope keeps its sign.
        let [mid, half] = self.scale[0];
        let place = |k: usize| mid + 1.5 * half * (k as f64 / LOOKS as f64 - 1.0);
        let at = |k: usize| {
            let [here, slope, _] = self.at(place(k), drive);
            (here - a, slope.signum() == self.sign)
        };
        let crossed = (0..2 * LOOKS).find(|&k| {
            let ((p, runs), (q, on)) = (at(k), at(k + 1));
            runs && on && (p <= 0.0) != (q <= 0.0)
        });
        let miss = |x: f64| self.at(x, drive)[0] - a;
        crossed.map_or(f64::NAN, |k| bracketed(miss, place(k), place(k + 1)).exp())
    }

    fn variance(&self, a: f64, drive: f64, _: bool) -> f64 {
        self.find(drive, self.expected(a, drive), Known::default()).map_or(f64::NAN, |f| f.variance)
    }
}

fn by_position(points: &[Point], of: impl Fn(&Point) -> f64) -> Vec<(f64, f64)> {
    let mut sums = BTreeMap::<usize, (f64, f64)>::new();
    for p in points {
        let sum = sums.entry(p.position).or_default();
        *sum = (sum.0 + p.n * of(p), sum.1 + p.n);
    }
    sums.into_values().collect()
}

fn ranges(points: &[Point]) -> Vec<Range> {
    let mut order: Vec<&Point> = points.iter().collect();
    order.sort_by(|p, q| p.drive.total_cmp(&q.drive));
    let groups = Groups::of(points.iter().map(|p| p.drive), None, true);
    let one = |group: &[&Point]| (groups.centre(group[0].drive), range(group.iter().map(|p| p.signal.ln())));
    let all: Vec<Range> =
        order.chunk_by(|p, q| groups.centre(p.drive) == groups.centre(q.drive)).map(one).collect();
    let stride = all.len().div_ceil(DRIVES);
    all.into_iter().step_by(stride.max(1)).collect()
}
