//! The facts of every column of every table, from `columns.csv`: a line is a column of some tables, and columns follow its order. The first line of a
//! name has its type, unit and axis; a later line what differs. `this|that` has two names; a line without tables is a second name.

use std::collections::HashMap;
use std::sync::LazyLock;

use crate::scene::{Property, Setup};

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

/// The condition under which a table has a column; `WORDS` explains each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs)]
pub enum Only {
    Always,
    Tilt,
    Lean,
    Direction,
    Second,
    Wrench,
    Several,
    Channel,
    Built,
    Curved,
    Varies,
}

impl Only {
    const WORDS: [(&'static str, Self, &'static str); 11] = [
        ("", Self::Always, ""),
        ("tilt", Self::Tilt, "if the spec has tilt"),
        ("lean", Self::Lean, "if the spec has lean"),
        ("direction", Self::Direction, "if the spec has tilt or lean"),
        ("second", Self::Second, "with a second gauge"),
        ("wrench", Self::Wrench, "with wrench = true"),
        ("several", Self::Several, "with several channels"),
        ("channel", Self::Channel, "one for each channel"),
        ("built", Self::Built, "unless the whisker is a plain cone"),
        ("curved", Self::Curved, "if the whisker is curved at rest"),
        ("varied", Self::Varies, "if varied"),
    ];

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

/// All facts, in the order of tables.
pub static FACTS: LazyLock<Vec<Fact>> = LazyLock::new(|| {
    let mut all: Vec<Fact> = Vec::new();
    let mut firsts: HashMap<String, usize> = HashMap::new();
    let mut lines = csv::Reader::from_reader(&include_bytes!("columns.csv")[..]);
    for line in lines.deserialize::<[String; 8]>() {
        let [name, kind, unit, axis, scale, tables, when, meaning] = line.expect("columns.csv is a table");
        let first = firsts.get(self::first(&name)).map(|place| &all[*place]);
        let known =
            |word| Kind::WORDS.iter().find(|(one, _)| *one == word).expect("columns.csv: a known type").1;
        let kind = match kind.as_str() {
            "" => first.map_or(Kind::Number, |first| first.kind),
            word => known(word),
        };
        let only =
            Only::WORDS.iter().find(|(word, ..)| *word == when).expect("columns.csv: a known `when`").1;
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
        firsts.entry(self::first(&name).to_owned()).or_insert(all.len());
        all.push(Fact { name, tables, kind, unit, axis, log, only, meaning });
    }
    all
});

static BY_NAME: LazyLock<HashMap<&str, Vec<&Fact>>> = LazyLock::new(|| {
    let mut all: HashMap<&str, Vec<&Fact>> = HashMap::new();
    FACTS.iter().for_each(|fact| all.entry(first(&fact.name)).or_default().push(fact));
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
    BY_NAME.get(first(name))?.first().copied()
}

/// Facts of the column `name` in `table`.
pub fn fact_in(table: &str, name: &str) -> Option<&'static Fact> {
    BY_NAME.get(first(name))?.iter().copied().find(|fact| fact.is_of(table))
}

/// The type of the column `name`; an unknown column has numbers.
pub fn kind(name: &str) -> Kind {
    fact(name).map_or(Kind::Number, |fact| fact.kind)
}
