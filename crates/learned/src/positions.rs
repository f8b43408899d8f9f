//! Effects of positions: the taps of one share theirs, those of neighbours do not.

/// Positions within this share of the range of ln a share their effect.
const TOGETHER: f64 = 0.01;
/// Most columns for effects of positions, of visits each; more are approximated.
const EFFECTS: usize = 64;

/// Where taps are, on −1 … 1 of ln a.
pub struct Positions(Vec<f64>);

impl Positions {
    /// Of taps at `places`. Those that lie together, with room to the next ones on either side, are at one position, however a stage
    /// that records its own jitter labels them: an effect that differs within 0.05 mm would be one of whatever else changes there. (A
    /// magnetometer rig whose recorded distance creeps with the drive had σ of 1.7 mm from that, at errors of 0.6.)
    pub fn of(places: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|i, k| places[*i].total_cmp(&places[*k]));
        let mut centred = places.to_vec();
        for group in order.chunk_by(|i, k| places[*k] - places[*i] <= TOGETHER) {
            let (first, last) = (places[group[0]], places[group[group.len() - 1]]);
            // Places without gaps, as of a hand, stay what they are.
            if last - first <= 2.0 * TOGETHER {
                let mean = group.iter().map(|i| places[*i] - first).sum::<f64>() / group.len() as f64;
                group.iter().for_each(|i| centred[*i] = first + mean);
            }
        }
        Self(centred)
    }

    /// Whether two taps are at one position.
    pub fn repeated(&self) -> bool {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.windows(2).any(|w| w[1] - w[0] < 2.0 * TOGETHER)
    }

    /// Columns of the effects, which taps share where `shared` says that they may.
    pub fn effects(&self, shared: impl Fn(usize, usize) -> bool) -> Vec<Vec<f64>> {
        let near = |i: usize, k: usize| (-0.5 * ((self.0[i] - self.0[k]) / (2.0 * TOGETHER)).powi(2)).exp();
        factor(self.0.len(), &|i, k| if shared(i, k) { near(i, k) } else { 0.0 })
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_shares_one_effect_and_a_continuum_none() {
        let jitter = [-1.0, -0.998, -0.996, 0.0, 0.003, 1.0];
        let effects = Positions::of(&jitter).effects(|_, _| true);
        assert_eq!(effects.len(), 3);
        for column in &effects {
            assert!((column[0] - column[1]).abs() < 1e-12 && (column[0] - column[2]).abs() < 1e-12);
            assert!((column[3] - column[4]).abs() < 1e-12);
        }
        let hand: Vec<f64> = (0..200).map(|k| -1.0 + 0.009 * f64::from(k)).collect();
        let kept = Positions::of(&hand).0;
        assert!(kept.iter().zip(&hand).all(|(x, y)| x == y));
        assert!(!Positions::of(&[-1.0, -0.5, 0.0, 1.0]).repeated());
    }
}
