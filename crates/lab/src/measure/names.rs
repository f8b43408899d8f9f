//! Content of a column, by its name or as `--columns` says.

use super::{Unit, columns::drive_like};
use crate::error::InputError;
use crate::scene::{Drive, Signal, channels::numbered};

/// Column of the contact distance.
pub const DISTANCE: &str = "a_mm";
/// Column of the tilt of the pole.
pub const TILT: &str = "tilt_deg";

/// Content of a column.
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
    /// Signal of this channel of a matrix.
    Channel(&'static str),
    /// Not used.
    Ignored,
}

impl Role {
    /// Every role with its name in `--columns` and its column's name.
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

    pub(super) fn short(self) -> &'static str {
        match self {
            Self::Channel(name) => name,
            _ => Self::ALL.iter().find(|r| r.2 == self).map_or("", |r| r.0),
        }
    }

    pub(super) fn column(self) -> Option<&'static str> {
        Self::ALL.iter().find(|r| r.2 == self).map(|r| r.1)
    }
}

/// Names of the columns that have a role.
pub fn names() -> impl Iterator<Item = &'static str> {
    Role::ALL.into_iter().filter(|(.., role)| *role != Role::Ignored).map(|(_, column, _)| column)
}

/// The one of `known` that `name` may stand for, as a question; empty if none is near.
pub(super) fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let close = crate::error::nearest(name, &known.collect::<Vec<_>>());
    close.map_or_else(String::new, |close| format!("; is {close} meant?"))
}

impl Channel {
    pub(super) fn missing(&self, names: &[String]) -> InputError {
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

/// Column names given by the user: `a=dist,theta=ang_deg,reading=ch3`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Names {
    pub(super) said: Vec<(Role, String)>,
    pub(super) channel: Option<Channel>,
}

/// The channel that is read, in a file with several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Channel {
    /// The columns of this signal.
    Of(Signal),
    /// A reading in the column of this name.
    Named(&'static str),
}

impl Names {
    /// Reads the value of `--columns`.
    /// Errors: a part that is not `role=name`; a role that is unknown or named twice.
    pub fn parse(text: &str) -> Result<Self, InputError> {
        let allowed = "a, theta or delta, strain, microstrain, bridge or reading, the same with _2, tilt, run, t, channel_1 … channel_6, ignore; each as role=column";
        let fault = |message: String, part: &str| {
            InputError::new(message).key("--columns").value(part).allowed(allowed)
        };
        let mut all: Vec<(Role, String)> = Vec::new();
        // A name may contain commas: a part without `=` continues the name before it.
        let mut parts: Vec<String> = Vec::new();
        for part in text.split(',') {
            match parts.last_mut().filter(|_| !part.contains('=') && !part.trim().is_empty()) {
                Some(before) => *before += &format!(",{part}"),
                None => parts.push(part.to_owned()),
            }
        }
        for part in parts.iter().map(|part| part.trim()).filter(|p| !p.is_empty()) {
            let Some((role, name)) = part.split_once('=').map(|(r, n)| (r.trim(), n.trim())) else {
                return Err(fault("this names no column".to_owned(), part));
            };
            let known = Role::ALL.iter().find(|(short, column, _)| *short == role || *column == role);
            let known = known.map(|known| known.2).or_else(|| numbered(role).map(Role::Channel));
            let Some(role) = known else {
                let close = meant(role, Role::ALL.iter().map(|r| r.0));
                return Err(fault(format!("there is no such role{close}"), part));
            };
            if name.is_empty() {
                return Err(fault("the name of the column is missing".to_owned(), part));
            }
            if role != Role::Ignored && all.iter().any(|(r, _)| *r == role) {
                return Err(fault("this role is named twice".to_owned(), part));
            }
            all.push((role, name.to_owned()));
        }
        Ok(Self { said: all, channel: None })
    }

    /// The same, with `name` as the column of runs.
    #[must_use]
    pub fn with_run(mut self, name: &str) -> Self {
        self.said.retain(|(role, _)| *role != Role::Run);
        self.said.push((Role::Run, name.to_owned()));
        self
    }

    /// The same, with only this channel read.
    #[must_use]
    pub fn of_channel(&self, channel: Channel) -> Self {
        Self { said: self.said.clone(), channel: Some(channel) }
    }

    /// True if the user named no column.
    pub fn is_empty(&self) -> bool {
        self.said.is_empty()
    }

    /// Role of the column `name`: as the user said, else by its own name, unless the user named another column for that role.
    pub(super) fn role(&self, name: &str) -> Option<Role> {
        let role = match self.said.iter().find(|(_, n)| n == name) {
            Some((role, _)) => Some(*role),
            None => {
                Role::ALL.iter().find(|r| r.1 == name && r.2 != Role::Ignored).map(|r| r.2).filter(|own| {
                    let same_kind = |r: &Role| std::mem::discriminant(r) == std::mem::discriminant(own);
                    // Channels may be named independently.
                    let same = |r: &Role| if self.channel.is_some() { r == own } else { same_kind(r) };
                    !self.said.iter().any(|(r, _)| same(r))
                })
            }
        };
        let Some(channel) = &self.channel else { return role };
        let (reading, ignored) = (Some(Role::Signal(Unit::Reading)), Some(Role::Ignored));
        let is_said = |column| self.said.iter().any(|(role, _)| *role == Role::Channel(column));
        match (channel, role) {
            (Channel::Named(column), Some(Role::Channel(said))) if said == *column => reading,
            (_, Some(Role::Channel(_))) => ignored,
            (Channel::Named(column), _) if name == *column && !is_said(column) => reading,
            (Channel::Named(_), None) if name.starts_with("channel_") => ignored,
            (Channel::Named(_), Some(Role::Signal(_))) => ignored,
            (Channel::Of(signal), Some(Role::Signal(unit))) if unit.signal() != Some(*signal) => ignored,
            _ => role,
        }
    }

    /// True if `name` is that of a column, by itself or by the user. Run names do not count: they are common words.
    pub(super) fn means(&self, name: &str) -> bool {
        self.said.iter().any(|(_, said)| said == name)
            || self.role(name).is_some_and(|role| !matches!(role, Role::Run | Role::Ignored))
    }

    pub(super) fn is_drive(&self, name: &str) -> bool {
        matches!(self.role(name), Some(Role::Drive(_)))
    }

    /// True if `name` is a column name, or nearly one: its line is a header.
    pub fn known(&self, name: &str) -> bool {
        self.role(name).is_some() || drive_like(name).is_some()
    }
}
