//! Text files, read in blocks: one that is too long or not text is refused before it fills the memory.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;
use std::string::FromUtf8Error;

use crate::error::InputError;

/// Length up to which a file is read whole, bytes: a spec, a calibration, a `run.json`.
pub const WHOLE: u64 = 16 << 20;
/// Longest line of a table, bytes.
pub const LINE: usize = 1 << 20;
const BLOCK: usize = 1 << 16;

/// The limit that a reader enforces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// At most [`WHOLE`] bytes, valid UTF-8.
    Whole,
    /// Lines of at most [`LINE`] bytes, valid UTF-8.
    Lines,
    /// Lines of at most [`LINE`] bytes; the caller handles invalid text line by line.
    AnyLines,
}

/// A reader that fails with an [`InputError`] at the first block beyond its limit, or, where UTF-8 is required, not valid UTF-8 or with a NUL byte.
#[derive(Debug)]
pub struct TextFile<R> {
    reader: R,
    limit: Limit,
    /// Kind of the file, for errors.
    what: String,
    label: String,
    total: u64,
    lines: usize,
    line: usize,
    /// Start of a UTF-8 character that the next block completes.
    begun: Vec<u8>,
}

impl TextFile<File> {
    /// Opens the `what` file at `path`, which may be a pipe.
    pub fn open(path: &Path, what: &str, limit: Limit) -> std::result::Result<Self, InputError> {
        let label = path.display().to_string();
        let refuse = |why: String| InputError::new(why).at(&label, None);
        if path.is_dir() {
            return Err(refuse(format!("this is a folder, no {what} file")));
        }
        let file = File::open(path).map_err(|e| match e.kind() {
            ErrorKind::NotFound => refuse(format!("there is no such {what} file")),
            _ => unread(what, &label, &e),
        })?;
        let length = file.metadata().ok().filter(|m| m.is_file()).map_or(0, |m| m.len());
        let text = Self::new(file, &label, what, limit);
        if limit == Limit::Whole && length > WHOLE { Err(text.too_long()) } else { Ok(text) }
    }
}

impl<R: Read> TextFile<R> {
    /// Wraps `reader`; `label` is the file name as the user gave it.
    pub fn new(reader: R, label: &str, what: &str, limit: Limit) -> Self {
        let (what, label) = (what.to_owned(), label.to_owned());
        Self { reader, limit, what, label, total: 0, lines: 0, line: 0, begun: Vec::new() }
    }

    /// Reads everything.
    pub fn bytes(&mut self) -> std::result::Result<Vec<u8>, InputError> {
        let mut bytes = Vec::new();
        let read = self.read_to_end(&mut bytes).map(|_| bytes);
        read.map_err(|e| refused(e).unwrap_or_else(|e| unread(&self.what, &self.label, &e)))
    }

    /// Reads everything as text, without byte order mark.
    pub fn text(&mut self) -> std::result::Result<String, InputError> {
        let valid = |e: FromUtf8Error| 1 + ends(&e.as_bytes()[..e.utf8_error().valid_up_to()]);
        let mut text = String::from_utf8(self.bytes()?).map_err(|e| self.no_text(valid(e)))?;
        if text.starts_with('\u{feff}') {
            text.drain(..'\u{feff}'.len_utf8());
        }
        Ok(text)
    }

    /// Like [`Self::text`], for TOML. A file of more than a block must start with `key = value` or `[section]`: parsing other text takes many times
    /// its memory.
    pub fn toml(&mut self) -> std::result::Result<String, InputError> {
        let text = self.text()?;
        let says = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
        match (1..).zip(text.lines()).find(|(_, line)| says(line)) {
            Some((at, line)) if text.len() > BLOCK && !line.contains(['=', '[']) => {
                let error = InputError::new(format!("this is no {} file", self.what));
                let error = error.at(&self.label, Some(at)).value(line);
                Err(error.allowed("TOML: lines `key = value` and `[section]`"))
            }
            _ => Ok(text),
        }
    }

    fn too_long(&self) -> InputError {
        let why = format!("this file is longer than 16 MiB, so it is no {} file", self.what);
        InputError::new(why).at(&self.label, None).allowed("up to 16 MiB")
    }

    fn no_text(&self, line: usize) -> InputError {
        let why = format!("this {} file is not UTF-8 text; save it as UTF-8", self.what);
        InputError::new(why).at(&self.label, Some(line))
    }

    fn check(&mut self, block: &[u8]) -> std::result::Result<(), InputError> {
        self.total += block.len() as u64;
        if self.limit != Limit::AnyLines {
            if let Some(at) = block.iter().position(|b| *b == 0) {
                let why = format!("a NUL byte stands in this line, so this is no {} file", self.what);
                let error = InputError::new(why).at(&self.label, Some(self.lines + 1 + ends(&block[..at])));
                return Err(error.allowed("text without NUL bytes, in UTF-8"));
            }
            let bytes = [&self.begun[..], block].concat();
            self.begun.clear();
            if let Err(e) = std::str::from_utf8(&bytes) {
                let (text, rest) = bytes.split_at(e.valid_up_to());
                if e.error_len().is_some() {
                    return Err(self.no_text(self.lines + 1 + ends(text)));
                }
                self.begun.extend(rest);
            }
        }
        if self.limit == Limit::Whole && self.total > WHOLE {
            return Err(self.too_long());
        }
        let is_end = |b: &u8| matches!(b, b'\n' | b'\r');
        let first = block.iter().position(is_end);
        if self.limit != Limit::Whole && self.line + first.unwrap_or(block.len()) > LINE {
            let why = format!("this line is longer than 1 MiB, so this is no {} file", self.what);
            let error = InputError::new(why).at(&self.label, Some(self.lines + 1));
            return Err(error.allowed("lines of up to 1 MiB"));
        }
        self.lines += ends(block);
        self.line = match block.iter().rposition(is_end) {
            Some(last) => block.len() - 1 - last,
            None => self.line + block.len(),
        };
        Ok(())
    }
}

impl<R: Read> Read for TextFile<R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let most = buffer.len().min(BLOCK);
        let n = self.reader.read(&mut buffer[..most])?;
        self.check(&buffer[..n]).map_err(|e| Error::new(ErrorKind::InvalidData, e))?;
        Ok(n)
    }
}

/// The [`InputError`] inside a read error, if there is one.
pub fn refused(error: Error) -> std::result::Result<InputError, Error> {
    error.downcast()
}

/// The error of a `what` file that the system cannot read.
pub fn unread(what: &str, label: &str, e: &Error) -> InputError {
    InputError::new(format!("this {what} file cannot be read: {e}")).at(label, None)
}

fn ends(text: &[u8]) -> usize {
    text.iter().filter(|b| **b == b'\n').count()
}
