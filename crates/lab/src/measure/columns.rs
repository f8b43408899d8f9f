//! Finds the columns of a file by their names, or as `--columns` says.

use super::names::{DISTANCE, Names, Role, meant};
use super::{Groups, Row, Unit};
use crate::{error::InputError, reduce::distinct, scene::Drive, sink::lab::LabCell};

/// Names of run columns; the first one present counts.
const RUNS: [&str; 4] = ["run", "session", "date", "pass"];

/// Positions of the columns of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    /// Contact distance.
    pub a: Option<usize>,
    /// Kind and position of the drive.
    pub drive: Option<(Drive, usize)>,
    /// Unit and position of the signal.
    pub signal: (Unit, usize),
    /// Signal of a second gauge, in the unit of the first if there is one.
    pub second: Option<(Unit, usize)>,
    /// Tilt of the pole.
    pub tilt: Option<usize>,
    /// Column of runs.
    pub run: Option<usize>,
    /// Column of times.
    pub time: Option<usize>,
    /// Names of unused columns.
    pub ignored: Vec<String>,
}

impl Columns {
    /// Finds the columns among the header's `names`, with the user's names in `said`; of two drives takes `kind`.
    /// Errors: a missing, doubled or contradicting column; a name like that of a drive.
    pub fn find(names: &[String], said: &Names, kind: Option<Drive>) -> Result<Self, InputError> {
        for (role, name) in &said.said {
            if !names.contains(name) {
                let close = meant(name, names.iter().map(String::as_str));
                let message = format!("the file has no column {name}{close}");
                let role = role.short();
                let error = InputError::new(message).key("--columns").value(format!("{role}={name}"));
                return Err(error.allowed(names.join(", ")));
            }
        }
        let roles: Vec<Option<Role>> = names.iter().map(|n| said.role(n)).collect();
        let once = |wanted: Role| {
            let places: Vec<usize> = (0..names.len()).filter(|&i| roles[i] == Some(wanted)).collect();
            match places[..] {
                [place, _, ..] => {
                    let error = InputError::new("this column appears twice").key(&names[place]);
                    Err(error.allowed("each column once"))
                }
                _ => Ok(places.first().copied()),
            }
        };
        let a = once(Role::Distance)?;
        let mut drives = Vec::new();
        for drive in [Drive::Angle, Drive::Displacement] {
            drives.extend(once(Role::Drive(drive))?.map(|place| (drive, place)));
        }
        if drives.len() > 1 {
            drives.retain(|(d, _)| kind.is_none_or(|k| k == *d));
        }
        if drives.len() > 1 {
            let error = InputError::new("a whisker is driven by an angle or by a displacement, not by both");
            let error = error.key("theta_deg").value("theta_deg and delta_mm");
            return Err(error.allowed("one of the two columns"));
        }
        let each = |role: fn(Unit) -> Role| -> Result<Vec<(Unit, usize)>, InputError> {
            let places = Unit::ALL.into_iter().map(|unit| Ok(once(role(unit))?.map(|place| (unit, place))));
            places.filter_map(Result::transpose).collect()
        };
        let signals = each(Role::Signal)?;
        let like = |&i: &usize| roles[i].is_none() && drive_like(&names[i]).is_some();
        if let Some(i) = (0..names.len()).find(like).filter(|_| drives.is_empty()) {
            return Err(unknown_drive(&names[i]));
        }
        let signal = match signals.as_slice() {
            [one] => *one,
            [] => return Err(said.channel.as_ref().map_or_else(|| no_signal(names), |c| c.missing(names))),
            several => {
                let found: Vec<&str> = several.iter().map(|(_, place)| names[*place].as_str()).collect();
                let error =
                    InputError::new("there are several signal columns, and they may contradict each other");
                let allowed = format!("exactly one of {}; or --columns ignore=NAME", signal_names());
                return Err(error.key(found[0]).value(found.join(", ")).allowed(allowed));
            }
        };
        let seconds = each(Role::Second)?;
        let second = seconds.iter().find(|s| s.0 == signal.0).or(seconds.first()).copied();
        let tilt = once(Role::Tilt)?;
        let named = |name: &&str| names.iter().position(|n| n == name && said.role(n) == Some(Role::Run));
        let said_run = said.said.iter().find(|(r, _)| *r == Role::Run);
        let said_run = said_run.and_then(|(_, n)| names.iter().position(|m| m == n));
        let run = said_run.or_else(|| RUNS.iter().find_map(named));
        let time = once(Role::Time)?;
        let used = [a, drives.first().map(|d| d.1), Some(signal.1), second.map(|s| s.1), tilt, run, time];
        let unused = |i: &usize| !used.contains(&Some(*i)) && roles[*i] != Some(Role::Ignored);
        let ignored = (0..names.len()).filter(unused).map(|i| names[i].clone()).collect();
        let drive = drives.first().copied();
        Ok(Self { a, drive, signal, second, tilt, run, time, ignored })
    }
}

/// The error for a missing column, with the nearest of `names`.
pub fn missing(name: &str, names: &[String]) -> InputError {
    let close = meant(name, names.iter().map(String::as_str));
    let message = format!("column {name} is missing{close}");
    let allowed = format!("{}; or --columns {}=NAME", all_names(), name.split('_').next().unwrap_or(name));
    InputError::new(message).key(name).value(names.join(",")).allowed(allowed)
}

/// Names of the columns of a data file, for messages.
pub fn all_names() -> String {
    format!("{DISTANCE}, theta_deg or delta_mm, and one of {}", signal_names())
}

fn signal_names() -> String {
    Unit::ALL.map(Unit::column).join(", ")
}

fn has(name: &str, words: &[&str]) -> bool {
    name.to_lowercase().split(|c: char| !c.is_alphabetic()).any(|part| words.contains(&part))
}

/// True if an unknown name may be that of a drive, among other things.
pub fn may_drive(name: &str) -> bool {
    has(name, &["step", "steps", "mm", "position", "pos", "stage", "travel", "stroke", "weg"])
}

/// The error for a file without a signal, with the likely column.
fn no_signal(names: &[String]) -> InputError {
    const UNITS: [(&[&str], &str); 3] = [
        (&["µε", "με", "µstrain", "μstrain", "ustrain", "microstrain", "ue"], "microstrain"),
        (&["strain", "ε", "dehnung"], "strain"),
        (&["mv"], "bridge"),
    ];
    let role = |name: &str| UNITS.into_iter().find(|(words, _)| has(name, words)).map(|u| u.1);
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    match names.iter().find_map(|name| Some((role(name)?, name))) {
        Some((role, name)) if crate::error::nearest("strain", &known).is_none() => {
            let error =
                InputError::new("this column looks like the signal, but it is none by name").key(name);
            error.allowed(format!("one of {}; or {}", signal_names(), said_as(role, name)))
        }
        _ => missing("strain", names),
    }
}

/// The `--columns` argument for the column `name`, quoted for a shell.
fn said_as(role: &str, name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-.:/".contains(c);
    let quote = if name.chars().all(plain) { "" } else { "'" };
    format!("--columns {quote}{role}={name}{quote}")
}

/// The error for a column whose values behave like a drive.
pub fn followed(name: &str) -> InputError {
    let message = "the signal follows the few values of this column as it follows a drive, but no column is one by name";
    let (drive, other) = (said_as("theta", name), said_as("ignore", name));
    let allowed = format!("theta_deg or delta_mm; or {drive} (degrees) or delta (mm); or {other}");
    InputError::new(message).key(name).allowed(allowed)
}

/// None if the name does not look like a drive; else the likely drive, or `Some(None)` if it may be either.
pub(super) fn drive_like(name: &str) -> Option<Option<Drive>> {
    const ANGLE: [&str; 12] = [
        "theta", "θ", "angle", "angles", "ang", "winkel", "rotation", "phi", "deg", "degree", "degrees",
        "rad",
    ];
    const DISPLACEMENT: [&str; 8] =
        ["delta", "δ", "disp", "displ", "displacement", "auslenkung", "deflection", "push"];
    let has = |words: &[&str]| has(name, words);
    let near = crate::error::nearest(name, &["theta_deg", "delta_mm"]);
    match near {
        _ if has(&ANGLE) => Some(Some(Drive::Angle)),
        _ if has(&DISPLACEMENT) => Some(Some(Drive::Displacement)),
        Some("theta_deg") => Some(Some(Drive::Angle)),
        Some(_) => Some(Some(Drive::Displacement)),
        None => has(&["drive", "motor"]).then_some(None),
    }
}

fn unknown_drive(name: &str) -> InputError {
    let (likely, role, unit) = match drive_like(name).flatten() {
        Some(Drive::Angle) => ("theta_deg", "theta", "degrees"),
        Some(Drive::Displacement) => ("delta_mm", "delta", "mm"),
        None => ("theta_deg or delta_mm", "theta", "degrees"),
    };
    let (drive, other) = (said_as(role, name), said_as("ignore", name));
    if has(name, &["rad", "radians"]) {
        let message = "this column looks like a drive in radians; theta_deg is meant, in degrees";
        return InputError::new(message).key(name).allowed(format!("theta_deg, in degrees; or {other}"));
    }
    let message = format!("this column looks like a drive, but it is none by name; is {likely} meant?");
    let allowed = format!("{likely}; or {drive} where it is in {unit}; or {other}");
    InputError::new(message).key(name).allowed(allowed)
}

/// Least share of the steps between levels in which the signal changes in the same direction.
const SAME_WAY: f64 = 0.95;
/// Fewest steps.
const CASES: usize = 6;
/// Least mean range over the levels at one distance, as a share of the range of all signals.
const FAR: f64 = 0.2;

/// Numbers in unused columns; empty if the drive is known.
pub struct Others<'a> {
    columns: Vec<(usize, &'a str, Vec<f64>)>,
}

impl<'a> Others<'a> {
    /// Starts with the unused columns of a file with these `names`.
    pub fn new(columns: &Columns, names: &'a [String]) -> Self {
        let unused = |(_, n): &(usize, &String)| columns.drive.is_none() && columns.ignored.contains(n);
        let all = names.iter().enumerate().filter(unused);
        Self { columns: all.map(|(place, name)| (place, name.as_str(), Vec::new())).collect() }
    }

    /// Adds a line; a column with a word is dropped.
    pub fn push(&mut self, record: &[LabCell<'_>]) {
        self.columns.retain_mut(|(place, _, values)| {
            let x = record[*place].number().filter(|x| x.is_finite());
            values.extend(x);
            x.is_some()
        });
    }

    /// The column that behaves like a drive.
    pub fn drive(&self, rows: &[Row]) -> Option<&'a str> {
        self.columns.iter().find(|(.., values)| leads(values, rows)).map(|(_, name, _)| *name)
    }
}

/// True if the signal follows a few `levels`: monotonically at each distance, and over a large range.
fn leads(levels: &[f64], rows: &[Row]) -> bool {
    let distances = Groups::of(rows.iter().map(|r| r.a), None, false);
    let mut cells = std::collections::BTreeMap::<[i64; 2], (f64, f64)>::new();
    let ordered = |x: f64| x.to_bits() as i64 ^ ((x.to_bits() as i64 >> 63) as u64 >> 1) as i64;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (level, row) in levels.iter().zip(rows).filter(|(_, r)| r.a.is_finite() && r.value.is_finite()) {
        let cell = cells.entry([distances.centre(row.a), *level].map(ordered)).or_default();
        *cell = (cell.0 + row.value, cell.1 + 1.0);
        (low, high) = (low.min(row.value), high.max(row.value));
    }
    let distinct = distinct(levels.iter().copied());
    let means: Vec<(i64, f64)> = cells.iter().map(|([a, _], (sum, n))| (*a, sum / n)).collect();
    let steps = means.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1 - w[0].1);
    let (up, all) = steps.fold((0, 0), |(up, n), step| (up + usize::from(step > 0.0), n + 1));
    let several = means.chunk_by(|p, q| p.0 == q.0).filter(|c| c.len() > 1);
    let ranges: Vec<f64> = several.map(|c| (c[c.len() - 1].1 - c[0].1).abs()).collect();
    2 * distinct.len() <= rows.len()
        && all >= CASES
        && up.max(all - up) as f64 >= SAME_WAY * all as f64
        && ranges.iter().sum::<f64>() >= FAR * (high - low) * ranges.len() as f64
}
