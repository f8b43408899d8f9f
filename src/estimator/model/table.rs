//! `table`: monotone interpolation of the data themselves, no theory of the whisker.
//!
//! Per drive, ln(signal/drive) over ln a by piecewise cubic Hermite polynomials with the slopes of Fritsch and Butland (SIAM J.
//! Sci. Stat. Comput. 5, 1984), which keep it monotone between knots; between drives linear in the drive.

use super::Found;
use crate::physics::root::bracketed;

/// Points between two knots between which roots are looked for.
const LOOKS: usize = 4;

/// One knot of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knot {
    /// Contact distance, mm.
    pub a: f64,
    /// Signal per unit of drive (degree or mm).
    pub signal: f64,
    /// Variance of ln signal.
    pub variance: f64,
}

/// The data of one drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    knots: Vec<Knot>,
    x: Vec<f64>,
    y: Vec<f64>,
    slopes: Vec<f64>,
}

impl Curve {
    /// From knots of ascending a; `None` with fewer than two. Knots that noise has put out of order on either side of the
    /// peak are pooled (Ayer et al. 1955), so that a signal has one distance on each side.
    pub fn new(knots: &[Knot]) -> Option<Self> {
        let peak = (0..knots.len()).max_by(|&i, &j| knots[i].signal.total_cmp(&knots[j].signal))?;
        let mut near: Vec<Knot> = knots[..=peak].iter().rev().copied().collect();
        pool(&mut near);
        near.reverse();
        let mut far = knots[peak..].to_vec();
        pool(&mut far);
        let knots: Vec<Knot> = near.into_iter().chain(far.into_iter().skip(1)).collect();
        if knots.len() < 2 {
            return None;
        }
        let x: Vec<f64> = knots.iter().map(|k| k.a.ln()).collect();
        let y: Vec<f64> = knots.iter().map(|k| k.signal.ln()).collect();
        let slopes = slopes(&x, &y);
        Some(Self { knots, x, y, slopes })
    }

    /// Knots after pooling.
    pub fn knots(&self) -> &[Knot] {
        &self.knots
    }

    /// Ends of ln a that are answered: a share `beyond` of a step beyond the last knots, for noise leads there.
    fn reach(&self, beyond: f64) -> [f64; 2] {
        let (x, n) = (&self.x, self.x.len());
        [x[0] - beyond * (x[1] - x[0]), x[n - 1] + beyond * (x[n - 1] - x[n - 2])]
    }

    /// ln signal, its slope over ln a, and its variance, at ln a = `x`.
    fn at(&self, x: f64) -> (f64, f64, f64) {
        let i = self.x.partition_point(|k| *k < x).clamp(1, self.x.len() - 1) - 1;
        let h = self.x[i + 1] - self.x[i];
        let t = (x - self.x[i]) / h;
        let (y0, y1, m0, m1) = (self.y[i], self.y[i + 1], self.slopes[i] * h, self.slopes[i + 1] * h);
        let rise = y1 - y0;
        let (c2, c3) = (3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise);
        // Beyond the last knots the curve goes on straight.
        let (value, slope) = match t {
            ..0.0 => (y0 + t * m0, m0 / h),
            0.0..=1.0 => (y0 + t * (m0 + t * (c2 + t * c3)), (m0 + t * (2.0 * c2 + 3.0 * t * c3)) / h),
            _ => (y1 + (t - 1.0) * m1, m1 / h),
        };
        let variance = (1.0 - t).powi(2) * self.knots[i].variance + t * t * self.knots[i + 1].variance;
        (value, slope, variance)
    }
}

/// Pools neighbours until the signal falls strictly from the first knot on.
fn pool(knots: &mut Vec<Knot>) {
    let mut done: Vec<(Knot, f64)> = Vec::with_capacity(knots.len());
    for knot in knots.drain(..) {
        done.push((knot, 1.0));
        while let [.., (p, n), (q, m)] = done[..] {
            if q.signal < p.signal {
                break;
            }
            let mean = |x: f64, y: f64| (n * x + m * y) / (n + m);
            let pooled = Knot {
                a: mean(p.a, q.a),
                signal: mean(p.signal, q.signal),
                variance: (n * n * p.variance + m * m * q.variance) / (n + m).powi(2),
            };
            done.truncate(done.len() - 2);
            done.push((pooled, n + m));
        }
    }
    knots.extend(done.into_iter().map(|(k, _)| k));
}

/// Fritsch–Butland slopes: harmonic means inside, one-sided parabolas at the ends, none across an extremum.
fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let h: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
    let d: Vec<f64> = (0..n - 1).map(|i| (y[i + 1] - y[i]) / h[i]).collect();
    if n == 2 {
        return vec![d[0]; 2];
    }
    let end = |h0: f64, h1: f64, d0: f64, d1: f64| {
        let m = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
        if m * d0 <= 0.0 {
            0.0
        } else if d0 * d1 <= 0.0 && m.abs() > 3.0 * d0.abs() {
            3.0 * d0
        } else {
            m
        }
    };
    let inner = |i: usize| {
        if d[i - 1] * d[i] <= 0.0 {
            return 0.0;
        }
        let (w1, w2) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
        (w1 + w2) / (w1 / d[i - 1] + w2 / d[i])
    };
    let mut m = vec![end(h[0], h[1], d[0], d[1])];
    m.extend((1..n - 1).map(inner));
    m.push(end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]));
    m
}

/// Curves over the calibrated drives.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    drives: Vec<f64>,
    curves: Vec<Curve>,
    /// Share of a step between knots that is answered beyond the last ones.
    beyond: f64,
}

impl Table {
    /// `curves` at `drives`, ascending; `None` without any. It answers half a step beyond its last knots.
    pub fn new(drives: Vec<f64>, curves: Vec<Curve>) -> Option<Self> {
        (!curves.is_empty() && drives.len() == curves.len()).then_some(Self { drives, curves, beyond: 0.5 })
    }

    /// The same with answers so many steps beyond the last knots.
    pub fn reaching(self, beyond: f64) -> Self {
        Self { beyond, ..self }
    }

    /// Drives and their curves.
    pub fn curves(&self) -> impl Iterator<Item = (f64, &Curve)> {
        self.drives.iter().copied().zip(&self.curves)
    }

    /// The curves about `drive` and the weight of the second; beyond the drives of the table, where jitter leads, the nearest one.
    fn around(&self, drive: f64) -> Option<(&Curve, &Curve, f64)> {
        let (first, last) = (*self.drives.first()?, *self.drives.last()?);
        let (j, w) = super::bracket(&self.drives, drive.clamp(first, last))?;
        Some((&self.curves[j], &self.curves[(j + 1).min(self.curves.len() - 1)], w))
    }

    /// ln a of the knots of both curves, and of the ends of what both answer, from the far end.
    fn shared(&self, p: &Curve, q: &Curve) -> Vec<f64> {
        let ([p0, p1], [q0, q1]) = (p.reach(self.beyond), q.reach(self.beyond));
        let (from, to) = (p0.max(q0), p1.min(q1));
        let inside = p.x.iter().chain(&q.x).copied().filter(|x| *x > from && *x < to);
        let mut knots: Vec<f64> = inside.chain([from, to]).collect();
        knots.sort_by(|x, y| y.total_cmp(x));
        knots.dedup();
        knots
    }

    /// Knots at drives near `drive`, and ends of what is answered there, ascending, mm.
    pub fn knots(&self, drive: f64) -> Vec<f64> {
        let Some((p, q, _)) = self.around(drive) else { return Vec::new() };
        self.shared(p, q).into_iter().rev().map(f64::exp).collect()
    }

    /// Variance of the expected reading that the noise of the calibration leaves.
    pub fn variance(&self, a: f64, drive: f64) -> f64 {
        let Some((p, q, w)) = self.around(drive) else { return f64::NAN };
        let x = a.ln();
        self.expected(a, drive).powi(2) * ((1.0 - w).powi(2) * p.at(x).2 + w * w * q.at(x).2)
    }

    /// Distance at which the data give `reading` > 0 at `drive`.
    pub fn find(&self, drive: f64, reading: f64) -> Option<Found> {
        let (p, q, w) = self.around(drive)?;
        let y = (reading / drive).ln();
        let at = |x: f64| {
            let (s, t) = (p.at(x), q.at(x));
            let mix = |s: f64, t: f64| if w == 0.0 { s } else { s + w * (t - s) };
            (mix(s.0, t.0), mix(s.1, t.1), (1.0 - w).powi(2) * s.2 + w * w * t.2)
        };
        let knots = self.shared(p, q);
        let mut found = [None; 2];
        let mut n = 0;
        let mut last: Option<(f64, f64)> = None;
        // At one drive each piece between knots is monotone; a mixture of two curves may peak between knots that enclose the largest.
        let parts = if w == 0.0 { 1 } else { LOOKS };
        for (i, x) in knots.iter().enumerate() {
            let part = |k: usize| knots[i - 1] + (x - knots[i - 1]) * (k as f64 / parts as f64);
            let value = at(*x).0;
            let high = last.is_some_and(|(_, before)| before < y && value < y && y - before.max(value) < 0.1);
            let inner =
                (1..parts).filter(|_| i > 0 && high).map(part).map(|x| (x, at(x).0)).collect::<Vec<_>>();
            for now in inner.into_iter().chain([(*x, value)]) {
                if let Some(before) = last
                    && (before.1 <= y) != (now.1 <= y)
                    && n < 2
                {
                    found[n] = Some(bracketed(|x| at(x).0 - y, now.0, before.0));
                    n += 1;
                }
                last = Some(now);
            }
            if n == 2 {
                break;
            }
        }
        let x = found[0]?;
        let (_, slope, variance) = at(x);
        let a = x.exp();
        Some(Found {
            a,
            near: found[1].map(f64::exp),
            slope: reading * slope / a,
            variance: reading * reading * variance, sigma: f64::NAN })
    }

    /// Reading that the data give at a, mm; NaN more than half a step beyond them.
    pub fn expected(&self, a: f64, drive: f64) -> f64 {
        let Some((p, q, w)) = self.around(drive) else { return f64::NAN };
        let x = a.ln();
        if [p, q].iter().any(|c| x < c.reach(self.beyond)[0] || x > c.reach(self.beyond)[1]) {
            return f64::NAN;
        }
        let (s, t) = (p.at(x).0, q.at(x).0);
        drive * (if w == 0.0 { s } else { s + w * (t - s) }).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knots(f: impl Fn(f64) -> f64, from: u32, to: u32) -> Vec<Knot> {
        (from..=to).map(f64::from).map(|a| Knot { a, signal: f(a), variance: 0.0 }).collect()
    }

    #[test]
    fn interpolates_and_inverts() {
        let f = |a: f64| (a - 6.0) / (a * a);
        let curve = |c: f64| Curve::new(&knots(|a| c * f(a), 8, 40)).unwrap();
        let table = Table::new(vec![1.0, 3.0], vec![curve(1.0), curve(1.1)]).unwrap();
        for (drive, c) in [(1.0, 1.0), (2.0, 1.1f64.sqrt()), (3.0, 1.1)] {
            let found = table.find(drive, drive * c * f(25.3)).unwrap();
            assert!((found.a - 25.3).abs() < 1e-3, "{found:?}");
            assert!((found.near.unwrap() - 25.3 * 6.0 / 19.3).abs() < 3e-2, "{found:?}");
            let step = table.expected(25.31, drive) - table.expected(25.29, drive);
            assert!((found.slope / (step / 0.02) - 1.0).abs() < 1e-2, "{found:?}");
        }
        assert!(table.find(0.9, 0.01).is_none() && table.find(2.0, 1.0).is_none());
        assert!(table.expected(41.0, 1.0).is_nan());
    }

    #[test]
    fn noise_does_not_make_two_distances_of_one() {
        let mut noisy = knots(|a| 1.0 / a, 10, 20);
        noisy[5].signal = noisy[4].signal * 1.01;
        let curve = Curve::new(&noisy).unwrap();
        assert!(curve.knots().windows(2).all(|w| w[1].signal < w[0].signal));
        assert_eq!(curve.knots().len(), 10);
    }
}
