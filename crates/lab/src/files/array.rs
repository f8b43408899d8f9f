//! An array of whiskers as TOML: the file of `locate --array`.

use std::path::{Path, PathBuf};

use super::sense;
use crate::contour::point::{Noise, Pose};
use crate::error::InputError;
use crate::spec::{self, Item};

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
    /// Of a `text` that `label` names; calibrations are relative to `folder`.
    ///
    /// # Errors
    /// A text that says something else; two whiskers of one name.
    pub fn parse(label: &str, text: &str, folder: &Path) -> Result<Self, InputError> {
        spec::described(label, text, "array", |file| Self::of(file, folder))
    }

    fn of(file: &Item<'_>, folder: &Path) -> Result<Self, InputError> {
        let angle = file.or("angle_noise", Noise::default().angle, Item::ranged)?;
        let base = file.or("base_noise", 0.0, Item::ranged)?;
        let whiskers = file.needs("whisker")?;
        let mut mounts: Vec<Mount> = Vec::new();
        for whisker in whiskers.tables()? {
            let mount = mount(&whisker, folder)?;
            if mounts.iter().any(|m| m.name == mount.name) {
                return whisker.needs("name")?.refuse("two whiskers have this name", "different names");
            }
            mounts.push(mount);
        }
        if mounts.is_empty() {
            return whiskers.wrong("there is no whisker");
        }
        Ok(Self { mounts, noise: Noise { angle, base, touch: None } })
    }
}

fn mount(whisker: &Item<'_>, folder: &Path) -> Result<Mount, InputError> {
    let place = |key: &str| whisker.needs(key)?.ranged();
    let heading = place("heading")?.to_radians();
    let base = [place("x")?, place("y")?, whisker.or("z", 0.0, Item::ranged)?];
    Ok(Mount {
        name: whisker.needs("name")?.text()?.to_owned(),
        calibration: folder.join(whisker.needs("calibration")?.text()?),
        pose: Pose { base, heading, sense: sense(whisker)? },
    })
}
