//! In which order the rows of the parts follow each other in the whole, and which of them are in it.

use std::collections::HashSet;

use super::part::{Part, refuse};
use super::source::Source;
use crate::error::Error;
use crate::sink::folder::unpack;
use crate::sink::sheet::Sheet;
use crate::sink::table::Table;
use crate::sweep::{PLACES, Place};

/// The order of the rows of all tables.
pub(super) struct Order {
    /// The places of the rows of each part; none where one part simply follows the other.
    parts: Vec<Vec<Place>>,
    /// The rows that `top` keeps of the whole, where it is asked for.
    kept: Option<Kept>,
}

struct Kept {
    /// Designs and strokes.
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

    /// How many rows `top` keeps; `None` where it is not asked for.
    pub fn kept(&self) -> Option<usize> {
        self.kept.as_ref().map(|kept| kept.rows.len())
    }

    /// Writes the rows of `table`; how many.
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
        // The rows of a part are in order already, and stay so.
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
    /// Of the `candidates` that the chart of the whole would have brought back, and of the rows that were solved, the `top` best.
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
