//! Words that users say, and words of a status as numbers.

use pyo3::prelude::*;
use vibrissa::recommend;
use vibrissa::status::Status;

/// Status word of each bit. A new word takes the next bit, wherever it stands among the words.
const BITS: [Status; 12] = [
    Status::INVALID_GEOMETRY,
    Status::NO_STRAIN,
    Status::NOT_CONVERGED,
    Status::MATERIAL_LIMIT,
    Status::SLIPPED_OFF,
    Status::STRAIN_LIMIT,
    Status::NO_ROOT,
    Status::AMBIGUOUS,
    Status::OUTSIDE_CALIBRATION,
    Status::BAD_INPUT,
    Status::AT_KNOT,
    Status::INCONSISTENT,
];
const _: () = assert!(BITS.len() == Status::ALL.len());

pub fn bits(status: Status) -> u16 {
    if status == Status::OK {
        return 0;
    }
    BITS.iter().enumerate().map(|(k, word)| u16::from(status.has(*word)) << k).sum()
}

/// The place of the row that is recommended: of `values`, smaller is better; `codes` are places in `words`, those of the taps of each row.
#[pyfunction]
pub fn recommended(values: Vec<f64>, codes: Vec<i32>, words: Vec<String>) -> Option<usize> {
    let words: Vec<Status> = words.iter().map(|words| Status::of_words(words)).collect();
    let of =
        |code: i32| usize::try_from(code).ok().and_then(|code| words.get(code).copied()).unwrap_or_default();
    recommend::recommended(codes.into_iter().map(of).zip(values)).map(|(place, _)| place)
}
