//! The rows of one table of one part, in their order. Rows of CSV are copied as they are; those of Parquet are put into groups anew.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;

use super::part::Part;
use crate::error::{Error, InputError};
use crate::sink::folder::Folder;
use crate::sink::format::TableFormat;
use crate::sink::frame::Frame;
use crate::sink::parquet;
use crate::sink::sheet::Sheet;
use crate::sink::table::Table;

/// Rows of a table.
pub(super) struct Source {
    path: PathBuf,
    /// Its header, as a line of CSV.
    pub header: Vec<u8>,
    rows: Rows,
}

enum Rows {
    Csv {
        file: BufReader<File>,
        /// The last row.
        line: Vec<u8>,
    },
    Parquet {
        reader: Box<parquet::Reader>,
        /// Rows that were read, and how many of them were taken.
        group: (Frame, usize),
    },
}

impl Source {
    pub fn open(part: &Part, table: Table) -> Result<Self, Error> {
        let (path, file) = part.file(&table.file(part.format))?;
        let mut header = Vec::new();
        let rows = match part.format {
            TableFormat::Csv => {
                let mut file = BufReader::with_capacity(1 << 20, file);
                file.read_until(b'\n', &mut header).map_err(|e| Error::io(&path, e))?;
                Rows::Csv { file, line: Vec::new() }
            }
            TableFormat::Parquet => {
                let reader = Box::new(parquet::Reader::new(&path, file)?);
                header = reader.frame().header()?;
                Rows::Parquet { reader, group: (Frame::default(), 0) }
            }
        };
        Ok(Self { path, header, rows })
    }

    /// A table `name` in `folder` with the same columns, from the same place.
    pub fn sheet(&self, folder: &mut Folder, name: &str) -> Result<Sheet, Error> {
        let mut output = folder.file(name)?;
        Ok(match &self.rows {
            Rows::Csv { .. } => {
                output.write(&self.header)?;
                Sheet::Csv(Box::new(output))
            }
            Rows::Parquet { reader, .. } => {
                let writer = parquet::Writer::new(output, &reader.frame(), &reader.provenance())?;
                Sheet::Parquet(Box::new(writer))
            }
        })
    }

    fn ends_early(&self) -> Error {
        let error = InputError::new("this table has fewer rows than its places");
        error.at(self.path.display().to_string(), None).allowed("the part as it was written").into()
    }

    /// Takes the next row into `sheet`, or passes over it.
    pub fn next(&mut self, wanted: bool, sheet: &mut Sheet) -> Result<(), Error> {
        match &mut self.rows {
            Rows::Csv { file, line } => {
                line.clear();
                match file.read_until(b'\n', line).map_err(|e| Error::io(&self.path, e))? {
                    0 => Err(self.ends_early()),
                    _ if wanted => sheet.output().write(line),
                    _ => Ok(()),
                }
            }
            Rows::Parquet { reader, group: (group, taken) } => {
                while *taken == group.len() {
                    (*group, *taken) = match reader.next_group()? {
                        Some(next) => (next, 0),
                        None => return Err(self.ends_early()),
                    };
                }
                *taken += 1;
                if wanted { sheet.copy(group, *taken - 1..*taken) } else { Ok(()) }
            }
        }
    }

    /// All rows, into `sheet`; how many.
    pub fn rest(&mut self, sheet: &mut Sheet) -> Result<u64, Error> {
        let mut rows = 0;
        match &mut self.rows {
            Rows::Csv { file, .. } => loop {
                let block = file.fill_buf().map_err(|e| Error::io(&self.path, e))?;
                if block.is_empty() {
                    return Ok(rows);
                }
                rows += block.iter().filter(|b| **b == b'\n').count() as u64;
                sheet.output().write(block)?;
                let n = block.len();
                file.consume(n);
            },
            Rows::Parquet { reader, .. } => {
                while let Some(group) = reader.next_group()? {
                    rows += group.len() as u64;
                    sheet.copy(&group, 0..group.len())?;
                }
                Ok(rows)
            }
        }
    }
}
