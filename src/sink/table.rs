//! The columns of every table: names, order, values. The one place that knows them.

use crate::design::Design;
use crate::estimate::Estimated;
use crate::evaluate::Outcome;
use crate::scene::{Convention, Drive, Setup, Tuple};
use crate::statistics::{DistanceRow, DriveRow};
use crate::status::Status;

/// A table that a sweep writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// One row per tap.
    Tuples,
    /// One row per design and drive.
    Designs,
    /// One row per design and distance.
    Distances,
}

/// One value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Field {
    /// A number; not finite is missing.
    Number(f64),
    /// A count.
    Count(u64),
    /// One of a few words.
    Word(&'static str),
    /// Any text.
    Text(String),
    /// Status words.
    Status(Status),
}

impl From<Option<f64>> for Field {
    fn from(x: Option<f64>) -> Self {
        Self::Number(x.unwrap_or(f64::NAN))
    }
}

impl Table {
    /// File name.
    pub fn file(self) -> &'static str {
        match self {
            Self::Tuples => "tuples.csv",
            Self::Designs => "designs.csv",
            Self::Distances => "distances.csv",
        }
    }

    /// Column names for `setup`.
    pub fn columns(self, setup: &Setup) -> Vec<&'static str> {
        let drive = setup.drive.column();
        let mm = setup.estimate.convention == Convention::Elongation;
        let (k, mean, sd) = if mm { ("K_mm", "K_mean_mm", "K_sd_mm") } else { ("K", "K_mean", "K_sd") };
        let mut names = vec!["D_mm", "d_mm", "L_a_mm", "x_ss_mm", "l_mm"];
        let rest: &[&str] = match self {
            Self::Tuples => &[
                "a_mm",
                drive,
                "strain",
                "strain_linear",
                k,
                "K_deviation",
                "distance_mm",
                "error_mm",
                "sigma_mm",
                "normal_force_N",
                "tangential_force_N",
                "contact_arc_mm",
                "contact_state",
                "status",
            ],
            Self::Designs => &[
                drive,
                "n",
                mean,
                sd,
                "error_rms_mm",
                "error_max_mm",
                "error_mean_mm",
                "noise_rms_mm",
                "total_rms_mm",
                "strain_max",
                "force_max_N",
                "status",
            ],
            Self::Distances => &["a_mm", "n", mean, sd, "status"],
        };
        names.extend(rest);
        names
    }
}

fn design_fields(t: &Tuple) -> [Field; 5] {
    [t.D, t.d, t.L_a, t.x_ss, t.l].map(Field::Number)
}

/// K̄ and SD in the unit of the table.
fn k_fields(row: &crate::reduce::Spread, unit: f64) -> [Field; 3] {
    let mean = row.mean().map(|m| (1.0 + m) * unit);
    [Field::Count(row.n), mean.into(), row.sd().map(|s| s * unit).into()]
}

/// Row of tuples.csv.
pub fn tuple_row(
    design: &Design,
    (a, drive): (f64, f64),
    tap: &Outcome,
    e: &Estimated,
    mm: Option<f64>,
    out: &mut Vec<Field>,
) {
    let unit = mm.unwrap_or(1.0);
    let solved = tap.arc.is_finite();
    out.extend(design_fields(&design.tuple));
    out.extend(
        [
            a,
            drive,
            tap.strain,
            tap.strain_linear,
            (1.0 + tap.deviation) * unit,
            if mm.is_some() { f64::NAN } else { tap.deviation },
            e.distance,
            e.distance - a,
            e.sigma,
            tap.normal_force,
            tap.tangential_force,
            tap.arc,
        ]
        .map(Field::Number),
    );
    let state = if tap.sticking { "stick" } else { "slide" };
    out.push(Field::Word(if solved { state } else { "" }));
    out.push(Field::Status(tap.status | e.status));
}

/// Row of designs.csv.
pub fn drive_row(design: &Tuple, drive: f64, row: &DriveRow, unit: f64, out: &mut Vec<Field>) {
    out.extend(design_fields(design));
    out.push(Field::Number(drive));
    out.extend(k_fields(&row.deviation, unit));
    out.extend(
        [
            row.error_rms(),
            row.error_max(),
            row.error_mean(),
            row.noise_rms(),
            row.total_rms(),
            row.strain_max(),
            row.force_max(),
        ]
        .map(Field::from),
    );
    out.push(Field::Status(row.status));
}

/// Row of distances.csv.
pub fn distance_row(design: &Design, a: f64, row: &DistanceRow, unit: f64, out: &mut Vec<Field>) {
    out.extend(design_fields(&design.tuple));
    out.push(Field::Number(a));
    out.extend(k_fields(&row.deviation, unit));
    out.push(Field::Status(row.status));
}

/// Name of the drive with unit, for people.
pub fn drive_unit(drive: Drive) -> (&'static str, &'static str) {
    match drive {
        Drive::Angle => ("θ", "°"),
        Drive::Displacement => ("δ", " mm"),
    }
}
