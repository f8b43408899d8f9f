//! Tails of an answer: its variances come from few runs and positions, so that readings have longer tails than a normal distribution.
//! A normal number with an uncertain variance V, Var V = c² V², has the kurtosis 3 + 3c² to first order, as Student's distribution of 4 + 2/c²
//! degrees of freedom, whose quantiles are used.

/// Number of variances of a reading: independent noise, proportional noise, position, visit, zero and gain of a run.
pub const PARTS: usize = 6;

/// Covariance of these variances.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tails(pub [[f64; PARTS]; PARTS]);

/// Half width of the 95 % interval of a standard normal number.
pub const OF_95: f64 = 1.959_964;

impl Tails {
    /// Ratio of the half width of the 95 % interval to [`OF_95`] σ; `parts` are the derivatives of `variance` by the learned variances.
    pub fn longer(&self, parts: [f64; PARTS], variance: f64) -> f64 {
        let row = |row: &[f64; PARTS]| row.iter().zip(parts).map(|(c, p)| c * p).sum::<f64>();
        let uncertain =
            self.0.iter().zip(parts).map(|(r, p)| p * row(r)).sum::<f64>() / (variance * variance);
        if uncertain.is_nan() || uncertain <= 0.0 {
            return 1.0;
        }
        let inverse = 1.0 / (4.0 + 2.0 / uncertain);
        student(OF_95, inverse) / student(1.0, inverse) / OF_95
    }
}

/// Quantile of Student's distribution of 1/`inverse` ≥ 4 degrees of freedom where the normal one is x, to 0.3 % (Abramowitz and Stegun 26.7.5).
fn student(x: f64, inverse: f64) -> f64 {
    let y = x * x;
    let g1 = (y + 1.0) / 4.0;
    let g2 = ((5.0 * y + 16.0) * y + 3.0) / 96.0;
    let g3 = (((3.0 * y + 19.0) * y + 17.0) * y - 15.0) / 384.0;
    x * (1.0 + inverse * (g1 + inverse * (g2 + inverse * g3)))
}
