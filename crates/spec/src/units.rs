//! Numbers that were probably meant in another unit: metres, micrometres, pascals, microstrain, radians, percent.
//!
//! They are warned about, never changed. The bounds leave room for every whisker and rod, from a rat's (D 0.2 mm, L_a 40 mm) to rubber
//! of 30 mm by 300 mm, and for moduli from 0.05 MPa to those of steel, 200 000 MPa. Lengths are judged beside each other where they can be: one
//! that is written in metres among millimetres is at most a thousandth of the others.

use super::reader::Item;
use super::sections::Sections;
use super::space::keys;
use crate::design::MOST;
use crate::error::InputError;
use crate::scene::{Column, Drive, Material, Spec, Study, Tuple};

/// Why a number is doubted, how many of the right unit one of the other unit is, and the other unit.
#[derive(Debug)]
struct Doubt {
    why: &'static str,
    factor: f64,
    other: &'static str,
}

const fn doubt(why: &'static str, factor: f64, other: &'static str) -> Option<Doubt> {
    Some(Doubt { why, factor, other })
}

impl Doubt {
    /// In a sentence; `value` is in `unit`.
    fn say(&self, value: f64, unit: &str) -> String {
        let Self { why, factor, other } = self;
        let meant: f64 = format!("{:.4e}", value * factor).parse().unwrap_or(f64::NAN);
        let meant = if meant < 1e-3 { format!("{meant:e}") } else { shown(meant) };
        format!("{}{unit} {why}; is it {meant}{unit}, written in {other}?", shown(value))
    }
}

/// A number without a row of zeros.
fn shown(value: f64) -> String {
    if (1e-9..1e12).contains(&value) { value.to_string() } else { format!("{value:e}") }
}

/// Ends of the lengths beside which others are judged, mm; NaN where they are not known, or doubted themselves.
struct Beside {
    length: [f64; 2],
    base: [f64; 2],
    distance: [f64; 2],
}

impl Beside {
    fn new(ends: impl Fn(Column) -> [f64; 2]) -> Self {
        let none = [f64::NAN; 2];
        let mut beside = Self { length: none, base: none, distance: none };
        let sound = |column, beside: &Self| {
            let ends = ends(column);
            if ends.iter().any(|v| length(column, *v, beside).is_some()) { none } else { ends }
        };
        beside.length = sound(Column::Length, &beside);
        beside.base = sound(Column::BaseDiameter, &beside);
        beside.distance = sound(Column::Distance, &beside);
        beside
    }

    fn of(study: &Study) -> Self {
        Self::new(|column| study.space.axis(column).map_or([f64::NAN; 2], |axis| [axis.min(), axis.max()]))
    }
}

/// Whether `v` mm is doubtful as a length of this kind. A comparison with what is not known is false.
#[inline(always)] // Taps that are given by millions are judged one by one.
fn length(column: Column, v: f64, beside: &Beside) -> Option<Doubt> {
    let ([shortest, longest], [thinnest, thickest]) = (beside.length, beside.base);
    let metres = |why| doubt(why, 1e3, "metres");
    let micrometres = |why| doubt(why, 1e-3, "micrometres");
    match column {
        Column::Length if v < 1.0 => metres("is shorter than any whisker"),
        Column::Length if v > 5e3 => micrometres("is longer than any whisker"),
        Column::BaseDiameter if v < 0.02 => metres("is thinner than a hair"),
        // A fibre of 0.1 mm and 100 mm length has 1/1000.
        Column::BaseDiameter if 1500.0 * v < shortest => metres("is less than 1/1500 of the length"),
        Column::BaseDiameter if v > 500.0 => micrometres("is thicker than any whisker"),
        Column::BaseDiameter if v > 2.0 * longest => micrometres("is more than twice the length"),
        // A rat's whisker ends at 1/50 of its base.
        Column::TipDiameter if 700.0 * v < thinnest => metres("is less than 1/700 of D"),
        Column::TipDiameter if v > 10.0 * thickest => micrometres("is more than ten times D"),
        // No gauge in metres has a grid or a place of more than 0.2.
        Column::GaugePosition | Column::GridLength if v > 0.2 => None,
        Column::GaugePosition | Column::GridLength | Column::Distance if v > 0.0 && 1e3 * v <= shortest => {
            metres("is at most 1/1000 of the length")
        }
        Column::Drive if v < 2e-4 * beside.distance[0] => metres("is less than 1/5000 of the distance"),
        _ => None,
    }
}

/// The warnings about a spec; numbers that stand in none are not doubted.
pub(super) fn doubts(sections: &Sections<'_>, spec: &Spec) -> Vec<String> {
    let study = &spec.study;
    let written = |section, key| sections.section(section).written(key);
    let beside = Beside::of(study);
    let mut said = Vec::new();
    let more = [
        ("whisker", "hub", Column::GaugePosition),
        ("model", "pole_radius", Column::GaugePosition),
        ("estimate", "range", Column::Distance),
    ];
    for (section, key, column) in keys(study.setup.drive).into_iter().chain(more) {
        said.extend(written(section, key).and_then(|item| doubted(&item, column, study, &beside)));
    }
    let wide = [
        ("whisker", "hub", 20.0, "is more than twenty times the length"),
        ("model", "pole_radius", 5.0, "is more than five times the length"),
    ];
    for (section, key, most, why) in wide {
        said.extend(written(section, key).and_then(|item| {
            let v = item.number().ok().filter(|v| *v > most * beside.length[1])?;
            warning(&item, doubt(why, 1e-3, "micrometres")?, v, " mm")
        }));
    }
    for key in ["noise_strain", "factor", "strain_limit"] {
        said.extend(written("gauge", key).and_then(|item| doubted_alone(&item, key)));
    }
    said.extend(written("model", "material").and_then(|item| material(&item, spec)));
    said
}

pub(super) fn of_search(sections: &Sections<'_>, study: &Study) -> Vec<String> {
    let beside = Beside::of(study);
    let [variables, limits] = ["variables", "limits"].map(|key| sections.section("optimise").written(key));
    let bounds = |key: &str| variables.as_ref()?.child(key);
    let doubts = |(_, key, column)| doubted(&bounds(key)?, column, study, &beside);
    let mut said: Vec<String> = keys(study.setup.drive).into_iter().filter_map(doubts).collect();
    said.extend(limits.and_then(|table| doubted_alone(&table.child("strain")?, "strain_limit")));
    said
}

/// The numbers of a value, a list, an axis or bounds, each at its place.
fn numbers<'a>(item: &Item<'a>) -> Vec<(f64, Item<'a>)> {
    let parts: Vec<Item<'a>> = match item.elements() {
        Some(elements) => elements.collect(),
        None if item.value.is_table() => {
            ["from", "to", "min", "max"].into_iter().filter_map(|key| item.child(key)).collect()
        }
        None => vec![item.clone()],
    };
    parts.into_iter().filter_map(|part| Some((part.number().ok()?, part))).collect()
}

/// The warning about numbers of this column.
fn doubted(item: &Item<'_>, column: Column, study: &Study, beside: &Beside) -> Option<String> {
    let mut numbers = numbers(item).into_iter();
    if column == Column::Drive && study.setup.drive == Drive::Angle {
        let (largest, part) = numbers.max_by(|a, b| a.0.total_cmp(&b.0))?;
        return warning(&part, angle(largest)?, largest, "°");
    }
    numbers.find_map(|(v, part)| warning(&part, length(column, v, beside)?, v, " mm"))
}

/// Whether angles up to `largest` degrees are doubtful: 0.2 rad is 11°.
fn angle(largest: f64) -> Option<Doubt> {
    let radians = doubt("is hardly a tap", 180.0 / std::f64::consts::PI, "radians");
    radians.filter(|_| largest < 0.2)
}

/// The warning about the number of a `key` that stands beside no other.
fn doubted_alone(item: &Item<'_>, key: &str) -> Option<String> {
    let v = item.number().ok()?;
    let slip = match key {
        "noise_strain" if v > 0.0 && v < 1e-12 => {
            let why = "this is less noise than any gauge has; 0 says that there is none";
            return Some(item.error(why).to_string());
        }
        "noise_strain" if v > 2e-3 => doubt("is more strain than most taps make", 1e-3, "millistrain"),
        "factor" if v < 1e-4 => doubt("is no gauge's factor", 1e6, "1/microstrain"),
        "factor" if v < 0.05 => doubt("is no gauge's factor", 1e3, "1/millistrain"),
        // Silicon has 175.
        "factor" if v > 200.0 => doubt("is more than any gauge's factor", 1e-2, "percent"),
        "strain_limit" if v > 100.0 && v <= 1e6 => {
            doubt("is a strain of more than 100 %", 1e-6, "microstrain")
        }
        "strain_limit" if v > 1.0 && v <= 100.0 => doubt("is a strain of more than 100 %", 1e-2, "percent"),
        _ => None,
    };
    warning(item, slip?, v, "")
}

fn material(item: &Item<'_>, spec: &Spec) -> Option<String> {
    let material = &spec.study.setup.model.material;
    let (e0, rubber) = (material.e0(), !matches!(material, Material::Hooke(_)));
    // Rubber tears at some 10.
    let torn = spec.material_fit.as_ref().map(|fit| fit.range[1]).filter(|strain| *strain > 12.0);
    if let Some(strain) = torn {
        return warning(item, doubt("is a strain at which rubber is torn", 1e-2, "percent")?, strain, "");
    }
    let slip = match e0 {
        // Gelatine has 0.01 MPa, tungsten 411 000 MPa; the softest rubber fewer than 20 000 kPa.
        _ if e0 < 5e-3 => doubt("is softer than gelatine", 1e3, "GPa"),
        _ if rubber && e0 > 2e4 => doubt("is stiffer than any rubber", 1e-6, "pascals"),
        _ if rubber && e0 > 1e3 => doubt("is stiffer than any rubber", 1e-3, "kPa"),
        _ if e0 > 4.2e5 => doubt("is stiffer than tungsten", 1e-6, "pascals"),
        _ => None,
    };
    warning(item, slip?, e0, " MPa")
}

/// What is said of the `value` at `item`.
fn warning(item: &Item<'_>, doubt: Doubt, value: f64, unit: &str) -> Option<String> {
    Some(item.error(doubt.say(value, unit)).to_string())
}

/// Least and largest value of each column, numbers alone.
pub type Ends = [[f64; 2]; 9];

/// Those of no row.
pub const NO_ENDS: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// `ends` with `v` among what lies between them.
#[inline(always)]
pub fn widened([least, most]: [f64; 2], v: f64) -> [f64; 2] {
    [if v < least { v } else { least }, if v > most { v } else { most }]
}

/// The warnings about `n` taps that are given one by one, `tap(i)` being tap i, all of them within `ends` where these are known; `key` names a column.
pub fn of_taps(
    drive: Drive,
    n: usize,
    ends: Option<Ends>,
    tap: impl Fn(usize) -> Tuple,
    key: impl Fn(Column) -> String,
) -> Vec<String> {
    let mut rows = DoubtfulRows::new(drive);
    if !ends.is_some_and(|ends| rows.are_sure(n, &ends)) {
        (0..n).for_each(|i| rows.take(&tap(i), i));
    }
    rows.said(|column, value, words, _| InputError::new(words).key(key(column)).value(shown(value)))
}

/// What is doubtful in rows of taps: the first of it is told, and how many rows are like it.
#[derive(Debug)]
pub(crate) struct DoubtfulRows {
    drive: Drive,
    rows: u64,
    doubted: u64,
    /// Column, value, doubt and place of the first.
    first: Option<(Column, f64, Doubt, usize)>,
    largest: f64,
}

impl DoubtfulRows {
    pub fn new(drive: Drive) -> Self {
        Self { drive, rows: 0, doubted: 0, first: None, largest: f64::NEG_INFINITY }
    }

    /// Whether nothing is doubtful in the next `count` rows, whose columns lie between `ends`: then they are counted.
    fn are_sure(&mut self, count: usize, ends: &Ends) -> bool {
        // The longest stands where the shortest is asked for.
        let beside = Beside::new(|column| [1, 0].map(|k| ends[column as usize][k]));
        let sure = |column: &Column| {
            let ends = ends[*column as usize];
            matches!(column, Column::Tilt | Column::Lean)
                || ends[0] > 0.0 && ends.iter().all(|v| length(*column, *v, &beside).is_none())
        };
        let drives = ends[Column::Drive as usize];
        let all = self.lengths().iter().all(sure) && drives.iter().all(|drive| admissible(*drive));
        if all {
            self.rows += count as u64;
            self.largest = self.largest.max(drives[1]);
        }
        all
    }

    fn lengths(&self) -> &'static [Column] {
        match self.drive {
            Drive::Angle => &Column::ALL[..6],
            Drive::Displacement => &Column::ALL,
        }
    }

    /// The next row, which starts at `place`.
    pub fn take(&mut self, tuple: &Tuple, place: usize) {
        self.rows += 1;
        if admissible(tuple.drive) {
            self.largest = self.largest.max(tuple.drive);
        }
        let values = tuple.to_array();
        let beside = Beside::new(|column| [values[column as usize]; 2]);
        let slip = |column: &Column| {
            let v = values[*column as usize];
            Some((*column, v, length(*column, v, &beside).filter(|_| admissible(v))?, place))
        };
        if let Some(first) = self.lengths().iter().find_map(slip) {
            self.doubted += 1;
            self.first.get_or_insert(first);
        }
    }

    /// The warnings, one for lengths and one for angles; `line` finds the line of a place in `file`.
    pub fn doubts(self, file: &str, line: impl Fn(usize) -> Option<usize>) -> Vec<String> {
        let drive = self.drive;
        self.said(|column, value, words, place| {
            InputError::new(words).at(file, place.and_then(&line)).key(column.name(drive)).value(shown(value))
        })
    }

    /// The warnings as `say` makes them of column, value, words and, where there is one, the place.
    fn said(self, say: impl Fn(Column, f64, String, Option<usize>) -> InputError) -> Vec<String> {
        let Self { drive, rows, doubted, first, largest } = self;
        let among = |words: String, what: String| if rows > 1 { words + &what } else { words };
        let lengths = first.map(|(column, v, doubt, place)| {
            let words = among(doubt.say(v, " mm"), format!(" ({doubted} of {rows} rows)"));
            say(column, v, words, Some(place))
        });
        let angles = angle(largest).filter(|_| drive == Drive::Angle && largest > 0.0);
        let angles = angles.map(|doubt| {
            say(Column::Drive, largest, among(doubt.say(largest, "°"), " (the largest)".into()), None)
        });
        lengths.into_iter().chain(angles).map(|error| error.to_string()).collect()
    }
}

/// Whether a value may be right: what is outside every domain has a status, and no unit that would mend it.
fn admissible(v: f64) -> bool {
    v > 0.0 && v <= MOST
}
