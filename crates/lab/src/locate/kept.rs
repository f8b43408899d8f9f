//! Answers of a file: its own columns, and what was made of them.

use super::rows::{Answerer, RowReader};
use super::stream::add;
use crate::sink::fact::{Kind, Only, fact_in};
use crate::sink::frame::Frame;
use crate::sink::heading::{Heading, heading};
use crate::sink::lab::LabCell;
use crate::sink::values::{Field, Values};

/// Columns that are added after the user's own, of two gauges or of one, with the interval where it is asked for.
pub fn added(who: Answerer<'_>, interval: bool) -> Vec<&'static str> {
    let wanted = |name: &&str| match fact_in("located", name).map(|fact| fact.only) {
        _ if name.ends_with("_95_mm") => interval,
        Some(Only::Second) => who.is_twofold(),
        _ => true,
    };
    heading("located").names_from("zero").into_iter().filter(wanted).collect()
}

/// A line of a file as it is kept: its number, the user's columns, drive and signal unless the file names them so, zero, answer.
pub struct Kept {
    /// The table without rows.
    pub empty: Frame,
    /// Types of the user's columns.
    own: Vec<Kind>,
    /// Whether drive and signal are added.
    more: [bool; 2],
}

impl Kept {
    /// For these rows, those of `frame` where they are in memory, in a `table` with the columns `added`, of which the zero is the first. Of a text the user's
    /// own columns are words, as they are.
    pub fn new(rows: &RowReader<'_>, frame: Option<&Frame>, table: &Heading, added: &[&'static str]) -> Self {
        let own = rows.names();
        let common = [rows.drive().column(), rows.who.first().unit.common()];
        let taken = |n: &String| n == "line" || added.contains(&n.as_str());
        let mut names = own.clone();
        for k in (0..own.len()).filter(|k| taken(&own[*k])) {
            let mut name = format!("given_{}", own[k]);
            while names.contains(&name) {
                name.insert_str(0, "given_");
            }
            names[k] = name;
        }
        let missing = common.map(|c| !own.iter().any(|n| n == c));
        // Of several channels each has a column of its own.
        let more = [missing[0], missing[1] && !rows.who.finds_drives()];
        let kind = |k: usize| match frame.map(|frame| &frame.columns[k]) {
            Some(Values::Numbers(_) | Values::Counts(_)) => Kind::Number,
            _ => Kind::Word,
        };
        let own: Vec<Kind> = (0..names.len()).map(kind).collect();
        let mut empty = Frame::of(&table.file, ["line"]);
        names.into_iter().zip(&own).for_each(|(name, kind)| empty.add(name, Values::new(*kind)));
        let common = common.into_iter().zip(more).filter(|(_, more)| *more).map(|(name, _)| name);
        add(&mut empty, &table.table, &common.chain(added.iter().copied()).collect::<Vec<_>>());
        Self { empty, own, more }
    }

    /// A row of it up to the zero: number and fields of the line, then these.
    pub fn fields(&self, line: usize, cells: &[LabCell<'_>], [drive, signal, zero]: [f64; 3]) -> Vec<Field> {
        let own = self.own.iter().enumerate();
        let own = own.map(|(k, kind)| cells.get(k).unwrap_or(&LabCell::EMPTY).field(*kind));
        let more =
            [drive, signal].into_iter().zip(self.more).filter(|(_, more)| *more).map(|(x, _)| x.into());
        std::iter::once(line.into()).chain(own).chain(more).chain([zero.into()]).collect()
    }
}
