//! A complete spec, and how tests change it.

use std::path::Path;

use vibrissa::error::InputError;
use vibrissa::scene::Spec;
use vibrissa::spec;

/// A complete spec. Tests refer to its line numbers.
pub const GOOD: &str = r#"format = 1
[whisker]
D = 10.0
d = 4
L_a = 96.0
[gauge]
x_ss = 6.0
l = 2.0
[tap]
a = [30, 50, 70]
theta = { from = 2, to = 4, steps = 3 }
[model]
[estimate]
[output]
[run]
"#;

pub fn parse(text: &str) -> Result<Spec, InputError> {
    let read = spec::parse("whisker.toml", text, Path::new("."));
    super::schema::keep(text, read.as_ref().err());
    read
}

pub fn with(line: &str, new: &str) -> String {
    assert!(GOOD.contains(line), "no line {line}");
    GOOD.replacen(line, new, 1)
}
