//! Linear model: signal = Σ column · coefficient + noise, with normal coefficients whose variances are learned.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::fit::{Start, slopes};
use crate::rows::{Cell, Row, TOGETHER};
use crate::{base::About, evidence::Hyper};
use vibrissa_core::reduce::{range, sorted};

const DEGREE: usize = 2;
const LESS: f64 = 0.3;
/// Count of waves in ln a and in ln u, the constant included, and largest sum of both orders in a product.
pub(crate) const WAVES: [usize; 3] = [9, 4, 9];
/// Half of the period of the waves, in half ranges of the data.
const PERIOD: f64 = 1.8;
const KNOTS: usize = 16;
/// Prior standard deviation of a coefficient of unknown size.
pub(crate) const FLAT: f64 = 1e2;
/// Prior offsets of distance and drive: shares of the middle distance and of the largest drive.
pub(crate) const OFFSETS: [f64; 2] = [0.005, 0.03];

/// Meaning of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    /// Legendre degrees in ln a and ln u, times the base.
    Curve(u8, u8),
    /// Orders of waves in ln a and ln u, times the base.
    Wave(u8, u8),
    /// Offset of the distance.
    OffsetA,
    /// Offset of the drive.
    OffsetU,
    /// Zero that all rows share.
    Zero,
    /// Effect that new readings do not have.
    Local,
}

/// Prior of a column: ln variance = `fixed` + 2 Σ ln hyper, for a wave plus its spectrum.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Column {
    pub term: Term,
    pub fixed: f64,
    /// Learned parts, as indices into the hyperparameters.
    pub learned: Vec<usize>,
}

/// Angular frequency of wave n, in 1/half range.
pub(crate) fn frequency(n: usize) -> f64 {
    n as f64 * std::f64::consts::PI / (2.0 * PERIOD)
}

/// Waves 0 … n − 1 at x: cosines, so that long lengths give a constant (Solin and Särkkä 2020, with free ends).
fn waves(n: usize, x: f64) -> Vec<f64> {
    let first = (frequency(1) * (x.clamp(-PERIOD, PERIOD) + PERIOD)).cos();
    let mut cosines = vec![1.0, first];
    (2..n).for_each(|k| cosines.push(2.0 * first * cosines[k - 1] - cosines[k - 2]));
    cosines.iter().enumerate().map(|(k, c)| if k == 0 { 1.0 } else { std::f64::consts::SQRT_2 * c }).collect()
}

/// Middle and half range of ln a and ln u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Middle and half range of ln a.
    pub a: [f64; 2],
    /// Middle and half range of ln u; the half range is 0 for one drive.
    pub u: [f64; 2],
    /// A middle distance in mm, and the largest drive.
    pub sizes: [f64; 2],
    /// Offset added to the drive before its logarithm.
    pub offset: f64,
}

impl Scales {
    /// Scales of the taps among `cells`.
    pub fn of(cells: &[Cell], offset: f64) -> Self {
        let scale = |f: &dyn Fn(&Cell) -> f64| {
            let [lo, hi] = range(cells.iter().filter(|c| c.row.touches()).map(f));
            [0.5 * (lo + hi), 0.5 * (hi - lo)]
        };
        let (a, u) = (scale(&|c| c.row.a.ln()), scale(&|c| (c.row.u + offset).ln()));
        let u = if u[1] > 1e-6 { u } else { [u[0], 0.0] };
        Self { a, u, sizes: [a[0].exp(), (u[0] + u[1]).exp()], offset }
    }

    /// ln a and ln u scaled to −1 … 1 over the data.
    pub fn place(&self, a: f64, u: f64) -> [f64; 2] {
        let v = if self.u[1] > 0.0 { ((u + self.offset).ln() - self.u[0]) / self.u[1] } else { 0.0 };
        [(a.ln() - self.a[0]) / self.a[1], v]
    }
}

/// Legendre polynomials up to [`DEGREE`] at x.
fn legendre(x: f64) -> [f64; DEGREE + 1] {
    [1.0, x, (3.0 * x * x - 1.0) / 2.0]
}

/// Terms of new readings, for a `known` whisker, for `several` drives.
pub(crate) fn terms(known: bool, several: bool) -> Vec<Term> {
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

/// Value of each of `terms` for a tap at a (mm) and drive u with the base `base`; 1 for [`Term::Zero`].
pub(crate) fn values(base: &About, scales: &Scales, terms: &[Term], a: f64, u: f64) -> Vec<f64> {
    let m = base.value;
    let [x, v] = scales.place(a, u);
    let (p, q) = (legendre(x), legendre(v));
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

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Effects {
    pub known: bool,
    /// Prior standard deviation of the zero in units of the signal, large if zeros were read; `None` if it is learned.
    pub zero: Option<f64>,
    pub drift: bool,
}

/// Model matrix of cells with priors.
pub(crate) struct Columns {
    pub matrix: DMatrix<f64>,
    /// Prior of each column; the [`terms`] of new readings come last.
    pub columns: Vec<Column>,
    pub hypers: Vec<Hyper>,
}

impl Columns {
    /// Columns of the `terms` of new readings.
    pub fn places(&self, terms: &[Term]) -> std::ops::Range<usize> {
        self.columns.len() - terms.len()..self.columns.len()
    }

    /// Columns of `cells` for the base and the units of `start`.
    pub fn new(cells: &[Cell], start: &Start, scales: &Scales, effects: Effects) -> Self {
        let (base, [.., unit], slopes) = (&start.base, start.numbers, slopes(cells, start, scales));
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
        let m = |c: &Cell| if c.row.touches() { base.value(c.row.a, c.row.u) / unit } else { 0.0 };
        let m: Vec<f64> = cells.iter().map(m).collect();
        let terms = terms(effects.known, several);
        let mut columns: Vec<Column> = Vec::new();
        let mut data: Vec<Vec<f64>> = Vec::new();
        let of_tap = |Row { a, u, .. }: Row| values(&base.about(unit, a, u), scales, &terms, a, u);
        let rows: BTreeMap<usize, Vec<f64>> = taps.iter().map(|k| (*k, of_tap(cells[*k].row))).collect();
        // The curve comes last, so that its covariance needs only the last rows of a factor.
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

/// Ramps over the time of the rows: a random walk with independent steps.
fn ramps(cells: &[Cell]) -> Vec<Vec<f64>> {
    let [first, last] = range(cells.iter().map(|c| c.row.t));
    let step = (last - first) / KNOTS as f64;
    let ramp = |k: usize| {
        let from = first + step * k as f64;
        let scale = (1.0 / KNOTS as f64).sqrt();
        // Start from the middle: the zero is that of the middle of the time.
        let shift = if 2 * k < KNOTS { 1.0 } else { 0.0 };
        cells.iter().map(|c| (((c.row.t - from) / step).clamp(0.0, 1.0) - shift) * scale).collect()
    };
    if step > 0.0 { (0..KNOTS).map(ramp).collect() } else { Vec::new() }
}

/// Maximum of columns for positions, and for visits; more are approximated.
const EFFECTS: usize = 64;
const SAME: f64 = 1e-6;
const CLOSE: f64 = 2.355;

/// Columns of positions and of visits over `taps` of `cells`; none if each tap has a separate position.
fn of_positions(cells: &[Cell], taps: &[usize], scales: &Scales, runs: usize) -> [Vec<Vec<f64>>; 2] {
    let n = taps.len();
    let row = |i: usize| cells[taps[i]].row;
    let positions: Vec<f64> = (0..n).map(|i| scales.place(row(i).a, row(i).u)[0]).collect();
    let ascending = sorted(positions.iter().copied());
    let repeated =
        taps.iter().any(|k| cells[*k].n > 1.0) || ascending.windows(2).any(|w| w[1] - w[0] < 2.0 * TOGETHER);
    if !repeated {
        return [Vec::new(), Vec::new()];
    }
    let near = |i: usize, k: usize| (-0.5 * ((positions[i] - positions[k]) / (2.0 * TOGETHER)).powi(2)).exp();
    // Nearly equal labels are jitter of one setting, or several settings with separate errors.
    let same = |i: usize, k: usize| (row(i).a - row(k).a).abs() <= SAME * row(i).a;
    let both = |i: usize, k: usize| 0.5 * near(i, k) + if same(i, k) { 0.5 } else { 0.0 };
    let visited = |i: usize, k: usize| if row(i).run == row(k).run { both(i, k) } else { 0.0 };
    let mut labels = sorted((0..n).map(|i| row(i).a));
    labels.dedup_by(|a, b| *a - *b <= SAME * *b);
    let place = |a: f64| scales.place(a, row(0).u)[0];
    let close = labels.windows(2).any(|w| place(w[1]) - place(w[0]) < CLOSE * TOGETHER);
    // If each tap has a separate label, its error is noise.
    let settings = runs > 1 || close && 2 * labels.len() <= n;
    [factor(n, &near), if settings { factor(n, &visited) } else { Vec::new() }]
}

/// Columns F with F Fᵀ = matrix of `kernel`: pivoted Cholesky, truncated at 1e-6.
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
