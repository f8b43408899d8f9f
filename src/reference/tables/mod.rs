//! What the columns of the tables say whose headers are lists of names: a test compares these lists with the files.

mod judged;
mod object;
mod traced;

use judged::{VERIFY, WORK};
use object::{ALONG, NEXT, PLAN, PLAN_ERRORS, RAW, READINGS, TOGETHER};
use traced::{ARRAY, CURVE, POINTS, STROKES};
use traced::{CONTACTS, SHAPE};

/// Name (`this or that` where it is one or the other) and meaning.
pub type Told = (&'static str, &'static str);

/// A table and its columns.
#[derive(Debug)]
pub struct Table {
    /// The command that writes it.
    pub command: &'static str,
    /// The file.
    pub file: &'static str,
    /// What a row is.
    pub row: &'static str,
    /// Its first columns, which another table has too.
    pub before: &'static [Told],
    /// Its own columns, in order.
    pub columns: &'static [Told],
}

impl Table {
    /// With columns `before` its own.
    const fn after(self, before: &'static [Told]) -> Self {
        Self { before, ..self }
    }
}

const fn table(
    command: &'static str,
    file: &'static str,
    row: &'static str,
    columns: &'static [Told],
) -> Table {
    Table { command, file, row, before: &[], columns }
}

const STATUS: Told = ("status", "ok, or words joined by +");
const DRIVE: Told = ("theta_deg or delta_mm", "tap angle θ, or displacement δ of the object");
const TILT: Told = ("tilt_deg", "tilt β of the object's edge (§6)");
const LEAN: Told = ("lean_deg", "lean γ of the object's edge (§6)");
const A: Told = ("a_mm", "contact distance a");
const SIDE: Told = ("side", "side of the whisker: contact or far");
const BASE: Told = ("D_mm", "base diameter D");
const TIP: Told = ("d_mm", "tip diameter d");
const LENGTH: Told = ("L_a_mm", "length L_a");
const PLACE: Told = ("x_ss_mm", "place of the gauge's near end x_ss");
const GRID: Told = ("l_mm", "length of the gauge's grid l");

/// What `designs.csv` of a calibration has more than that of a sweep.
pub const AT_DRIVE: &[Told] = &[
    ("held_out_rms_mm", "rms error of the paper's estimator on distances left out of its calibration"),
    SIDE,
];
/// What `distances.csv` of a calibration has more than that of a sweep.
pub const AT_DISTANCE: &[Told] = &[SIDE];

/// Tables that are no table of a sweep.
pub const OTHERS: &[Table] = &[
    HISTORY,
    SENSITIVITY,
    TAP,
    K_TABLE,
    ROWS,
    LOCATED,
    TOGETHER,
    ALONG,
    ARRAY,
    PLAN,
    PLAN_ERRORS,
    NEXT,
    RAW,
    READINGS,
    POINTS,
    CURVE,
    MEASUREMENTS,
    STROKES,
    SHAPE,
    CONTACTS,
    VERIFY,
    WORK,
];

const HISTORY: Table = table(
    "optimise",
    "history.csv",
    "A row is a step of the search that found something better, and the best so far.",
    &[
        ("evaluations", "evaluations so far"),
        ("start", "number of the start"),
        ("stage", "swarm or polish"),
        BASE,
        TIP,
        LENGTH,
        PLACE,
        GRID,
        DRIVE,
        ("K_sd or K_sd_mm", "spread of K (§4.2); over the samples with `robust`"),
        ("total_rms_mm", "bias and noise in quadrature (§4.4); over the samples with `robust`"),
        ("weighted", "value of the objective \"weighted\""),
        ("violation", "sum of what exceeds the limits; 0 where all are kept"),
    ],
);

const SENSITIVITY: Table = table(
    "optimise",
    "sensitivity.csv",
    "A row is a parameter p of the nominal whisker.",
    &[
        ("parameter", "key of the spec"),
        ("K_sd_elasticity", "∂ln K_sd/∂ln p at the optimum, % per %"),
        ("total_rms_elasticity", "∂ln total_rms_mm/∂ln p at the optimum, % per %"),
        (
            "K_sd_first",
            "share of the variance of ln K_sd over the box of the variables that p makes alone: first-order Sobol' index",
        ),
        ("K_sd_total", "share in which p takes part: total Sobol' index"),
        ("total_rms_first", "the same of ln total_rms_mm, first order"),
        ("total_rms_total", "the same of ln total_rms_mm, total"),
        ("K_sd_first_low", "lower end of the 95 % confidence interval of K_sd_first"),
        ("K_sd_first_high", "its upper end"),
        ("K_sd_total_low", "lower end of the interval of K_sd_total"),
        ("K_sd_total_high", "its upper end"),
        ("total_rms_first_low", "lower end of the interval of total_rms_first"),
        ("total_rms_first_high", "its upper end"),
        ("total_rms_total_low", "lower end of the interval of total_rms_total"),
        ("total_rms_total_high", "its upper end"),
        ("scale", "\"ln\": the shares are of the logarithm of the figure; empty where p does not vary"),
    ],
);

const TAP: Table = table(
    "tap",
    "tap.csv",
    "A row is one drive of the interval.",
    &[
        DRIVE,
        ("K_mean or K_mean_mm", "mean of K over the taps that count, (22)"),
        ("K_sd or K_sd_mm", "sample standard deviation of K (n − 1), (22)"),
        ("bias_rms_mm", "another name of error_rms_mm"),
        ("noise_rms_mm", "root mean square of the standard deviation of â by noise (24)"),
        ("total_rms_mm", "bias and noise in quadrature (§4.4)"),
        ("strain_max", "largest |strain|"),
        ("error_rms_mm", "bias: root mean square of â − a (§4.3)"),
        STATUS,
    ],
);

const K_TABLE: Table = table(
    "calibrate",
    "K_table.csv",
    "A row is a cell: one distance, one drive, one side; values are those of the mean of its repeats.",
    &[
        A,
        DRIVE,
        ("n", "taps of the cell that are used"),
        ("strain or reading", "mean signal of the taps, zero removed; tension positive"),
        ("strain_sd or reading_sd", "standard deviation of one tap's signal"),
        ("strain_linear", "±θ f(a) of the estimator's theory (20)"),
        ("K", "strain_linear over the signal (20)"),
        ("K_deviation", "K − 1"),
        ("distance_mm", "distance â that the paper's procedure gives back (23)"),
        ("error_mm", "â − a"),
        ("sigma_mm", "standard deviation of â"),
        SIDE,
        STATUS,
    ],
);

const ROWS: Table = table(
    "calibrate",
    "rows.csv",
    "A row is a row of the data; the estimator is the one that won.",
    &[
        ("line", "line of the data file"),
        A,
        ("theta_deg or delta_mm", "drive as labelled; empty where it was not recorded"),
        (
            "recorded_strain or recorded_microstrain or recorded_bridge_mV_per_V or recorded_reading",
            "signal as recorded",
        ),
        (
            "zero",
            "zero, and drift, that were subtracted; of a bridge, of which they are subtracted in mV/V, as strain",
        ),
        ("strain or reading", "signal without its zero; tension positive"),
        ("expected", "signal that the estimator expects at a"),
        ("residual", "signal − expected"),
        ("distance_mm", "distance â read from the signal"),
        ("sigma_mm", "standard deviation of â"),
        ("error_mm", "â − a"),
        ("held_out_error_mm", "the same, where the row's distance is left out of the calibration"),
        STATUS,
        ("use", "used, suspect, or second: of use to the second gauge only"),
        ("reason", "why it is suspect, or what was done to it"),
    ],
);

const LOCATED: Table = table(
    "locate",
    "located.csv",
    "A row is a reading. The file's own columns stand after line, one with a name from below as given_…; drive and signal under their own names \
     follow where the file has others. On a stream: the same without line, zero and other columns.",
    &[
        ("line", "number of the line in the file"),
        DRIVE,
        ("strain or reading", "the signal as recorded; tension positive"),
        ("zero", "what was subtracted from it, of a bridge in mV/V; empty where no zero is known"),
        ("distance_mm", "distance â"),
        ("sigma_mm", "standard deviation of â: noise, calibration and bias (docs/calibration.md)"),
        ("from_95_mm", "with --interval: lower end of the interval that holds the distance with 95 %"),
        ("to_95_mm", "its upper end"),
        ("tilt_deg", "tilt β̂ of the pole (§6)"),
        ("sigma_tilt_deg", "its standard deviation"),
        ("corr", "correlation of the errors of distance and tilt"),
        ("x_mm", "place of the contact at first touch from the motor's axis: along the whisker"),
        ("y_mm", "the same, towards the object in the plane of rotation"),
        ("z_mm", "the same, along the motor's axis"),
        ("sigma_x_mm", "standard deviation of x_mm"),
        ("sigma_y_mm", "standard deviation of y_mm"),
        ("sigma_z_mm", "standard deviation of z_mm"),
        STATUS,
    ],
);

const MEASUREMENTS: Table = table(
    "simulate",
    "measurements.csv",
    "A row is a synthetic reading.",
    &[
        ("a_mm", "contact distance as labelled"),
        TILT,
        LEAN,
        ("theta_deg or delta_mm", "drive as labelled; 0 is a zero reading"),
        (
            "strain or microstrain or bridge_mV_per_V or reading",
            "the signal; microstrain in 1e-6, reading in any unit",
        ),
        ("strain_2 or microstrain_2 or bridge_mV_per_V_2 or reading_2", "that of the second gauge"),
        ("repeat", "number of the repeat; empty for a zero reading"),
        ("source", "synthetic, in every row"),
        ("fault", "what is wrong on purpose: saturated, mislabelled or spike"),
        ("status", "ok, or words of the tap joined by +"),
    ],
);
