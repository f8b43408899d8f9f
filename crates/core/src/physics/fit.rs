//! Least squares of Yeoh's law, s(e) = 2 (λ − λ⁻²)(C10 + 2 C20 (I₁ − 3) + 3 C30 (I₁ − 3)²), which is linear in its coefficients.
//! Orthogonalised columns (QR) do not square the condition number.

use nalgebra::{DMatrix, DVector};

use super::section::SectionLaw;
use crate::error::InputError;
use crate::reduce::range;
use crate::scene::Material;

const DEPENDENT: f64 = 1e-7;

const INTERVALS: u32 = 4000;

/// Column of nominal strains.
pub const STRAIN: &str = "strain";
/// Column of nominal stresses.
pub const STRESS: &str = "stress_MPa";

/// C10, C20 and C30, MPa, and the root mean square of law − data, MPa: least squares to points (strain > −1, stress in MPa), ascending in strain.
/// Errors: strains too few or too alike to tell three coefficients apart; a whisker without stiffness; a law that does not rise over the data and to 0.
pub fn yeoh(points: &[[f64; 2]]) -> Result<([f64; 3], f64), InputError> {
    let [first, last] = range(points.iter().map(|[e, _]| *e));
    let coefficients = least_squares(points).ok_or_else(|| {
        InputError::new("these strains do not determine C10, C20 and C30 of Yeoh's law")
            .key(STRAIN)
            .value(format!("{first} … {last}"))
            .allowed("strains spread over the range in use, for example 0 … 0.5")
    })?;
    let [c10, ..] = coefficients;
    if c10 <= 0.0 {
        return Err(InputError::new("the Yeoh law fitted to this curve has no stiffness at rest")
            .key("C10")
            .value(format!("{c10} MPa"))
            .allowed("C10 > 0 MPa: a curve whose slope at small strain is well measured"));
    }
    let SectionLaw::Hyperelastic(law) = SectionLaw::new(&Material::Yeoh(coefficients)) else {
        unreachable!("Yeoh's law is hyperelastic")
    };
    let (min, max) = (first.min(0.0), last.max(0.0));
    let strain = |i: u32| min + (max - min) * f64::from(i) / f64::from(INTERVALS);
    let flat = |e: &f64| {
        let (_, slope) = law.stress(*e);
        slope.is_nan() || slope <= 0.0
    };
    if let Some(e) = (0..=INTERVALS).map(strain).find(flat) {
        let why = "the Yeoh law fitted to this curve is not monotone: its stress falls at strain";
        return Err(InputError::new(format!("{why} {e:.4}"))
            .key(STRESS)
            .value(format!("fit over strains {first} … {last}"))
            .allowed("a curve that Yeoh's law can follow, or { yeoh = [C10, C20, C30] }"));
    }
    let squares: f64 = points.iter().map(|[e, s]| (law.stress(*e).0 - s).powi(2)).sum();
    Ok((coefficients, (squares / points.len() as f64).sqrt()))
}

/// ds/dC10, ds/dC20, ds/dC30 at the strain `e`; free of cancellation at e = 0.
fn basis(e: f64) -> [f64; 3] {
    let inverse = 1.0 / (1.0 + e);
    let g = e * (3.0 + e * (3.0 + e)) * inverse * inverse;
    let j = e * e * (3.0 + e) * inverse;
    [2.0 * g, 4.0 * g * j, 6.0 * g * j * j]
}

fn least_squares(points: &[[f64; 2]]) -> Option<[f64; 3]> {
    if points.len() < 3 {
        return None;
    }
    let columns = DMatrix::from_fn(points.len(), 3, |i, k| basis(points[i][0])[k]);
    let scale: [f64; 3] = std::array::from_fn(|k| columns.column(k).norm());
    let qr = DMatrix::from_fn(points.len(), 3, |i, k| columns[(i, k)] / scale[k]).qr();
    let mut stress = DVector::from_iterator(points.len(), points.iter().map(|[_, s]| *s));
    qr.q_tr_mul(&mut stress);
    let r = qr.r();
    let independent = r.diagonal().iter().all(|x| x.abs() >= DEPENDENT);
    let c = r.solve_upper_triangular(&stress.rows(0, 3)).filter(|_| independent)?;
    let c: [f64; 3] = std::array::from_fn(|k| c[k] / scale[k]);
    c.iter().all(|x| x.is_finite()).then_some(c)
}
