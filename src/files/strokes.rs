//! What a whisker strokes, and from where, as TOML: the file of `simulate --object`.

use std::path::Path;

use serde::Deserialize;

use crate::contour::pose::Pose;
use crate::error::InputError;
use crate::measure::text::{fields, number, separator};
use crate::simulate::object::{Curve, Object};
use crate::simulate::strokes::Strokes;

/// The file. Lengths in mm, angles in degrees.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    object: Shape,
    #[serde(default)]
    start: Vec<Start>,
    around: Option<Around>,
    #[serde(default)]
    touch_noise: f64,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "shape", rename_all = "lowercase", deny_unknown_fields)]
enum Shape {
    Circle {
        x: f64,
        y: f64,
        radius: f64,
    },
    Box {
        x: f64,
        y: f64,
        width: f64,
        height: f64,
        #[serde(default)]
        turn: f64,
    },
    Curve {
        file: String,
        #[serde(default)]
        closed: bool,
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Start {
    x: f64,
    y: f64,
    heading: f64,
    #[serde(default = "counterclockwise")]
    sense: f64,
}

/// Starts on a circle about the object, the whisker first square to the way to its centre.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Around {
    starts: u32,
    distance: f64,
    #[serde(default = "counterclockwise")]
    sense: f64,
    #[serde(default)]
    from: f64,
    #[serde(default = "turn")]
    to: f64,
}

fn counterclockwise() -> f64 {
    1.0
}

fn turn() -> f64 {
    360.0
}

impl Strokes {
    /// Reads the file at `path`; the files it names are relative to it.
    ///
    /// # Errors
    /// A file that is missing or says something else; an object that is none.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let label = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| unread(path, &e))?;
        let line = |at: usize| 1 + text.as_bytes()[..at].iter().filter(|b| **b == b'\n').count();
        let written: Written = toml::from_str(&text).map_err(|e| {
            InputError::new(e.message().to_owned())
                .at(&label, e.span().map(|s| line(s.start)))
                .allowed("[object] shape = \"circle\" | \"box\" | \"curve\", [[start]] or [around], touch_noise (docs/contour.md)")
        })?;
        let fault = |key: &str, value: f64, allowed: &str| {
            InputError::new("this is out of range").at(&label, None).key(key).value(value).allowed(allowed)
        };
        let positive = |key: &str, value: f64| match value > 0.0 && value.is_finite() {
            true => Ok(()),
            false => Err(fault(key, value, "> 0 (mm)")),
        };
        let object = match written.object {
            Shape::Circle { x, y, radius } => {
                positive("object.radius", radius)?;
                Object::Circle { centre: [x, y], radius }
            }
            Shape::Box { x, y, width, height, turn } => {
                positive("object.width", width)?;
                positive("object.height", height)?;
                Object::boxed([x, y], [width, height], turn.to_radians())
            }
            Shape::Curve { file, closed } => {
                let path = path.parent().unwrap_or(Path::new("")).join(file);
                Object::Curve(curve(&path, closed)?)
            }
        };
        let mut starts = Vec::new();
        for s in &written.start {
            starts.push((s.x, s.y, s.heading, s.sense));
        }
        if let Some(a) = &written.around {
            positive("around.distance", a.distance)?;
            let [x, y] = object.centre();
            for k in 0..a.starts {
                let bearing = a.from + (a.to - a.from) * f64::from(k) / f64::from(a.starts);
                let (sin, cos) = bearing.to_radians().sin_cos();
                let heading = bearing + 180.0 - 90.0 * a.sense;
                starts.push((x + a.distance * cos, y + a.distance * sin, heading, a.sense));
            }
        }
        let mut poses = Vec::with_capacity(starts.len());
        for (x, y, heading, sense) in starts {
            if sense.abs() != 1.0 {
                return Err(fault("sense", sense, "1 or -1"));
            }
            poses.push(Pose { base: [x, y, 0.0], heading: heading.to_radians(), sense });
        }
        if poses.is_empty() {
            let error = InputError::new("there is no start").at(&label, None).key("start");
            return Err(error.allowed("[[start]] x, y, heading, or [around] starts, distance"));
        }
        if !(written.touch_noise >= 0.0 && written.touch_noise < 10.0) {
            return Err(fault("touch_noise", written.touch_noise, "0 … 10 (degrees)"));
        }
        Ok(Self { object, starts: poses, touch_noise: written.touch_noise })
    }
}

fn unread(path: &Path, e: &std::io::Error) -> InputError {
    let what = match e.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
        _ => format!("this file cannot be read: {e}"),
    };
    InputError::new(what).at(path.display().to_string(), None)
}

/// A curve through the points of a CSV file with the columns x_mm and y_mm.
fn curve(path: &Path, closed: bool) -> Result<Curve, InputError> {
    let label = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|e| unread(path, &e))?;
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
