//! What a whisker strokes, and from where, as TOML: the file of `simulate --object`.

use std::path::Path;

use crate::contour::truth::Pose;
use crate::error::InputError;
use crate::measure::text::{fields, number, separator};
use crate::simulate::object::{Curve, Object};
use crate::simulate::strokes::Strokes;
use crate::spec::{self, COUNTERCLOCKWISE, Domain, Item, LENGTH, SENSE, domain};
use crate::text_file::{Limit, TextFile};

/// What the file may say.
const KEYS: &str =
    "[object] shape = \"circle\" | \"box\" | \"curve\", [[start]] or [around], touch_noise (docs/contour.md)";
const CIRCLE: &str = "shape, x, y, radius";
const BOX: &str = "shape, x, y, width, height, turn";
const CURVE: &str = "shape, file, closed";
const START: &str = "x, y, heading, sense";
const AROUND: &str = "starts, distance, sense, from, to";

const TOUCH: Domain = domain("0 … 10 (degrees)", |v| (0.0..10.0).contains(&v));
/// More strokes than an object is stroked by, so that a slip of the finger does not take all memory.
const MOST_STARTS: u64 = 1_000_000;

#[derive(Debug, Clone, Copy)]
enum Shape {
    Circle,
    Box,
    Curve,
}

impl Strokes {
    /// Of a `text` that `label` names; the files it names are relative to `folder`.
    ///
    /// # Errors
    /// A text that says something else; an object that is none.
    pub fn parse(label: &str, text: &str, folder: &Path) -> Result<Self, InputError> {
        spec::described_by(label, text, |file| Self::of(file, folder))
    }

    fn of(file: &Item<'_>, folder: &Path) -> Result<Self, InputError> {
        file.only(&["object", "start", "around", "touch_noise"], KEYS)?;
        let touch_noise = file.or("touch_noise", 0.0, |x| x.within(&TOUCH))?;
        let described = file.needs("object", KEYS)?;
        let object = object(&described, folder)?;
        let curve = described.child("file").and_then(|file| Some(folder.join(file.value.as_str()?)));
        let mut starts = Vec::new();
        if let Some(list) = file.child("start") {
            for start in list.tables(START)? {
                starts.push(self::start(&start)?);
            }
        }
        if let Some(table) = file.child("around") {
            starts.extend(around(&table, object.centre())?);
        }
        if starts.is_empty() {
            let error = match file.needs("start", KEYS) {
                Ok(list) => list.error("there is no start"),
                Err(missing) => missing,
            };
            return Err(error.key("start").allowed("[[start]] x, y, heading, or [around] starts, distance"));
        }
        Ok(Self { object, starts, touch_noise, files: curve.into_iter().collect() })
    }
}

/// Keys of a list for people.
fn listed(keys: &'static str) -> Vec<&'static str> {
    keys.split(", ").collect()
}

fn object(table: &Item<'_>, folder: &Path) -> Result<Object, InputError> {
    let shapes = [("circle", Shape::Circle), ("box", Shape::Box), ("curve", Shape::Curve)];
    if table.child("shape").is_none() {
        table.only(&[&listed(BOX)[..], &listed(CIRCLE), &listed(CURVE)].concat(), KEYS)?;
    }
    let shape = table.needs("shape", KEYS)?.word(&shapes)?;
    let number = |key: &str, what: &str| table.needs(key, what)?.sensible("mm");
    let length = |key: &str, what: &str| table.needs(key, what)?.within(&LENGTH);
    match shape {
        Shape::Circle => {
            table.only(&listed(CIRCLE), CIRCLE)?;
            let centre = [number("x", CIRCLE)?, number("y", CIRCLE)?];
            Ok(Object::Circle { centre, radius: length("radius", CIRCLE)? })
        }
        Shape::Box => {
            table.only(&listed(BOX), BOX)?;
            let turn = table.or("turn", 0.0, |turn| turn.sensible("degrees"))?;
            let centre = [number("x", BOX)?, number("y", BOX)?];
            Ok(Object::boxed(centre, [length("width", BOX)?, length("height", BOX)?], turn.to_radians()))
        }
        Shape::Curve => {
            table.only(&listed(CURVE), CURVE)?;
            let closed = table.or("closed", false, Item::flag)?;
            Ok(Object::Curve(curve(&folder.join(table.needs("file", CURVE)?.text()?), closed)?))
        }
    }
}

fn start(table: &Item<'_>) -> Result<Pose, InputError> {
    table.only(&listed(START), START)?;
    let number = |key: &str, unit: &str| table.needs(key, START)?.sensible(unit);
    let base = [number("x", "mm")?, number("y", "mm")?, 0.0];
    let heading = number("heading", "degrees")?.to_radians();
    Ok(Pose { base, heading, sense: table.or("sense", COUNTERCLOCKWISE, |s| s.within(&SENSE))? })
}

/// Starts on a circle about the object, the whisker first square to the way to its centre.
fn around(table: &Item<'_>, [x, y]: [f64; 2]) -> Result<Vec<Pose>, InputError> {
    table.only(&listed(AROUND), AROUND)?;
    let counted = table.needs("starts", AROUND)?;
    let n = counted.whole(1)?;
    if n > MOST_STARTS {
        return counted.refuse("so many strokes are not made", format!("1 … {MOST_STARTS}"));
    }
    let distance = table.needs("distance", AROUND)?.within(&LENGTH)?;
    let sense = table.or("sense", COUNTERCLOCKWISE, |s| s.within(&SENSE))?;
    let degrees = |key: &str, usual: f64| table.or(key, usual, |x| x.sensible("degrees"));
    let (from, to) = (degrees("from", 0.0)?, degrees("to", 360.0)?);
    let pose = |k: u64| {
        let bearing = from + (to - from) * k as f64 / n as f64;
        let (sin, cos) = bearing.to_radians().sin_cos();
        let heading = (bearing + 180.0 - 90.0 * sense).to_radians();
        Pose { base: [x + distance * cos, y + distance * sin, 0.0], heading, sense }
    };
    Ok((0..n).map(pose).collect())
}

/// A curve through the points of a CSV file with the columns x_mm and y_mm.
fn curve(path: &Path, closed: bool) -> Result<Curve, InputError> {
    let label = path.display().to_string();
    let text = TextFile::open(path, "curve", Limit::Whole)?.text()?;
    let mut lines = (1..).zip(text.lines()).filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    let (line, header) = lines.next().unwrap_or((1, ""));
    let mark = separator(header);
    let names = fields(header, mark);
    let place = |name: &str| {
        names.iter().position(|n| n == name).ok_or_else(|| {
            let error = InputError::new(format!("column {name} is missing")).at(&label, Some(line));
            error.key(name).value(header).allowed("x_mm, y_mm")
        })
    };
    let places = [place("x_mm")?, place("y_mm")?];
    let mut points = Vec::new();
    for (line, row) in lines {
        let row = fields(row, mark);
        let value = |k: usize| {
            let field = row.get(k).map_or("", |f| f.as_ref());
            number(field).filter(|x| x.is_finite()).ok_or_else(|| {
                let error = InputError::new("this is not a number").at(&label, Some(line));
                error.key(names[k].as_ref()).value(field).allowed("a number in mm")
            })
        };
        points.push([value(places[0])?, value(places[1])?]);
    }
    Curve::new(points, closed).ok_or_else(|| {
        let error = InputError::new("these points make no curve").at(&label, None);
        error.allowed("four points or more, no two that follow each other the same")
    })
}
