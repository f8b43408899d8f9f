//! Rows and columns of the tables of a sweep.

use super::Field::{self, Count, Number, Word};
use super::Name::{Drive as DriveName, Is, K, Read};
use super::{Column, Name, Only, column, only, with_properties};
use crate::design::Design;
use crate::estimate::Estimated;
use crate::evaluate::Outcome;
use crate::scene::channels::MOST_CHANNELS;
use crate::scene::{Direction, PROPERTIES, Tuple};
use crate::statistics::{DistanceRow, Figures, Reduction};

/// A row of tuples.csv: one tap.
#[derive(Debug, Clone, Copy)]
pub struct TapRow<'a> {
    /// Its whisker.
    pub design: &'a Design,
    /// Contact distance, mm.
    pub a: f64,
    /// Direction of the pole.
    pub direction: Direction,
    /// Tap angle, degrees, or displacement, mm.
    pub drive: f64,
    /// What the rod gives.
    pub tap: &'a Outcome,
    /// The distance read from it.
    pub estimated: &'a Estimated,
    /// Length by which K is multiplied, where it has a unit, mm.
    pub elongation: Option<f64>,
    /// Reading and K of each channel; nothing of one signal.
    pub channels: Option<[[f64; 2]; MOST_CHANNELS]>,
}

/// A row of designs.csv: a design at one stroke (direction of the pole and drive), over its distances.
#[derive(Debug, Clone, Copy)]
pub struct AtDrive<'a> {
    /// The whisker.
    pub design: &'a Tuple,
    /// Direction of the pole.
    pub direction: Direction,
    /// Tap angle, degrees, or displacement, mm.
    pub drive: f64,
    /// Its statistics.
    pub row: Figures,
    /// Unit of K.
    pub unit: f64,
}

/// A row of distances.csv: a design at one distance and direction of the pole, over its drives.
#[derive(Debug, Clone, Copy)]
pub struct AtDistance<'a> {
    /// The whisker.
    pub design: &'a Tuple,
    /// Contact distance, mm.
    pub a: f64,
    /// Direction of the pole.
    pub direction: Direction,
    /// Its statistics.
    pub row: &'a DistanceRow,
    /// Unit of K.
    pub unit: f64,
}

/// The largest size of what is read.
pub const LARGEST: Name = Read("strain_max", "signal_max");

const DIAMETER: &str = "base diameter D";
const TIP: &str = "tip diameter d";
const LENGTH: &str = "length L_a";
const PLACE: &str = "place of the gauge's near end x_ss";
const GRID: &str = "length of the gauge's grid l";
const DISTANCE: &str = "contact distance a";
const TILT: &str = "tilt β of the object's edge round the whisker's axis (§6)";
const LEAN: &str = "lean γ of the object's edge along the whisker (§6)";
const AZIMUTH: &str = "azimuth φ of the plane in which the whisker bends, from that of rotation (§6)";
const DRIVE: &str = "tap angle θ, or displacement δ of the object";
const COUNTED: &str = "taps that count (§4.5)";
const MEAN: &str = "mean of K over the taps that count (22)";
const SPREAD: &str = "sample standard deviation of K, n − 1 (22)";
const WORDS: &str = "ok, or words joined by +";

/// Mean of K in the unit of the table, from that of K − 1.
fn mean(mean: Option<f64>, unit: f64) -> Field {
    mean.map(|m| (1.0 + m) * unit).into()
}

/// Its standard deviation.
fn sd(sd: Option<f64>, unit: f64) -> Field {
    sd.map(|s| s * unit).into()
}

/// The column of channel `k` that is its reading (0), or its K (1).
const fn channel<R>(k: usize, which: usize, meaning: &'static str, read: fn(&R) -> Field) -> Column<R> {
    Column { name: Name::Channel(k, which), meaning, only: Only::Channel(k), read }
}

fn reading<const K: usize>(r: &TapRow<'_>) -> Field {
    r.channels.map(|all| all[K][0]).into()
}

fn factor<const K: usize>(r: &TapRow<'_>) -> Field {
    r.channels.map(|all| all[K][1]).into()
}

impl<'a> TapRow<'a> {
    /// Of one `tap`: its whisker, where and how it is tapped, what is read from it; `reduced` is that of its whisker.
    pub fn of(
        reduced: &Reduction<'_>,
        design: &'a Design,
        (a, direction, drive): (f64, Direction, f64),
        (tap, estimated): (&'a Outcome, &'a Estimated),
    ) -> Self {
        let channels = reduced.of_channels((a, drive), tap);
        Self { design, a, direction, drive, tap, estimated, elongation: reduced.elongation, channels }
    }
}

impl TapRow<'_> {
    /// Columns of tuples.csv.
    pub const COLUMNS: [Column<Self>; 41 + PROPERTIES] = with_properties(
        [
            column(Is("D_mm"), DIAMETER, |r| Number(r.design.tuple.D)),
            column(Is("d_mm"), TIP, |r| Number(r.design.tuple.d)),
            column(Is("L_a_mm"), LENGTH, |r| Number(r.design.tuple.L_a)),
            column(Is("x_ss_mm"), PLACE, |r| Number(r.design.tuple.x_ss)),
            column(Is("l_mm"), GRID, |r| Number(r.design.tuple.l)),
            column(Is("a_mm"), DISTANCE, |r| Number(r.a)),
            only(
                Only::Curved,
                "x_a_mm",
                "abscissa of the contact on the whisker at rest, r₀(a)·x (§7)",
                |r| Number(r.design.abscissa(r.a)),
            ),
            only(Only::Tilt, "tilt_deg", TILT, |r| Number(r.direction.tilt)),
            only(Only::Lean, "lean_deg", LEAN, |r| Number(r.direction.lean)),
            column(DriveName, DRIVE, |r| Number(r.drive)),
            column(
                Read("strain", "signal"),
                "mean strain over the grid, tension positive (§1); or M₀ (N mm), or F_y (N), as the root feels it (§7)",
                |r| Number(r.tap.strain),
            ),
            column(
                Read("strain_linear", "signal_linear"),
                "the same of the estimator's theory, ±θ f (20)",
                |r| Number(r.tap.strain_linear),
            ),
            column(
                K("K", "K_mm"),
                "strain_linear/strain (20); of two gauges θ f cos β̂/√(ε₁² + ε₂²), tan β̂ = ε₂/ε₁ (§6)",
                |r| Number((1.0 + r.tap.deviation) * r.elongation.unwrap_or(1.0)),
            ),
            column(
                Is("K_deviation"),
                "K − 1 at full relative precision (21); empty where K has a unit",
                |r| Number(if r.elongation.is_some() { f64::NAN } else { r.tap.deviation }),
            ),
            column(Is("distance_mm"), "estimated distance â (23); by the model itself (25)", |r| {
                Number(r.estimated.distance)
            }),
            column(Is("error_mm"), "bias: â − a", |r| Number(r.estimated.distance - r.a)),
            column(Is("sigma_mm"), "standard deviation of â by the noise of the gauge (24), (26)", |r| {
                Number(r.estimated.sigma)
            }),
            column(Is("normal_force_N"), "contact force across the whisker P (§3.1)", |r| {
                Number(r.tap.normal_force)
            }),
            column(Is("tangential_force_N"), "contact force along the whisker T (§3.1)", |r| {
                Number(r.tap.tangential_force)
            }),
            column(Is("contact_arc_mm"), "arc length of the contact c (§3.2)", |r| Number(r.tap.arc)),
            column(Is("contact_state"), "slide or stick (§3.5)", |r| {
                let state = if r.tap.sticking { "stick" } else { "slide" };
                Word(if r.tap.arc.is_finite() { state } else { "" })
            }),
            only(Only::Second, "strain_2", "strain of the second gauge, 90° round the whisker (§6)", |r| {
                Number(r.tap.strain_2)
            }),
            only(Only::Second, "bending_azimuth_deg", AZIMUTH, |r| Number(r.tap.azimuth.to_degrees())),
            only(Only::Second, "slide_mm", "slide λ of the contact along the object's edge (§6)", |r| {
                Number(r.tap.slide)
            }),
            only(
                Only::Wrench,
                "base_moment_Nmm",
                "moment of the whisker on its root M₀, counterclockwise (§7)",
                |r| Number(r.tap.wrench[0]),
            ),
            only(Only::Wrench, "base_fx_N", "force of the whisker on its root along it, F_x (§7)", |r| {
                Number(r.tap.wrench[1])
            }),
            only(Only::Wrench, "base_fy_N", "the same across it, towards the object, F_y (§7)", |r| {
                Number(r.tap.wrench[2])
            }),
            channel(0, 0, "reading of a channel (§7)", reading::<0>),
            channel(0, 1, "K of this channel: linear theory over the reading", factor::<0>),
            channel(1, 0, "reading of a channel (§7)", reading::<1>),
            channel(1, 1, "K of this channel: linear theory over the reading", factor::<1>),
            channel(2, 0, "reading of a channel (§7)", reading::<2>),
            channel(2, 1, "K of this channel: linear theory over the reading", factor::<2>),
            channel(3, 0, "reading of a channel (§7)", reading::<3>),
            channel(3, 1, "K of this channel: linear theory over the reading", factor::<3>),
            channel(4, 0, "reading of a channel (§7)", reading::<4>),
            channel(4, 1, "K of this channel: linear theory over the reading", factor::<4>),
            channel(5, 0, "reading of a channel (§7)", reading::<5>),
            channel(5, 1, "K of this channel: linear theory over the reading", factor::<5>),
            only(
                Only::Several,
                "estimated_force_N",
                "contact force P told by all channels together (§7)",
                |r| Number(r.estimated.force),
            ),
            column(Is("status"), WORDS, |r| Field::Status(r.tap.status | r.estimated.status)),
        ],
        |r| Count(r.design.tuple.rig),
    );
}

impl AtDrive<'_> {
    /// Columns of designs.csv.
    pub const COLUMNS: [Column<Self>; 19 + PROPERTIES] = with_properties(
        [
            column(Is("D_mm"), DIAMETER, |r| Number(r.design.D)),
            column(Is("d_mm"), TIP, |r| Number(r.design.d)),
            column(Is("L_a_mm"), LENGTH, |r| Number(r.design.L_a)),
            column(Is("x_ss_mm"), PLACE, |r| Number(r.design.x_ss)),
            column(Is("l_mm"), GRID, |r| Number(r.design.l)),
            only(Only::Tilt, "tilt_deg", TILT, |r| Number(r.direction.tilt)),
            only(Only::Lean, "lean_deg", LEAN, |r| Number(r.direction.lean)),
            column(DriveName, DRIVE, |r| Number(r.drive)),
            column(Is("n"), COUNTED, |r| Count(r.row.n)),
            column(K("K_mean", "K_mean_mm"), MEAN, |r| mean(r.row.mean, r.unit)),
            column(K("K_sd", "K_sd_mm"), SPREAD, |r| sd(r.row.sd, r.unit)),
            column(Is("error_rms_mm"), "bias: root mean square of â − a (§4.3)", |r| {
                r.row.error_rms.into()
            }),
            column(Is("error_max_mm"), "bias: largest |â − a|", |r| r.row.error_max.into()),
            column(Is("error_mean_mm"), "bias: mean of â − a", |r| r.row.error_mean.into()),
            column(Is("noise_rms_mm"), "noise: root mean square of sigma_mm (§4.4)", |r| {
                r.row.noise_rms.into()
            }),
            column(Is("total_rms_mm"), "bias (error_rms_mm) and noise in quadrature (§4.4)", |r| {
                r.row.total_rms().into()
            }),
            column(
                LARGEST,
                "largest |strain|; of two gauges √(ε₁² + ε₂²); or largest |signal| (§7)",
                |r| r.row.strain_max.into(),
            ),
            column(Is("force_max_N"), "largest contact force P", |r| r.row.force_max.into()),
            column(Is("status"), WORDS, |r| Field::Status(r.row.status)),
        ],
        |r| Count(r.design.rig),
    );
}

impl AtDistance<'_> {
    /// Columns of distances.csv.
    pub const COLUMNS: [Column<Self>; 12 + PROPERTIES] = with_properties(
        [
            column(Is("D_mm"), DIAMETER, |r| Number(r.design.D)),
            column(Is("d_mm"), TIP, |r| Number(r.design.d)),
            column(Is("L_a_mm"), LENGTH, |r| Number(r.design.L_a)),
            column(Is("x_ss_mm"), PLACE, |r| Number(r.design.x_ss)),
            column(Is("l_mm"), GRID, |r| Number(r.design.l)),
            column(Is("a_mm"), DISTANCE, |r| Number(r.a)),
            only(Only::Tilt, "tilt_deg", TILT, |r| Number(r.direction.tilt)),
            only(Only::Lean, "lean_deg", LEAN, |r| Number(r.direction.lean)),
            column(Is("n"), COUNTED, |r| Count(r.row.deviation.n)),
            column(K("K_mean", "K_mean_mm"), MEAN, |r| mean(r.row.deviation.mean(), r.unit)),
            column(K("K_sd", "K_sd_mm"), SPREAD, |r| sd(r.row.deviation.sd(), r.unit)),
            column(Is("status"), WORDS, |r| Field::Status(r.row.status)),
        ],
        |r| Count(r.design.rig),
    );
}
