//! Tuples listed in a CSV file.

use std::borrow::Cow;
use std::io::{BufRead, BufReader, Cursor, Read as _};
use std::path::Path;
use std::sync::Arc;

use super::space::Read;
use super::table::{self, Columns, Header, Source};
use super::{AxisItem, InputError, Item, Result, Sections, properties, usual};
use crate::fields::{fields, separator};
use crate::scene::{Axis, COLUMNS, Column, Drive, Listed, Property, Rigs, Space, Tuple};
use crate::scene::{listed::MOST_ROWS, property::Description, space::MOST_TAPS};
use crate::sink::{Frame, WHISKER};
use crate::text_file::{Limit, TextFile, refused, unread};

const WHAT: &str = "tuple";

/// Columns that may be missing: poles are then upright.
const SPARE: [&str; 2] = ["tilt_deg", "lean_deg"];

/// Properties that a file may have, in the order of their columns, which follow those of a tuple; a file has no scale of a profile.
fn varied() -> impl Iterator<Item = Property> {
    Property::ALL.into_iter().filter(|property| *property != Property::Scale)
}

struct Rows {
    listed: Listed,
    places: Vec<(Property, usize)>,
    rigs: Arc<Rigs>,
    /// Largest value of each column and of each property.
    largest: ([f64; COLUMNS], Vec<f64>),
}

impl Rows {
    fn new(names: &[Cow<'_, str>]) -> Self {
        let there = |(property, _): &(Property, usize)| names.iter().any(|n| n == property.about().column);
        let places: Vec<(Property, usize)> = varied().zip(COLUMNS..).filter(there).collect();
        let properties: Vec<Property> = places.iter().map(|(property, _)| *property).collect();
        let (listed, largest) = (Listed::default(), ([f64::NAN; COLUMNS], vec![0.0; places.len()]));
        Self { listed, largest, rigs: Arc::new(Rigs::listed(properties)), places }
    }

    fn take(&mut self, row: &[f64]) {
        let mut tuple = Tuple::from_array(std::array::from_fn(|k| row[k]));
        self.largest.0 = std::array::from_fn(|k| row[k].max(self.largest.0[k]));
        if !self.places.is_empty() {
            let values: Vec<f64> = self.places.iter().map(|(_, place)| row[*place]).collect();
            for ((value, largest), (property, _)) in values.iter().zip(&mut self.largest.1).zip(&self.places)
            {
                if value.abs() > largest.abs() && property.about().range.holds(*value) {
                    *largest = *value;
                }
            }
            tuple.rig = self.rigs.number(&values);
        }
        // One row more shows that there are too many.
        if self.listed.len() as u64 <= MOST_ROWS {
            self.listed.push(&tuple);
        }
    }

    /// Warns about columns in unusual units; `file` names the file, if there is one.
    fn warn(&self, sections: &Sections<'_>, drive: Drive, file: Option<&str>) {
        let place = |column: Column, what: String| {
            let error = InputError::new(what).key(column.name(drive));
            if let Some(file) = file { error.at(file, None) } else { error }
        };
        sections.warn(usual::of_taps(drive, self.largest.0, place));
    }

    fn read<'a>(self, sections: &Sections<'a>, item: &Item<'a>, header: &Header<'_>) -> Result<Read<'a>> {
        let listed = self.listed;
        let many = listed.len() as u64 > MOST_ROWS;
        item.refuse_if(many, "this file has too many rows", MOST_ROWS.to_string())?;
        short(item, &listed)?;
        let has = |property| self.places.iter().any(|(p, _)| *p == property);
        for (property, _) in &self.places {
            let Description { column, key, section, .. } = *property.about();
            let written = properties::written(sections, *property);
            let unwritten = written.is_none();
            // A number in an inline table is replaced in each row.
            if let Some(other) = written.filter(|_| !key.contains('.') && *property != Property::Modulus) {
                let why = format!("the tuple file of [tuples] has the column {column}");
                return other.refuse(why, "one of the two");
            }
            let coreless = sections.section("whisker").written("core").is_none();
            let beside = |other, column| {
                let allowed = format!("a column {column} beside it, or core = {{ diameter, modulus }}");
                (!has(other) && coreless, allowed)
            };
            let (missing, allowed) = match property {
                Property::Foil => (unwritten, "foil = { stiffness, length, width }".to_owned()),
                Property::Core => beside(Property::CoreModulus, "E_core_MPa"),
                Property::CoreModulus => beside(Property::Core, "core_mm"),
                Property::Modulus => {
                    let material = sections.section("model").written("material");
                    let other = |m: Item<'_>| m.child("hooke").or_else(|| m.child("neo-hookean")).is_none();
                    let laws = "material = { hooke = E } or { neo-hookean = E }";
                    (material.is_some_and(other), laws.to_owned())
                }
                _ => continue,
            };
            let why = format!("the column {column} of this file needs more in [{section}]");
            item.refuse_if(missing, why, allowed)?;
        }
        let axis = |value: &f64| AxisItem { item: item.clone(), axis: Axis::Value(*value) };
        let properties = self.places.iter().map(|(p, _)| *p).zip(self.largest.1.iter().map(axis)).collect();
        let rigs = Some(self.rigs).filter(|rigs| !rigs.properties.is_empty());
        let both = [Column::Tilt, Column::Lean];
        let directions = both.map(|column| header.places[column as usize].is_some());
        let leaning = both.map(|column| listed.has(column).then(|| item.clone()));
        Ok(Read { space: Space::List(listed), directions, leaning, properties, rigs })
    }
}

pub fn read<'a>(sections: &Sections<'a>, item: &Item<'a>, drive: Drive, base: &Path) -> Result<Read<'a>> {
    let path = base.join(item.text()?);
    let label = path.display().to_string();
    let text = TextFile::open(&path, WHAT, Limit::Lines);
    let begun = |text| header(text).map_err(|e| refused(e).unwrap_or_else(|e| unread(WHAT, &label, &e)));
    let (first, text) = text.and_then(begun).map_err(|e| table::named(item, e))?;
    let tips = [WHISKER[1], Column::TipDiameter.name(drive)];
    let written = fields(&first, separator(&first));
    let [now, before] = tips.map(|tip| written.iter().any(|name| name == tip));
    if now && before {
        let error = InputError::new("both of these columns are the diameter of the tip").at(label, None);
        return Err(table::named(item, error.key(tips.join(", ")).allowed("one of them")));
    }
    let tip = tips[usize::from(!now)];
    let [names, spare] = names(drive, tip);
    let columns = Columns { names: &names, spare: &spare, allowed };
    let mut all = Rows::new(&written);
    let mut row = |values: &[f64], _| all.take(values);
    let header = table::scan(Source::File(&path), (text, separator(&first)), columns, &mut row)?;
    sections.warn(header.warning(&label));
    all.warn(sections, drive, Some(&label));
    all.read(sections, item, &header)
}

fn short(item: &Item<'_>, listed: &Listed) -> Result<()> {
    if listed.len() as u64 <= MOST_TAPS {
        return Ok(());
    }
    let groups = listed.groups();
    let mut taps = vec![0u64; groups.counts[0] as usize];
    groups.designs.iter().for_each(|k| taps[*k as usize] += 1);
    let n = taps.into_iter().max().unwrap_or(0);
    let allowed =
        format!("{MOST_TAPS} rows of a design at most: fewer distances or drives, or several files");
    item.refuse_if(n > MOST_TAPS, format!("one design of this file has {n} rows"), allowed)
}

/// Names of the columns, with `tip` for the diameter of the tip, and those that may be missing.
fn names(drive: Drive, tip: &'static str) -> [Vec<&'static str>; 2] {
    let own = Column::ALL.map(|column| if column == Column::TipDiameter { tip } else { column.name(drive) });
    let names: Vec<&str> = own.into_iter().chain(varied().map(|property| property.about().column)).collect();
    let spare = [&SPARE, &names[COLUMNS..]].concat();
    [names, spare]
}

pub(super) fn of_frame<'a>(sections: &Sections<'a>, drive: Drive, frame: &Frame) -> Result<Read<'a>> {
    let [names, spare] = names(drive, WHISKER[1]);
    let columns = Columns { names: &names, spare: &spare, allowed };
    let mut all = Rows::new(&frame.names);
    let header = table::of_frame(frame, columns, &mut |values, _| all.take(values));
    let header = header.map_err(|e| InputError { key: e.key.map(|key| format!("tuples.{key}")), ..e })?;
    all.warn(sections, drive, None);
    all.read(sections, &sections.of_tuples(), &header)
}

fn header<R: std::io::Read>(text: R) -> std::io::Result<(String, impl std::io::Read)> {
    let (mut text, mut read, mut line) = (BufReader::new(text), Vec::new(), String::new());
    loop {
        let from = read.len();
        let end = text.read_until(b'\n', &mut read)? == 0;
        line.clear();
        line += String::from_utf8_lossy(&read[from..]).trim_start_matches('\u{feff}');
        if end || !line.trim().is_empty() && !line.starts_with('#') {
            return Ok((line, Cursor::new(read).chain(text)));
        }
    }
}

fn allowed(column: &str) -> &'static str {
    match varied().find(|property| property.about().column == column) {
        Some(property) => property.about().allowed,
        None if column.ends_with("_deg") => "a number in degrees, no unit",
        None => "a number in mm, no unit",
    }
}
