//! The linear model: signal = Σ column · coefficient + noise, coefficients normal with variances that are learned.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::base::{About, Base};
use crate::hyper::Hyper;
use crate::labels::TOGETHER;
use crate::rows::{Cell, range};

/// Largest degree in ln a and in ln u.
const DEGREE: usize = 2;
/// Size of a term of a quadratic to that of one degree below.
const LESS: f64 = 0.3;
/// Waves in ln a and in ln u, the constant one included, and the most of a product.
pub const WAVES: [usize; 3] = [9, 4, 9];
/// Half of the interval on which waves repeat, in half ranges of the data.
const PERIOD: f64 = 1.8;
/// Knots of a drift.
const KNOTS: usize = 16;
/// Standard deviation of a coefficient of which nothing is known beforehand.
pub(crate) const FLAT: f64 = 1e2;
/// Offsets of distance and drive that a rig has: shares of a middle distance, and of the largest drive.
pub(crate) const OFFSETS: [f64; 2] = [0.005, 0.03];

/// What a column says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    /// Degrees in ln a and ln u of the factor of the base.
    Curve(u8, u8),
    /// Waves in ln a and ln u of the same.
    Wave(u8, u8),
    /// Offset of the distance.
    OffsetA,
    /// Offset of the drive.
    OffsetU,
    /// The zero that all rows share.
    Zero,
    /// Anything that is not asked for of new readings.
    Local,
}

/// A column's prior: ln of its variance is `fixed` + 2 Σ ln hyper, and of a wave its spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// What it says.
    pub term: Term,
    /// Part that is not learned.
    pub fixed: f64,
    /// Learned parts: places among the hyperparameters.
    pub learned: Vec<usize>,
}

/// Angular frequency of wave n, in half ranges.
pub fn frequency(n: usize) -> f64 {
    n as f64 * std::f64::consts::PI / (2.0 * PERIOD)
}

/// Waves 0 … n − 1 at x: cosines, so that a curve of great length is constant (Solin and Särkkä 2020, with free ends).
fn waves(n: usize, x: f64) -> Vec<f64> {
    let first = (frequency(1) * (x.clamp(-PERIOD, PERIOD) + PERIOD)).cos();
    let mut cosines = vec![1.0, first];
    (2..n).for_each(|k| cosines.push(2.0 * first * cosines[k - 1] - cosines[k - 2]));
    cosines.iter().enumerate().map(|(k, c)| if k == 0 { 1.0 } else { std::f64::consts::SQRT_2 * c }).collect()
}

/// Scales of ln a and ln u: middle and half of their ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Of ln a.
    pub a: [f64; 2],
    /// Of ln u; half a range of 0 where there is one drive.
    pub u: [f64; 2],
    /// A middle distance and the largest drive.
    pub sizes: [f64; 2],
    /// What is added to the drive before its logarithm is taken.
    pub offset: f64,
}

impl Scales {
    /// Of the taps among `cells`.
    pub fn of(cells: &[Cell], offset: f64) -> Self {
        let scale = |f: &dyn Fn(&Cell) -> f64| {
            let [lo, hi] = range(cells.iter().filter(|c| c.row.touches()).map(f));
            [0.5 * (lo + hi), 0.5 * (hi - lo)]
        };
        let (a, u) = (scale(&|c| c.row.a.ln()), scale(&|c| (c.row.u + offset).ln()));
        let u = if u[1] > 1e-6 { u } else { [u[0], 0.0] };
        Self { a, u, sizes: [a[0].exp(), (u[0] + u[1]).exp()], offset }
    }

    /// ln a and ln u on −1 … 1 of the data.
    pub fn place(&self, a: f64, u: f64) -> [f64; 2] {
        let v = if self.u[1] > 0.0 { ((u + self.offset).ln() - self.u[0]) / self.u[1] } else { 0.0 };
        [(a.ln() - self.a[0]) / self.a[1], v]
    }
}

/// Legendre polynomials P_0 … P_n at x.
pub fn legendre(n: usize, x: f64) -> Vec<f64> {
    let mut p = vec![1.0, x];
    for k in 1..n {
        let k_ = k as f64;
        p.push(((2.0 * k_ + 1.0) * x * p[k] - k_ * p[k - 1]) / (k_ + 1.0));
    }
    p.truncate(n + 1);
    p
}

/// Terms that new readings are answered with.
pub fn terms(known: bool, several: bool) -> Vec<Term> {
    let pairs = |n: usize, m: usize, most: usize| {
        let m = if several { m } else { 1 };
        let all = (0..n).flat_map(move |j| (0..m).map(move |k| (j, k)));
        all.filter(move |(j, k)| j + k <= most).map(|(j, k)| (j as u8, k as u8))
    };
    let mut all: Vec<Term> =
        pairs(DEGREE + 1, DEGREE + 1, 2 * DEGREE).map(|(j, k)| Term::Curve(j, k)).collect();
    all.extend(pairs(WAVES[0], WAVES[1], WAVES[2]).map(|(j, k)| Term::Wave(j, k)));
    if several {
        all.push(Term::OffsetU);
    }
    if known {
        all.push(Term::OffsetA);
    }
    all.push(Term::Zero);
    all
}

/// What a tap at a (mm) by the drive u gives of each of `terms` (of [`Term::Zero`] 1), where the base is `base`.
pub fn values(base: &About, scales: &Scales, terms: &[Term], a: f64, u: f64) -> Vec<f64> {
    let m = base.value;
    let [x, v] = scales.place(a, u);
    let (p, q) = (legendre(DEGREE, x), legendre(DEGREE, v));
    let (f, g) = (waves(WAVES[0], x), waves(WAVES[1], v));
    let value = |t: &Term| match t {
        Term::Curve(j, k) => m * p[usize::from(*j)] * q[usize::from(*k)],
        Term::Wave(j, k) => m * f[usize::from(*j)] * g[usize::from(*k)],
        Term::OffsetA => base.by_distance * scales.sizes[0] / a,
        Term::OffsetU => base.by_drive * scales.sizes[1] / u,
        Term::Zero => 1.0,
        Term::Local => 0.0,
    };
    terms.iter().map(value).collect()
}

/// What the rows of a rig have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effects {
    /// Whether the base is a whisker's curve.
    pub known: bool,
    /// Standard deviation of the zero before any tap, in units of the signal, large where it was read; `None` where it is learned.
    pub zero: Option<f64>,
    /// Whether a drift is looked for.
    pub drift: bool,
}

/// The model of some cells.
pub struct Columns {
    /// Of each cell its row.
    pub matrix: DMatrix<f64>,
    /// Of each column its prior; those of new readings' [`terms`] are the last ones.
    pub columns: Vec<Column>,
    /// What is learned.
    pub hypers: Vec<Hyper>,
}

impl Columns {
    /// Places of the columns of new readings' `terms`.
    pub fn places(&self, terms: &[Term]) -> std::ops::Range<usize> {
        self.columns.len() - terms.len()..self.columns.len()
    }

    /// Of `cells` with `base`, which is divided by `unit`; `slopes` are ∂ signal/∂ ln a of each, in the same unit.
    pub fn new(
        cells: &[Cell],
        (base, unit): (&Base, f64),
        slopes: &[f64],
        scales: &Scales,
        effects: Effects,
    ) -> Self {
        let taps: Vec<usize> = (0..cells.len()).filter(|k| cells[*k].row.touches()).collect();
        let runs = cells.iter().map(|c| c.row.run).max().unwrap_or(0) + 1;
        let several = scales.u[1] > 0.0;
        let mut hypers = vec![Hyper::Floor, Hyper::Relative, Hyper::Bend, Hyper::Deviation, Hyper::LengthA];
        hypers.extend(if several { vec![Hyper::LengthU, Hyper::Twist] } else { Vec::new() });
        let [position, visit] = of_positions(cells, &taps, scales, runs);
        hypers.extend((!position.is_empty()).then_some(Hyper::Position));
        hypers.extend((!visit.is_empty()).then_some(Hyper::Visit));
        hypers.extend(if runs > 1 { vec![Hyper::RunZero, Hyper::RunGain] } else { Vec::new() });
        hypers.extend(effects.zero.is_none().then_some(Hyper::Zero));
        hypers.extend(effects.drift.then_some(Hyper::Drift));
        let at = |h: Hyper| hypers.iter().position(|x| *x == h).expect("it was put there");
        let m: Vec<f64> = cells
            .iter()
            .map(|c| if c.row.touches() { base.value(c.row.a, c.row.u) / unit } else { 0.0 })
            .collect();

        let terms = terms(effects.known, several);
        let mut columns: Vec<Column> = Vec::new();
        let mut data: Vec<Vec<f64>> = Vec::new();
        let rows: BTreeMap<usize, Vec<f64>> = taps
            .iter()
            .map(|k| (*k, cells[*k].row))
            .map(|(k, row)| (k, values(&base.about(unit, row.a, row.u), scales, &terms, row.a, row.u)))
            .collect();
        // Those of the curve last: then its covariance is that of the last rows of a factor alone.
        let mut add = |hyper: Hyper, values: Vec<f64>| {
            columns.push(Column { term: Term::Local, fixed: 0.0, learned: vec![at(hyper)] });
            data.push(values);
        };
        for (hyper, effect) in [(Hyper::Position, position), (Hyper::Visit, visit)] {
            for column in effect {
                let mut values = vec![0.0; cells.len()];
                taps.iter().zip(column).for_each(|(k, x)| values[*k] = slopes[*k] * x);
                add(hyper, values);
            }
        }
        for r in 0..if runs > 1 { runs } else { 0 } {
            let here = |k: usize| if cells[k].row.run == r { 1.0 } else { 0.0 };
            add(Hyper::RunZero, (0..cells.len()).map(here).collect());
            add(Hyper::RunGain, (0..cells.len()).map(|k| here(k) * m[k]).collect());
        }
        if effects.drift {
            ramps(cells).into_iter().for_each(|values| add(Hyper::Drift, values));
        }
        for (j, term) in terms.iter().enumerate() {
            let (fixed, learned) = match *term {
                Term::Curve(0, 0) => (FLAT, Vec::new()),
                Term::Curve(1, 0) | Term::Curve(0, 1) if !effects.known => (FLAT, Vec::new()),
                Term::Curve(j, k) => {
                    let beyond = i32::from(j + k) - if effects.known { 1 } else { 2 };
                    (LESS.powi(beyond), vec![at(if k == 0 { Hyper::Bend } else { Hyper::Twist })])
                }
                Term::Wave(..) => (1.0, vec![at(Hyper::Deviation)]),
                Term::OffsetA => (OFFSETS[0], Vec::new()),
                Term::OffsetU => (OFFSETS[1], Vec::new()),
                Term::Zero => {
                    effects.zero.map_or_else(|| (1.0, vec![at(Hyper::Zero)]), |sd| (sd, Vec::new()))
                }
                Term::Local => unreachable!("no term of the curve"),
            };
            columns.push(Column { term: *term, fixed: 2.0 * fixed.ln(), learned });
            let of_rest = if *term == Term::Zero { 1.0 } else { 0.0 };
            data.push((0..cells.len()).map(|k| rows.get(&k).map_or(of_rest, |r| r[j])).collect());
        }
        let matrix = DMatrix::from_fn(cells.len(), columns.len(), |i, j| data[j][i]);
        Self { matrix, columns, hypers }
    }
}

/// Ramps between knots of the order of the rows: a walk whose steps are independent.
fn ramps(cells: &[Cell]) -> Vec<Vec<f64>> {
    let mut times: Vec<f64> = cells.iter().map(|c| c.row.t).collect();
    times.sort_by(f64::total_cmp);
    let (first, last) = (times[0], times[times.len() - 1]);
    let step = (last - first) / KNOTS as f64;
    let ramp = |k: usize| {
        let from = first + step * k as f64;
        let scale = (1.0 / KNOTS as f64).sqrt();
        // From the middle of the time on both ways: the zero is that of the middle.
        let shift = if 2 * k < KNOTS { 1.0 } else { 0.0 };
        cells.iter().map(|c| (((c.row.t - from) / step).clamp(0.0, 1.0) - shift) * scale).collect()
    };
    if step > 0.0 { (0..KNOTS).map(ramp).collect() } else { Vec::new() }
}

/// Most columns for effects of positions, of visits each; more are approximated.
const EFFECTS: usize = 64;
/// Labels that differ by no more than this share are one.
const SAME: f64 = 1e-6;
/// Labels nearer than so many [`TOGETHER`] have effects that are more than half the same.
const CLOSE: f64 = 2.355;

/// Columns of positions and of visits, over `taps` of `cells` in so many `runs`; none where each tap has a position of its own.
pub(crate) fn of_positions(
    cells: &[Cell],
    taps: &[usize],
    scales: &Scales,
    runs: usize,
) -> [Vec<Vec<f64>>; 2] {
    let n = taps.len();
    let row = |i: usize| cells[taps[i]].row;
    let positions: Vec<f64> = (0..n).map(|i| scales.place(row(i).a, row(i).u)[0]).collect();
    let mut sorted = positions.clone();
    sorted.sort_by(f64::total_cmp);
    // An effect of the position is one of the reading where each position has one.
    let repeated =
        taps.iter().any(|k| cells[*k].n > 1.0) || sorted.windows(2).any(|w| w[1] - w[0] < 2.0 * TOGETHER);
    if !repeated {
        return [Vec::new(), Vec::new()];
    }
    let near = |i: usize, k: usize| (-0.5 * ((positions[i] - positions[k]) / (2.0 * TOGETHER)).powi(2)).exp();
    // Labels that hardly differ are jitter of one setting, or several settings, each with its own error.
    let same = |i: usize, k: usize| (row(i).a - row(k).a).abs() <= SAME * row(i).a;
    let visited = |i: usize, k: usize| match row(i).run == row(k).run {
        true => 0.5 * near(i, k) + if same(i, k) { 0.5 } else { 0.0 },
        false => 0.0,
    };
    let mut labels: Vec<f64> = (0..n).map(|i| row(i).a).collect();
    labels.sort_by(f64::total_cmp);
    labels.dedup_by(|a, b| *a - *b <= SAME * *b);
    let place = |a: f64| scales.place(a, row(0).u)[0];
    let close = labels.windows(2).any(|w| place(w[1]) - place(w[0]) < CLOSE * TOGETHER);
    // Where each tap has a label of its own, its error is noise.
    let settings = runs > 1 || close && 2 * labels.len() <= n;
    [factor(n, &near), if settings { factor(n, &visited) } else { Vec::new() }]
}

/// Columns F with F Fᵀ = the matrix of `kernel`, by Cholesky's method with pivots; what is below 1e-6 is left.
fn factor(n: usize, kernel: &dyn Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let mut left: Vec<f64> = (0..n).map(|i| kernel(i, i)).collect();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    while columns.len() < EFFECTS {
        let Some(pivot) = (0..n).max_by(|i, k| left[*i].total_cmp(&left[*k]).then(k.cmp(i))) else { break };
        if left[pivot] < 1e-6 {
            break;
        }
        let root = left[pivot].sqrt();
        let entry =
            |i: usize| (kernel(i, pivot) - columns.iter().map(|c| c[i] * c[pivot]).sum::<f64>()) / root;
        let column: Vec<f64> = (0..n).map(entry).collect();
        left.iter_mut().zip(&column).for_each(|(l, x)| *l = (*l - x * x).max(0.0));
        columns.push(column);
    }
    columns
}
