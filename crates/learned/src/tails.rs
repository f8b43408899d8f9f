//! How far the tails of an answer reach: the variances that its σ is made of were learned, from few runs and positions, so that a reading is not normal
//! about its distance but has longer tails.
//!
//! A normal number whose variance V is uncertain by Var V = c² V² has the kurtosis 3 + 3c² to first order; so has Student's of 4 + 2/c² degrees of
//! freedom, whose quantiles are taken.

/// Variances that move a reading: noise of all readings and of such that go with the signal, position, visit, zero and gain of a run.
pub const PARTS: usize = 6;

/// Covariance of these.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tails(pub [[f64; PARTS]; PARTS]);

/// The interval that holds a normal number with 95 % ends here on either side.
pub const OF_95: f64 = 1.959_964;

impl Tails {
    /// By how much more than [`OF_95`] times σ, which holds 68 %, the interval of 95 % reaches: a factor; of an answer of this variance, of which
    /// `parts` are the derivatives by the learned variances.
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

/// The quantile of Student's distribution of 1/`inverse` ≥ 4 degrees of freedom at which the normal one has x; to 0.3 % (Abramowitz and Stegun 26.7.5).
fn student(x: f64, inverse: f64) -> f64 {
    let y = x * x;
    let g1 = (y + 1.0) / 4.0;
    let g2 = ((5.0 * y + 16.0) * y + 3.0) / 96.0;
    let g3 = (((3.0 * y + 19.0) * y + 17.0) * y - 15.0) / 384.0;
    x * (1.0 + inverse * (g1 + inverse * (g2 + inverse * g3)))
}
