//! Where the whisker stood at each row of a file.

use super::pose::Pose;
use crate::error::InputError;
use crate::locate::table::Readings;

/// Columns that must be there.
pub const NEEDED: [&str; 3] = ["base_x_mm", "base_y_mm", "heading_deg"];
/// Columns that may be there.
pub const MORE: [&str; 4] = ["base_z_mm", "contact_deg", "sense", "stroke"];

/// A row's pose and stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// At first touch; NaN where the row says nothing.
    pub pose: Pose,
    /// Number of the stroke; `None` of a tap.
    pub stroke: Option<f64>,
}

/// Poses of all rows.
///
/// # Errors
/// A column that is missing; a word in the place of a number; a sense that is none; a stroke with two poses.
pub fn placed(readings: &Readings) -> Result<Vec<Placed>, InputError> {
    let n = readings.rows.len();
    let file = || readings.file.clone();
    let mut needed = Vec::new();
    for name in NEEDED {
        needed.push(readings.numbers(name)?.ok_or_else(|| {
            let known: Vec<&str> = readings.names.iter().map(String::as_str).collect();
            let close = crate::error::nearest(name, &known).map(|n| format!("; is {n} meant?"));
            InputError::new(format!("column {name} is missing{}", close.unwrap_or_default()))
                .at(file(), Some(1))
                .key(name)
                .value(readings.names.join(","))
                .allowed("base_x_mm, base_y_mm, heading_deg; sense, contact_deg, stroke, base_z_mm where they are needed; then those of readings")
        })?);
    }
    let or = |name: &str, other: f64| {
        Ok::<_, InputError>(readings.numbers(name)?.unwrap_or_else(|| vec![other; n]))
    };
    let (z, contact, sense, stroke) =
        (or("base_z_mm", 0.0)?, or("contact_deg", 0.0)?, or("sense", 1.0)?, or("stroke", f64::NAN)?);
    let mut all: Vec<Placed> = Vec::with_capacity(n);
    for i in 0..n {
        let sense = sense[i];
        if !(sense.is_nan() || sense.abs() == 1.0) {
            let error =
                InputError::new("this is not a sense of rotation").at(file(), Some(readings.rows[i].line));
            return Err(error.key("sense").value(sense).allowed("1 (counterclockwise) or -1"));
        }
        let pose = Pose {
            base: [needed[0][i], needed[1][i], z[i]],
            // Where the row does not say which way it turns, it does not say where it points when it touches.
            heading: if sense.is_nan() { f64::NAN } else { (needed[2][i] + contact[i]).to_radians() },
            sense,
        };
        let stroke = Some(stroke[i]).filter(|s| s.is_finite());
        let before = all.iter().find(|p| stroke.is_some() && p.stroke == stroke);
        if before.is_some_and(|p| p.pose != pose && p.pose.heading.is_finite() && pose.heading.is_finite()) {
            let message = "rows of one stroke have one pose: that at first touch";
            let error = InputError::new(message).at(file(), Some(readings.rows[i].line));
            return Err(error.key("stroke").value(stroke.unwrap_or_default()).allowed(
                "the same base, heading, sense and contact_deg in all rows of a stroke, the motor's angle since then in theta_deg",
            ));
        }
        all.push(Placed { pose, stroke });
    }
    Ok(all)
}
