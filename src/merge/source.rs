//! The rows of one table of one part, in their order.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::part::Part;
use crate::error::{Error, InputError};
use crate::sink::columns::Columns;
use crate::sink::parquet;
use crate::sink::rows::{Rows, TableFormat};
use crate::sink::sheet::Sheet;
use crate::sink::table::Table;

/// Rows of a table.
pub(super) struct Source {
    pub columns: Vec<String>,
    pub provenance: String,
    path: PathBuf,
    rows: Kind,
}

enum Kind {
    Lines(BufReader<File>),
    Groups { reader: Box<parquet::Reader>, group: Columns, at: usize },
}

/// Bytes that are written together.
const BLOCK: usize = 1 << 20;

impl Source {
    pub fn open(part: &Part, table: Table) -> Result<Self, Error> {
        let (path, file) = part.file(&table.file(part.format))?;
        match part.format {
            TableFormat::Csv => {
                let (mut reader, mut header) = (BufReader::with_capacity(BLOCK, file), String::new());
                reader.read_line(&mut header).map_err(|e| Error::io(&path, e))?;
                let columns = header.trim_end().split(',').map(str::to_owned).collect();
                Ok(Self { columns, provenance: String::new(), path, rows: Kind::Lines(reader) })
            }
            TableFormat::Parquet => {
                let reader = Box::new(parquet::Reader::new(&path, file)?);
                let (columns, provenance) = (reader.columns(), reader.provenance());
                let rows = Kind::Groups { reader, group: Columns::of(&columns), at: 0 };
                Ok(Self { columns, provenance, path, rows })
            }
        }
    }

    /// Passes over the next row, or writes it into `to`: the table, and the rows of Parquet that wait to be written together.
    pub fn next(&mut self, to: Option<(&mut Sheet, &mut Columns)>) -> Result<(), Error> {
        let early = || {
            let error = InputError::new("this table has fewer rows than its places");
            Error::from(error.at(self.path.display().to_string(), None).allowed("the part as it was written"))
        };
        match &mut self.rows {
            Kind::Lines(reader) => {
                let mut line = Vec::new();
                match reader.read_until(b'\n', &mut line).map_err(|e| Error::io(&self.path, e))? {
                    0 => Err(early()),
                    _ => to.map_or(Ok(()), |(sheet, _)| sheet.lines(&line)),
                }
            }
            Kind::Groups { reader, group, at } => {
                while *at == group.len() {
                    (*group, *at) = (next_group(reader, group, &self.path)?.ok_or_else(early)?, 0);
                }
                *at += 1;
                let Some((sheet, batch)) = to else { return Ok(()) };
                batch.extend(group, *at - 1..*at)?;
                match batch.len() >= parquet::GROUP {
                    true => sheet.write(Rows::Columns(batch.take())),
                    false => Ok(()),
                }
            }
        }
    }

    /// All rows that are left, into `sheet`; how many.
    pub fn rest(&mut self, sheet: &mut Sheet) -> Result<u64, Error> {
        let mut rows = 0;
        match &mut self.rows {
            Kind::Lines(reader) => {
                let mut block = vec![0; BLOCK];
                loop {
                    let n = reader.read(&mut block).map_err(|e| Error::io(&self.path, e))?;
                    if n == 0 {
                        return Ok(rows);
                    }
                    rows += block[..n].iter().filter(|b| **b == b'\n').count() as u64;
                    sheet.lines(&block[..n])?;
                }
            }
            Kind::Groups { reader, group, .. } => {
                while let Some(next) = next_group(reader, group, &self.path)? {
                    rows += next.len() as u64;
                    sheet.write(Rows::Columns(next))?;
                }
                Ok(rows)
            }
        }
    }
}

/// The next group of `reader`, whose columns must be of the kinds that `before` has.
fn next_group(reader: &mut parquet::Reader, before: &Columns, path: &Path) -> Result<Option<Columns>, Error> {
    let group = reader.next_group()?;
    if group.as_ref().is_some_and(|group| !before.is_like(group)) {
        let error = InputError::new("these are not the columns of a table of a sweep");
        let error = error.at(path.display().to_string(), None).allowed("the part as it was written");
        return Err(error.into());
    }
    Ok(group)
}
