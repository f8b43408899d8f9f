//! The rows of one table of one part, in order. Rows of CSV are copied; rows of Parquet are regrouped.

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

    fn ends_early(&self) -> Error {
        let error = InputError::new("this table has fewer rows than its places");
        error.at(self.path.display().to_string(), None).allowed("the part as it was written").into()
    }

    /// Copies the next row into `sheet`, or skips it.
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
                match sheet {
                    Sheet::Parquet(writer) if wanted => writer.write(group, *taken - 1..*taken),
                    _ => Ok(()),
                }
            }
        }
    }

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
                    sheet.write(&[group])?;
                }
                Ok(rows)
            }
        }
    }
}
