//! Least squares of Yeoh's law, s(e) = 2 (λ − λ⁻²)(C10 + 2 C20 (I₁ − 3) + 3 C30 (I₁ − 3)²), which is linear in its coefficients.
//! Orthogonalised columns (modified Gram–Schmidt) do not square the condition number.

use super::section::SectionLaw;
use crate::scene::Material;

const DEPENDENT: f64 = 1e-7;

const INTERVALS: u32 = 4000;

/// A fitted law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YeohFit {
    /// C10, C20, C30, MPa.
    pub coefficients: [f64; 3],
    /// Root mean square of law − data, MPa.
    pub rms: f64,
}

/// Why the law cannot be fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unfit {
    /// The strains are too few or too alike to tell three coefficients apart.
    Undetermined,
    /// C10 (MPa) is not positive: the whisker would have no stiffness.
    Soft(f64),
    /// The law does not rise at this strain, inside the data or between them and 0.
    Falls(f64),
}

/// Least squares of Yeoh's law to points (nominal strain > −1, nominal stress in MPa).
pub fn yeoh(points: &[[f64; 2]]) -> Result<YeohFit, Unfit> {
    let coefficients = least_squares(points).ok_or(Unfit::Undetermined)?;
    let [c10, ..] = coefficients;
    if c10 <= 0.0 {
        return Err(Unfit::Soft(c10));
    }
    let SectionLaw::Hyperelastic(law) = SectionLaw::new(&Material::Yeoh(coefficients)) else {
        unreachable!("Yeoh's law is hyperelastic")
    };
    let (min, max) = points.iter().fold((0.0f64, 0.0f64), |(lo, hi), [e, _]| (lo.min(*e), hi.max(*e)));
    let strain = |i: u32| min + (max - min) * f64::from(i) / f64::from(INTERVALS);
    let flat = |e: &f64| {
        let (_, slope) = law.stress(*e);
        slope.is_nan() || slope <= 0.0
    };
    if let Some(e) = (0..=INTERVALS).map(strain).find(flat) {
        return Err(Unfit::Falls(e));
    }
    let squares: f64 = points.iter().map(|[e, s]| (law.stress(*e).0 - s).powi(2)).sum();
    Ok(YeohFit { coefficients, rms: (squares / points.len() as f64).sqrt() })
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
