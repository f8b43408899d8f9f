//! A table that is being written, in its format: from its first row to its last, also by a run that goes on where another stopped.
//! Each step fails where the file cannot be read or written.

use rayon::prelude::*;

use super::folder::{Folder, Mark, Output};
use super::format::TableFormat;
use super::frame::Frame;
use super::pack::{Packer, Unpacker};
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

    /// Goes on with the table whose [`Self::pack`] is `state`; `None` where it, or the file, is not what it was.
    pub fn resume(
        folder: &mut Folder,
        about: &About<'_>,
        state: &mut Unpacker<'_>,
    ) -> Result<Option<Self>, Error> {
        let Some(mark) = state.take::<Mark>() else { return Ok(None) };
        let Some(output) = folder.file_again(&about.name(), &mark)? else { return Ok(None) };
        Ok(match about.format {
            TableFormat::Csv => Some(Self::Csv(Box::new(output))),
            TableFormat::Parquet => {
                let writer = parquet::Writer::resume(output, about.empty, about.provenance, state)?;
                writer.map(|writer| Self::Parquet(Box::new(writer)))
            }
        })
    }

    /// What [`Self::resume`] needs beside the file as it is now.
    pub fn pack(&mut self, to: &mut Packer<'_>) -> Result<(), Error> {
        to.put(&self.output().mark()?);
        match self {
            Self::Csv(_) => Ok(()),
            Self::Parquet(writer) => writer.pack(to),
        }
    }

    /// Appends the rows of `pieces`, whose text is made in parallel.
    ///
    /// # Errors
    /// A file that cannot be written; other columns.
    pub fn write(&mut self, pieces: &[Frame]) -> Result<(), Error> {
        match self {
            Self::Csv(output) => pieces.chunks(TOGETHER).try_for_each(|some| {
                let texts: Vec<Vec<u8>> = some.par_iter().map(Frame::lines).collect::<Result<_, _>>()?;
                texts.iter().try_for_each(|text| output.write(text))
            }),
            Self::Parquet(writer) => pieces.iter().try_for_each(|piece| writer.write(piece)),
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
