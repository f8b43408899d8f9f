//! An array of whiskers as TOML: the file of `locate --array`.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::contour::point::Noise;
use crate::contour::pose::Pose;
use crate::error::InputError;

/// The file. Lengths in mm, angles in degrees.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    whisker: Vec<One>,
    #[serde(default = "usual")]
    angle_noise: f64,
    #[serde(default)]
    base_noise: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct One {
    name: String,
    calibration: PathBuf,
    x: f64,
    y: f64,
    #[serde(default)]
    z: f64,
    heading: f64,
    #[serde(default = "counterclockwise")]
    sense: f64,
}

fn usual() -> f64 {
    Noise::default().angle
}

fn counterclockwise() -> f64 {
    1.0
}

/// A whisker and where it is mounted.
#[derive(Debug, Clone, PartialEq)]
pub struct Mount {
    /// Its name.
    pub name: String,
    /// Its calibration, from where the program runs.
    pub calibration: PathBuf,
    /// Where.
    pub pose: Pose,
}

/// An array as its file says it.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// At least one, of different names.
    pub mounts: Vec<Mount>,
    /// What is not certain beside the signals.
    pub noise: Noise,
}

impl Array {
    /// Reads the file at `path`; calibrations are relative to it.
    ///
    /// # Errors
    /// A file that is missing or says something else; two whiskers of one name.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let label = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| {
            let what = match e.kind() {
                std::io::ErrorKind::NotFound => "there is no such file of an array".to_owned(),
                _ => format!("this file cannot be read: {e}"),
            };
            InputError::new(what).at(&label, None)
        })?;
        let line = |at: usize| 1 + text.as_bytes()[..at].iter().filter(|b| **b == b'\n').count();
        let written: Written = toml::from_str(&text).map_err(|e| {
            InputError::new(e.message().to_owned())
                .at(&label, e.span().map(|s| line(s.start)))
                .allowed("[[whisker]] name, calibration, x, y, z, heading, sense; angle_noise, base_noise")
        })?;
        let fault = |key: &str, value: &dyn std::fmt::Display, message: &str, allowed: &str| {
            InputError::new(message).at(&label, None).key(key).value(value).allowed(allowed)
        };
        for (key, x) in [("angle_noise", written.angle_noise), ("base_noise", written.base_noise)] {
            if !(x >= 0.0 && x.is_finite()) {
                return Err(fault(key, &x, "this is no standard deviation", "≥ 0"));
            }
        }
        let mut mounts: Vec<Mount> = Vec::new();
        for w in written.whisker {
            if w.name.is_empty() || mounts.iter().any(|m| m.name == w.name) {
                return Err(fault(
                    "whisker.name",
                    &w.name,
                    "each whisker has a name of its own",
                    "different names",
                ));
            }
            if w.sense.abs() != 1.0 {
                return Err(fault("whisker.sense", &w.sense, "this is no sense of rotation", "1 or -1"));
            }
            for (key, x) in [("x", w.x), ("y", w.y), ("z", w.z), ("heading", w.heading)] {
                if !x.is_finite() {
                    return Err(fault(
                        &format!("whisker.{key}"),
                        &x,
                        "this must be a finite number",
                        "mm, degrees",
                    ));
                }
            }
            let pose = Pose { base: [w.x, w.y, w.z], heading: w.heading.to_radians(), sense: w.sense };
            let calibration = path.parent().unwrap_or(Path::new("")).join(w.calibration);
            mounts.push(Mount { name: w.name, calibration, pose });
        }
        if mounts.is_empty() {
            return Err(InputError::new("there is no whisker").at(&label, None).key("whisker"));
        }
        let noise = Noise { angle: written.angle_noise, base: written.base_noise, touch: None };
        Ok(Self { mounts, noise })
    }
}
