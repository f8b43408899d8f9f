//! Rows of a file, of a stream or of a table in memory, with their numbers.

use std::io::{BufRead, Read};

use super::{Ask, rows::RowReader};
use crate::error::{Error, InputError};
use crate::measure::header::{Comments, same};
use crate::sink::{LabRow, LabStream, LabTable};
use crate::text_file::LINE;

/// Longest line that can be a reading, bytes.
const LONGEST: usize = 4096;

/// What a program may write before the text of a file in UTF-8.
const BOM: &[u8] = "\u{feff}".as_bytes();

/// A row that is no header.
pub struct Line<'a> {
    /// What it says; `None` of a line that is no UTF-8, or too long.
    pub row: Option<LabRow<'a>>,
    pub number: usize,
    /// Number among the rows, from 0.
    pub place: usize,
    /// True if it has ended.
    pub whole: bool,
    /// True if no whole line has come yet after it.
    pub waiting: bool,
}

/// Rows one by one, of text in constant memory.
pub struct Source<'a> {
    input: LabStream<'a>,
    line: Vec<u8>,
    pub ask: &'a Ask<'a>,
    /// Lines so far; of a table in memory, those with its names and its rows.
    number: usize,
    place: usize,
    /// True if the line was read and not yet given.
    held: bool,
    begun: bool,
    comments: Comments,
}

impl<'a> Source<'a> {
    pub fn new(input: LabStream<'a>, ask: &'a Ask<'a>) -> Self {
        let (line, comments) = (Vec::with_capacity(256), Comments::default());
        Self { input, line, ask, number: 0, place: 0, held: false, begun: false, comments }
    }

    /// Reads the first line; a header goes to `rows`, anything else is given by [`Self::next`].
    pub fn first(&mut self, rows: &mut RowReader<'_>) -> Result<(), Error> {
        if self.begun {
            return Ok(());
        }
        if let LabTable::Frame(frame) = self.input {
            (self.begun, self.number) = (true, 1);
            let named = rows.first(LabRow::Of(frame, 0), &self.comments, self.ask.columns, true);
            return Ok(named.map(drop).map_err(|e| e.at(self.ask.label(), Some(1)))?);
        }
        self.held = self.read(rows)?;
        self.begun = true;
        let at = |e: InputError| {
            let line = e.line.or(Some(self.number));
            e.at(self.ask.label(), line)
        };
        let unread = self.held && self.line.len() <= LONGEST && text(&self.line).is_none();
        if unread && self.ask.label.is_some() {
            let error = InputError::new("this file is not UTF-8 text, so its columns cannot be told by name");
            return Err(at(error.allowed("CSV saved as UTF-8")).into());
        }
        if self.line.trim_ascii_end().contains(&b'\r') {
            let error = InputError::new("these lines end with CR alone");
            return Err(at(error.allowed("lines that end with LF or CR LF")).into());
        }
        let (line, file) =
            (text(&self.line).filter(|_| self.held).map(LabRow::Line), self.ask.label.is_some());
        let header = line.map(|line| rows.first(line, &self.comments, self.ask.columns, file));
        self.held &= header.transpose().map_err(at)? != Some(true) && self.is_read();
        Ok(())
    }

    /// True if the line that was read last is one of those that are asked for.
    fn is_read(&self) -> bool {
        self.ask.only.is_none_or(|only| only(self.number))
    }

    pub fn next(&mut self, rows: &mut RowReader<'_>) -> Result<Option<Line<'_>>, Error> {
        self.first(rows)?;
        let mut held = std::mem::take(&mut self.held);
        while !held {
            if !self.read(rows)? {
                return Ok(None);
            }
            held = self.is_read();
        }
        self.place += 1;
        let (row, whole, waiting) = match &self.input {
            LabTable::Frame(frame) => (Some(LabRow::Of(frame, self.number - 2)), true, false),
            LabTable::Text(reader) => {
                let waiting = !reader.buffer().contains(&b'\n');
                (text(&self.line).map(LabRow::Line), self.line.ends_with(b"\n"), waiting)
            }
        };
        Ok(Some(Line { row, number: self.number, place: self.place - 1, whole, waiting }))
    }

    /// Reads the next line that is no comment, at most one byte more than [`LINE`], or the next row in memory; whether there is one.
    fn read(&mut self, rows: &RowReader<'_>) -> Result<bool, Error> {
        loop {
            let reader = match &mut self.input {
                LabTable::Text(reader) => reader,
                LabTable::Frame(frame) => {
                    self.number += 1;
                    return Ok(self.number < frame.len() + 2);
                }
            };
            self.line.clear();
            let length = reader.by_ref().take(LINE as u64 + 1).read_until(b'\n', &mut self.line);
            if length.map_err(|e| Error::io(self.ask.label(), e))? == 0 {
                return Ok(false);
            }
            self.number += 1;
            if self.line.len() > LINE {
                let error = InputError::new("this line is longer than 1 MiB, so these are no readings");
                let error = error.at(self.ask.label(), Some(self.number));
                return Err(error.allowed("lines of up to 1 MiB").into());
            }
            if !self.line.strip_prefix(BOM).unwrap_or(&self.line).starts_with(b"#") {
                return Ok(true);
            }
            match text(&self.line) {
                Some(text) if self.begun => {
                    let (line, names) = (self.number, &rows.header.names);
                    let same = same(line, text, &names.join("\t"), names, self.ask.columns);
                    same.map_err(|e| e.at(self.ask.label(), Some(line)))?;
                }
                Some(text) => self.comments.push((self.number, text.to_owned())),
                None => {}
            }
        }
    }
}

fn text(line: &[u8]) -> Option<&str> {
    let text = (line.len() <= LONGEST).then(|| std::str::from_utf8(line).ok()).flatten()?;
    Some(text.trim_end_matches(['\n', '\r']).trim_start_matches('\u{feff}'))
}
