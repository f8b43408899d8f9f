//! Tables of `shape`.

use super::{A, BASE, DRIVE, GRID, LEAN, LENGTH, PLACE, STATUS, TILT, TIP, Table, Told, table};

const TAP: Told = ("tap", "number of the tap, from 0, in the order of the spec");

/// `shape.csv`.
pub const SHAPE: Table = table(
    "shape",
    "shape.csv",
    "A row is a section of a bent whisker; a block of rows is a tap, from the clamp to the tip. The motor's axis is the origin, x lies along the \
     whisker at first touch, y towards the object.",
    &[
        TAP,
        BASE,
        TIP,
        LENGTH,
        PLACE,
        GRID,
        A,
        TILT,
        LEAN,
        DRIVE,
        ("s_mm", "arc length s from the clamp, in the unloaded whisker"),
        ("x_mm", "place of the section's centre"),
        ("y_mm", "the same, towards the object"),
        ("z_mm", "the same, along the motor's axis"),
        ("psi_deg", "ψ: turn of the section against that at the contact"),
        ("direction_deg", "direction of the section's normal against x"),
        ("strain", "strain of the fibre on the side that touches; tension positive"),
        ("diameter_mm", "diameter of the unloaded section (model §7)"),
    ],
);

/// `contacts.csv`.
pub const CONTACTS: Table = table(
    "shape",
    "contacts.csv",
    "A row is a tap; places as in shape.csv.",
    &[
        TAP,
        BASE,
        TIP,
        LENGTH,
        PLACE,
        GRID,
        A,
        TILT,
        LEAN,
        DRIVE,
        ("hub_mm", "distance of the motor's axis behind the clamp"),
        ("gauge_from_mm", "near end x1 of the gauge"),
        ("gauge_to_mm", "far end x2 of the gauge"),
        ("strain", "mean strain of the gauge, on its side"),
        ("normal_force_N", "force P pressing on the object"),
        ("tangential_force_N", "friction T on the whisker, positive towards the tip"),
        ("contact_arc_mm", "arc length c of the contact"),
        ("contact_x_mm", "place where the force acts"),
        ("contact_y_mm", "the same, towards the object"),
        ("contact_z_mm", "the same, along the motor's axis"),
        ("pole_x_mm", "centre of the pole"),
        ("pole_y_mm", "the same, towards the object"),
        ("pole_z_mm", "the same, along the motor's axis"),
        ("pole_radius_mm", "its radius ρ"),
        ("contact_state", "slide or stick"),
        STATUS,
    ],
);
