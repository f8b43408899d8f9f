//! Where a whisker stands when it touches, and what that makes of a place on it.

/// The whisker at first touch, among the object: the frame of model §6.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The motor's axis, mm.
    pub base: [f64; 3],
    /// Direction of the undeflected whisker, rad, counterclockwise from +x.
    pub heading: f64,
    /// +1 where it turns counterclockwise towards the object, −1 clockwise.
    pub sense: f64,
}

impl Pose {
    /// A place in the frame of first touch (x along the whisker, y towards the object), mm, in the frame of the object.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [u, v] = self.direction([x, y]);
        [self.base[0] + u, self.base[1] + v]
    }

    /// As [`Self::place`], of a direction.
    pub fn direction(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.heading.sin_cos();
        let y = self.sense * y;
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// The same turned on towards the object by `angle`, rad.
    pub fn turned(&self, angle: f64) -> Self {
        Self { heading: self.heading + self.sense * angle, ..*self }
    }

    /// The same with the base carried along the whisker by `shift` mm.
    pub fn nearer(&self, shift: f64) -> Self {
        let [x, y] = self.place([shift, 0.0]);
        Self { base: [x, y, self.base[2]], ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn the_object_lies_where_the_whisker_turns_to() {
        let pose = Pose { base: [10.0, 20.0, 0.0], heading: FRAC_PI_2, sense: 1.0 };
        let near = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x - u).hypot(y - v) < 1e-12;
        assert!(near(pose.place([30.0, 2.0]), [8.0, 50.0]));
        assert!(near(Pose { sense: -1.0, ..pose }.place([30.0, 2.0]), [12.0, 50.0]));
        assert!(near(pose.nearer(5.0).place([30.0, 2.0]), [8.0, 55.0]));
        assert!(near(pose.turned(FRAC_PI_2).place([30.0, 0.0]), [-20.0, 20.0]));
        assert!(near(Pose { sense: -1.0, ..pose }.turned(FRAC_PI_2).place([30.0, 0.0]), [40.0, 20.0]));
    }
}
