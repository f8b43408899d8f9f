//! Least squares of Yeoh's law, s(e) = 2 (λ − λ⁻²)(C10 + 2 C20 (I₁ − 3) + 3 C30 (I₁ − 3)²), which is linear in its coefficients.
//! Orthogonalised columns (modified Gram–Schmidt) do not square the condition number.

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
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let dot = |v: &[f64], w: &[f64]| v.iter().zip(w).map(|(x, y)| x * y).sum::<f64>();
    // The last column is the data.
    let column = |k: usize| points.iter().map(|[e, s]| if k < 3 { basis(*e)[k] } else { *s }).collect();
    let mut columns: [Vec<f64>; 4] = std::array::from_fn(column);
    let scale: [f64; 3] = std::array::from_fn(|k| length(&columns[k]));
    for (scale, column) in scale.iter().zip(&mut columns) {
        column.iter_mut().for_each(|x| *x /= scale);
    }
    let mut r = [[0.0; 4]; 3];
    for (k, r) in r.iter_mut().enumerate() {
        let (done, later) = columns.split_at_mut(k + 1);
        let q = &mut done[k];
        r[k] = length(q);
        if r[k].is_nan() || r[k] < DEPENDENT {
            return None;
        }
        q.iter_mut().for_each(|x| *x /= r[k]);
        for (column, slot) in later.iter_mut().zip(&mut r[k + 1..]) {
            *slot = dot(q, column);
            column.iter_mut().zip(&*q).for_each(|(x, q)| *x -= *slot * q);
        }
    }
    let mut c = [0.0; 3];
    for k in (0..3).rev() {
        let known: f64 = (k + 1..3).map(|j| r[k][j] * c[j]).sum();
        c[k] = (r[k][3] - known) / r[k][k];
    }
    let c: [f64; 3] = std::array::from_fn(|k| c[k] / scale[k]);
    c.iter().all(|x| x.is_finite()).then_some(c)
}
