//! Data files of a rig: a_mm, theta_deg or delta_mm, and one signal.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::Path;

use super::Unit;
use crate::error::InputError;
use crate::scene::Drive;

/// Column of the contact distance.
pub const DISTANCE: &str = "a_mm";

/// One line of a data file; NaN where the line says nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// 1-based line.
    pub line: usize,
    /// Contact distance as labelled, mm.
    pub a: f64,
    /// θ in degrees or δ in mm as labelled; 0 is a zero reading.
    pub drive: f64,
    /// The signal as recorded.
    pub value: f64,
    /// Fingerprint of the whole line, extra columns and all.
    pub text: u64,
}

/// A data file.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// The file as the user named it.
    pub file: String,
    /// What drives the whisker; `None` where no column says.
    pub drive: Option<Drive>,
    /// What the signal is.
    pub unit: Unit,
    /// Every line after the header, comments and blank lines left out.
    pub rows: Vec<Row>,
    /// Columns that are not used.
    pub ignored: Vec<String>,
}

impl Data {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// A file that is missing or no CSV; columns that are missing, doubled or contradict each other; a field that is no
    /// number. An empty field, `NaN` and `inf` are missing values, which stay.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&path.display().to_string(), &Self::load(path)?)
    }

    /// The bytes of the file at `path`, which may be a pipe: it is read once.
    pub fn load(path: &Path) -> Result<Vec<u8>, InputError> {
        let label = path.display().to_string();
        if path.is_dir() {
            return Err(InputError::new("this is a folder; a data file is needed").at(label, None));
        }
        std::fs::read(path).map_err(|e| {
            let what = match e.kind() {
                std::io::ErrorKind::NotFound => "there is no such data file".to_owned(),
                _ => format!("this data file cannot be read: {e}"),
            };
            InputError::new(what).at(label, None)
        })
    }

    /// Reads `bytes`; `label` names them in messages. Errors as [`Self::read`].
    pub fn parse(label: &str, bytes: &[u8]) -> Result<Self, InputError> {
        let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|e| {
            let line = 1 + bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
            InputError::new("this data file is not UTF-8 text; save it as UTF-8 CSV").at(label, Some(line))
        })?;
        let mut lines = (1..).zip(text.lines()).filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
        let Some((line, header)) = lines.next() else {
            let allowed = format!("{DISTANCE}, theta_deg or delta_mm, and one of {}", signals());
            let message = "this file is empty; its first line must name the columns";
            return Err(InputError::new(message).at(label, None).allowed(allowed));
        };
        let names: Vec<String> = fields(header).iter().map(|f| f.to_string()).collect();
        let columns = Columns::find(&names).map_err(|e| e.at(label, Some(line)))?;

        let mut rows = Vec::new();
        for (line, text) in lines {
            let record = fields(text);
            if record.len() != names.len() {
                let message =
                    format!("this line has {} fields, but the header has {}", record.len(), names.len());
                let allowed = "one field for each column; numbers with a decimal point, no unit";
                return Err(InputError::new(message).value(text).allowed(allowed).at(label, Some(line)));
            }
            let number = |place: usize| {
                number(&record[place]).ok_or_else(|| {
                    InputError::new("this is not a number")
                        .key(&names[place])
                        .value(&record[place])
                        .allowed("a number with a decimal point, no unit; empty or NaN where it is missing")
                        .at(label, Some(line))
                })
            };
            let mut fingerprint = DefaultHasher::new();
            text.hash(&mut fingerprint);
            rows.push(Row {
                line,
                a: number(columns.a)?,
                drive: columns.drive.map_or(Ok(f64::NAN), |(_, place)| number(place))?,
                value: number(columns.signal.1)?,
                text: fingerprint.finish(),
            });
        }
        if rows.is_empty() {
            return Err(InputError::new("this file has a header but no rows").at(label, None));
        }
        let used = [Some(columns.a), columns.drive.map(|d| d.1), Some(columns.signal.1)];
        let ignored =
            (0..names.len()).filter(|i| !used.contains(&Some(*i))).map(|i| names[i].clone()).collect();
        Ok(Self {
            file: label.to_owned(),
            drive: columns.drive.map(|d| d.0),
            unit: columns.signal.0,
            rows,
            ignored,
        })
    }
}

/// Fields of a line, without blanks around them. A quoted field may hold commas.
pub fn fields(line: &str) -> Vec<std::borrow::Cow<'_, str>> {
    if !line.contains('"') {
        return line.split(',').map(|f| f.trim().into()).collect();
    }
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
    let record = reader.records().next().and_then(Result::ok).unwrap_or_default();
    record.iter().map(|f| f.trim().to_owned().into()).collect()
}

/// A number; NaN for an empty field or anything that is not finite; `None` for words.
pub fn number(field: &str) -> Option<f64> {
    if field.is_empty() {
        return Some(f64::NAN);
    }
    field.parse().ok().map(|x: f64| if x.is_finite() { x } else { f64::NAN })
}

fn signals() -> String {
    Unit::ALL.map(Unit::column).join(", ")
}

/// Where the columns of a data file stand.
struct Columns {
    a: usize,
    drive: Option<(Drive, usize)>,
    signal: (Unit, usize),
}

impl Columns {
    fn find(names: &[String]) -> Result<Self, InputError> {
        let once = |name: &str| {
            let mut places = (0..names.len()).filter(|&i| names[i] == name);
            let first = places.next();
            match places.next() {
                None => Ok(first),
                Some(_) => {
                    Err(InputError::new("this column appears twice").key(name).allowed("each column once"))
                }
            }
        };
        let missing = |name: &str, allowed: String| {
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            let close = crate::error::nearest(name, &known).map(|n| format!("; is {n} meant?"));
            let message = format!("column {name} is missing{}", close.unwrap_or_default());
            InputError::new(message).key(name).value(names.join(",")).allowed(allowed)
        };
        let all = format!("{DISTANCE}, theta_deg or delta_mm, and one of {}", signals());
        let a = once(DISTANCE)?.ok_or_else(|| missing(DISTANCE, all.clone()))?;
        let mut drives = Vec::new();
        for drive in [Drive::Angle, Drive::Displacement] {
            drives.extend(once(drive.column())?.map(|place| (drive, place)));
        }
        if let [_, _, ..] = drives.as_slice() {
            let error = InputError::new("a whisker is driven by an angle or by a displacement, not by both");
            return Err(error
                .key("theta_deg")
                .value("theta_deg and delta_mm")
                .allowed("one of the two columns"));
        }
        let mut found = Vec::new();
        for unit in Unit::ALL {
            found.extend(once(unit.column())?.map(|place| (unit, place)));
        }
        match found.as_slice() {
            [] => Err(missing("strain", format!("exactly one of {}", signals()))),
            [signal] => Ok(Self { a, drive: drives.first().copied(), signal: *signal }),
            several => {
                let names: Vec<&str> = several.iter().map(|(unit, _)| unit.column()).collect();
                let error =
                    InputError::new("there are several signal columns, and they may contradict each other");
                Err(error
                    .key(names[0])
                    .value(names.join(", "))
                    .allowed(format!("exactly one of {}", signals())))
            }
        }
    }
}
