//! The definition of a table: its file and rows (`tables.csv`), and its columns in order (`columns.csv`).

use std::sync::LazyLock;

use super::fact::{FACTS, Fact, Only, fact, fact_in, kind};
use crate::scene::{Convention, Drive, Setup, Signal};
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

/// Columns that exist once per channel: reading and K.
pub(super) const CHANNEL: [&str; 2] = ["signal_moment…|channel_1…", "K_moment…|K_1…"];

impl Heading {
    /// Names of the columns for `setup`.
    pub fn names(&self, setup: &Setup) -> Vec<&'static str> {
        let mut names = Vec::new();
        for Fact { name, only, .. } in self.columns.iter().copied() {
            match (&setup.channels, *only) {
                (Some(channels), Only::Channel) if name == CHANNEL[0] => {
                    names.extend(channels.names.iter().flatten().copied());
                }
                (_, Only::Channel) => {}
                (_, only) if only.holds(name, setup) => names.push(of_setup(name, setup)),
                _ => {}
            }
        }
        names
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
