//! Normal equations of least squares, scaled to ones on the diagonal so that the units of parameters do not matter.

use nalgebra::{DMatrix, DVector};

/// Solution of `n` x = `b`, and the inverse of `n`; `None` where it is singular or holds what is no finite number.
pub fn solve(n: &DMatrix<f64>, b: &DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let m = n.nrows();
    let scale: Vec<f64> = (0..m).map(|i| n[(i, i)].sqrt()).collect();
    if !scale.iter().all(|s| *s > 0.0 && s.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(m, m, |i, k| n[(i, k)] / (scale[i] * scale[k])).cholesky()?.inverse();
    let inverse = DMatrix::from_fn(m, m, |i, k| scaled[(i, k)] / (scale[i] * scale[k]));
    let x = &inverse * b;
    (x.iter().chain(inverse.iter()).all(|c| c.is_finite())).then_some((x, inverse))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_do_not_matter_and_what_is_not_determined_is_told() {
        let n = DMatrix::from_row_slice(2, 2, &[4e12, 1.0, 1.0, 1e-12]);
        let x = DVector::from_column_slice(&[3e-6, 5e6]);
        let (found, inverse) = solve(&n, &(&n * &x)).unwrap();
        assert!((found - &x).component_div(&x).amax() < 1e-12);
        assert!((&n * inverse - DMatrix::identity(2, 2)).map(|e| e * 1e-12).amax() < 1e-12);
        assert!(solve(&DMatrix::from_element(2, 2, 1.0), &DVector::zeros(2)).is_none());
        assert!(solve(&DMatrix::from_element(1, 1, f64::NAN), &DVector::zeros(1)).is_none());
        assert!(solve(&DMatrix::zeros(1, 1), &DVector::zeros(1)).is_none());
    }
}
