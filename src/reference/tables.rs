//! What the columns of the tables say whose headers are lists of names: a test compares these lists with the files.

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
    /// Its columns, in order.
    pub columns: &'static [Told],
}

const fn table(
    command: &'static str,
    file: &'static str,
    row: &'static str,
    columns: &'static [Told],
) -> Table {
    Table { command, file, row, columns }
}

const STATUS: Told = ("status", "ok, or words joined by +");
const DRIVE: Told = ("theta_deg or delta_mm", "tap angle θ, or displacement δ of the object");
const A: Told = ("a_mm", "contact distance a");
const SIDE: Told = ("side", "side of the whisker: contact or far");
const BASE: Told = ("D_mm", "base diameter D");
const TIP: Told = ("d_mm", "tip diameter d");
const LENGTH: Told = ("L_a_mm", "length L_a");
const PLACE: Told = ("x_ss_mm", "place of the gauge's near end x_ss");
const GRID: Told = ("l_mm", "length of the gauge's grid l");
const CONFIGURATION: Told = ("configuration", "built-in configuration of a whisker, or name of the spec");
const BACKEND: Told = ("backend", "gpu, cpu or reference");
const PRECISION: Told = ("precision", "f32 or f64");
const ADAPTER: Told = ("adapter", "name of the GPU's adapter");

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
    MEASUREMENTS,
    VERIFY,
    WORK,
    SCALING,
    THREADS,
    PEAKS,
    ROOFLINE,
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
        ("K_sd_first", "first-order Sobol' index of K_sd over the box of the variables"),
        ("K_sd_total", "total Sobol' index of K_sd"),
        ("total_rms_first", "first-order Sobol' index of total_rms_mm"),
        ("total_rms_total", "total Sobol' index of total_rms_mm"),
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
        ("bias_rms_mm", "root mean square of â − a; error_rms_mm of a sweep (§4.3)"),
        ("noise_rms_mm", "root mean square of the standard deviation of â by noise (24)"),
        ("total_rms_mm", "bias and noise in quadrature (§4.4)"),
        ("strain_max", "largest |strain|"),
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
        ("zero", "zero, and drift, that were subtracted"),
        ("strain or reading", "signal without its zero; tension positive"),
        ("expected", "signal that the estimator expects at a"),
        ("residual", "signal − expected"),
        ("distance_mm", "distance â read from the signal"),
        ("sigma_mm", "standard deviation of â"),
        ("error_mm", "â − a"),
        ("held_out_error_mm", "the same, where the row's distance is left out of the calibration"),
        STATUS,
        ("use", "used or suspect"),
        ("reason", "why it is suspect, or what was done to it"),
    ],
);

const LOCATED: Table = table(
    "locate",
    "located.csv",
    "A row is a reading; on a stream the same columns on stdout.",
    &[
        DRIVE,
        ("strain or reading", "the signal; tension positive"),
        ("distance_mm", "distance â"),
        ("sigma_mm", "standard deviation of â: noise, calibration and bias (docs/calibration.md)"),
        STATUS,
    ],
);

const MEASUREMENTS: Table = table(
    "simulate",
    "measurements.csv",
    "A row is a synthetic reading.",
    &[
        ("a_mm", "contact distance as labelled"),
        ("theta_deg or delta_mm", "drive as labelled; 0 is a zero reading"),
        (
            "strain or microstrain or bridge_mV_per_V or reading",
            "the signal; microstrain in 1e-6, reading in any unit",
        ),
        ("repeat", "number of the repeat; empty for a zero reading"),
        ("source", "synthetic, in every row"),
        ("fault", "what is wrong on purpose: saturated, mislabelled or spike"),
        ("status", "ok, or words of the tap joined by +"),
    ],
);

const VERIFY: Table = table(
    "verify",
    "verify.csv",
    "A row is one configuration on one backend (docs/verify.md); errors are relative.",
    &[
        CONFIGURATION,
        BACKEND,
        PRECISION,
        ADAPTER,
        ("bound", "largest strain and K error that passes; forces and arcs have ten times it"),
        ("taps", "taps asked for"),
        ("compared", "taps that both solved"),
        ("neither", "taps that neither solved"),
        ("unsolved", "taps that only the reference solved"),
        ("unanswered", "taps that only the backend solved"),
        ("differ", "taps whose words differ"),
        ("referred", "taps that the backend left to the reference"),
        ("strain_error_worst", "|ε − ε_ref|/max(|ε_ref|, 1e-3 θ f_max), largest"),
        ("strain_error_median", "the same, median"),
        ("strain_error_p99", "the same, 99th percentile"),
        ("strain_over", "taps above the bound"),
        ("K_error_worst", "|K − K_ref|/K_ref, weighted as the strain error, largest"),
        ("K_over", "taps above the bound"),
        ("force_error_worst", "larger error of P and T over the size of the force, largest"),
        ("force_over", "taps above the bound"),
        ("arc_error_worst", "|c − c_ref|/c_ref, largest"),
        ("arc_over", "taps above the bound"),
        ("sweeps_mean", "kernel sweeps of a tap, mean"),
        ("sweeps_max", "kernel sweeps of a tap, largest"),
        ("D_mm", "base diameter of the tap with the largest strain error, as in the next seven columns"),
        TIP,
        LENGTH,
        PLACE,
        GRID,
        A,
        ("theta_deg", "tap angle θ"),
        ("delta_mm", "displacement δ"),
        ("verdict", "ok, or what is wrong, joined by +"),
        ("other_words", "words of the first tap whose words differ, and the reference's"),
        ("status", "words of the tap with the largest strain error"),
    ],
);

const NS: Told = ("ns_per_tap", "time of a tap from tuple to outcome, fastest run");
const NS_MEDIAN: Told = ("ns_per_tap_median", "the same, median run");
const GFLOPS: &str = "gflops";
const GBYTES: &str = "gbytes_per_s";

const WORK: Table = table(
    "bench",
    "work_precision.csv",
    "A row is a configuration on one kernel, backend and tolerance.",
    &[
        CONFIGURATION,
        BACKEND,
        PRECISION,
        ADAPTER,
        ("kernel", "linear, exact (all rules, to a tolerance), exact-nodes (one rule alone) or reference"),
        ("nodes", "nodes of the rule, where it is one alone"),
        ("tolerance", "tolerance asked for; of one rule, that of its sweeps"),
        ("taps", "taps whose error was measured"),
        ("failed", "taps that only the reference solved"),
        NS,
        NS_MEDIAN,
        ("kernel_ns_per_tap", "time of a tap in the kernel alone, transfers included"),
        ("sweeps_mean", "sweeps of a tap, mean"),
        ("strain_error_median", "strain error against the reference, as in verify.csv, median"),
        ("strain_error_p99", "the same, 99th percentile"),
        ("strain_error_max", "the same, largest"),
    ],
);

const SCALING: Table = table(
    "bench",
    "scaling.csv",
    "A row is a whole sweep, from spec to tables.",
    &[
        (
            "shape",
            "gridded (whiskers, distances and 100 angles) or independent (every whisker its own angle)",
        ),
        BACKEND,
        PRECISION,
        ADAPTER,
        ("taps", "taps of the sweep"),
        ("solved", "taps solved by a kernel"),
        ("interpolated", "taps interpolated between solved ones"),
        ("failed", "taps without solution"),
        ("seconds", "the whole sweep, opening the device included, fastest run"),
        ("seconds_median", "the same, median run"),
        ("taps_per_second", "taps/seconds"),
        ("ns_per_tap", "seconds/taps"),
    ],
);

const THREADS: Table = table(
    "bench",
    "threads.csv",
    "A row is the same work on some CPU threads.",
    &[
        BACKEND,
        PRECISION,
        ADAPTER,
        ("threads", "CPU threads"),
        NS,
        NS_MEDIAN,
        ("speedup", "time on one thread over time on these"),
    ],
);

const PEAKS: Table = table(
    "bench",
    "peaks.csv",
    "A row is what a backend can do at most, as measured.",
    &[
        BACKEND,
        PRECISION,
        ADAPTER,
        (GFLOPS, "floating-point operations of fused multiply–adds"),
        (GBYTES, "bytes of a triad (CPU) or a copy (GPU)"),
    ],
);

const ROOFLINE: Table = table(
    "bench",
    "roofline.csv",
    "A row is a configuration on a backend at its default tolerance; operations are counted.",
    &[
        CONFIGURATION,
        BACKEND,
        PRECISION,
        ADAPTER,
        ("tolerance", "tolerance of the strain"),
        ("sweeps_mean", "sweeps of a tap, mean"),
        ("flops_per_tap", "floating-point operations of a tap"),
        ("add_per_tap", "additions"),
        ("mul_per_tap", "multiplications"),
        ("fma_per_tap", "fused multiply–adds"),
        ("div_per_tap", "divisions"),
        ("sqrt_per_tap", "square roots"),
        ("compare_per_tap", "comparisons"),
        ("bytes_per_tap", "bytes of a tap and its solution"),
        ("kernel_ns_per_tap", "time of a tap in the kernel, transfers included, fastest run"),
        ("kernel_ns_per_tap_median", "the same, median run"),
        (GFLOPS, "floating-point operations"),
        (GBYTES, "bytes of taps and solutions"),
        ("share_of_peak_flops", "share of the peak of peaks.csv"),
        ("share_of_peak_bytes", "share of the peak of peaks.csv"),
    ],
);
