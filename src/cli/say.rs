//! The one way to stderr: words for people. That nobody reads them, or that there is no room for them, is no reason to fail.

use std::fmt::Display;
use std::io::Write;

pub use vibrissa::command::{grouped, rough};
use vibrissa::excerpt::printable;

/// A line, with nothing in it that a terminal would obey: it may hold words of a file.
pub fn line(text: impl Display) {
    part(format!("{}\n", printable(&text.to_string())));
}

pub fn warning(text: impl Display) {
    line(format_args!("warning: {text}"));
}

pub fn part(text: impl Display) {
    let _ = std::io::stderr().write_all(text.to_string().as_bytes());
}
