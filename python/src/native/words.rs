//! Words that users say.

use pyo3::prelude::*;
use vibrissa::recommend;
use vibrissa::status::Status;

/// The place of the row that is recommended: of `values`, smaller is better; `codes` are places in `words`, those of the taps of each row.
#[pyfunction]
pub fn recommended(values: Vec<f64>, codes: Vec<i32>, words: Vec<String>) -> Option<usize> {
    let words: Vec<Status> = words.iter().map(|words| Status::of_words(words)).collect();
    let of =
        |code: i32| usize::try_from(code).ok().and_then(|code| words.get(code).copied()).unwrap_or_default();
    recommend::recommended(codes.into_iter().map(of).zip(values)).map(|(place, _)| place)
}
