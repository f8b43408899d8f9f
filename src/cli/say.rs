//! The one way to stderr: words for people. That nobody reads them, or that there is no room for them, is no reason to fail.

use std::cell::RefCell;
use std::fmt::Display;
use std::io::Write;

use vibrissa::excerpt::printable;

/// A line, with nothing in it that a terminal would obey: it may hold words of a file.
pub fn line(text: impl Display) {
    part(format!("{}\n", printable(&text.to_string())));
}

/// A warning, in a line.
pub fn warning(text: impl Display) {
    line(format_args!("warning: {text}"));
}

/// Each of `all` as a warning, unless the command is to be `quiet`.
pub fn warnings<T: Display>(quiet: bool, all: impl IntoIterator<Item = T>) {
    all.into_iter().filter(|_| !quiet).for_each(warning);
}

/// What tells warnings, unless the command is to be `quiet`.
pub fn unless(quiet: bool) -> impl Fn(&str) {
    move |text| warnings(quiet, [text])
}

/// Warnings that are told while a command runs, and kept for its record.
pub struct Told {
    quiet: bool,
    texts: RefCell<Vec<String>>,
}

impl Told {
    /// None so far; told on stderr unless the command is to be `quiet`.
    pub fn new(quiet: bool) -> Self {
        Self { quiet, texts: RefCell::default() }
    }

    /// One more.
    pub fn warn(&self, text: &str) {
        warnings(self.quiet, [text]);
        self.texts.borrow_mut().push(text.to_owned());
    }

    /// All so far.
    pub fn texts(&self) -> Vec<String> {
        self.texts.borrow().clone()
    }
}

/// Words that do not end their line.
pub fn part(text: impl Display) {
    let _ = std::io::stderr().write_all(text.to_string().as_bytes());
}

/// A count in groups of three digits: 10 000.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let first = digits.len() % 3;
    let groups: Vec<&str> = std::iter::once(&digits[..first])
        .chain((first..digits.len()).step_by(3).map(|i| &digits[i..i + 3]))
        .filter(|group| !group.is_empty())
        .collect();
    groups.join(" ")
}

/// A rate or a number of bytes, as exactly as anybody reads it: 870 000, 4.3e9.
pub fn rough(x: f64) -> String {
    let two: f64 = format!("{x:.1e}").parse().unwrap_or(x);
    match two {
        _ if two >= 1e9 => format!("{two:.1e}"),
        _ if two >= 10.0 => grouped(two as u64),
        _ => two.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_stand_in_threes() {
        let pairs = [(0, "0"), (33, "33"), (999, "999"), (10_000, "10 000"), (1_234_567, "1 234 567")];
        pairs.into_iter().for_each(|(n, text)| assert_eq!(grouped(n), text));
    }

    #[test]
    fn two_digits_are_enough() {
        let pairs = [
            (0.0123, "0.012"),
            (0.0, "0"),
            (2.66, "2.7"),
            (12.64, "13"),
            (868_901.0, "870 000"),
            (4.33e9, "4.3e9"),
        ];
        pairs.into_iter().for_each(|(x, text)| assert_eq!(rough(x), text));
    }
}
