//! Numbers outside the `usual` range of `keys.toml`, most likely in another unit: they are warned about, never changed.
//!
//! The ranges hold rats' whiskers (D 0.2 mm, L_a 40 mm), rubber rods of 30 mm by 300 mm, and moduli from gelatine to tungsten.

use super::{InputError, Item, Section, Sections, keys, space};
use crate::design::MOST;
use crate::fields::plain;
use crate::scene::{COLUMNS, Column, Drive};

/// The warning about the largest number of a key, if it is outside the usual range of that key.
fn unusual(key: &keys::Key, largest: f64) -> Option<String> {
    let [low, high] = key.usual?;
    let [from, to] = [low, high].map(plain);
    let unit = if key.unit.is_empty() { String::new() } else { format!(" {}", key.unit) };
    // A number beyond every domain has a status; no other unit mends it.
    let outside = 0.0 < largest && largest <= MOST && !(low..=high).contains(&largest);
    outside.then(|| format!("outside the usual {from} … {to}{unit}: is this number in another unit?"))
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

/// The warnings about `item` and the keys of its inline table.
fn warnings(item: &Item<'_>) -> Vec<String> {
    let Some(key) = item.known else { return Vec::new() };
    if key.usual.is_none() {
        let inner = item.table().filter(|_| item.value.is_table()).into_iter().flat_map(keys::Section::names);
        return inner.filter_map(|name| item.child(name)).flat_map(|child| warnings(&child)).collect();
    }
    let largest = numbers(item).into_iter().max_by(|p, q| p.0.total_cmp(&q.0));
    let said = largest.and_then(|(value, part)| Some(part.error(unusual(key, value)?).to_string()));
    said.into_iter().collect()
}

/// The warnings about what is written in these sections.
pub(super) fn of_spec<'a>(sections: &Sections<'a>, names: impl Fn(&str) -> bool) -> Vec<String> {
    let written = |section: Section<'a>| -> Vec<String> {
        let items = section.known.keys.iter().filter_map(|key| section.written(key.name));
        items.flat_map(|item| warnings(&item)).collect()
    };
    keys::sections().filter(|s| names(s.name)).flat_map(|s| written(sections.section(s.name))).collect()
}

/// The warnings about taps that are given one by one, from the `largest` value of each column; `error` places a message.
pub fn of_taps(
    drive: Drive,
    largest: [f64; COLUMNS],
    error: impl Fn(Column, String) -> InputError,
) -> Vec<String> {
    let of = |(section, key, column): space::ColumnKey| {
        let value = largest[column as usize];
        let message = unusual(keys::section(section).key(key)?, value)?;
        Some(error(column, message).value(plain(value)).to_string())
    };
    space::keys(drive).into_iter().filter_map(of).collect()
}
