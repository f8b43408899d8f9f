//! Answers of a file: its own columns, and what was made of them.

use std::borrow::Cow;

use super::lines::Line;
use super::rows::{Answerer, RowReader};
use super::stream::number;
use crate::fields;
use crate::sink::fact::{Kind, Only, fact_in, kind};
use crate::sink::frame::Frame;
use crate::sink::heading::{Heading, heading};
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

/// How rows of a file are written: number of the line, the user's columns, drive and signal under their own names where the user has
/// other ones, the zero that was subtracted, the answer.
pub struct Kept {
    names: Vec<String>,
    /// Whether drive and signal are added.
    more: [bool; 2],
    common: [&'static str; 2],
    added: Vec<&'static str>,
}

impl Kept {
    /// For these rows, with the columns `added`, of which the zero is the first.
    pub fn new(rows: &RowReader<'_>, added: &[&'static str]) -> Self {
        let own = rows.names();
        let common = [rows.lines().drive().column(), rows.who.first().unit.common()];
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
        Self { more, names, common, added: added.to_vec() }
    }

    /// The names of all columns.
    pub fn header(&self, out: &mut Vec<u8>) {
        out.extend(b"line,");
        self.names.iter().for_each(|n| field(out, n));
        self.common.iter().zip(self.more).filter(|(_, more)| *more).for_each(|(c, _)| field(out, c));
        out.extend(self.added.join(",").bytes());
        out.push(b'\n');
    }

    /// A table of these columns without rows, whose added ones are those of `table`. The user's own are words, as they are.
    pub fn frame(&self, table: &Heading) -> Frame {
        let mut frame = Frame::of(&table.file, ["line"]);
        self.names.iter().for_each(|name| frame.add(name.clone(), Values::new(Kind::Word)));
        let common = self.common.iter().zip(self.more).filter(|(_, more)| *more).map(|(name, _)| name);
        for name in common.chain(&self.added) {
            let kind = fact_in(&table.table, name).map_or_else(|| kind(name), |fact| fact.kind);
            frame.add(*name, Values::new(kind));
        }
        frame
    }

    /// A row of it up to the zero.
    pub fn fields(
        &self,
        line: &Line<'_>,
        rows: &RowReader<'_>,
        [drive, signal, zero]: [f64; 3],
    ) -> Vec<Field> {
        let (own, empty) = (rows.fields(line.text.unwrap_or_default()), Cow::Borrowed(""));
        let own = (0..self.names.len()).map(|k| pointed(own.get(k).unwrap_or(&empty)).into_owned().into());
        let more =
            [drive, signal].into_iter().zip(self.more).filter(|(_, more)| *more).map(|(x, _)| x.into());
        std::iter::once(line.number.into()).chain(own).chain(more).chain([zero.into()]).collect()
    }

    /// The fields before the answer; of `drive, signal, zero` what is no number is left empty.
    pub fn row(
        &self,
        out: &mut Vec<u8>,
        line: &Line<'_>,
        rows: &RowReader<'_>,
        [drive, signal, zero]: [f64; 3],
    ) {
        out.extend_from_slice(line.number.to_string().as_bytes());
        out.push(b',');
        let fields = rows.fields(line.text.unwrap_or_default());
        let empty = Cow::Borrowed("");
        for place in 0..self.names.len() {
            field(out, &pointed(fields.get(place).unwrap_or(&empty)));
        }
        [drive, signal].iter().zip(self.more).filter(|(_, more)| *more).for_each(|(x, _)| number(out, *x));
        number(out, zero);
    }
}

/// A field and the comma after it, in quotes where it needs them.
pub(super) fn field(out: &mut Vec<u8>, text: &str) {
    if text.bytes().any(|c| matches!(c, b',' | b'"' | b'\n' | b'\r')) {
        out.push(b'"');
        out.extend_from_slice(text.replace('"', "\"\"").as_bytes());
        out.push(b'"');
    } else {
        out.extend_from_slice(text.as_bytes());
    }
    out.push(b',');
}

/// A number with its decimal comma as a point; anything else as it is.
fn pointed(field: &str) -> Cow<'_, str> {
    let is_number = || fields::number(field).is_some_and(f64::is_finite);
    if field.contains(',') && is_number() { field.replacen(',', ".", 1).into() } else { field.into() }
}
