//! The section chart in the precision of the kernel.

use super::pack::{Packed, Scalar};
use crate::Chart;

impl<T: Scalar> Chart<T> {
    /// `chart` in another precision.
    pub fn of(chart: &Chart) -> Self {
        let &Chart { scale, bending, ref r, ref c, ref p, ref q, error, whole, covers } = chart;
        let line = |c: &Vec<f64>| c.iter().map(|&x| T::of(x)).collect::<Vec<T>>();
        let plane = |rows: &[Vec<f64>]| rows.iter().map(line).collect();
        let (scale, bending) = (T::of(scale), bending.map(T::of));
        Self { scale, bending, r: line(r), c: line(c), p: plane(p), q: plane(q), error, whole, covers }
    }

    /// (e₀ − t, χ, load) of the section law at the Hookean strains t and b; a load above 1 is outside the chart.
    #[inline(always)]
    pub fn section<P: Packed<Scalar = T>>(&self, t: P, b: P) -> [P; 3] {
        let of = P::of;
        let most = t.mul_add(P::splat(self.bending[1]), P::splat(self.bending[0]));
        let b2 = b * b;
        let beta = b2 / (most * most);
        let x = t * P::splat(self.scale);
        let load = if self.covers { x.abs() } else { beta.max(x.abs()) };
        let (x, y) = (x.max(of(-1.0)).min(of(1.0)), beta.min(of(1.0)).mul_add(of(2.0), of(-1.0)));
        let (extra, chi) = (P::plane(&self.p, x, y), P::plane(&self.q, x, y));
        [t * t * P::polynomial(&self.r, x) + b2 * extra, t * P::polynomial(&self.c, x) + b2 * chi, load]
    }
}
