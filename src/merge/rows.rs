//! The rows of the parts: their order in the whole, and the selection of kept rows; read one by one. Rows of CSV are copied, rows of Parquet
//! regrouped.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;

use super::Part;
use super::part::refuse;
use crate::error::{Error, InputError};
use crate::sink::{Folder, Frame, Sheet, Table, TableFormat, folder::unpack, parquet};
use crate::sweep::{PLACES, Place};

pub(super) struct Order {
    /// Positions of the rows of each part; empty if the parts are consecutive.
    parts: Vec<Vec<Place>>,
    /// The rows that `top` keeps of the whole, if requested: design and stroke.
    kept: Option<BTreeSet<(u64, u32)>>,
}

impl Order {
    pub fn new(parts: &[Part]) -> Result<Self, Error> {
        if !parts[0].lists(PLACES) {
            return Ok(Self { parts: Vec::new(), kept: None });
        }
        let shard = &parts[0].run["shard"];
        let (top, candidates) = (shard["top"].as_u64(), shard["candidates"].as_u64());
        let parts = parts.iter().map(places).collect::<Result<Vec<_>, _>>()?;
        let kept = top.map(|top| kept(&parts, top, candidates));
        Ok(Self { parts, kept })
    }

    pub fn kept(&self) -> Option<usize> {
        self.kept.as_ref().map(BTreeSet::len)
    }

    pub fn write(&self, table: Table, sources: &mut [Source], sheet: &mut Sheet) -> Result<u64, Error> {
        if self.parts.is_empty() {
            let mut rows = 0;
            for source in sources {
                while source.next(true, sheet)? {
                    rows += 1;
                }
            }
            return Ok(rows);
        }
        let is_kept = |place: &Place| match (&self.kept, place.of) {
            (None, _) => true,
            (Some(kept), (k, _)) if table == Table::Distances => {
                kept.range((k, 0)..=(k, u32::MAX)).next().is_some()
            }
            (Some(kept), of) => kept.contains(&of),
        };
        let mut all = Vec::new();
        for (part, places) in self.parts.iter().enumerate() {
            let own = places.iter().filter(|place| place.table == table);
            all.extend(own.map(|place| (place.order, part, is_kept(place))));
        }
        // Stable: the rows of each part are already in order.
        all.sort_by_key(|(order, part, _)| (*order, *part));
        for (_, part, wanted) in &all {
            if !sources[*part].next(*wanted, sheet)? {
                let error = InputError::new("this table has fewer rows than its places");
                let error = error.at(sources[*part].path.display().to_string(), None);
                return Err(error.allowed("the part as it was written").into());
            }
        }
        Ok(all.iter().filter(|(.., wanted)| *wanted).count() as u64)
    }
}

fn places(part: &Part) -> Result<Vec<Place>, Error> {
    let wrong = || refuse(&part.folder, "its places.bin is no list of places", "the part as it was written");
    let ((path, mut file), mut bytes) = (part.file(PLACES)?, Vec::new());
    file.read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    unpack(&bytes).ok_or_else(wrong)
}

/// The `top` best of the solved rows and of the first `candidates` rows by chart, which the whole would have solved.
fn kept(parts: &[Vec<Place>], top: u64, candidates: Option<u64>) -> BTreeSet<(u64, u32)> {
    let rows = parts.iter().flatten().filter(|place| place.table == Table::Designs);
    let (mut solved, mut charted): (Vec<&Place>, Vec<&Place>) =
        rows.partition(|place| place.charted.is_nan());
    charted.sort_by(|a, b| {
        let index = |place: &Place| (place.order.1, place.order.2);
        a.charted.total_cmp(&b.charted).then(index(a).cmp(&index(b)))
    });
    solved.extend(charted.iter().take(candidates.map_or(usize::MAX, |n| n as usize)));
    solved.sort_by_key(|place| place.order);
    solved.iter().take(top as usize).map(|place| place.of).collect()
}

pub(super) struct Source {
    path: PathBuf,
    pub empty: Frame,
    rows: Rows,
}

enum Rows {
    Csv {
        file: BufReader<File>,
        line: Vec<u8>,
    },
    Parquet {
        reader: Box<parquet::Reader>,
        /// The current row group, and the number of its rows already taken.
        group: (Frame, usize),
    },
}

impl Source {
    pub fn open(part: &Part, table: Table) -> Result<Self, Error> {
        let (path, file) = part.file(&table.file(part.format))?;
        let (empty, rows) = match part.format {
            TableFormat::Csv => {
                let (mut file, mut line) = (BufReader::with_capacity(1 << 20, file), Vec::new());
                file.read_until(b'\n', &mut line).map_err(|e| Error::io(&path, e))?;
                let names = String::from_utf8_lossy(&line);
                (Frame::of("", names.trim_end().split(',').map(str::to_owned)), Rows::Csv { file, line })
            }
            TableFormat::Parquet => {
                let reader = Box::new(parquet::Reader::new(&path, file)?);
                (reader.frame(), Rows::Parquet { reader, group: (Frame::default(), 0) })
            }
        };
        Ok(Self { path, empty, rows })
    }

    pub fn sheet(&self, folder: &mut Folder, name: &str) -> Result<Sheet, Error> {
        let (format, provenance) = match &self.rows {
            Rows::Csv { .. } => (TableFormat::Csv, String::new()),
            Rows::Parquet { reader, .. } => (TableFormat::Parquet, reader.provenance()),
        };
        Sheet::new(format, folder.file(name)?, (&self.empty, &provenance), None)
    }

    /// Copies the next row into `sheet`, or skips it; false after the last.
    pub fn next(&mut self, wanted: bool, sheet: &mut Sheet) -> Result<bool, Error> {
        match (&mut self.rows, sheet) {
            (Rows::Csv { file, line }, Sheet::Csv(output)) => {
                line.clear();
                file.read_until(b'\n', line).map_err(|e| Error::io(&self.path, e))?;
                if wanted {
                    output.write(line)?;
                }
                Ok(!line.is_empty())
            }
            (Rows::Parquet { reader, group: (group, taken) }, Sheet::Parquet(writer)) => {
                while *taken == group.len() {
                    let Some(next) = reader.next_group()? else { return Ok(false) };
                    (*group, *taken) = (next, 0);
                }
                *taken += 1;
                if wanted {
                    writer.write(group, *taken - 1..*taken)?;
                }
                Ok(true)
            }
            _ => Err(Error::Run("parts of two formats".into())),
        }
    }
}
