//! A smooth, monotone curve of distance over signal and drive: a polynomial in ln(signal) and the drive, no theory of the whisker.
//!
//! Fitted is a, or ln a, because that is what is asked: the error that is made small is that of the distance. Its order, and whether the
//! drive counts as it is or by its logarithm, is chosen by the error at positions left out whole ([`Polynomial::choose`]).

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::Found;
use super::form::Form;
use crate::estimator::least::solve;
use crate::physics::inverse::bracketed;

/// Points of the range of signals at which the curve must fall, or rise, as everywhere else.
const LOOKS: usize = 24;
/// Drives at which that is looked at.
const DRIVES: usize = 32;

/// A tap: distance in mm, drive, |signal| > 0, and its position among those that may be left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Contact distance, mm.
    pub a: f64,
    /// Drive, degrees or mm.
    pub drive: f64,
    /// |signal|.
    pub signal: f64,
    /// Number of the position.
    pub position: usize,
    /// Number of taps that it stands for.
    pub n: f64,
}

/// Range of ln signal at one drive.
type Range = (f64, [f64; 2]);

/// A curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polynomial {
    /// What is a polynomial of what.
    pub form: Form,
    /// Middle and half width of ln signal, and of the drive (or its logarithm): both count as −1 … 1.
    pub scale: [[f64; 2]; 2],
    /// Coefficients, by the exponent of the scaled ln signal, then of the scaled drive.
    pub coefficients: Vec<f64>,
    /// Their covariance.
    pub covariance: Vec<Vec<f64>>,
    /// 1 where the distance grows with the signal, −1 where it falls.
    pub sign: f64,
    /// Distances that are answered, mm.
    pub reach: [f64; 2],
}

/// Value of a curve, and what it is worth.
struct At {
    a: f64,
    /// da/d(ln signal), mm.
    slope: f64,
    /// Variance of a from the fit, mm².
    variance: f64,
}

/// Sums of one position: of products of terms, and of terms with what is fitted.
struct Moments {
    xx: DMatrix<f64>,
    xy: DVector<f64>,
}

impl Polynomial {
    /// The form that does best at positions left out; `None` where none is monotone, or too few points are there.
    pub fn choose(points: &[Point]) -> Option<Form> {
        let mut positions: Vec<usize> = points.iter().map(|p| p.position).collect();
        positions.sort_unstable();
        positions.dedup();
        let mut drives: Vec<f64> = points.iter().map(|p| p.drive).collect();
        drives.sort_by(f64::total_cmp);
        // Jitter of one drive is none of several.
        let steps = crate::measure::group::Groups::of(drives.iter().copied(), None, true).centres.len();
        let ranges = ranges(points);
        let tried = |form| Some((form, Self::left_out(points, &positions, &ranges, form)?));
        let mut tried: Vec<(Form, Vec<f64>)> =
            Form::all(positions.len(), steps).into_iter().filter_map(tried).collect();
        let mean = |squares: &[f64]| squares.iter().sum::<f64>() / squares.len() as f64;
        tried.sort_by(|(f, x), (g, y)| {
            f.terms_in_all().cmp(&g.terms_in_all()).then(mean(x).total_cmp(&mean(y)))
        });
        let best = tried.iter().map(|(_, s)| s).min_by(|x, y| mean(x).total_cmp(&mean(y)))?;
        // Of forms that the positions cannot tell from the best, the simplest.
        let as_good = |(_, squares): &&(Form, Vec<f64>)| {
            let mut worse = crate::reduce::Spread::default();
            squares.iter().zip(best).for_each(|(s, b)| worse.push(s - b));
            let error = worse.sd().unwrap_or(0.0) / (worse.n as f64).sqrt();
            worse.mean().unwrap_or(0.0) <= error
        };
        Some(tried.iter().find(as_good)?.0)
    }

    /// The curve of `form` through `points`; `None` where it is not monotone. `beyond`: share of the last step between positions to which
    /// it answers beyond them.
    pub fn through(points: &[Point], form: Form, beyond: f64) -> Option<Self> {
        Self::fit(points, &ranges(points), form, beyond)
    }

    /// Scales of ln signal and the drive.
    fn scales(points: &[Point], form: Form) -> [[f64; 2]; 2] {
        let range = |f: &dyn Fn(&Point) -> f64| {
            let ends = points
                .iter()
                .map(f)
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
            let half = 0.5 * (ends[1] - ends[0]);
            [0.5 * (ends[0] + ends[1]), if half > 0.0 { half } else { 1.0 }]
        };
        [range(&|p| p.signal.ln()), range(&|p| form.drive(p.drive))]
    }

    /// Moments of each position.
    fn moments(
        points: &[Point],
        form: Form,
        scale: [[f64; 2]; 2],
    ) -> std::collections::BTreeMap<usize, Moments> {
        let powers = form.powers();
        let mut all = std::collections::BTreeMap::new();
        for p in points {
            let x = DVector::from_vec(form.terms(&powers, scale, p.signal.ln(), p.drive).0);
            let sum = all.entry(p.position).or_insert_with(|| Moments {
                xx: DMatrix::zeros(x.len(), x.len()),
                xy: DVector::zeros(x.len()),
            });
            sum.xx.ger(p.n, &x, &x, 1.0);
            sum.xy.axpy(p.n * form.target(p.a), &x, 1.0);
        }
        all
    }

    /// Mean square error at each position where that is left out; `None` where the form is none of these data.
    fn left_out(points: &[Point], positions: &[usize], ranges: &[Range], form: Form) -> Option<Vec<f64>> {
        let scale = Self::scales(points, form);
        let powers = form.powers();
        // A curve that turns is no calibration, however well it fits.
        Self::fit(points, ranges, form, 0.0)?;
        if points.len() < powers.len() + 1 || positions.len() < 3 {
            // Nothing can be left out of so little: the simplest form has to do.
            return (form.degree == 1).then(|| vec![0.0]);
        }
        let moments = Self::moments(points, form, scale);
        let (mut xx, mut xy) = (DMatrix::zeros(powers.len(), powers.len()), DVector::zeros(powers.len()));
        for m in moments.values() {
            xx += &m.xx;
            xy += &m.xy;
        }
        let mut sums = std::collections::BTreeMap::<usize, (f64, f64)>::new();
        let mut without = std::collections::BTreeMap::new();
        for (position, m) in &moments {
            without.insert(*position, solve(&(&xx - &m.xx), &(&xy - &m.xy))?.0);
        }
        for p in points {
            let (x, _) = form.terms(&powers, scale, p.signal.ln(), p.drive);
            let y: f64 = x.iter().zip(without[&p.position].iter()).map(|(x, c)| x * c).sum();
            let sum = sums.entry(p.position).or_default();
            *sum = (sum.0 + p.n * (form.distance(y) - p.a).powi(2), sum.1 + p.n);
        }
        let squares: Vec<f64> = sums.values().map(|(s, n)| s / n).collect();
        squares.iter().all(|s| s.is_finite()).then_some(squares)
    }

    /// Least squares; `None` where the curve is not monotone over the data, or the data do not determine it.
    fn fit(points: &[Point], ranges: &[Range], form: Form, beyond: f64) -> Option<Self> {
        let scale = Self::scales(points, form);
        let powers = form.powers();
        let moments = Self::moments(points, form, scale);
        let (mut xx, mut xy) = (DMatrix::zeros(powers.len(), powers.len()), DVector::zeros(powers.len()));
        for m in moments.values() {
            xx += &m.xx;
            xy += &m.xy;
        }
        let (c, inverse) = solve(&xx, &xy)?;
        let mean = |k: &usize| {
            let here = || points.iter().filter(|p| p.position == *k).map(|p| p.a);
            here().sum::<f64>() / here().count() as f64
        };
        let mut a: Vec<f64> = moments.keys().map(mean).collect();
        a.sort_by(f64::total_cmp);
        let n = a.len();
        let room = |p: usize, q: usize| if n > 1 { beyond * (a[p] - a[q]).abs() } else { 0.0 };
        let ends = points.iter().fold([f64::INFINITY, 0.0f64], |[l, h], p| [l.min(p.a), h.max(p.a)]);
        let reach = [ends[0] - room(1 % n, 0), ends[1] + room(n - 1, n.saturating_sub(2))];
        let mut curve = Self {
            form,
            scale,
            coefficients: c.iter().copied().collect(),
            covariance: Vec::new(),
            sign: 1.0,
            reach: [reach[0].max(0.0), reach[1]],
        };
        curve.sign = curve.direction(ranges)?;
        curve.covariance = curve.spread(points, &moments, &inverse);
        Some(curve)
    }

    /// Whether distance grows or falls with the signal everywhere among the data; `None` where it does both.
    fn direction(&self, ranges: &[Range]) -> Option<f64> {
        let mut sign = 0.0;
        for (drive, [lo, hi]) in ranges {
            for k in 0..=LOOKS {
                let slope = self.at(lo + (hi - lo) * k as f64 / LOOKS as f64, *drive).slope;
                if slope == 0.0 || !slope.is_finite() || (sign != 0.0 && slope.signum() != sign) {
                    return None;
                }
                sign = slope.signum();
            }
        }
        (sign != 0.0).then_some(sign)
    }

    /// Covariance of the coefficients. What a position has in common — its label, what the form does not follow — counts once, not
    /// once a tap: the larger of the two variances that taps and positions show is that of every tap.
    fn spread(
        &self,
        points: &[Point],
        moments: &std::collections::BTreeMap<usize, Moments>,
        inverse: &DMatrix<f64>,
    ) -> Vec<Vec<f64>> {
        let left = |p: &Point| self.form.target(p.a) - self.form.target(self.at(p.signal.ln(), p.drive).a);
        let n: f64 = points.iter().map(|p| p.n).sum();
        let m = self.coefficients.len() as f64;
        let of_taps = points.iter().map(|p| p.n * left(p).powi(2)).sum::<f64>() / (n - m).max(1.0);
        let mut sums = std::collections::BTreeMap::<usize, (f64, f64)>::new();
        for p in points {
            let sum = sums.entry(p.position).or_default();
            *sum = (sum.0 + p.n * left(p), sum.1 + p.n);
        }
        let groups = moments.len() as f64;
        let used = (self.form.degree + 1) as f64;
        let of_positions = sums.values().map(|(s, n)| s * s / n).sum::<f64>() / (groups - used).max(1.0);
        let variance = of_taps.max(of_positions);
        (0..inverse.nrows())
            .map(|i| (0..inverse.ncols()).map(|k| variance * inverse[(i, k)]).collect())
            .collect()
    }

    /// The curve at ln signal = `x`.
    fn at(&self, x: f64, drive: f64) -> At {
        let powers = self.form.powers();
        let (terms, slopes) = self.form.terms(&powers, self.scale, x, drive);
        let dot = |t: &[f64]| t.iter().zip(&self.coefficients).map(|(t, c)| t * c).sum::<f64>();
        let (y, dy) = (dot(&terms), dot(&slopes));
        let of_row =
            |(t, row): (&f64, &Vec<f64>)| t * row.iter().zip(&terms).map(|(c, u)| c * u).sum::<f64>();
        let variance: f64 = terms.iter().zip(&self.covariance).map(of_row).sum();
        let a = self.form.distance(y);
        let per = if self.form.log_a { a } else { 1.0 };
        At { a, slope: dy * per, variance: variance.max(0.0) * per * per }
    }

    /// Distance at which the curve has `signal` > 0 at `drive`; `None` beyond its reach.
    pub fn find(&self, drive: f64, signal: f64) -> Option<Found> {
        let at = self.at(signal.ln(), drive);
        let inside = at.a >= self.reach[0] && at.a <= self.reach[1];
        if !inside || at.slope.signum() != self.sign || !at.a.is_finite() {
            return None;
        }
        let slope = signal / at.slope;
        Some(Found {
            a: at.a,
            near: None,
            slope,
            variance: at.variance * slope * slope,
            sigma: f64::NAN,
            ends: [f64::NAN; 2],
            wide: false,
        })
    }

    /// Signal of a tap at a (mm) by `drive`; NaN beyond the reach.
    pub fn expected(&self, a: f64, drive: f64) -> f64 {
        if !(self.reach[0]..=self.reach[1]).contains(&a) {
            return f64::NAN;
        }
        // Half as far again as the signals of all drives, where the curve runs as it does among the data.
        let [mid, half] = self.scale[0];
        let place = |k: usize| mid + 1.5 * half * (k as f64 / LOOKS as f64 - 1.0);
        let at = |k: usize| {
            let here = self.at(place(k), drive);
            (here.a - a, here.slope.signum() == self.sign)
        };
        let crossed = (0..2 * LOOKS).find(|&k| {
            let ((p, runs), (q, on)) = (at(k), at(k + 1));
            runs && on && (p <= 0.0) != (q <= 0.0)
        });
        let miss = |x: f64| self.at(x, drive).a - a;
        crossed.map_or(f64::NAN, |k| bracketed(miss, place(k), place(k + 1)).exp())
    }
}

/// Range of ln signal at each drive, of some where there are many.
fn ranges(points: &[Point]) -> Vec<Range> {
    let mut order: Vec<&Point> = points.iter().collect();
    order.sort_by(|p, q| p.drive.total_cmp(&q.drive));
    let groups = crate::measure::group::Groups::of(points.iter().map(|p| p.drive), None, true);
    let one = |group: &[&Point]| {
        let ends = group.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], p| {
            let x = p.signal.ln();
            [l.min(x), h.max(x)]
        });
        (groups.centre(group[0].drive), ends)
    };
    let all: Vec<Range> =
        order.chunk_by(|p, q| groups.centre(p.drive) == groups.centre(q.drive)).map(one).collect();
    let stride = all.len().div_ceil(DRIVES);
    all.into_iter().step_by(stride.max(1)).collect()
}
