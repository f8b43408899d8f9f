//! The tables of a sweep: their columns, their rows, and how values are read from rows.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::heading::{Fact, Heading, Only, heading, property};
use crate::design::Design;
use crate::estimate::Estimated;
use crate::evaluate::Outcome;
use crate::scene::{Drive, Property, Setup, Tuple, channels::MOST_CHANNELS};
use crate::sheet::TableFormat;
use crate::statistics::{DistanceRow, Figures, Reduction};
use crate::values::{Field, named};

vibrissa_core::words! {
    /// A table that a sweep writes, in the order of their counts.
    #[derive(Serialize)]
    Table {
        /// One row per tap.
        Tuples = "tuples",
        /// One row per design and stroke: a direction of the pole and a drive.
        Designs = "designs",
        /// One row per design, distance and direction of the pole.
        Distances = "distances",
    }
}

impl Table {
    /// Its file name.
    pub fn file(self, format: TableFormat) -> String {
        format!("{}.{}", self.word(), format.word())
    }

    /// Its definition, with columns.
    pub fn heading(self) -> &'static Heading {
        heading(self.word())
    }
}

/// Columns of the whisker.
pub const WHISKER: [&str; 5] = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm"];

/// Stands in `columns.csv` for the varying properties of the rig, one column each; the value read is the number of the rig.
const PROPERTIES: &str = "*";

/// Reads a value from a row `R`; the number is the channel.
type Read<R> = fn(&R, usize) -> Field;

type Column<R> = (&'static str, Read<R>);

/// The columns of a table for one setup, in order.
pub struct Chosen<'s, R> {
    setup: &'s Setup,
    values: Vec<(Read<R>, usize, Option<Property>)>,
}

impl<'s, R> Chosen<'s, R> {
    fn new(table: Table, columns: &[Column<R>], setup: &'s Setup) -> Self {
        let value = |(fact, k, _): (&Fact, usize, &str)| {
            let own = if fact.only == Only::Varies { PROPERTIES } else { &fact.name };
            let (_, read) = columns.iter().find(|(name, _)| *name == own).expect("every column has a value");
            (*read, k, property(&fact.name))
        };
        let values = table.heading().chosen(setup).into_iter().map(value).collect();
        Self { setup, values }
    }

    /// The values of `row`.
    pub fn fields(&self, row: &R) -> impl Iterator<Item = Field> {
        self.values.iter().map(move |(read, k, property)| match (property, read(row, *k), &self.setup.rigs) {
            (Some(property), Field::Count(rig), Some(rigs)) => rigs.value(rig, *property).into(),
            (_, field, _) => field,
        })
    }
}

/// Symbol and unit of the drive, for readers.
pub fn drive_unit(drive: Drive) -> (&'static str, &'static str) {
    match drive {
        Drive::Angle => ("θ", "°"),
        Drive::Displacement => ("δ", " mm"),
    }
}

/// A row of tuples.csv: one tap.
#[derive(Debug, Clone, Copy)]
pub struct TapRow<'a> {
    design: Tuple,
    whisker: &'a Design,
    tap: &'a Outcome,
    estimated: &'a Estimated,
    /// Length by which K is multiplied if it has a unit, mm.
    elongation: Option<f64>,
    /// Reading and K of each channel; `None` with one signal.
    channels: Option<[[f64; 2]; MOST_CHANNELS]>,
}

/// A row of designs.csv: a design at one stroke (direction of the pole and drive), over its distances.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AtDrive {
    /// Whisker and stroke.
    pub design: Tuple,
    /// Its statistics.
    pub row: Figures,
    /// Factor of K: 1, or the elongation length, mm.
    pub unit: f64,
}

/// A row of distances.csv: a design at one distance and direction of the pole, over its drives.
#[derive(Debug, Clone, Copy)]
pub struct AtDistance<'a> {
    /// Whisker, distance and direction.
    pub design: Tuple,
    /// Its statistics.
    pub row: &'a DistanceRow,
    /// Factor of K: 1, or the elongation length, mm.
    pub unit: f64,
}

fn mean(mean: Option<f64>, unit: f64) -> Field {
    mean.map(|m| (1.0 + m) * unit).into()
}

fn sd(sd: Option<f64>, unit: f64) -> Field {
    sd.map(|s| s * unit).into()
}

impl<'a> TapRow<'a> {
    /// A row of the tap `design` of `whisker`: its outcome, and the distance estimated from it; `reduced` belongs to the whisker.
    pub fn of(
        reduced: &Reduction<'_>,
        whisker: &'a Design,
        design: Tuple,
        (tap, estimated): (&'a Outcome, &'a Estimated),
    ) -> Self {
        let channels = reduced.of_channels((design.a, design.drive), tap);
        Self { design, whisker, tap, estimated, elongation: reduced.elongation, channels }
    }

    const COLUMNS: [Column<Self>; 23] = [
        ("a_mm", |r, _| r.design.a.into()),
        ("x_a_mm", |r, _| r.whisker.abscissa(r.design.a).into()),
        ("theta_deg|delta_mm", |r, _| r.design.drive.into()),
        ("strain|signal", |r, _| r.tap.strain.into()),
        ("strain_linear|signal_linear", |r, _| r.tap.strain_linear.into()),
        ("K|K_mm", |r, _| ((1.0 + r.tap.deviation) * r.elongation.unwrap_or(1.0)).into()),
        ("K_deviation", |r, _| r.elongation.map_or(r.tap.deviation, |_| f64::NAN).into()),
        ("distance_mm", |r, _| r.estimated.distance.into()),
        ("error_mm", |r, _| (r.estimated.distance - r.design.a).into()),
        ("sigma_mm", |r, _| r.estimated.sigma.into()),
        ("normal_force_N", |r, _| r.tap.normal_force.into()),
        ("tangential_force_N", |r, _| r.tap.tangential_force.into()),
        ("contact_arc_mm", |r, _| r.tap.arc.into()),
        ("contact_state", |r, _| match (r.tap.arc.is_finite(), r.tap.sticking) {
            (false, _) => "".into(),
            (_, true) => "stick".into(),
            _ => "slide".into(),
        }),
        ("strain_2", |r, _| r.tap.strain_2.into()),
        ("bending_azimuth_deg", |r, _| r.tap.azimuth.to_degrees().into()),
        ("slide_mm", |r, _| r.tap.slide.into()),
        ("base_moment_Nmm", |r, _| r.tap.wrench[0].into()),
        ("base_fx_N", |r, _| r.tap.wrench[1].into()),
        ("base_fy_N", |r, _| r.tap.wrench[2].into()),
        ("signal_moment…|channel_1…", |r, k| r.channels.map(|all| all[k / 2][k % 2]).into()),
        ("estimated_force_N", |r, _| r.estimated.force.into()),
        ("status", |r, _| (r.tap.status | r.estimated.status).into()),
    ];
}

impl AtDrive {
    const COLUMNS: [Column<Self>; 12] = [
        ("theta_deg|delta_mm", |r, _| r.design.drive.into()),
        ("n", |r, _| r.row.n.into()),
        ("K_mean|K_mean_mm", |r, _| mean(r.row.mean, r.unit)),
        ("K_sd|K_sd_mm", |r, _| sd(r.row.sd, r.unit)),
        ("error_rms_mm", |r, _| r.row.error_rms.into()),
        ("error_max_mm", |r, _| r.row.error_max.into()),
        ("error_mean_mm", |r, _| r.row.error_mean.into()),
        ("noise_rms_mm", |r, _| r.row.noise_rms.into()),
        ("total_rms_mm", |r, _| r.row.total_rms().into()),
        ("strain_max|signal_max", |r, _| r.row.strain_max.into()),
        ("force_max_N", |r, _| r.row.force_max.into()),
        ("status", |r, _| r.row.status.into()),
    ];

    /// The row as JSON by column name; missing is null.
    pub fn json(&self, setup: &Setup) -> Value {
        named(Table::Designs.heading().names(setup), AtDrive::chosen(setup).fields(self))
    }
}

impl AtDistance<'_> {
    const COLUMNS: [Column<Self>; 5] = [
        ("a_mm", |r, _| r.design.a.into()),
        ("n", |r, _| r.row.deviation.n.into()),
        ("K_mean|K_mean_mm", |r, _| mean(r.row.deviation.mean(), r.unit)),
        ("K_sd|K_sd_mm", |r, _| sd(r.row.deviation.sd(), r.unit)),
        ("status", |r, _| r.row.status.into()),
    ];
}

/// The columns of each table for a setup: shared ones (whisker, direction), then those of the table.
macro_rules! chosen {
    ($($row:ty => $table:ident;)*) => {$(
        impl $row {
            /// Its columns for `setup`.
            pub fn chosen(setup: &Setup) -> Chosen<'_, Self> {
                let shared: [Column<Self>; 8] = [
                    ("D_mm", |r, _| r.design.D.into()),
                    ("d_tip_mm", |r, _| r.design.d.into()),
                    ("L_a_mm", |r, _| r.design.L_a.into()),
                    ("x_ss_mm", |r, _| r.design.x_ss.into()),
                    ("l_mm", |r, _| r.design.l.into()),
                    (PROPERTIES, |r, _| Field::Count(r.design.rig)),
                    ("tilt_deg", |r, _| r.design.tilt.into()),
                    ("lean_deg", |r, _| r.design.lean.into()),
                ];
                Chosen::new(Table::$table, &[&shared[..], &Self::COLUMNS].concat(), setup)
            }
        }
    )*};
}
chosen!(TapRow<'_> => Tuples; AtDrive => Designs; AtDistance<'_> => Distances;);
