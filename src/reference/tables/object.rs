//! Tables about taps of one object.

use super::{DRIVE, Table, table};

/// What `located.csv` has more of taps that are taken together.
pub const TOGETHER: Table = table(
    "locate --same, --object",
    "located.csv",
    "These columns follow status where taps of one object are taken together; they say what all taps of the object so far tell.",
    &[
        ("object", "the object, on a stream with --object; a file keeps its own column"),
        ("taps", "taps of the object so far"),
        ("object_distance_mm", "distance that all of them tell"),
        ("object_sigma_mm", "its standard deviation; what the taps share is counted once"),
        ("apart_line", "line of the tap that is farthest from what the others say"),
        ("apart_sigmas", "by how many standard deviations"),
        ("object_status", "ok, or ambiguous, outside_calibration, inconsistent, joined by +"),
    ],
);

/// `next.csv`.
pub const NEXT: Table = table(
    "next",
    "next.csv",
    "A row is a drive that the next tap could have.",
    &[
        DRIVE,
        (
            "expected_signal",
            "signal above its zero where the object is most likely: strain, or the unit of the reading",
        ),
        ("expected_sigma_mm", "standard deviation of the distance that is expected after the tap"),
        ("status", "ok, or strain_limit where the sensor could be overloaded"),
    ],
);
