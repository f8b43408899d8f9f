//! Errors with all that a user needs to correct an input; the command line prints them and exits, `--json` prints the same fields.

use std::fmt;

use crate::excerpt::{Excerpt, printable, short};

/// An input that cannot be used, and what would be allowed in its place. Exit code 2.
#[derive(Debug, Clone, Default)]
pub struct InputError {
    /// File as the user named it; `None` for a command-line option.
    pub file: Option<String>,
    /// 1-based line in `file`.
    pub line: Option<usize>,
    /// Dotted key (`whisker.D`), column (`a_mm`) or option (`--tolerance`).
    pub key: Option<String>,
    /// The value as written.
    pub value: Option<String>,
    /// Allowed range or words, with unit.
    pub allowed: Option<String>,
    /// The error, in one sentence.
    pub message: String,
    /// Lines of `file` around the error.
    pub snippet: Option<Box<Excerpt>>,
}

impl InputError {
    /// An error with a message only.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), ..Self::default() }
    }

    /// The key, column or option at fault.
    pub fn key(mut self, key: impl Into<String>) -> Self {
        self.key = Some(short(&key.into()));
        self
    }

    /// The value as written, cut where it is very long.
    pub fn value(mut self, value: impl fmt::Display) -> Self {
        self.value = Some(short(&value.to_string()));
        self
    }

    /// The range or the words that would be accepted.
    pub fn allowed(mut self, allowed: impl Into<String>) -> Self {
        self.allowed = Some(allowed.into());
        self
    }

    /// The file and 1-based line at fault.
    pub fn at(mut self, file: impl Into<String>, line: Option<usize>) -> Self {
        self.file = Some(file.into());
        self.line = line;
        self
    }

    /// The place in the `text` of the file to show.
    pub fn snippet(mut self, text: &str, range: std::ops::Range<usize>) -> Self {
        self.snippet = Some(Box::new(Excerpt::new(text, range)));
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = self.file.as_deref().map(printable) {
            match self.line {
                Some(line) => write!(f, "{file}:{line}: ")?,
                None => write!(f, "{file}: ")?,
            }
        }
        match (&self.key, &self.value) {
            (Some(k), Some(v)) => write!(f, "{k} = {v}: ")?,
            (Some(k), None) => write!(f, "{k}: ")?,
            (None, Some(v)) => write!(f, "{v}: ")?,
            (None, None) => {}
        }
        f.write_str(&printable(&self.message))?;
        if let Some(allowed) = &self.allowed {
            write!(f, " (allowed: {})", printable(allowed))?;
        }
        Ok(())
    }
}

impl std::error::Error for InputError {}

/// Reasons why taps cannot be solved.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SolveError {
    /// A device, its driver or its shader failed; the message is the driver's.
    #[error("{0}")]
    Device(String),
    /// No kernel is compiled for this number of nodes.
    #[error("no kernel with {0} nodes")]
    Nodes(usize),
    /// The caller cancelled the work.
    #[error("interrupted")]
    Stopped,
    /// More taps than allowed would need the reference or have no solution.
    #[error("too many taps have no solution that the kernels find")]
    TooHard,
}

/// Anything that ends a command early.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Bad usage or a bad spec: exit code 2.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Taps cannot be solved: exit code 1.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The run itself failed: exit code 1.
    #[error("{0}")]
    Run(String),
    /// Reading or writing a file failed: exit code 1.
    #[error("{}: {source}", printable(path))]
    Io {
        /// The file or folder.
        path: String,
        /// The system's reason.
        source: std::io::Error,
    },
}

impl Error {
    /// A failed file operation, with the path it was tried on.
    pub fn io(path: impl AsRef<std::path::Path>, source: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().display().to_string(), source }
    }

    /// The process exit code.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::Input(_)) { 2 } else { 1 }
    }
}

/// Result of work that may fail for any reason; the error type may be another one.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Result of a check of input.
pub type Checked<T> = Result<T, InputError>;

/// The word of `known` that is closest to `word`, if any is close; case, `_`, `-` and spaces hardly count.
pub fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let plain = |s: &str| s.to_lowercase().replace(['_', '-', ' '], "");
    let distance = |name: &str| strsim::damerau_levenshtein(&plain(word), &plain(name));
    let close =
        |name: &&str| distance(name) <= (plain(word).len() / 3).max(1) && distance(name) < plain(name).len();
    let nearest = known.iter().copied().min_by_key(|name| (distance(name), strsim::levenshtein(word, name)));
    nearest.filter(close)
}
