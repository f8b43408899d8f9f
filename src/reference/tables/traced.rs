//! Tables of traced objects.

use super::{DRIVE, STATUS, Table, Told, table};
use crate::shape;

const X: Told = (
    "x_mm",
    "where the whisker touched: first of a tap, then of a stroke's reading; in the frame of the bases",
);
const LINE: Told = ("line", "number of the line in the file");
const SIGNAL: Told = ("strain or reading", "the signal as recorded; tension positive");
const ZERO: Told = ("zero", "what was subtracted from it; empty where no zero is known");
const Y: Told = ("y_mm", "the same");

/// `points.csv`.
pub const POINTS: Table = table(
    "contour",
    "points.csv",
    "A row is a row of the data, whose own columns stand after line as in located.csv (docs/contour.md).",
    &[
        LINE,
        ("base_x_mm", "the motor's axis"),
        ("base_y_mm", "the motor's axis"),
        ("heading_deg", "direction of the undeflected whisker at first touch"),
        DRIVE,
        SIGNAL,
        ZERO,
        ("distance_mm", "distance â of the tap, or of the virtual tap of a stroke's reading"),
        ("sigma_mm", "standard deviation of â"),
        X,
        Y,
        ("z_mm", "the third coordinate, that of the base"),
        ("sigma_major_mm", "longer half axis of the ellipse of one standard deviation"),
        ("sigma_minor_mm", "shorter half axis"),
        ("axis_deg", "direction of the longer half axis against x"),
        ("off_mm", "distance to the left of the curve; empty without one"),
        ("off_sigma", "off_mm over the standard deviation of the point across the curve"),
        ("status", "ok, or words joined by +; outlier: off the curve, or off its stroke"),
    ],
);

/// `located.csv` of an array.
pub const ARRAY: Table = table(
    "locate --array",
    "located.csv",
    "A row is a reading of one of several whiskers; the file's own columns stand after line, as in that of one whisker.",
    &[
        LINE,
        ("whisker", "name of the whisker"),
        DRIVE,
        SIGNAL,
        ZERO,
        ("distance_mm", "distance â"),
        ("sigma_mm", "standard deviation of â"),
        ("x_mm", "where the whisker first touched, in the frame of the array"),
        Y,
        ("z_mm", "the same: the plane in which the whisker turns"),
        ("sigma_x_mm", "standard deviation of x"),
        ("sigma_y_mm", "standard deviation of y"),
        ("sigma_z_mm", "standard deviation of z"),
        STATUS,
    ],
);

/// `curve.csv`.
pub const CURVE: Table = table(
    "contour",
    "curve.csv",
    "A row is a place on the curve, from its first point to its last; none where there is no curve.",
    &[
        ("s_mm", "length from the first place"),
        ("x_mm", "place"),
        ("y_mm", "place"),
        ("direction_deg", "direction of the curve against x"),
        ("sigma_mm", "standard deviation of the curve across it"),
    ],
);

/// `strokes.csv`.
pub const STROKES: Table = table(
    "simulate",
    "strokes.csv",
    "A row is a synthetic reading of a stroke (simulate --object).",
    &[
        ("stroke", "number of the start"),
        ("base_x_mm", "the motor's axis"),
        ("base_y_mm", "the motor's axis"),
        ("heading_deg", "direction of the undeflected whisker at first touch, as it is noticed"),
        ("sense", "1: turns counterclockwise, -1: clockwise"),
        ("theta_deg", "angle since the touch was noticed; 0 is a zero reading"),
        ("strain or microstrain or bridge_mV_per_V or reading", "the signal"),
        ("true_x_mm", "where the whisker touches; true_y_mm too"),
        ("true_y_mm", "the same"),
        ("touch_x_mm", "where it first touched; touch_y_mm too"),
        ("touch_y_mm", "the same"),
        ("source", "synthetic, in every row"),
        ("status", "ok, or slipped_off where the whisker has left the place: off its tip, or along a face"),
    ],
);

/// `shape.csv`.
pub const SHAPE: Table = table(
    "shape",
    "shape.csv",
    "A row is a section of a bent whisker; a block of rows is a tap, from the clamp to the tip. The motor's axis is the origin, x lies along the \
     whisker at first touch, y towards the object.",
    shape::COLUMNS,
)
.after(shape::TAP);

/// `contacts.csv`.
pub const CONTACTS: Table =
    table("shape", "contacts.csv", "A row is a tap; places as in shape.csv.", shape::CONTACTS)
        .after(shape::TAP);
