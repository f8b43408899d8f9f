//! Which column of a file is what: by the names that every table has, or as `--columns` says.

use super::Unit;
use crate::error::InputError;
use crate::scene::{Drive, Signal};

/// Column of the contact distance.
pub const DISTANCE: &str = "a_mm";
/// Column of the tilt of the pole.
pub const TILT: &str = "tilt_deg";

/// Columns of the run, the first that is there counts.
const RUNS: [&str; 4] = ["run", "session", "date", "pass"];

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Contact distance, mm.
    Distance,
    /// Tap angle in degrees, or displacement in mm.
    Drive(Drive),
    /// The signal.
    Signal(Unit),
    /// The signal of a second gauge, 90° round the whisker.
    Second(Unit),
    /// Tilt of the pole, degrees.
    Tilt,
    /// The run that a row belongs to: a name, a number, a date.
    Run,
    /// When it was taken, seconds.
    Time,
    /// Nothing that is used.
    Ignored,
}

impl Role {
    /// All, with the short name and the column's own name.
    const ALL: [(&'static str, &'static str, Self); 20] = [
        ("a", DISTANCE, Self::Distance),
        ("theta", "theta_deg", Self::Drive(Drive::Angle)),
        ("delta", "delta_mm", Self::Drive(Drive::Displacement)),
        ("strain", "strain", Self::Signal(Unit::Strain)),
        ("microstrain", "microstrain", Self::Signal(Unit::Microstrain)),
        ("bridge", "bridge_mV_per_V", Self::Signal(Unit::Bridge)),
        ("reading", "reading", Self::Signal(Unit::Reading)),
        ("moment", "moment_Nmm", Self::Signal(Unit::Moment)),
        ("force", "force_N", Self::Signal(Unit::Force)),
        ("strain_2", "strain_2", Self::Second(Unit::Strain)),
        ("microstrain_2", "microstrain_2", Self::Second(Unit::Microstrain)),
        ("bridge_2", "bridge_mV_per_V_2", Self::Second(Unit::Bridge)),
        ("reading_2", "reading_2", Self::Second(Unit::Reading)),
        ("tilt", TILT, Self::Tilt),
        ("run", "run", Self::Run),
        ("run", "pass", Self::Run),
        ("run", "session", Self::Run),
        ("run", "date", Self::Run),
        ("t", "t_s", Self::Time),
        ("ignore", "ignore", Self::Ignored),
    ];

    fn of_column(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, column, role)| *column == name && *role != Self::Ignored).map(|r| r.2)
    }
}

/// Names of the columns that have a role.
pub fn names() -> impl Iterator<Item = &'static str> {
    Role::ALL.into_iter().filter(|(.., role)| *role != Role::Ignored).map(|(_, column, _)| column)
}

impl Channel {
    /// That its column is missing.
    fn missing(&self, names: &[String]) -> InputError {
        let (column, allowed) = match self {
            Self::Named(column) => (*column, format!("a column {column}")),
            Self::Of(signal) => {
                let units =
                    || Unit::ALL.into_iter().filter(|u| u.signal() == Some(*signal)).map(Unit::column);
                (Unit::of_signal(*signal).column(), units().collect::<Vec<_>>().join(", "))
            }
        };
        let error = InputError::new(format!("the column of the channel {column} is missing"));
        error.key(column).value(names.join(",")).allowed(allowed)
    }
}

/// Names that the user gave to columns: `a=dist,theta=ang_deg,reading=ch3`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Names {
    said: Vec<(Role, String)>,
    channel: Option<Channel>,
}

/// The one channel that is read of a file with several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Channel {
    /// The columns of this signal.
    Of(Signal),
    /// The column of this name, a reading.
    Named(&'static str),
}

impl Names {
    /// Reads the value of `--columns`.
    ///
    /// # Errors
    /// A part that is no `role=name`, a role that is unknown or named twice.
    pub fn parse(text: &str) -> Result<Self, InputError> {
        let allowed = "a, theta or delta, strain, microstrain, bridge or reading, the same with _2, tilt, run, t, ignore; each as role=column";
        let fault = |message: String, part: &str| {
            InputError::new(message).key("--columns").value(part).allowed(allowed)
        };
        let mut all: Vec<(Role, String)> = Vec::new();
        for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            let Some((role, name)) = part.split_once('=').map(|(r, n)| (r.trim(), n.trim())) else {
                return Err(fault("this names no column".to_owned(), part));
            };
            let known = Role::ALL.iter().find(|(short, column, _)| *short == role || *column == role);
            let Some((.., role)) = known else {
                let short: Vec<&str> = Role::ALL.iter().map(|r| r.0).collect();
                let close = crate::error::nearest(role, &short).map(|n| format!("; is {n} meant?"));
                return Err(fault(format!("there is no such role{}", close.unwrap_or_default()), part));
            };
            if name.is_empty() {
                return Err(fault("the name of the column is missing".to_owned(), part));
            }
            if *role != Role::Ignored && all.iter().any(|(r, _)| r == role) {
                return Err(fault("this role is named twice".to_owned(), part));
            }
            all.push((*role, name.to_owned()));
        }
        Ok(Self { said: all, channel: None })
    }

    /// The same with the column `name` as that of the runs.
    #[must_use]
    pub fn with_run(mut self, name: &str) -> Self {
        self.said.retain(|(role, _)| *role != Role::Run);
        self.said.push((Role::Run, name.to_owned()));
        self
    }

    /// The same where one channel is read and the others are ignored.
    #[must_use]
    pub fn of_channel(&self, channel: Channel) -> Self {
        Self { said: self.said.clone(), channel: Some(channel) }
    }

    /// Whether nothing was said.
    pub fn is_empty(&self) -> bool {
        self.said.is_empty()
    }

    /// Role of the column `name`: as the user said, else by its own name unless the user named another for that.
    fn role(&self, name: &str) -> Option<Role> {
        let role = match self.said.iter().find(|(_, n)| n == name) {
            Some((role, _)) => Some(*role),
            None => Role::of_column(name).filter(|own| {
                let same_kind = |r: &Role| std::mem::discriminant(r) == std::mem::discriminant(own);
                // Of several channels each may be named for itself.
                let same = |r: &Role| if self.channel.is_some() { r == own } else { same_kind(r) };
                !self.said.iter().any(|(r, _)| same(r))
            }),
        };
        let Some(channel) = &self.channel else { return role };
        match (channel, role) {
            (Channel::Named(column), _) if name == *column => Some(Role::Signal(Unit::Reading)),
            (Channel::Named(_), None) if name.starts_with("channel_") => Some(Role::Ignored),
            (Channel::Named(_), Some(Role::Signal(_))) => Some(Role::Ignored),
            (Channel::Of(signal), Some(Role::Signal(unit))) if unit.signal() != Some(*signal) => {
                Some(Role::Ignored)
            }
            _ => role,
        }
    }

    /// Whether `name` says what a column holds, rightly or nearly so: such a line is a header.
    pub fn known(&self, name: &str) -> bool {
        self.role(name).is_some() || drive_like(name).is_some()
    }
}

/// Where the columns of a file stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    /// Contact distance.
    pub a: Option<usize>,
    /// Drive.
    pub drive: Option<(Drive, usize)>,
    /// Signal.
    pub signal: (Unit, usize),
    /// Signal of a second gauge: in the unit of the first, where there is one.
    pub second: Option<(Unit, usize)>,
    /// Tilt of the pole.
    pub tilt: Option<usize>,
    /// Run.
    pub run: Option<usize>,
    /// Time.
    pub time: Option<usize>,
    /// Number of columns.
    pub fields: usize,
    /// Names of those that are not used.
    pub ignored: Vec<String>,
}

impl Columns {
    /// From the `names` in a header and what the user said of them. Of two drives that of `kind` is taken.
    ///
    /// # Errors
    /// A column that is missing, doubled, or contradicts another; one that looks like a drive and is none.
    pub fn find(names: &[String], said: &Names, kind: Option<Drive>) -> Result<Self, InputError> {
        for (role, name) in &said.said {
            if !names.contains(name) {
                let known: Vec<&str> = names.iter().map(String::as_str).collect();
                let close = crate::error::nearest(name, &known).map(|n| format!("; is {n} meant?"));
                let message = format!("the file has no column {name}{}", close.unwrap_or_default());
                let role = Role::ALL.iter().find(|r| r.2 == *role).map_or("", |r| r.0);
                let error = InputError::new(message).key("--columns").value(format!("{role}={name}"));
                return Err(error.allowed(names.join(", ")));
            }
        }
        let roles: Vec<Option<Role>> = names.iter().map(|n| said.role(n)).collect();
        let once = |wanted: Role| {
            let mut places = (0..names.len()).filter(|&i| roles[i] == Some(wanted));
            let first = places.next();
            match (first, places.next()) {
                (Some(place), Some(_)) => {
                    let error = InputError::new("this column appears twice").key(&names[place]);
                    Err(error.allowed("each column once"))
                }
                _ => Ok(first),
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
            return Err(error
                .key("theta_deg")
                .value("theta_deg and delta_mm")
                .allowed("one of the two columns"));
        }
        let mut signals = Vec::new();
        for unit in Unit::ALL {
            signals.extend(once(Role::Signal(unit))?.map(|place| (unit, place)));
        }
        if let ([], Some(i)) = (
            drives.as_slice(),
            (0..names.len()).find(|&i| roles[i].is_none() && drive_like(&names[i]).is_some()),
        ) {
            return Err(unknown_drive(&names[i]));
        }
        let signal = match signals.as_slice() {
            [one] => *one,
            [] => match &said.channel {
                Some(channel) => return Err(channel.missing(names)),
                None => return Err(missing("strain", names)),
            },
            several => {
                let found: Vec<&str> = several.iter().map(|(_, place)| names[*place].as_str()).collect();
                let error =
                    InputError::new("there are several signal columns, and they may contradict each other");
                return Err(error
                    .key(found[0])
                    .value(found.join(", "))
                    .allowed(format!("exactly one of {}; or --columns ignore=NAME", signal_names())));
            }
        };
        let mut seconds = Vec::new();
        for unit in Unit::ALL {
            seconds.extend(once(Role::Second(unit))?.map(|place| (unit, place)));
        }
        let second = seconds.iter().find(|s| s.0 == signal.0).or(seconds.first()).copied();
        let tilt = once(Role::Tilt)?;
        // Of several columns that may name runs, the first in the order of the names.
        let named = |name: &&str| names.iter().position(|n| n == name && said.role(n) == Some(Role::Run));
        let said_run = said
            .said
            .iter()
            .find(|(r, _)| *r == Role::Run)
            .and_then(|(_, n)| names.iter().position(|m| m == n));
        let run = said_run.or_else(|| RUNS.iter().find_map(named));
        let time = once(Role::Time)?;
        let used = [a, drives.first().map(|d| d.1), Some(signal.1), second.map(|s| s.1), tilt, run, time];
        let unused = |i: &usize| !used.contains(&Some(*i)) && roles[*i] != Some(Role::Ignored);
        let ignored = (0..names.len()).filter(unused).map(|i| names[i].clone()).collect();
        let drive = drives.first().copied();
        Ok(Self { a, drive, signal, second, tilt, run, time, fields: names.len(), ignored })
    }
}

/// That a column is missing, and which of `names` may be meant.
pub fn missing(name: &str, names: &[String]) -> InputError {
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    let close = crate::error::nearest(name, &known).map(|n| format!("; is {n} meant?"));
    let message = format!("column {name} is missing{}", close.unwrap_or_default());
    let allowed = format!("{}; or --columns {}=NAME", all_names(), name.split('_').next().unwrap_or(name));
    InputError::new(message).key(name).value(names.join(",")).allowed(allowed)
}

/// The columns of a data file, in words.
pub fn all_names() -> String {
    format!("{DISTANCE}, theta_deg or delta_mm, and one of {}", signal_names())
}

fn signal_names() -> String {
    Unit::ALL.map(Unit::column).join(", ")
}

/// Whether one of `words` stands in a name.
fn has(name: &str, words: &[&str]) -> bool {
    name.to_lowercase().split(|c: char| !c.is_alphabetic()).any(|part| words.contains(&part))
}

/// Whether a name that is no column may be that of a drive as well as of anything else.
pub fn may_drive(name: &str) -> bool {
    has(name, &["step", "steps", "mm", "position", "pos", "stage", "travel", "stroke", "weg"])
}

/// `--columns` with the column `name` as `role`, as a shell takes it.
fn said_as(role: &str, name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-.:/".contains(c);
    let quote = if name.chars().all(plain) { "" } else { "'" };
    format!("--columns {quote}{role}={name}{quote}")
}

/// The error for a column whose values are like those of a drive.
pub fn followed(name: &str) -> InputError {
    let message = "the signal follows the few values of this column as it follows a drive, but no column is one by name";
    InputError::new(message).key(name).allowed(format!(
        "theta_deg or delta_mm; or {} (degrees) or delta (mm); or {}",
        said_as("theta", name),
        said_as("ignore", name)
    ))
}

/// What a name that is no column looks like: a drive, with its likely column; `None` where it may be either.
fn drive_like(name: &str) -> Option<Option<Drive>> {
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

/// The error for a column that looks like a drive.
fn unknown_drive(name: &str) -> InputError {
    let radians = has(name, &["rad", "radians"]);
    let (likely, role) = match drive_like(name).flatten() {
        Some(Drive::Angle) => ("theta_deg", "theta"),
        Some(Drive::Displacement) => ("delta_mm", "delta"),
        None => ("theta_deg or delta_mm", "theta"),
    };
    let message = match radians {
        true => "this column looks like a drive in radians; theta_deg is meant, in degrees".to_owned(),
        false => format!("this column looks like a drive, but it is none by name; is {likely} meant?"),
    };
    let allowed = match radians {
        true => format!("theta_deg, in degrees; or {}", said_as("ignore", name)),
        false => format!(
            "{likely}; or {} where it is in {}; or {}",
            said_as(role, name),
            if role == "theta" { "degrees" } else { "mm" },
            said_as("ignore", name)
        ),
    };
    InputError::new(message).key(name).allowed(allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(header: &str, said: &str) -> Result<Columns, InputError> {
        let names: Vec<String> = header.split(',').map(str::to_owned).collect();
        Columns::find(&names, &Names::parse(said)?, None)
    }

    #[test]
    fn columns_are_found_by_name_or_as_said() {
        let c = find("a_mm,theta_deg,strain,run", "").unwrap();
        assert_eq!((c.a, c.drive, c.signal), (Some(0), Some((Drive::Angle, 1)), (Unit::Strain, 2)));
        assert_eq!((c.run, c.ignored.len()), (Some(3), 0));
        let c = find("dist,ang,ch1,ch3", "a=dist, theta=ang,reading=ch3,ignore=ch1").unwrap();
        assert_eq!((c.a, c.drive, c.signal), (Some(0), Some((Drive::Angle, 1)), (Unit::Reading, 3)));
        assert_eq!(c.ignored, [] as [&str; 0]);
        // What the user says goes before the column's own name.
        let c = find("a_mm,theta_deg,strain,strain_2", "strain=strain_2").unwrap();
        assert_eq!((c.signal, c.second), ((Unit::Strain, 3), None));
        let c = find("a_mm,tilt_deg,theta_deg,strain,reading_2,strain_2", "").unwrap();
        assert_eq!((c.second, c.tilt), (Some((Unit::Strain, 5)), Some(1)));
        assert_eq!(c.ignored, ["reading_2"]);
    }

    #[test]
    fn what_looks_like_a_drive_is_asked_for() {
        for (name, likely) in [
            ("theta", "theta_deg"),
            ("theta_rad", "theta_deg"),
            ("angle", "theta_deg"),
            ("Angle (deg)", "theta_deg"),
            ("delta", "delta_mm"),
            ("displacement_mm", "delta_mm"),
            ("thetadeg", "theta_deg"),
            ("motor", "theta_deg or delta_mm"),
        ] {
            let e = find(&format!("a_mm,{name},strain"), "").unwrap_err();
            assert!(e.to_string().contains(likely) && e.key.as_deref() == Some(name), "{name}: {e}");
            assert!(find(&format!("a_mm,{name},strain"), &format!("ignore={name}")).is_ok());
            let hint = e.allowed.unwrap();
            assert_eq!(name.contains(' '), hint.contains(&format!("'ignore={name}'")), "{hint}");
        }
        for name in ["run", "t_s", "temperature", "operator", "grade", "comment"] {
            assert!(find(&format!("a_mm,{name},strain"), "").is_ok(), "{name}");
        }
    }

    #[test]
    fn what_is_said_of_columns_is_checked() {
        for (said, word) in [
            ("a", "names no column"),
            ("dist=a_mm", "no such role"),
            ("a=", "missing"),
            ("a=x,a=y", "twice"),
            ("a=nothing", "no column nothing"),
        ] {
            let e = find("a_mm,theta_deg,strain", said).unwrap_err();
            assert!(e.to_string().contains(word) && e.key.as_deref() == Some("--columns"), "{said}: {e}");
        }
    }
}
