//! The order of the parts' rows in the whole, and the selection of kept rows.

use std::collections::HashSet;

use super::part::{Part, refuse};
use super::source::Source;
use crate::error::Error;
use crate::sink::folder::unpack;
use crate::sink::sheet::Sheet;
use crate::sink::table::Table;
use crate::sweep::{PLACES, Place};

pub(super) struct Order {
    /// Positions of the rows of each part; empty if the parts are consecutive.
    parts: Vec<Vec<Place>>,
    /// The rows that `top` keeps of the whole, if requested.
    kept: Option<Kept>,
}

struct Kept {
    rows: HashSet<(u64, u32)>,
    designs: HashSet<u64>,
}

impl Order {
    pub fn new(parts: &[Part]) -> Result<Self, Error> {
        if !parts[0].lists(PLACES) {
            return Ok(Self { parts: Vec::new(), kept: None });
        }
        let (top, candidates) = (parts[0].number("top"), parts[0].number("candidates"));
        let parts = parts.iter().map(places).collect::<Result<Vec<_>, _>>()?;
        let kept = top.map(|top| Kept::new(&parts, top, candidates));
        Ok(Self { parts, kept })
    }

    pub fn kept(&self) -> Option<usize> {
        self.kept.as_ref().map(|kept| kept.rows.len())
    }

    pub fn write(&self, table: Table, sources: &mut [Source], sheet: &mut Sheet) -> Result<u64, Error> {
        if self.parts.is_empty() {
            return sources.iter_mut().map(|source| source.rest(sheet)).sum();
        }
        let is_kept = |place: &Place| self.kept.as_ref().is_none_or(|kept| kept.has(place));
        let mut all = Vec::new();
        for (part, places) in self.parts.iter().enumerate() {
            let own = places.iter().filter(|place| place.table == table);
            all.extend(own.map(|place| (place.order, part, is_kept(place))));
        }
        // Stable: the rows of each part are already in order.
        all.sort_by_key(|(order, part, _)| (*order, *part));
        all.iter().try_for_each(|(_, part, wanted)| sources[*part].next(*wanted, sheet))?;
        Ok(all.iter().filter(|(.., wanted)| *wanted).count() as u64)
    }
}

fn places(part: &Part) -> Result<Vec<Place>, Error> {
    let wrong = || refuse(&part.folder, "its places.bin is no list of places", "the part as it was written");
    unpack(&part.bytes(PLACES)?).ok_or_else(wrong)
}

impl Kept {
    /// The `top` best of the solved rows and of the first `candidates` rows by chart, which the whole would have solved.
    fn new(parts: &[Vec<Place>], top: u64, candidates: Option<u64>) -> Self {
        let rows = parts.iter().flatten().filter(|place| place.table == Table::Designs);
        let (mut solved, mut charted): (Vec<&Place>, Vec<&Place>) =
            rows.partition(|place| place.charted.is_nan());
        charted.sort_by(|a, b| {
            let index = |place: &Place| (place.order.1, place.order.2);
            a.charted.total_cmp(&b.charted).then(index(a).cmp(&index(b)))
        });
        solved.extend(charted.iter().take(candidates.map_or(usize::MAX, |n| n as usize)));
        solved.sort_by_key(|place| place.order);
        solved.truncate(top as usize);
        Self {
            rows: solved.iter().map(|place| place.of).collect(),
            designs: solved.iter().map(|place| place.of.0).collect(),
        }
    }

    fn has(&self, place: &Place) -> bool {
        match place.table {
            Table::Designs | Table::Tuples => self.rows.contains(&place.of),
            Table::Distances => self.designs.contains(&place.of.0),
        }
    }
}
