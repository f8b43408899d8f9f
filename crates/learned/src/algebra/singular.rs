//! Singular values without surprise: nalgebra's own door panics at what is no number, and may turn for ever.

use nalgebra::{DMatrix, Dyn, SVD};

/// Most steps; a matrix of a handful of columns takes dozens.
const STEPS: usize = 10_000;

/// Singular values in no particular order, with the right vectors, and the left ones if `left`; `None` of an empty matrix and of
/// one that holds, or leads to, what is no finite number.
pub fn values(matrix: DMatrix<f64>, left: bool) -> Option<SVD<f64, Dyn, Dyn>> {
    let finite = |x: &f64| x.is_finite();
    if matrix.is_empty() || !matrix.iter().all(finite) {
        return None;
    }
    let svd = SVD::try_new_unordered(matrix, left, true, 5.0 * f64::EPSILON, STEPS)?;
    let sound = |m: &DMatrix<f64>| m.iter().all(finite);
    let all = svd.singular_values.iter().all(finite)
        && svd.v_t.as_ref().is_none_or(sound)
        && svd.u.as_ref().is_none_or(sound);
    all.then_some(svd)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_has_none() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(values(DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 3.0, bad, 5.0, 6.0]), true).is_none());
        }
        assert!(values(DMatrix::zeros(0, 2), true).is_none());
        let svd = values(DMatrix::from_row_slice(3, 2, &[3.0, 0.0, 0.0, 4.0, 0.0, 0.0]), true).unwrap();
        assert!(
            (svd.singular_values.max() - 4.0).abs() < 1e-14
                && (svd.singular_values.min() - 3.0).abs() < 1e-14
        );
        assert!(values(DMatrix::zeros(3, 2), false).is_some_and(|s| s.singular_values.max() == 0.0));
        // Whatever the sizes: an answer or none.
        let _ =
            values(DMatrix::from_row_slice(3, 2, &[1e300, 1e-300, f64::MAX, -f64::MAX, 5e-324, 0.0]), true);
    }
}
