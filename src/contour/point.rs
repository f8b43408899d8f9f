//! A point on an object, with what is known of it.

use super::curve::Covariance;
use super::pose::Pose;
use crate::error::InputError;
use crate::locate::Locator;
use crate::locate::table::Reading;
use crate::measure::skin::Skin;
use crate::status::Status;

/// Half width of central differences over the drive, relative.
const STEP: f64 = 1e-3;

/// Largest standard deviation, degrees or mm, that says anything.
pub const MOST_NOISE: f64 = 1000.0;

/// What is not certain beside the signal: one standard deviation each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of the heading at first touch, degrees: it moves a point across the whisker.
    pub angle: f64,
    /// Of each coordinate of the base, mm.
    pub base: f64,
    /// Of the motor's angle at first touch, degrees: heading and drive change by as much in opposite ways. `None`: of a tap none, of a
    /// stroke nothing is known before.
    pub touch: Option<f64>,
}

impl Default for Noise {
    /// 0.1° of heading, a base that is where it is said to be.
    fn default() -> Self {
        Self { angle: 0.1, base: 0.0, touch: None }
    }
}

impl Noise {
    /// What a user says of it.
    ///
    /// # Errors
    /// A number that is no standard deviation.
    pub fn said(angle: f64, base: f64, touch: Option<f64>) -> Result<Self, InputError> {
        let within = |key: &str, x: f64, unit: &str| match (0.0..=MOST_NOISE).contains(&x) {
            true => Ok(x),
            false => Err(InputError::new("this is not a standard deviation")
                .key(key)
                .value(x)
                .allowed(format!("0 … {MOST_NOISE} ({unit})"))),
        };
        Ok(Self {
            touch: touch.map(|x| within("--touch-noise", x, "degrees")).transpose()?,
            angle: within("--angle-noise", angle, "degrees")?,
            base: within("--base-noise", base, "mm")?,
        })
    }
}

/// A point on an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Where, mm; NaN where there is none.
    pub at: [f64; 2],
    /// mm².
    pub covariance: Covariance,
    /// How many points like it make one that is independent, as a share: 1, and less in a stroke, whose points have errors in common.
    pub share: f64,
    /// Distance from the whisker's clamp and its standard deviation, mm.
    pub distance: [f64; 2],
    /// Words of warning.
    pub status: Status,
}

impl Point {
    /// None, and why.
    pub fn nothing(status: Status) -> Self {
        Self {
            at: [f64::NAN; 2],
            covariance: Covariance([f64::NAN; 3]),
            share: 1.0,
            distance: [f64::NAN; 2],
            status,
        }
    }

    /// Whether it is somewhere.
    pub fn is_there(&self) -> bool {
        self.at.iter().chain(&self.covariance.0).all(|x| x.is_finite())
    }

    /// Where the whisker at `pose` first touched what gave `reading`.
    pub fn of_tap(locator: &Locator, skin: &Skin, pose: &Pose, reading: &Reading, noise: &Noise) -> Self {
        let found = reading.located;
        let sound = pose.base.iter().chain([&pose.heading, &pose.sense]).all(|x| x.is_finite());
        if !sound || !found.distance.is_finite() {
            let unsound = if sound { Status::OK } else { Status::BAD_INPUT };
            return Self::nothing(found.status | unsound);
        }
        let a = found.distance;
        let [x, y] = skin.place(a);
        let slope = skin.slope();
        let across = [-y, x];
        let mut covariance = Covariance([noise.base * noise.base, 0.0, noise.base * noise.base])
            .along(pose.direction(slope), found.sigma * found.sigma)
            .along(pose.direction(across), noise.angle.to_radians().powi(2));
        if let Some(touch) = noise.touch.filter(|t| *t > 0.0) {
            // A touch that was seen too late makes the heading too large and the drive too small.
            let per_degree = by_drive(locator, reading);
            let by = [0, 1].map(|i| across[i].to_radians() - slope[i] * per_degree);
            covariance = covariance.along(pose.direction(by), touch * touch);
        }
        Self {
            at: pose.place([x, y]),
            covariance,
            share: 1.0,
            distance: [a, found.sigma],
            status: found.status,
        }
    }
}

/// d a/d drive at a reading, mm per degree; 0 where it cannot be told.
fn by_drive(locator: &Locator, reading: &Reading) -> f64 {
    let h = STEP * reading.drive.abs();
    let at = |drive: f64| locator.locate(drive, reading.signal).distance;
    let slope = match (at(reading.drive - h), reading.located.distance, at(reading.drive + h)) {
        (low, _, high) if low.is_finite() && high.is_finite() => (high - low) / (2.0 * h),
        (low, here, _) if low.is_finite() => (here - low) / h,
        (_, here, high) => (high - here) / h,
    };
    if slope.is_finite() { slope } else { 0.0 }
}
