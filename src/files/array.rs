//! An array of whiskers as TOML: the file of `locate --array`.

use std::path::{Path, PathBuf};

use crate::contour::point::{MOST_NOISE, Noise};
use crate::contour::truth::Pose;
use crate::error::InputError;
use crate::spec::{self, COUNTERCLOCKWISE, Domain, Item, SENSE, domain};

/// What the file may say.
const KEYS: &str = "[[whisker]] name, calibration, x, y, z, heading, sense; angle_noise, base_noise";
/// Keys of a `[[whisker]]` and their units; empty where there is none.
pub const UNITS: [(&str, &str); 7] = [
    ("name", ""),
    ("calibration", ""),
    ("x", "mm"),
    ("y", "mm"),
    ("z", "mm"),
    ("heading", "degrees"),
    ("sense", ""),
];

const ANGLE: Domain =
    domain("0 … 1000 degrees, one standard deviation", |v| (0.0..=MOST_NOISE).contains(&v));
const PLACE: Domain = domain("0 … 1000 mm, one standard deviation", |v| (0.0..=MOST_NOISE).contains(&v));

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
        let folder = path.parent().unwrap_or(Path::new(""));
        spec::described(path, "array", |file| Self::of(file, folder))
    }

    /// As [`Self::read`], from a `text` that `label` names; calibrations are relative to `folder`.
    ///
    /// # Errors
    /// A text that says something else; two whiskers of one name.
    pub fn parse(label: &str, text: &str, folder: &Path) -> Result<Self, InputError> {
        spec::described_by(label, text, |file| Self::of(file, folder))
    }

    fn of(file: &Item<'_>, folder: &Path) -> Result<Self, InputError> {
        file.only(&["whisker", "angle_noise", "base_noise"], KEYS)?;
        let angle = file.or("angle_noise", Noise::default().angle, |x| x.within(&ANGLE))?;
        let base = file.or("base_noise", 0.0, |x| x.within(&PLACE))?;
        let whiskers = file.needs("whisker", KEYS)?;
        let mut mounts: Vec<Mount> = Vec::new();
        for whisker in whiskers.tables(KEYS)? {
            let mount = mount(&whisker, folder)?;
            if mounts.iter().any(|m| m.name == mount.name) {
                return whisker.needs("name", KEYS)?.refuse("two whiskers have this name", "different names");
            }
            mounts.push(mount);
        }
        if mounts.is_empty() {
            return whiskers.refuse("there is no whisker", KEYS);
        }
        Ok(Self { mounts, noise: Noise { angle, base, touch: None } })
    }
}

fn mount(whisker: &Item<'_>, folder: &Path) -> Result<Mount, InputError> {
    whisker.only(&UNITS.map(|(key, _)| key), KEYS)?;
    let place = |key: &str| whisker.needs(key, KEYS)?.sensible("mm");
    let heading = whisker.needs("heading", KEYS)?.sensible("degrees")?;
    let z = whisker.or("z", 0.0, |z| z.sensible("mm"))?;
    Ok(Mount {
        name: whisker.needs("name", KEYS)?.text()?.to_owned(),
        calibration: folder.join(whisker.needs("calibration", KEYS)?.text()?),
        pose: Pose {
            base: [place("x")?, place("y")?, z],
            heading: heading.to_radians(),
            sense: whisker.or("sense", COUNTERCLOCKWISE, |s| s.within(&SENSE))?,
        },
    })
}
