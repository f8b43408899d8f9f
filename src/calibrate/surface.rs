//! What is smooth in measured signals: ln(signal/expected) as a low polynomial of 1/a and the drive, fitted by iterated weights (Tukey's
//! biweight from an L1 start); scales are medians.

use nalgebra::{DMatrix, DVector};

use crate::estimator::cells::{Cell, Levels};
use crate::estimator::taps::Tap;
use crate::reduce::median;

/// A deviation is suspect beyond so many robust standard deviations.
pub const FAR: f64 = 6.0;
/// And beyond this share of the signal: no smooth misfit of a model is flagged.
pub const LEAST: f64 = 0.01;
/// Median absolute deviation to standard deviation of a normal.
pub const NORMAL: f64 = 1.4826;

/// What a model without any fit expects at (a, drive).
pub type Expected<'a> = dyn Fn(f64, f64) -> f64 + 'a;

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
pub struct Compared<'a> {
    smooth: Smooth,
    expected: &'a Expected<'a>,
    /// Of each cell, what it is off: of ln signal, and in the unit of the signal; NaN where the model has no such tap.
    pub off: Vec<(f64, f64)>,
    /// Robust standard deviations of both.
    pub scale: [f64; 2],
}

impl<'a> Compared<'a> {
    /// With that of `models` from which the data differ most smoothly; `None` where there are too few data.
    pub fn best(signals: &[(Cell, f64)], levels: [&Levels; 2], models: &[&'a Expected<'a>]) -> Option<Self> {
        let compared = models.iter().filter_map(|m| Self::new(signals, levels, *m));
        compared.min_by(|p, q| p.scale[0].total_cmp(&q.scale[0]))
    }

    fn new(signals: &[(Cell, f64)], levels: [&Levels; 2], expected: &'a Expected<'a>) -> Option<Self> {
        let ratio = |(c, s): &(Cell, f64)| (s / expected(c.a, c.drive)).ln();
        let known: Vec<(Cell, f64)> = signals.iter().filter(|s| ratio(s).is_finite()).cloned().collect();
        if known.len() < 4 || 2 * known.len() < signals.len() {
            return None;
        }
        let cells: Vec<Cell> = known.iter().map(|(c, _)| c.clone()).collect();
        let mut smooth = Smooth::new(&cells, levels);
        let places: Vec<(f64, f64)> = known.iter().map(|(c, _)| (c.a, c.drive)).collect();
        smooth.fit(&places, &known.iter().map(ratio).collect::<Vec<_>>());
        let miss = |signal: &(Cell, f64)| {
            let (c, s) = signal;
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

    /// Number of terms of the surface.
    pub fn terms(&self) -> usize {
        self.smooth.terms.len()
    }

    /// The signal of the surface.
    pub fn fitted(&self, a: f64, drive: f64) -> f64 {
        (self.expected)(a, drive) * self.smooth.at(a, drive).exp()
    }

    /// Whether a signal that is off by `r` (of its logarithm) is off by more than scatter, relative and in its unit.
    pub fn is_far(&self, r: f64, signal: f64) -> bool {
        let [relative, absolute] = self.scale;
        let off = signal * -(-r).exp_m1();
        r.abs() > LEAST && r.abs() > FAR * relative && off.abs() > FAR * absolute
    }
}

/// What is compared with a surface: cells with the medians of their signals.
pub fn judged(taps: &[Tap], all: &[Cell]) -> Vec<(Cell, f64)> {
    // Two repeats that disagree do not say which is wrong: each is judged by itself.
    let alone = |c: &Cell| -> Vec<Cell> {
        let one = |&k: &usize| Cell { taps: vec![k], a: taps[k].a, drive: taps[k].drive, ..c.clone() };
        if c.taps.len() < 3 { c.taps.iter().map(one).collect() } else { vec![c.clone()] }
    };
    let middle = |c: &Cell| median(&mut c.taps.iter().map(|&k| taps[k].signal.abs()).collect::<Vec<_>>());
    all.iter().flat_map(alone).map(|c| (c.clone(), middle(&c))).collect()
}
