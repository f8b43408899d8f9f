//! Tables of `shape`.

use super::{Table, table};
use crate::shape;

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
