//! The rows of one table of one part, in their order.

use std::fs::File;
use std::path::PathBuf;

use super::part::Part;
use crate::error::{Error, InputError};
use crate::sink::format::TableFormat;
use crate::sink::frame::Frame;
use crate::sink::sheet::Sheet;
use crate::sink::table::Table;
use crate::sink::{parquet, read};

/// Rows of CSV that are read together.
const BLOCK: usize = 1 << 12;
/// Blocks whose text is made in parallel.
const TOGETHER: usize = 16;

/// Rows of a table.
pub(super) struct Source {
    /// It without rows.
    pub empty: Frame,
    pub provenance: String,
    path: PathBuf,
    rows: Rows,
    /// Rows that were read, and how many of them were taken.
    block: (Frame, usize),
}

enum Rows {
    Csv(read::Rows<File>),
    Parquet(Box<parquet::Reader>),
}

impl Source {
    pub fn open(part: &Part, table: Table) -> Result<Self, Error> {
        let (path, file) = part.file(&table.file(part.format))?;
        let (empty, provenance, rows) = match part.format {
            TableFormat::Csv => {
                let rows = read::Rows::new(&path.display().to_string(), file)?;
                (rows.empty(), String::new(), Rows::Csv(rows))
            }
            TableFormat::Parquet => {
                let reader = Box::new(parquet::Reader::new(&path, file)?);
                let empty = reader.frame();
                if !empty.is_like(&Frame::of("", empty.names.clone())) {
                    let error = InputError::new("these are not the columns of a table of a sweep");
                    let error = error.at(empty.file, None).allowed("the part as it was written");
                    return Err(error.into());
                }
                (empty, reader.provenance(), Rows::Parquet(reader))
            }
        };
        Ok(Self { block: (empty.clone(), 0), empty, provenance, path, rows })
    }

    /// The next rows; `None` after the last.
    fn next_block(&mut self) -> Result<Option<Frame>, Error> {
        match &mut self.rows {
            Rows::Csv(rows) => {
                let block = rows.next(BLOCK)?;
                block.iter().try_for_each(Frame::whole)?;
                Ok(block)
            }
            Rows::Parquet(reader) => reader.next_group(),
        }
    }

    /// Takes the next row into `batch`, or passes over it.
    pub fn next(&mut self, batch: Option<&mut Frame>) -> Result<(), Error> {
        while self.block.1 == self.block.0.len() {
            let block = self.next_block()?.ok_or_else(|| {
                let error = InputError::new("this table has fewer rows than its places");
                error.at(self.path.display().to_string(), None).allowed("the part as it was written")
            })?;
            self.block = (block, 0);
        }
        let (block, at) = &mut self.block;
        *at += 1;
        batch.map_or(Ok(()), |batch| batch.extend(block, *at - 1..*at))
    }

    /// All rows, into `sheet`; how many.
    pub fn rest(&mut self, sheet: &mut Sheet) -> Result<u64, Error> {
        let (mut rows, mut blocks) = (0, Vec::new());
        loop {
            let block = self.next_block()?;
            let last = block.is_none();
            blocks.extend(block);
            if last || blocks.len() == TOGETHER {
                rows += blocks.iter().map(|block| block.len() as u64).sum::<u64>();
                sheet.write(&blocks)?;
                blocks.clear();
            }
            if last {
                return Ok(rows);
            }
        }
    }
}
