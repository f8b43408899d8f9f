//! Lines of a file or a stream, with their numbers.

use std::io::{BufRead, BufReader, Read};

use super::rows::RowReader;
use super::stream::Ask;
use crate::error::{Error, InputError};
use crate::measure::header::Comments;
use crate::text_file::LINE;

/// Longest line that can be a reading, bytes.
const LONGEST: usize = 4096;

/// What a program may write before the text of a file in UTF-8.
const BOM: &[u8] = "\u{feff}".as_bytes();

/// A line that is no header.
pub struct Line<'a> {
    /// Its text without the end; `None` where it is no UTF-8, or too long.
    pub text: Option<&'a str>,
    /// Number in the file, from 1.
    pub number: usize,
    /// Number among the lines that are no header, from 0.
    pub place: usize,
    /// Whether it has ended.
    pub whole: bool,
    /// Whether no whole line has come yet after it.
    pub waiting: bool,
}

/// Lines one by one, in constant memory.
pub struct Source<'a, R: Read> {
    reader: BufReader<R>,
    line: Vec<u8>,
    ask: &'a Ask<'a>,
    number: usize,
    place: usize,
    /// Length of a line that was read and not yet given.
    held: Option<usize>,
    begun: bool,
    /// Comments before the first line.
    comments: Comments,
}

impl<'a, R: Read> Source<'a, R> {
    /// Of `input`.
    pub fn new(input: R, ask: &'a Ask<'a>) -> Self {
        let reader = BufReader::with_capacity(1 << 16, input);
        let (line, comments) = (Vec::with_capacity(256), Comments::default());
        Self { reader, line, ask, number: 0, place: 0, held: None, begun: false, comments }
    }

    fn label(&self) -> &'a str {
        self.ask.label.unwrap_or("stdin")
    }

    /// Reads the first line; a header goes to `rows`, anything else is given by [`Self::next`].
    ///
    /// # Errors
    /// A header that does not fit the calibration; input that fails.
    pub fn first(&mut self, rows: &mut RowReader<'_>) -> Result<(), Error> {
        if self.begun {
            return Ok(());
        }
        self.held = self.read(rows)?;
        self.begun = true;
        let at = |e: InputError| {
            let line = e.line.or(Some(self.number));
            e.at(self.label(), line)
        };
        let unread = self.held.is_some_and(|n| n <= LONGEST && text(&self.line, n).is_none());
        if unread && self.ask.label.is_some() {
            let error = InputError::new("this file is not UTF-8 text, so its columns cannot be told by name");
            return Err(at(error.allowed("CSV saved as UTF-8")).into());
        }
        if self.line.trim_ascii_end().contains(&b'\r') {
            let error = InputError::new("these lines end with CR alone");
            return Err(at(error.allowed("lines that end with LF or CR LF")).into());
        }
        let header = match self.held.and_then(|n| text(&self.line, n)) {
            Some(text) => {
                let file = self.ask.label.is_some();
                rows.first(text, &self.comments, self.ask.columns, file).map_err(at)?
            }
            None => false,
        };
        if header {
            self.held = None;
        }
        Ok(())
    }

    /// The next line; `None` at the end.
    pub fn next(&mut self, rows: &mut RowReader<'_>) -> Result<Option<Line<'_>>, Error> {
        self.first(rows)?;
        let length = match self.held.take() {
            Some(length) => length,
            None => match self.read(rows)? {
                Some(length) => length,
                None => return Ok(None),
            },
        };
        self.place += 1;
        Ok(Some(Line {
            text: text(&self.line, length),
            number: self.number,
            place: self.place - 1,
            whole: self.line.ends_with(b"\n"),
            waiting: !self.reader.buffer().contains(&b'\n'),
        }))
    }

    /// The length of the next line that is no comment.
    ///
    /// # Errors
    /// A comment that names other columns than the lines before it have; input that fails.
    fn read(&mut self, rows: &RowReader<'_>) -> Result<Option<usize>, Error> {
        loop {
            let length =
                read_line(&mut self.reader, &mut self.line).map_err(|e| Error::io(self.label(), e))?;
            self.number += usize::from(length.is_some());
            if length.is_some_and(|length| length > LINE) {
                let error = InputError::new("this line is longer than 1 MiB, so these are no readings");
                let error = error.at(self.label(), Some(self.number));
                return Err(error.allowed("lines of up to 1 MiB").into());
            }
            let comment =
                length.filter(|_| self.line.strip_prefix(BOM).unwrap_or(&self.line).starts_with(b"#"));
            if comment.is_none() {
                return Ok(length);
            }
            match comment.and_then(|n| text(&self.line, n)) {
                Some(text) if self.begun => {
                    let (line, said) = (self.number, self.ask.columns);
                    rows.same(line, text, said).map_err(|e| e.at(self.label(), Some(line)))?;
                }
                Some(text) => self.comments.push(self.number, text),
                None => {}
            }
        }
    }
}

/// The text of a line of `length` bytes.
fn text(line: &[u8], length: usize) -> Option<&str> {
    let text = (length <= LONGEST).then(|| std::str::from_utf8(line).ok()).flatten()?;
    Some(text.trim_end_matches(['\n', '\r']).trim_start_matches('\u{feff}'))
}

/// Reads a line into `line`, of which at most [`LONGEST`] bytes are kept; its length, `None` at the end.
fn read_line(reader: &mut BufReader<impl Read>, line: &mut Vec<u8>) -> std::io::Result<Option<usize>> {
    line.clear();
    let mut length = 0;
    loop {
        let buffer = match reader.fill_buf() {
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
            other => other?,
        };
        if buffer.is_empty() {
            return Ok((length > 0).then_some(length));
        }
        let (part, ended) = match buffer.iter().position(|b| *b == b'\n') {
            Some(end) => (&buffer[..=end], true),
            None => (buffer, false),
        };
        let room = LONGEST.saturating_sub(line.len()).min(part.len());
        line.extend_from_slice(&part[..room]);
        let n = part.len();
        length += n;
        reader.consume(n);
        if ended || length > LINE {
            return Ok(Some(length));
        }
    }
}
