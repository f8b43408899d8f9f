//! Whether a whisker can be built, and touched.

use std::f64::consts::PI;

use super::Body;
use crate::physics::real::Vector;

impl Body {
    /// Where what is inside is as thick as the whisker: place, and both diameters, mm.
    pub fn burst(&self) -> Option<(f64, f64, f64)> {
        let ends = [0.0, self.length];
        // Where a line meets a curve that is no line no knot need tell.
        let between = (1..64).map(|k| self.length * f64::from(k) / 64.0);
        let mut places = ends.into_iter().chain(self.knots.iter().copied()).chain(between);
        let seen = |s: f64| {
            let inner = self.inside(s, s);
            (s, inner, 2.0 * self.radius(s, s))
        };
        places.find_map(|s| Some(seen(s)).filter(|(_, inner, outer)| inner >= outer))
    }

    /// Why a pole of this radius, mm, cannot touch the resting whisker at the arc `a`, from outside its bend, with a lever about a motor's axis `hub`
    /// behind the base (a displaced object: none).
    pub fn refuses(&self, a: f64, pole: f64, hub: Option<f64>) -> Option<&'static str> {
        if self.is_straight() {
            return None;
        }
        let angle = self.rest_angle(a);
        let normal = Vector::from_angle(angle).perp();
        let lever = hub.map_or(normal.y, |hub| (self.rest(a) + Vector::new(hub, 0.0)).perp_dot(normal));
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
