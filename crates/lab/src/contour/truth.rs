//! An object that is known, beside what was traced of it.

use serde_json::{Value, json};

use super::trace::Trace;
use crate::error::InputError;
use crate::locate::table::Readings;
use crate::simulate::object::Object;

/// Steps along the outline of a known object; along a traced curve half as many.
pub const OUTLINE: usize = 400;

/// Distances of points from the object; where the data say what was touched (`true_x_mm`, `true_y_mm` by the readings of a stroke,
/// `touch_x_mm`, `touch_y_mm` first), from these places.
pub fn compared(trace: &Trace, readings: &Readings, object: &Object) -> Result<Value, InputError> {
    let there: Vec<usize> =
        (0..trace.points.len()).filter(|&i| trace.points[i].is_there() && !trace.outliers[i]).collect();
    let rms = |all: Vec<f64>| {
        let known: Vec<f64> = all.into_iter().filter(|x| x.is_finite()).collect();
        (known.iter().map(|x| x * x).sum::<f64>() / known.len() as f64).sqrt()
    };
    let points = rms(there.iter().map(|&i| object.distance(trace.points[i].at)).collect());
    let places = |name: &str| -> Result<Option<[Vec<f64>; 2]>, InputError> {
        let x = readings.numbers(&format!("{name}_x_mm"))?;
        Ok(x.zip(readings.numbers(&format!("{name}_y_mm"))?).map(|(x, y)| [x, y]))
    };
    let (now, first) = (places("true")?, places("touch")?);
    let apart = now.zip(first).map(|(now, first)| {
        let one = |&i: &usize| {
            let [x, y] = if trace.swept[i] { &now } else { &first };
            let at = trace.points[i].at;
            (at[0] - x[i]).hypot(at[1] - y[i])
        };
        rms(there.iter().map(one).collect())
    });
    let curve = trace.curve.as_ref().ok().map(|chosen| {
        let traced = chosen.curve.traced(&trace.samples, OUTLINE / 2);
        rms(traced.iter().map(|(at, ..)| object.distance(*at)).collect())
    });
    Ok(
        json!({ "points_rms_mm": points, "places_rms_mm": apart, "curve_rms_mm": curve, "points": there.len() }),
    )
}

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
    use std::f64::consts::FRAC_PI_2;

    use super::*;

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
