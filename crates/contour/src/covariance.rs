//! Variances in the plane.

/// A symmetric 2 × 2 matrix: xx, xy, yy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Covariance(pub [f64; 3]);

impl Covariance {
    /// Plus `variance` along `by`.
    pub fn along(self, by: [f64; 2], variance: f64) -> Self {
        let [xx, xy, yy] = self.0;
        let [x, y] = by;
        Self([xx + variance * x * x, xy + variance * x * y, yy + variance * y * y])
    }

    /// Variance along `by`.
    pub fn of(self, [x, y]: [f64; 2]) -> f64 {
        let [xx, xy, yy] = self.0;
        xx * x * x + 2.0 * xy * x * y + yy * y * y
    }

    /// Half axes of the ellipse of one standard deviation, the longer first, and the direction of that, degrees in (−90, 90].
    pub fn ellipse(self) -> ([f64; 2], f64) {
        let [xx, xy, yy] = self.0;
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let axis = 0.5 * (2.0 * xy).atan2(xx - yy);
        ([(mean + half).sqrt(), (mean - half).max(0.0).sqrt()], axis.to_degrees())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_is_that_of_its_axes() {
        let (sin, cos) = 0.4f64.sin_cos();
        let c = Covariance::default().along([cos, sin], 9.0).along([-sin, cos], 4.0);
        let ([major, minor], axis) = c.ellipse();
        assert!((major - 3.0).abs() < 1e-12 && (minor - 2.0).abs() < 1e-12);
        assert!((axis - 0.4f64.to_degrees()).abs() < 1e-10);
        assert!((c.of([cos, sin]) - 9.0).abs() < 1e-12);
    }
}
