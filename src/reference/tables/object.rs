//! Tables about taps of one object, and about what a raw record shows.

use super::{DRIVE, Table, table};

/// What `located.csv` has more of taps that are taken together.
pub const TOGETHER: Table = table(
    "locate --same, --object",
    "located.csv",
    "These columns follow status where taps of one object are taken together; they say what all taps of the object so far tell.",
    &[
        ("object", "the object, on a stream with --object; a file keeps its own column"),
        ("taps", "taps of the object so far"),
        (
            "object_distance_mm",
            "distance that all of them tell, from where the base stands at shift_mm = 0 if the file has this column",
        ),
        ("object_sigma_mm", "its standard deviation; what the taps share is counted once"),
        ("object_from_95_mm", "with --interval: lower end of the interval that holds it with 95 %"),
        ("object_to_95_mm", "its upper end"),
        ("object_tilt_deg", "tilt that all of them tell, with a second gauge"),
        ("object_sigma_tilt_deg", "its standard deviation"),
        ("apart_line", "line of the tap that is farthest from what the others say"),
        ("apart_sigmas", "by how many standard deviations"),
        ("object_status", "ok, or ambiguous, outside_calibration, inconsistent, joined by +"),
    ],
);

/// What `located.csv` has more of strokes.
pub const ALONG: Table = table(
    "locate --strokes",
    "located.csv",
    "These columns follow status where readings are of strokes; they say what the readings of the stroke so far tell, so that its last row is its \
     answer. They are empty at rest, and where the drive falls.",
    &[
        ("stroke", "its number; a file that has such a column keeps its own"),
        ("rows", "readings of the stroke so far"),
        ("touch", "drive at which the whisker touched, degrees or mm"),
        ("touch_sigma", "its standard deviation"),
        ("stroke_distance_mm", "distance that they tell: the middle of its posterior"),
        ("from_68_mm", "lower end of the interval that holds it with 68 %"),
        ("to_68_mm", "upper end"),
        ("from_95_mm", "lower end of the interval that holds it with 95 %"),
        ("to_95_mm", "upper end"),
        ("apart_drive", "drive at which readings next to each other are farthest off the curve"),
        ("apart_sigmas", "by how many standard deviations"),
        (
            "stroke_status",
            "ok, or no_strain (no contact is seen), ambiguous, outside_calibration, strain_limit, inconsistent (no curve fits, as after a slip), \
             joined by +",
        ),
    ],
);

/// `taps.csv`.
pub const RAW: Table = table(
    "taps",
    "taps.csv",
    "A row is a tap, or where the record has a drive also a rest, in the order of time, as calibrate and locate read it.",
    &[
        ("a_mm", "distance of the record or of --a; empty of a rest that has none"),
        (
            "theta_deg or delta_mm",
            "mean drive; 0 is a rest. None where the record has none: then the rest is subtracted from the signal",
        ),
        ("strain or reading", "mean signal, in the unit and under the name of the record"),
        ("t_s", "middle of the samples of the mean"),
        ("tilt_deg", "of the record"),
        ("run", "of the record"),
    ],
);

/// `readings.csv`.
pub const READINGS: Table = table(
    "taps",
    "readings.csv",
    "A row is a reading of the record: what taps.csv was made of.",
    &[
        ("kind", "rest, plateau or peak"),
        ("begins_s", "first sample of the contact, or of the rest"),
        ("ends_s", "its last sample"),
        ("from_s", "first sample of the mean"),
        ("to_s", "its last sample"),
        ("samples", "number of samples of the mean"),
        ("signal", "their mean"),
        ("rest", "level without contact there"),
        ("sd", "standard deviation of the samples"),
    ],
);

/// `next.csv`.
pub const NEXT: Table = table(
    "next",
    "next.csv",
    "A row is a drive that the next tap could have, and a place of the base.",
    &[
        DRIVE,
        (
            "shift_mm",
            "how much nearer to the object the base stands than where its distance is told from: --shift; else where it stood for the last tap",
        ),
        (
            "expected_signal",
            "signal above its zero where the object is most likely: strain, or the unit of the reading",
        ),
        ("expected_sigma_mm", "standard deviation of the distance that is expected after the tap"),
        (
            "status",
            "ok, or strain_limit where the sensor could be overloaded, or outside_calibration where the base may move and the object could be \
             beyond the calibrated distances",
        ),
    ],
);

/// `plan.csv`.
pub const PLAN: Table = table(
    "plan",
    "plan.csv",
    "A row is a tap to do, or a zero reading, in this order; the column of the signal is to be filled in.",
    &[
        ("run", "the rig is set up anew for each"),
        ("a_mm", "contact distance to set"),
        ("theta_deg or delta_mm", "drive; 0 without contact"),
        ("strain, moment_Nmm or force_N", "empty"),
    ],
);

/// `plan_errors.csv`.
pub const PLAN_ERRORS: Table = table(
    "plan",
    "plan_errors.csv",
    "A row is a number of taps.",
    &[
        ("design", "planned, or even: all drives at as many positions, evenly apart, in each run"),
        ("taps", "number of taps"),
        ("sigma_mm", "root mean square error of a distance that is expected"),
    ],
);
