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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_student() {
        // scipy.stats.t.ppf.
        for (x, freedom, t) in
            [(OF_95, 4.0, 2.776_445), (OF_95, 10.0, 2.228_139), (1.0, 4.0, 1.141_600), (1.0, 30.0, 1.017_0)]
        {
            let got = student(x, 1.0 / freedom);
            assert!((got / t - 1.0).abs() < 3e-3, "{x} {freedom}: {got} {t}");
        }
    }

    #[test]
    fn tails_are_longer_the_less_the_variances_are_known() {
        let tails = |doubt: f64| {
            let mut all = Tails::default();
            all.0[0][0] = doubt;
            all
        };
        let parts = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(tails(0.0).longer(parts, 2.0), 1.0);
        let [little, much, most] = [0.1, 1.0, 1e9].map(|doubt| tails(doubt).longer(parts, 2.0));
        assert!(1.0 < little && little < much && much < most && most < 1.25, "{little} {much} {most}");
        // What does not move the reading is of no matter.
        assert_eq!(tails(1.0).longer([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], 2.0), 1.0);
    }
}
