//! What a table is: where it stands, what a row is, and its columns in order. Each stands beside what writes it.

use super::fact::{Fact, Kind, Only, fact, fact_in, kind};
use super::frame::Frame;
use crate::scene::{Convention, Drive, Setup, Signal};

/// A table that a command writes.
#[derive(Debug, Clone, Copy)]
pub struct Heading {
    /// Its name in `columns.csv`.
    pub table: &'static str,
    /// The command that writes it.
    pub command: &'static str,
    /// The file, where its name is not that of the table.
    pub file_name: Option<&'static str>,
    /// What a row is.
    pub row: &'static str,
    /// Names of its columns in order, `this|that` where one is called this or that.
    pub columns: &'static str,
}

/// The columns that each channel has: its reading, and its K.
pub(super) const CHANNEL: [&str; 2] = ["signal_moment…|channel_1…", "K_moment…|K_1…"];

impl Heading {
    /// A table that is alone in the file of its name.
    pub const fn new(
        command: &'static str,
        table: &'static str,
        row: &'static str,
        columns: &'static str,
    ) -> Self {
        Self { table, command, file_name: None, row, columns }
    }

    /// The same in `file`.
    pub const fn in_file(self, file: &'static str) -> Self {
        Self { file_name: Some(file), ..self }
    }

    /// Name of its file as CSV.
    pub fn file(&self) -> String {
        self.file_name.map_or_else(|| format!("{}.csv", self.table), str::to_owned)
    }

    /// Its columns, each with what is known of it.
    ///
    /// # Panics
    /// A column that `columns.csv` does not have in this table.
    pub fn facts(&self) -> impl Iterator<Item = (&'static str, &'static Fact)> {
        let table = self.table;
        let fact = move |name: &'static str| {
            let first = name.split('|').next().unwrap_or_default();
            let found = fact_in(table, first);
            (name, found.unwrap_or_else(|| panic!("columns.csv does not say what {first} is in {table}")))
        };
        self.columns.split_whitespace().map(fact)
    }

    /// Names of the columns for `setup`.
    pub fn names(&self, setup: &Setup) -> Vec<&'static str> {
        let mut names = Vec::new();
        for (name, fact) in self.facts() {
            match (&setup.channels, fact.only) {
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

    /// Names of all columns; of those that are called this or that the one which is among `said`.
    pub fn names_as(&self, said: &[&str]) -> Vec<&'static str> {
        let name = |name: &'static str| {
            let first = name.split('|').next().unwrap_or(name);
            name.split('|').find(|one| said.contains(one)).unwrap_or(first)
        };
        self.columns.split_whitespace().map(name).collect()
    }

    /// The columns from `name` on, called as [`Self::names_as`] does.
    pub fn names_from(&self, name: &str) -> Vec<&'static str> {
        self.names_as(&[]).into_iter().skip_while(|one| *one != name).collect()
    }

    /// An empty table with columns of these `names`.
    pub fn of(&self, names: &[&'static str]) -> Frame {
        let kind = |name: &&str| fact_in(self.table, name).map_or_else(|| kind(name), |fact| fact.kind);
        let kinds: Vec<Kind> = names.iter().map(kind).collect();
        Frame::new(self.file(), names, &kinds)
    }

    /// An empty table with all columns, called as `said`.
    pub fn frame(&self, said: &[&str]) -> Frame {
        self.of(&self.names_as(said))
    }

    /// An empty table for `setup`.
    pub fn frame_for(&self, setup: &Setup) -> Frame {
        self.of(&self.names(setup))
    }
}

/// What a column that is called this or that is called for `setup`.
fn of_setup(name: &'static str, setup: &Setup) -> &'static str {
    let Some((first, second)) = name.split_once('|') else { return name };
    let is_second = match first {
        "theta_deg" => setup.drive == Drive::Displacement,
        "K" | "K_mean" | "K_sd" => setup.estimate.convention == Convention::Elongation,
        _ => setup.signal != Signal::Strain,
    };
    if is_second { second } else { first }
}

/// Units of `name`, which may be `this|that`, as people read them; empty where it has none.
pub fn units(name: &str) -> String {
    let of = |name: &str| fact(name).map_or("", |fact| &fact.unit).to_owned();
    let mut units: Vec<String> = name.split('|').map(of).collect();
    units.iter_mut().filter(|unit| unit.is_empty()).for_each(|unit| *unit = "none".to_owned());
    units.dedup();
    if units == ["none"] { String::new() } else { units.join(" or ") }
}

/// The unit of the column `name` in the metadata of a file; `1` of a number or a word without one.
pub fn unit(name: &str) -> &'static str {
    match fact(name).map_or("", |fact| fact.unit.as_str()) {
        "" => "1",
        "degrees" => "deg",
        unit => unit,
    }
}
