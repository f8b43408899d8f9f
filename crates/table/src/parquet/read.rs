//! Reads a Parquet file of this program, row group by row group.

use std::borrow::Cow;
use std::fs::File;
use std::path::{Path, PathBuf};

use parquet::basic::Type;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use parquet::schema::types::ColumnDescPtr;

use crate::error::{Error, InputError};
use crate::heading::Kind;
use crate::kernel::gpu::quietly;
use crate::values::Words;
use crate::{Frame, Values};

/// Reader of the row groups, in order.
pub struct Reader {
    path: PathBuf,
    file: SerializedFileReader<File>,
    next: usize,
}

impl Reader {
    /// Opens `file`, which is at `path`.
    pub fn new(path: &Path, file: File) -> std::result::Result<Self, Error> {
        let file = guarded(|| SerializedFileReader::new(file)).map_err(|e| unreadable(path, &e))?;
        Ok(Self { path: path.to_owned(), file, next: 0 })
    }

    /// A table with its columns and no rows.
    pub fn frame(&self) -> Frame {
        let schema = self.file.metadata().file_metadata().schema_descr();
        let of = |column: &ColumnDescPtr| {
            let kind = match column.physical_type() {
                Type::INT64 => Kind::Count,
                Type::BYTE_ARRAY => Kind::Word,
                _ => Kind::Number,
            };
            (Cow::Owned(column.name().to_owned()), Values::new(kind))
        };
        let (names, columns) = schema.columns().iter().map(of).unzip();
        Frame { file: self.path.display().to_string(), names, columns, ..Frame::default() }
    }

    /// Its provenance; empty if missing.
    pub fn provenance(&self) -> String {
        let facts = self.file.metadata().file_metadata().key_value_metadata();
        let fact = facts.into_iter().flatten().find(|fact| fact.key == super::PROVENANCE);
        fact.and_then(|fact| fact.value.clone()).unwrap_or_default()
    }

    /// The rows of the next group; `None` after the last.
    pub fn next_group(&mut self) -> std::result::Result<Option<Frame>, Error> {
        if self.next == self.file.num_row_groups() {
            return Ok(None);
        }
        let group = guarded(|| self.file.get_row_group(self.next).and_then(|group| columns(&*group)));
        self.next += 1;
        let columns = group.map_err(|e| unreadable(&self.path, &e))?;
        Ok(Some(Frame { columns, ..self.frame() }))
    }
}

/// Turns a panic of the decoder into an error; it panics on some damaged files.
fn guarded<T>(read: impl FnOnce() -> Result<T>) -> Result<T> {
    quietly(read).unwrap_or_else(|why| Err(ParquetError::General(why)))
}

fn unreadable(path: &Path, e: &ParquetError) -> Error {
    let error = InputError::new(format!("this is not a whole Parquet file: {e}"));
    error.at(path.display().to_string(), None).allowed("the file as it was written").into()
}

fn columns(group: &dyn RowGroupReader) -> Result<Vec<Values>> {
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
    if rows > super::GROUP {
        return Err(ParquetError::General("a row group has more rows than this program writes".into()));
    }
    (0..group.num_columns()).map(|at| column(group.get_column_reader(at)?, rows)).collect()
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
                words.push(word.as_ref().map_or(Ok(""), ByteArray::as_utf8)?);
            }
            Values::Words(words)
        }
        _ => return Err(ParquetError::General("this is not a table of this program".into())),
    })
}

fn read<T: DataType>(mut reader: ColumnReaderImpl<T>, rows: usize) -> Result<Vec<Option<T::T>>> {
    // A damaged file may state any number of rows, so memory is not reserved in advance.
    let (mut there, mut known) = (Vec::new(), Vec::new());
    while there.len() < rows {
        let (read, ..) = reader.read_records(rows - there.len(), Some(&mut there), None, &mut known)?;
        if read == 0 {
            return Err(ParquetError::EOF("a column ends early".into()));
        }
    }
    let mut known = known.into_iter();
    Ok(there.iter().map(|level| if *level > 0 { known.next() } else { None }).collect())
}
