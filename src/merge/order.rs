//! In which order the rows of the parts follow each other in the whole, and which of them are in it.

use std::collections::HashSet;

use super::part::Part;
use super::source::Source;
use crate::error::{Error, InputError};
use crate::sink::folder::unpack;
use crate::sink::sheet::Sheet;
use crate::sink::table::Table;
use crate::sweep::{PLACES, Place};

/// By what rows are ordered.
type Key = [u64; 3];

/// Orders of all tables.
pub(super) enum Orders {
    /// One part behind the other.
    Behind,
    /// By their places: of every part, those of each table.
    Places { parts: Vec<[Vec<Place>; 3]>, kept: Option<Kept>, distances: Option<[u64; 2]> },
}

/// The rows that `top` keeps of the whole.
pub(super) struct Kept {
    /// Place of their design and drive, or first row in the tuple file.
    rows: HashSet<(u64, u32)>,
    /// First row of each in the tuple file.
    firsts: HashSet<u64>,
    /// Their designs.
    designs: HashSet<u64>,
}

/// Numbers that are ordered as `x` is by `total_cmp`.
pub fn ordered(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

impl Orders {
    pub fn new(parts: &[Part]) -> Result<Self, Error> {
        if !parts[0].files().any(|path| path.ends_with(PLACES)) {
            return Ok(Self::Behind);
        }
        let places = parts.iter().map(places).collect::<Result<Vec<_>, _>>()?;
        let kept = parts[0].number("top").map(|top| kept(&places, top, parts[0].number("candidates")));
        let directions = parts[0].number("directions_each").unwrap_or(1);
        let distances = parts[0].number("distances_each").map(|n| [n, directions]);
        Ok(Self::Places { parts: places, kept, distances })
    }

    /// How many rows `top` keeps; `None` where it is not asked for.
    pub fn kept(&self) -> Option<u64> {
        match self {
            Self::Places { kept: Some(kept), .. } => Some(kept.rows.len() as u64),
            _ => None,
        }
    }

    /// Writes the rows of `table`; how many.
    pub fn write(&self, table: Table, sources: &mut [Source], sheet: &mut Sheet) -> Result<u64, Error> {
        let Self::Places { parts, kept, distances } = self else {
            return sources.iter_mut().map(|source| source.rest(sheet)).sum();
        };
        let mut all = Vec::new();
        for (p, places) in parts.iter().enumerate() {
            let keys = keys(table, places, kept.as_ref(), *distances).into_iter();
            all.extend(keys.map(|(key, wanted)| (key, p, wanted)));
        }
        // The rows of a part are in order already, and stay so.
        all.sort_by_key(|(key, p, _)| (*key, *p));
        all.iter().try_for_each(|(_, p, wanted)| sources[*p].next(*wanted, sheet))?;
        Ok(all.iter().filter(|(.., wanted)| *wanted).count() as u64)
    }
}

/// The places of a part, by table.
fn places(part: &Part) -> Result<[Vec<Place>; 3], Error> {
    let all = unpack::<Place>(&part.bytes(PLACES)?).ok_or_else(|| {
        let path = part.folder.join(PLACES).display().to_string();
        InputError::new("this is not a list of places").at(path, None).allowed("the part as it was written")
    })?;
    let mut by_table = [const { Vec::new() }; 3];
    all.into_iter().for_each(|place| by_table[place.table as usize].push(place));
    Ok(by_table)
}

/// The rows kept of the whole: of the candidates that its chart would have brought back, and of the rows that were solved, the best.
fn kept(parts: &[[Vec<Place>; 3]], top: u64, candidates: Option<u64>) -> Kept {
    let all = || parts.iter().flat_map(|places| &places[Table::Designs as usize]);
    let mut charted: Vec<&Place> = all().filter(|place| !place.charted.is_nan()).collect();
    charted.sort_by(|a, b| a.charted.total_cmp(&b.charted).then(a.index.cmp(&b.index)));
    charted.truncate(candidates.map_or(usize::MAX, |n| n as usize));
    charted.extend(all().filter(|place| place.charted.is_nan()));
    charted.sort_by(|a, b| a.rank.total_cmp(&b.rank).then(a.index.cmp(&b.index)));
    charted.truncate(top as usize);
    Kept {
        rows: charted.iter().map(|place| place.index).collect(),
        firsts: charted.iter().map(|place| place.index.0).collect(),
        designs: charted.iter().map(|place| place.owner).collect(),
    }
}

/// The rows of a table of a part, in its order: where each stands, and whether it is wanted.
fn keys(
    table: Table,
    places: &[Vec<Place>; 3],
    kept: Option<&Kept>,
    distances: Option<[u64; 2]>,
) -> Vec<(Key, bool)> {
    let designs = &places[Table::Designs as usize];
    let is_kept = |index: (u64, u32)| kept.is_none_or(|kept| kept.rows.contains(&index));
    let design_kept = |owner: u64| kept.is_none_or(|kept| kept.designs.contains(&owner));
    let listed = |wanted: &dyn Fn(&Place) -> bool| {
        let key = |place: &Place| ([ordered(place.rank), place.index.0, place.index.1.into()], wanted(place));
        places[table as usize].iter().map(key).collect()
    };
    match (table, distances) {
        (Table::Designs, _) => listed(&|place| is_kept(place.index)),
        (Table::Tuples, None) => listed(&|place| kept.is_none_or(|kept| kept.firsts.contains(&place.owner))),
        (Table::Distances, None) => listed(&|place| design_kept(place.owner)),
        // Of a grid: designs in order, then distances, then the strokes that the part kept, or all directions.
        (_, Some([n, directions])) => {
            let mut indices: Vec<(u64, u32)> = designs.iter().map(|place| place.index).collect();
            indices.sort_unstable();
            let design = |rows: &[(u64, u32)]| -> Vec<(Key, bool)> {
                let k = rows[0].0;
                let taps = |i: u64| rows.iter().map(move |&(_, j)| ([k, i, j.into()], is_kept((k, j))));
                match table {
                    Table::Tuples => (0..n).flat_map(taps).collect(),
                    _ => (0..n * directions).map(|i| ([k, i, 0], design_kept(k))).collect(),
                }
            };
            indices.chunk_by(|a, b| a.0 == b.0).flat_map(design).collect()
        }
    }
}
