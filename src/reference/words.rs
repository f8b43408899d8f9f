//! Words that stand in tables, and exit codes.

use super::layout::{Entry, Part};
use crate::status::Status;

/// Before the lists.
pub const ABOUT: &str = "Every row that was asked for comes back; one without values says why. `status` is `ok`, or words of the first list joined \
    by `+` in its order; of a row over many taps it is the union of their words. A tap that counts enters K̄, SD, errors and maxima of its row. \
    Summaries count each combination of words once, and add up to the number of taps, as `counts.combinations` of run.json does; `counts.status` there \
    counts each word.";

/// What a word says in a sweep, which values a tap has with it, and what it says in `locate` where that is something else.
const STATUSES: [(Status, &str, &str, &str); 12] = [
    (Status::INVALID_GEOMETRY, "the tuple lies outside its domain (model §1)", "none", ""),
    (
        Status::NO_STRAIN,
        "the contact is at or inside the gauge's near end",
        "strain 0, strain_linear, forces, contact arc",
        "the signal is zero, or this is a zero reading (drive 0)",
    ),
    (Status::NOT_CONVERGED, "the tolerance was not met, or no equilibrium was found", "strain_linear", ""),
    (
        Status::MATERIAL_LIMIT,
        "a fibre leaves the range of its material law (model §3.3)",
        "strain_linear",
        "",
    ),
    (
        Status::AT_KNOT,
        "the contact reaches a corner of the profile, on whose surface it slides (model §7)",
        "strain_linear",
        "",
    ),
    (
        Status::SLIPPED_OFF,
        "the contact has run past the tip",
        "all, with the taper continued; strain_linear of a whisker that is no cone clamped at its base",
        "",
    ),
    (
        Status::STRAIN_LIMIT,
        "|strain| exceeds gauge.strain_limit",
        "all",
        "the same; without a distance, the sensor stands at its end stop",
    ),
    (
        Status::NO_ROOT,
        "no distance gives this reading: it lies above the peak of the curve that is inverted",
        "all but the distance, its error and sigma",
        "",
    ),
    (
        Status::AMBIGUOUS,
        "a second distance in the range of interest gives this reading",
        "all; the farther distance",
        "",
    ),
    (
        Status::OUTSIDE_CALIBRATION,
        "d > D only: the distance of this reading lies beyond the whisker, and no other one is of interest (model §2.3)",
        "all",
        "the drive, the side or the distance lies outside what was calibrated",
    ),
    (
        Status::INCONSISTENT,
        "not in a sweep",
        "",
        "taps of one object contradict each other (columns apart_line and apart_sigmas say which), or no curve fits the readings of a stroke",
    ),
    (Status::BAD_INPUT, "not in a sweep", "", "the line is no reading"),
];

/// Reasons in rows.csv.
pub const REASONS: [(&str, &str); 13] = [
    ("not_a_number", "a field is empty or no finite number"),
    (
        "missing_value",
        "a number stands for no value: -9999, 9.9e37, or the same value at several places far from all others",
    ),
    ("outside_domain", "a or the drive lies outside the whisker, or below zero"),
    ("no_strain", "the contact is at or inside the gauge's near end"),
    ("zero_signal", "the signal is exactly zero although there is contact"),
    ("opposite_sign", "the sign is that of the other side, of which there is too little to calibrate"),
    ("saturated", "the sensor stands at its end stop"),
    ("repeat_outlier", "far off the other repeats of its cell"),
    ("wrong_unit", "off by whole decades: recorded in another unit"),
    ("mislabelled", "the signal fits another distance or drive"),
    ("outlier", "off the smooth surface through the other rows"),
    ("zero_outlier", "a zero reading far off its neighbours"),
    ("tilted", "the pole is tilted: the row serves the second gauge only"),
];

/// Words of `verdict` in verify.csv.
pub const VERDICTS: [(&str, &str); 8] = [
    ("nothing_compared", "no tap was solved by both"),
    ("strain", "a strain error above the bound"),
    ("K", "an error of K above the bound"),
    ("force", "an error of a force above ten times the bound"),
    ("arc", "an error of the contact arc above ten times the bound"),
    ("status", "words differ, and not next to a threshold"),
    (
        "unsolved",
        "too many taps that only the reference solved, or that were left to it far from base and gauge",
    ),
    ("unanswered", "too many taps that only the backend solved"),
];

/// Exit codes of the program.
pub const EXIT_CODES: [(&str, &str); 3] = [
    ("0", "done"),
    ("1", "the run failed or was interrupted, or `verify` found a bound broken"),
    ("2", "bad usage, a bad spec or bad data; the message says file, line, key, value and what is allowed"),
];

/// Statuses, reasons, verdicts, exit codes.
pub fn parts() -> Vec<Part> {
    let heads = ["word", "counts", "values of the tap", "in locate", "meaning"];
    let entries = Status::ALL.into_iter().map(|(status, word)| entry(status, word));
    vec![
        Part::new("status", "In the order in which words are joined.", &heads, entries),
        list("reason", "Why `calibrate` does not use a row (rows.csv).", &REASONS),
        list("verdict", "What `verify` finds wrong (verify.csv).", &VERDICTS),
        list("exit codes", "What the program returns.", &EXIT_CODES),
    ]
}

fn entry(status: Status, word: &str) -> Entry {
    let told = STATUSES.iter().find(|(s, ..)| *s == status);
    let (meaning, values, locate) = told.map_or(("", "", ""), |t| (t.1, t.2, t.3));
    // A word that no tap of a sweep has neither counts nor does not.
    let counts = match (values, status.counts()) {
        ("", _) => "",
        (_, true) => "yes",
        (_, false) => "no",
    };
    let facts = [counts, values, locate].map(str::to_owned).to_vec();
    Entry { name: word.to_owned(), facts, meaning: meaning.to_owned() }
}

fn list(title: &str, about: &str, words: &[(&str, &str)]) -> Part {
    let entry = |(word, meaning): &(&str, &str)| Entry {
        name: (*word).to_owned(),
        facts: Vec::new(),
        meaning: (*meaning).to_owned(),
    };
    Part::new(title, about, &["word", "meaning"], words.iter().map(entry))
}
