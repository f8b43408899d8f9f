//! A point on an object, with what is known of it.

use super::curve::Covariance;
use crate::locate::{AnsweredRow, Locator, Readings};
use crate::measure::{Skin, columns::missing};
use crate::{error::InputError, status::Status};

/// Half width of central differences over the drive, relative.
const STEP: f64 = 1e-3;

/// Largest standard deviation, degrees or mm, that says anything.
const MOST_NOISE: f64 = 1000.0;

/// Standard deviation of a heading where none is said, degrees.
pub const ANGLE: f64 = 0.1;

/// Uncertainty of everything but the signal: one standard deviation each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Heading at first touch, degrees: it moves a point across the whisker.
    pub angle: f64,
    /// Each coordinate of the base, mm.
    pub base: f64,
    /// Motor's angle at first touch, degrees: heading and drive err in opposite ways. `None`: 0 for a tap, unknown for a stroke.
    pub touch: Option<f64>,
}

impl Noise {
    pub fn said(angle: f64, base: f64, touch: Option<f64>) -> Result<Self, InputError> {
        let within = |key: &str, x: f64, unit: &str| {
            let error = InputError::new("this is not a standard deviation").key(key).value(x);
            let error = error.allowed(format!("0 … {MOST_NOISE} ({unit})"));
            (0.0..=MOST_NOISE).contains(&x).then_some(x).ok_or(error)
        };
        let touch = touch.map(|x| within("--touch-noise", x, "degrees")).transpose()?;
        let angle = within("--angle-noise", angle, "degrees")?;
        Ok(Self { touch, angle, base: within("--base-noise", base, "mm")? })
    }
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

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Its place, mm; NaN without a contact.
    pub at: [f64; 2],
    /// mm².
    pub covariance: Covariance,
    /// How many points like it make one that is independent, as a share: 1, and less in a stroke, whose points have errors in common.
    pub share: f64,
    /// Distance from the whisker's clamp and its standard deviation, mm.
    pub distance: [f64; 2],
    /// Third coordinate, that of the base, mm.
    pub height: f64,
    /// True where a stroke was followed: the place of the contact at that reading, not at first touch.
    pub swept: bool,
    /// True off the stroke, or off the curve.
    pub outlier: bool,
    pub status: Status,
}

impl Point {
    pub fn nothing(status: Status) -> Self {
        let (at, height, covariance) = ([f64::NAN; 2], f64::NAN, Covariance([f64::NAN; 3]));
        Self { at, covariance, share: 1.0, distance: at, height, swept: false, outlier: false, status }
    }

    pub fn is_there(&self) -> bool {
        self.at.iter().chain(&self.covariance.0).all(|x| x.is_finite())
    }

    /// Its coordinates, mm; NaN in the third where it is nowhere.
    pub fn coordinates(&self) -> [f64; 3] {
        [self.at[0], self.at[1], if self.is_there() { self.height } else { f64::NAN }]
    }

    /// Where the whisker at `pose` first touched what gave `reading`.
    pub fn of_tap(locator: &Locator, skin: &Skin, pose: &Pose, reading: &AnsweredRow, noise: &Noise) -> Self {
        let found = reading.answer.located;
        if reading.rests {
            return Self::nothing(found.status);
        }
        let sound = pose.base.iter().chain([&pose.heading, &pose.sense]).all(|x| x.is_finite());
        if !sound || !found.distance.is_finite() {
            let unsound = if sound { Status::OK } else { Status::BAD_INPUT };
            return Self::nothing(found.status | unsound);
        }
        let a = found.distance;
        let [x, y] = skin.place(a);
        let slope = skin.slope();
        let across = [-y, x];
        let mut covariance = Covariance::default()
            .plus(noise.base * noise.base)
            .along(pose.direction(slope), found.sigma * found.sigma)
            .along(pose.direction(across), noise.angle.to_radians().powi(2));
        if let Some(touch) = noise.touch.filter(|t| *t > 0.0) {
            // A touch that was seen too late makes the heading too large and the drive too small.
            let per_degree = by_drive(locator, reading);
            let by = [0, 1].map(|i| across[i].to_radians() - slope[i] * per_degree);
            covariance = covariance.along(pose.direction(by), touch * touch);
        }
        let (at, distance, height) = (pose.place([x, y]), [a, found.sigma], pose.base[2]);
        Self { at, covariance, distance, height, ..Self::nothing(found.status) }
    }
}

/// d a/d drive at a reading, mm per degree; 0 where it cannot be told.
fn by_drive(locator: &Locator, reading: &AnsweredRow) -> f64 {
    let h = STEP * reading.drive.abs();
    let ends = [-h, h].map(|by| (by, locator.locate(reading.drive + by, reading.signal).distance));
    let here = (0.0, reading.answer.located.distance);
    let [low, high] = ends.map(|end| if end.1.is_finite() { end } else { here });
    let slope = (high.1 - low.1) / (high.0 - low.0);
    if slope.is_finite() { slope } else { 0.0 }
}

pub const NEEDED: [&str; 3] = ["base_x_mm", "base_y_mm", "heading_deg"];
/// Columns that may be there.
pub const MORE: [&str; 4] = ["base_z_mm", "contact_deg", "sense", "stroke"];

/// The pose at first touch (NaN where the row says nothing) and the number of the stroke (`None` of a tap) of each row.
pub fn placed(readings: &Readings) -> Result<Vec<(Pose, Option<f64>)>, InputError> {
    let n = readings.rows.len();
    let file = || readings.file.clone();
    let column = |name: &str| {
        readings.numbers(name)?.ok_or_else(|| {
            missing(name, &readings.names).at(file(), Some(1)).allowed(
                "base_x_mm, base_y_mm, heading_deg; sense, contact_deg, stroke, base_z_mm where they are needed; then those of readings",
            )
        })
    };
    let [x, y, heading] = [column(NEEDED[0])?, column(NEEDED[1])?, column(NEEDED[2])?];
    let or = |name: &str, other: f64| {
        Ok::<_, InputError>(readings.numbers(name)?.unwrap_or_else(|| vec![other; n]))
    };
    let (z, contact, sense, stroke) =
        (or("base_z_mm", 0.0)?, or("contact_deg", 0.0)?, or("sense", 1.0)?, or("stroke", f64::NAN)?);
    let mut all: Vec<(Pose, Option<f64>)> = Vec::with_capacity(n);
    for i in 0..n {
        let sense = sense[i];
        if !(sense.is_nan() || sense.abs() == 1.0) {
            let error =
                InputError::new("this is not a sense of rotation").at(file(), Some(readings.rows[i].line));
            return Err(error.key("sense").value(sense).allowed("1 (counterclockwise) or -1"));
        }
        // Without a sense of rotation the heading at touch is unknown.
        let heading = if sense.is_nan() { f64::NAN } else { (heading[i] + contact[i]).to_radians() };
        let pose = Pose { base: [x[i], y[i], z[i]], heading, sense };
        let stroke = Some(stroke[i]).filter(|s| s.is_finite());
        let before = all.iter().find(|(_, own)| stroke.is_some() && *own == stroke);
        let known = |pose: &Pose| pose.heading.is_finite();
        if before.is_some_and(|(other, _)| *other != pose && known(other) && known(&pose)) {
            let message = "rows of one stroke have one pose: that at first touch";
            let error = InputError::new(message).at(file(), Some(readings.rows[i].line));
            return Err(error.key("stroke").value(stroke.unwrap_or_default()).allowed(
                "the same base, heading, sense and contact_deg in all rows of a stroke, the motor's angle since then in theta_deg",
            ));
        }
        all.push((pose, stroke));
    }
    Ok(all)
}
