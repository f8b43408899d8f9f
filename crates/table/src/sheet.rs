//! A table that is being written, in its format: from its first row to its last, also by a run that goes on where another stopped.
//! Each step fails where the file cannot be read or written.

use std::ops::Range;

use rayon::prelude::*;

use super::folder::{Folder, Listed, Output};
use super::format::TableFormat;
use super::frame::Frame;
use super::parquet;
use super::table::Table;
use crate::error::Error;

/// Pieces of a table whose text is in memory together.
const TOGETHER: usize = 32;

/// A table on its way to its file.
pub enum Sheet {
    /// Comma-separated text.
    Csv(Box<Output>),
    /// Apache Parquet.
    Parquet(Box<parquet::Writer>),
}

/// What a table is: which one, in which format, and where it comes from.
#[derive(Debug, Clone, Copy)]
pub struct About<'a> {
    /// Which.
    pub table: Table,
    /// It without rows.
    pub empty: &'a Frame,
    /// Format.
    pub format: TableFormat,
    /// What its metadata say, where the format has any.
    pub provenance: &'a str,
}

impl About<'_> {
    /// Name of its file.
    pub fn name(&self) -> String {
        self.table.file(self.format)
    }
}

/// A table so far.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct Mark {
    file: Listed,
    /// What a Parquet file needs beside its bytes.
    more: Option<parquet::More>,
}

impl Sheet {
    /// A new table in `folder`.
    pub fn new(folder: &mut Folder, about: &About<'_>) -> Result<Self, Error> {
        let mut output = folder.file(&about.name())?;
        Ok(match about.format {
            TableFormat::Csv => {
                output.write(&about.empty.header()?)?;
                Self::Csv(Box::new(output))
            }
            TableFormat::Parquet => {
                Self::Parquet(Box::new(parquet::Writer::new(output, about.empty, about.provenance)?))
            }
        })
    }

    /// Continues the table that was `mark`; `None` where it, or the file, is not what it was.
    pub fn resume(folder: &mut Folder, about: &About<'_>, mark: Mark) -> Result<Option<Self>, Error> {
        let Some(output) = folder.file_again(&about.name(), &mark.file)? else { return Ok(None) };
        Ok(match (about.format, mark.more) {
            (TableFormat::Csv, _) => Some(Self::Csv(Box::new(output))),
            (TableFormat::Parquet, None) => None,
            (TableFormat::Parquet, Some(more)) => {
                let writer = parquet::Writer::resume(output, about.empty, about.provenance, more)?;
                writer.map(|writer| Self::Parquet(Box::new(writer)))
            }
        })
    }

    /// What [`Self::resume`] needs.
    pub fn mark(&mut self) -> Result<Mark, Error> {
        let file = self.output().mark()?;
        let more = match self {
            Self::Csv(_) => None,
            Self::Parquet(writer) => Some(writer.more()?),
        };
        Ok(Mark { file, more })
    }

    /// Appends the rows of `pieces`, whose text is made in parallel.
    pub fn write(&mut self, pieces: &[Frame]) -> Result<(), Error> {
        match self {
            Self::Csv(output) => pieces.chunks(TOGETHER).try_for_each(|some| {
                let texts: Vec<Vec<u8>> = some.par_iter().map(Frame::lines).collect::<Result<_, _>>()?;
                texts.iter().try_for_each(|text| output.write(text))
            }),
            Self::Parquet(writer) => pieces.iter().try_for_each(|piece| writer.write(piece, 0..piece.len())),
        }
    }

    /// Appends some rows of another table.
    pub fn copy(&mut self, from: &Frame, rows: Range<usize>) -> Result<(), Error> {
        match self {
            Self::Csv(output) => {
                let mut some = from.like();
                some.extend(from, rows)?;
                output.write(&some.lines()?)
            }
            Self::Parquet(writer) => writer.write(from, rows),
        }
    }

    /// The file on the way.
    pub fn output(&mut self) -> &mut Output {
        match self {
            Self::Csv(output) => output,
            Self::Parquet(writer) => writer.output(),
        }
    }

    /// Ends the file.
    pub fn close(self) -> Result<(), Error> {
        match self {
            Self::Csv(output) => output.close(),
            Self::Parquet(writer) => writer.close(),
        }
    }
}
