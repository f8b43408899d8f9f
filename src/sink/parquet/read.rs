//! A Parquet file of this program, read row group by row group.

use std::fs::File;
use std::path::{Path, PathBuf};

use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};

use crate::error::Error;
use crate::sink::columns::{Columns, Values, Words};

/// Rows of a table in their order.
pub struct Reader {
    path: PathBuf,
    file: SerializedFileReader<File>,
    next: usize,
}

impl Reader {
    /// Of `file`, which is at `path`.
    ///
    /// # Errors
    /// What is no Parquet file.
    pub fn new(path: &Path, file: File) -> std::result::Result<Self, Error> {
        let file = SerializedFileReader::new(file).map_err(|e| unreadable(path, &e))?;
        Ok(Self { path: path.to_owned(), file, next: 0 })
    }

    /// Names of its columns.
    pub fn columns(&self) -> Vec<String> {
        let schema = self.file.metadata().file_metadata().schema_descr();
        schema.columns().iter().map(|column| column.name().to_owned()).collect()
    }

    /// What it says of where it comes from.
    pub fn provenance(&self) -> String {
        let facts = self.file.metadata().file_metadata().key_value_metadata();
        let fact = facts.into_iter().flatten().find(|fact| fact.key == super::PROVENANCE);
        fact.and_then(|fact| fact.value.clone()).unwrap_or_default()
    }

    /// The rows of the next group; `None` after the last.
    ///
    /// # Errors
    /// A damaged file.
    pub fn next_group(&mut self) -> std::result::Result<Option<Columns>, Error> {
        if self.next == self.file.num_row_groups() {
            return Ok(None);
        }
        let group = self.file.get_row_group(self.next).and_then(|group| columns(&*group));
        self.next += 1;
        group.map(Some).map_err(|e| unreadable(&self.path, &e))
    }
}

fn unreadable(path: &Path, e: &ParquetError) -> Error {
    Error::io(path, std::io::Error::other(e.to_string()))
}

fn columns(group: &dyn RowGroupReader) -> Result<Columns> {
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    (0..group.num_columns())
        .map(|at| column(group.get_column_reader(at)?, rows))
        .collect::<Result<_>>()
        .map(Columns)
}

fn column(reader: ColumnReader, rows: usize) -> Result<Values> {
    Ok(match reader {
        ColumnReader::DoubleColumnReader(reader) => {
            let known = read(reader, rows)?;
            Values::Numbers(known.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
        }
        ColumnReader::Int64ColumnReader(reader) => {
            let known = read(reader, rows)?;
            Values::Counts(known.into_iter().map(|n| n.unwrap_or(0).cast_unsigned()).collect())
        }
        ColumnReader::ByteArrayColumnReader(reader) => {
            let mut words = Words::default();
            for word in read(reader, rows)? {
                let word = word.as_ref().map_or(Ok(""), ByteArray::as_utf8)?;
                words.push(word);
            }
            Values::Words(words)
        }
        _ => return Err(ParquetError::General("this is not a table of this program".into())),
    })
}

/// All values of a column, missing ones in their places.
fn read<T: DataType>(mut reader: ColumnReaderImpl<T>, rows: usize) -> Result<Vec<Option<T::T>>> {
    let (mut there, mut known) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
    while there.len() < rows {
        let (read, ..) = reader.read_records(rows - there.len(), Some(&mut there), None, &mut known)?;
        if read == 0 {
            return Err(ParquetError::EOF("a column ends early".into()));
        }
    }
    let mut known = known.into_iter();
    Ok(there.iter().map(|level| if *level > 0 { known.next() } else { None }).collect())
}
