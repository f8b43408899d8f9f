//! Writes text to stderr. A closed or full stderr is ignored.

use std::fmt::Display;
use std::io::Write;

pub use vibrissa::command::{grouped, rough};
use vibrissa::excerpt::printable;

/// Prints a line; control characters, which may come from a file, are made harmless.
pub fn line(text: impl Display) {
    part(format!("{}\n", printable(&text.to_string())));
}

pub fn warning(text: impl Display) {
    line(format_args!("warning: {text}"));
}

pub fn part(text: impl Display) {
    let _ = std::io::stderr().write_all(text.to_string().as_bytes());
}
