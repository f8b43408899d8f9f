//! Whiskers that are moved or mounted, as TOML: strokes over an object (`simulate --object`), an array (`locate --array`).

use std::path::{Path, PathBuf};

use crate::contour::point::{ANGLE, Noise, Pose};
use crate::simulate::object::{Curve, Object};
use crate::spec::{self, Item};
use crate::{error::InputError, simulate::strokes::Strokes};

impl Strokes {
    /// Parses `text` of the file `label`; its files are relative to `folder`.
    /// Errors: a text that is not such a file; an invalid object.
    pub fn parse(label: &str, text: &str, folder: &Path) -> Result<Self, InputError> {
        spec::described(label, text, "object", |file| {
            let touch_noise = file.or("touch_noise", 0.0, Item::ranged)?;
            let described = file.needs("object")?;
            let object = object(&described, folder)?;
            let curve = described.child("file").and_then(|file| Some(folder.join(file.value.as_str()?)));
            let mut starts = Vec::new();
            if let Some(list) = file.child("start") {
                starts = list.tables()?.iter().map(pose).collect::<Result<_, _>>()?;
            }
            if let Some(table) = file.child("around") {
                starts.extend(around(&table, object.centre())?);
            }
            if starts.is_empty() {
                let error = file.needs("start").map_or_else(|e| e, |list| list.error("there is no start"));
                return Err(error
                    .key("start")
                    .allowed("[[start]] x, y, heading, or [around] starts, distance"));
            }
            Ok(Self { object, starts, touch_noise, files: curve.into_iter().collect() })
        })
    }
}

fn object(table: &Item<'_>, folder: &Path) -> Result<Object, InputError> {
    let shaped = |shape: &str| table.clone().of(spec::keys::section("files").key(shape));
    let shape = shaped("box").needs("shape")?.own_word()?;
    let table = shaped(shape);
    table.only_known()?;
    let number = |key: &str| table.needs(key)?.ranged();
    match shape {
        "circle" => Ok(Object::Circle { centre: [number("x")?, number("y")?], radius: number("radius")? }),
        "box" => {
            let turn = table.or("turn", 0.0, Item::ranged)?.to_radians();
            let (centre, size) = ([number("x")?, number("y")?], [number("width")?, number("height")?]);
            Ok(Object::boxed(centre, size, turn))
        }
        _ => {
            let closed = table.or("closed", false, Item::flag)?;
            let columns = ["x_mm", "y_mm"];
            let (label, points) =
                spec::columns(&table.needs("file")?, folder, "curve", columns, |_| "a number in mm")?;
            Curve::new(points, closed).map(Object::Curve).ok_or_else(|| {
                let error = InputError::new("these points make no curve").at(&label, None);
                error.allowed("four points or more, no two that follow each other the same")
            })
        }
    }
}

/// Position and direction of a whisker, at the height 0 if nothing is said of it.
fn pose(table: &Item<'_>) -> Result<Pose, InputError> {
    let number = |key: &str| table.needs(key)?.ranged();
    let base = [number("x")?, number("y")?, table.or("z", 0.0, Item::ranged)?];
    Ok(Pose { base, heading: number("heading")?.to_radians(), sense: sense(table)? })
}

/// Starts on a circle about the object; the whisker points across the direction to its centre.
fn around(table: &Item<'_>, [x, y]: [f64; 2]) -> Result<Vec<Pose>, InputError> {
    table.only_known()?;
    let n = table.needs("starts")?.whole()?;
    let distance = table.needs("distance")?.ranged()?;
    let sense = sense(table)?;
    let (from, to) = (table.or("from", 0.0, Item::ranged)?, table.or("to", 360.0, Item::ranged)?);
    let pose = |k: u64| {
        let bearing = from + (to - from) * k as f64 / n as f64;
        let (sin, cos) = bearing.to_radians().sin_cos();
        let heading = (bearing + 180.0 - 90.0 * sense).to_radians();
        Pose { base: [x + distance * cos, y + distance * sin, 0.0], heading, sense }
    };
    Ok((0..n).map(pose).collect())
}

/// A whisker and its mounting.
#[derive(Debug, Clone, PartialEq)]
pub struct Mount {
    /// Name of the whisker.
    pub name: String,
    /// Path of its calibration.
    pub calibration: PathBuf,
    /// Position and direction.
    pub pose: Pose,
}

/// Array as read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// At least one mount; names are unique.
    pub mounts: Vec<Mount>,
    /// Uncertainties besides the signals.
    pub noise: Noise,
}

impl Array {
    /// Parses `text` of the file `label`; calibrations are relative to `folder`.
    /// Errors: a text that is not an array; two whiskers with one name.
    pub fn parse(label: &str, text: &str, folder: &Path) -> Result<Self, InputError> {
        spec::described(label, text, "array", |file| {
            let angle = file.or("angle_noise", ANGLE, Item::ranged)?;
            let base = file.or("base_noise", 0.0, Item::ranged)?;
            let whiskers = file.needs("whisker")?;
            let mut mounts: Vec<Mount> = Vec::new();
            for whisker in whiskers.tables()? {
                let (pose, name) = (pose(&whisker)?, whisker.needs("name")?.text()?.to_owned());
                let calibration = folder.join(whisker.needs("calibration")?.text()?);
                if mounts.iter().any(|m| m.name == name) {
                    return whisker.needs("name")?.refuse("two whiskers have this name", "different names");
                }
                mounts.push(Mount { name, calibration, pose });
            }
            if mounts.is_empty() {
                return whiskers.wrong("there is no whisker");
            }
            Ok(Self { mounts, noise: Noise { angle, base, touch: None } })
        })
    }
}

/// Sense of rotation of the whisker of `table`: 1 (counterclockwise, default) or −1.
fn sense(table: &Item<'_>) -> Result<f64, InputError> {
    table.or("sense", 1.0, |sense| match sense.ranged()? {
        value if value.abs() == 1.0 => Ok(value),
        _ => sense.wrong("this value is out of range"),
    })
}
