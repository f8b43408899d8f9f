//! Checks that a whisker can be built and touched.

use std::f64::consts::PI;

use glam::DVec2;

use super::Body;

impl Body {
    /// The first place where the inside is as thick as the whisker: s and both diameters, mm.
    pub fn burst(&self) -> Option<(f64, f64, f64)> {
        self.built.inner.as_ref()?;
        let ends = [0.0, self.length];
        // A power-law profile may meet the inner diameter between knots.
        let between = (1..64).map(|k| self.length * f64::from(k) / 64.0);
        let mut places = ends.into_iter().chain(self.knots.iter().copied()).chain(between);
        let seen = |s: f64| {
            let inner = self.inside(s, s);
            (s, inner, 2.0 * self.radius(s, s))
        };
        places.find_map(|s| Some(seen(s)).filter(|(_, inner, outer)| inner >= outer))
    }

    /// Reason why a pole (radius, mm) cannot press the resting whisker at arc `a`; `hub`: motor's axis behind the base, `None` if displaced.
    pub fn refuses(&self, a: f64, pole: f64, hub: Option<f64>) -> Option<&'static str> {
        if self.built.is_straight() {
            return None;
        }
        let angle = self.rest_angle(a);
        let normal = DVec2::from_angle(angle).perp();
        let lever = hub.map_or(normal.y, |hub| (self.rest(a) + DVec2::new(hub, 0.0)).perp_dot(normal));
        let fits = |s: f64| pole * self.curvature(s) > -1.0;
        match () {
            () if angle.abs() >= 0.5 * PI => Some("the resting whisker has turned by 90° or more"),
            () if lever <= 0.0 => Some("the drive does not press the resting whisker against its object"),
            () if !(fits(0.0) && fits(self.length)) => {
                Some("the pole does not fit into the bend of the whisker")
            }
            () => None,
        }
    }
}
