//! Tables as comma-separated text: UTF-8, LF, shortest round-trip numbers, empty where a value is missing.

use super::table::Field;
use crate::error::Error;

/// Bytes that a writer holds back. Each design of a sweep has a few of them, most of one row or none.
const BUFFER: usize = 256;

/// Rows as bytes of a CSV file, formatted away from the file so that it can be done in parallel.
pub struct Text {
    writer: csv::Writer<Vec<u8>>,
    number: ryu::Buffer,
}

impl Default for Text {
    fn default() -> Self {
        let writer = csv::WriterBuilder::new()
            .buffer_capacity(BUFFER)
            .terminator(csv::Terminator::Any(b'\n'))
            .from_writer(Vec::new());
        Self { writer, number: ryu::Buffer::new() }
    }
}

impl Text {
    /// The header line.
    ///
    /// # Errors
    /// None but a row of another width, here and below: rows are written to memory.
    pub fn header(&mut self, columns: &[&str]) -> Result<(), Error> {
        self.writer.write_record(columns).map_err(failed)
    }

    /// One row; `fields` is left empty for the next.
    pub fn row(&mut self, fields: &mut Vec<Field>) -> Result<(), Error> {
        self.row_with(fields, &[])
    }

    /// One row that ends with `texts`; `fields` is left empty for the next.
    pub fn row_with(&mut self, fields: &mut Vec<Field>, texts: &[&str]) -> Result<(), Error> {
        self.put(fields, texts).map_err(failed)
    }

    fn put(&mut self, fields: &mut Vec<Field>, texts: &[&str]) -> csv::Result<()> {
        for field in fields.drain(..) {
            match field {
                Field::Number(x) if x.is_finite() => {
                    let text = self.number.format_finite(x);
                    self.writer.write_field(text.strip_suffix(".0").unwrap_or(text))?;
                }
                Field::Number(_) => self.writer.write_field("")?,
                Field::Count(n) => self.writer.write_field(n.to_string())?,
                Field::Word(w) => self.writer.write_field(w)?,
                Field::Text(t) => self.writer.write_field(t)?,
                Field::Status(s) => self.writer.write_field(s.to_string())?,
            }
        }
        for text in texts {
            self.writer.write_field(text)?;
        }
        self.writer.write_record(None::<&[u8]>)
    }

    /// Bytes written so far, apart from what the writer still holds back.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        self.writer.get_ref().len()
    }

    /// What has been written.
    pub fn into_bytes(self) -> Vec<u8> {
        self.writer.into_inner().expect("writing to memory does not fail")
    }
}

fn failed(e: csv::Error) -> Error {
    Error::Run(e.to_string())
}
