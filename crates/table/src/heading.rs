//! The definition of a table: its file and rows (`tables.csv`), and its columns in order with their facts (`columns.csv`).
//!
//! In `columns.csv` a line is a column of some tables, and columns follow its order. The first line of a
//! name has its type, unit and axis; a later line what differs. `this|that` has two names; a line without tables is a second name.

use std::sync::LazyLock;

use crate::scene::{Convention, Drive, Property, Setup, Signal};
use crate::{Frame, Values};

/// A table that a command writes.
#[derive(Debug)]
pub struct Heading {
    /// Its name.
    pub table: String,
    /// The command that writes it.
    pub command: String,
    /// Its file name as CSV.
    pub file: String,
    /// Meaning of a row.
    pub row: String,
    /// Its columns, in order.
    pub columns: Vec<&'static Fact>,
}

/// All tables.
pub static HEADINGS: LazyLock<Vec<Heading>> = LazyLock::new(|| {
    let mut lines = csv::Reader::from_reader(&include_bytes!("tables.csv")[..]);
    let heading = |line: csv::Result<[String; 4]>| {
        let [table, command, file, row] = line.expect("tables.csv is a table");
        let columns = FACTS.iter().filter(|fact| fact.is_of(&table)).collect();
        Heading { table, command, file, row, columns }
    };
    lines.deserialize().map(heading).collect()
});

/// The table `table` of `tables.csv`; panics if it does not exist.
pub fn heading(table: &str) -> &'static Heading {
    let found = HEADINGS.iter().find(|heading| heading.table == table);
    found.unwrap_or_else(|| panic!("tables.csv has no {table}"))
}

/// The column in whose place reading and K of each channel stand.
const CHANNEL: &str = "signal_moment…|channel_1…";

impl Heading {
    /// The columns for `setup`: facts, number of the channel, name.
    pub(super) fn chosen(&self, setup: &Setup) -> Vec<(&'static Fact, usize, &'static str)> {
        let mut all = Vec::new();
        for fact in self.columns.iter().copied() {
            match (&setup.channels, fact.only) {
                (Some(channels), Only::Channel) if fact.name == CHANNEL => {
                    let names = channels.names.iter().flatten().enumerate();
                    all.extend(names.map(|(k, name)| (fact, k, *name)));
                }
                (_, Only::Channel) => {}
                (_, only) if only.holds(&fact.name, setup) => {
                    all.push((fact, 0, of_setup(&fact.name, setup)));
                }
                _ => {}
            }
        }
        all
    }

    /// Names of the columns for `setup`.
    pub fn names(&self, setup: &Setup) -> Vec<&'static str> {
        self.chosen(setup).into_iter().map(|(.., name)| name).collect()
    }

    /// Names of all columns; of a column with two names, the one in `said`, else the first.
    pub fn names_as(&self, said: &[&str]) -> Vec<&'static str> {
        let name = |fact: &&'static Fact| {
            let mut names = fact.name.split('|');
            names.clone().find(|one| said.contains(one)).or(names.next()).unwrap_or_default()
        };
        self.columns.iter().map(name).collect()
    }

    /// The columns from `name` to the last; of two names, the first.
    pub fn names_from(&self, name: &str) -> Vec<&'static str> {
        self.names_as(&[]).into_iter().skip_while(|one| *one != name).collect()
    }

    /// An empty table with columns of these `names`.
    pub fn of(&self, names: &[&'static str]) -> Frame {
        let mut frame = Frame { file: self.file.clone(), ..Frame::default() };
        for name in names {
            let kind = fact_in(&self.table, name).map_or_else(|| kind(name), |fact| fact.kind);
            frame.add(*name, Values::new(kind));
        }
        frame
    }

    /// An empty table with all columns, named by [`Self::names_as`].
    pub fn frame(&self, said: &[&str]) -> Frame {
        self.of(&self.names_as(said))
    }

    /// An empty table for `setup`.
    pub fn frame_for(&self, setup: &Setup) -> Frame {
        self.of(&self.names(setup))
    }
}

fn of_setup(name: &'static str, setup: &Setup) -> &'static str {
    let Some((first, second)) = name.split_once('|') else { return name };
    let is_second = match first {
        "theta_deg" => setup.drive == Drive::Displacement,
        "K" | "K_mean" | "K_sd" => setup.estimate.convention == Convention::Elongation,
        _ => setup.signal != Signal::Strain,
    };
    if is_second { second } else { first }
}

/// Units of `name` for readers, also of `this|that`; empty without a unit.
pub fn units(name: &str) -> String {
    let of = |name: &str| fact(name).map_or("", |fact| &fact.unit).to_owned();
    let mut units: Vec<String> = name.split('|').map(of).collect();
    units.iter_mut().filter(|unit| unit.is_empty()).for_each(|unit| *unit = "none".to_owned());
    units.dedup();
    if units == ["none"] { String::new() } else { units.join(" or ") }
}

/// The unit of the column `name` in file metadata; `1` if it has no unit.
pub fn unit(name: &str) -> &'static str {
    match fact(name).map_or("", |fact| fact.unit.as_str()) {
        "" => "1",
        "degrees" => "deg",
        unit => unit,
    }
}

vibrissa_core::words! {
    /// Type of a column.
    Kind {
        /// f64; NaN is missing.
        Number = "number",
        /// Unsigned whole number.
        Count = "count",
        /// Text; empty is missing.
        Word = "word",
    }
}

/// Facts of a column in some tables.
#[derive(Debug)]
pub struct Fact {
    /// Name; `this|that` for a column with two names.
    pub name: String,
    tables: String,
    /// Type of its values.
    pub kind: Kind,
    /// Unit; empty without one.
    pub unit: String,
    /// Title of its axis, which ends with its symbol; may be empty.
    pub axis: String,
    /// True for a logarithmic axis.
    pub log: bool,
    /// The condition under which these tables have it.
    pub only: Only,
    /// Meaning, for readers.
    pub meaning: String,
}

vibrissa_core::choices! {
    /// The condition under which a table has a column.
    Only {
        Always = "", "";
        Tilt = "tilt", "if the spec has tilt";
        Lean = "lean", "if the spec has lean";
        Direction = "direction", "if the spec has tilt or lean";
        Second = "second", "with a second gauge";
        Wrench = "wrench", "with wrench = true";
        Several = "several", "with several channels";
        Channel = "channel", "one for each channel";
        Built = "built", "unless the whisker is a plain cone";
        Curved = "curved", "if the whisker is curved at rest";
        Varies = "varied", "if varied";
    }
}

impl Only {
    /// The condition in words; empty for a column that is always there.
    pub fn when(self) -> &'static str {
        Self::WORDS[self as usize].2
    }

    /// True if a table of `setup` has the column `name` under this condition.
    pub fn holds(self, name: &str, setup: &Setup) -> bool {
        match self {
            Self::Always => true,
            Self::Tilt => setup.directions[0],
            Self::Lean => setup.directions[1],
            Self::Direction => setup.directions.contains(&true),
            Self::Second => setup.gauge.second,
            Self::Wrench => setup.wrench,
            Self::Several | Self::Channel => setup.channels.is_some(),
            Self::Built => setup.built.is_some(),
            Self::Curved => setup.is_curved(),
            Self::Varies => property(name).is_some_and(|property| setup.varies(property)),
        }
    }
}

/// The property whose column is `name`.
pub fn property(name: &str) -> Option<Property> {
    Property::ALL.into_iter().find(|property| property.about().column == name)
}

/// Name, type, unit, axis, scale, tables, when and meaning.
type Line = (String, Option<Kind>, String, String, String, String, Only, String);

/// All facts, in the order of tables.
pub static FACTS: LazyLock<Vec<Fact>> = LazyLock::new(|| {
    let mut all: Vec<Fact> = Vec::new();
    let mut lines = csv::Reader::from_reader(&include_bytes!("columns.csv")[..]);
    for line in lines.deserialize::<Line>() {
        let (name, kind, unit, axis, scale, tables, only, meaning) = line.expect("columns.csv is a table");
        let first = all.iter().find(|fact| first(&fact.name) == first(&name));
        let kind = kind.or(first.map(|first| first.kind)).unwrap_or(Kind::Number);
        let inherited = |own: String, of: fn(&Fact) -> &String| match first {
            Some(first) if own.is_empty() => of(first).clone(),
            _ => own,
        };
        let (unit, axis) = (inherited(unit, |f| &f.unit), inherited(axis, |f| &f.axis));
        let log = scale == "log" || first.is_some_and(|first| first.log);
        let meaning = match property(&name) {
            Some(property) if meaning.is_empty() => property.about().what.to_owned(),
            _ => meaning,
        };
        all.push(Fact { name, tables, kind, unit, axis, log, only, meaning });
    }
    all
});

fn first(name: &str) -> &str {
    name.split('|').next().unwrap_or(name)
}

impl Fact {
    /// True if `table` has this column.
    pub fn is_of(&self, table: &str) -> bool {
        self.tables.split(' ').any(|one| one == table)
    }
}

/// Facts of the column `name` in most tables.
pub fn fact(name: &str) -> Option<&'static Fact> {
    FACTS.iter().find(|fact| first(&fact.name) == first(name))
}

/// Facts of the column `name` in `table`.
pub fn fact_in(table: &str, name: &str) -> Option<&'static Fact> {
    FACTS.iter().find(|fact| first(&fact.name) == first(name) && fact.is_of(table))
}

/// The type of the column `name`; an unknown column has numbers.
pub fn kind(name: &str) -> Kind {
    fact(name).map_or(Kind::Number, |fact| fact.kind)
}
