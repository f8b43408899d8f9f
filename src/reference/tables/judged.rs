//! Tables of `verify` and `bench`.

use super::{A, GRID, LENGTH, PLACE, TIP, Table, Told, table};

const CONFIGURATION: Told = ("configuration", "built-in configuration of a whisker, or name of the spec");
const BACKEND: Told = ("backend", "gpu, cpu or reference");
const PRECISION: Told = ("precision", "f32 or f64");
const ADAPTER: Told = ("adapter", "name of the GPU's adapter");

/// `verify.csv`.
pub const VERIFY: Table = table(
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
        ("D_mm", "base diameter of the tap with the largest strain error, as in the next nine columns"),
        TIP,
        LENGTH,
        PLACE,
        GRID,
        A,
        ("tilt_deg", "tilt β of the object's edge round the whisker's axis (§6)"),
        ("lean_deg", "lean γ of the object's edge along the whisker (§6)"),
        ("theta_deg", "tap angle θ"),
        ("delta_mm", "displacement δ"),
        ("verdict", "ok, or what is wrong, joined by +"),
        ("other_words", "words of the first tap whose words differ or that is unsolved, and the reference's"),
        ("status", "words of the tap with the largest strain error"),
    ],
);

const NS: Told = ("ns_per_tap", "time of a tap from tuple to outcome, fastest run");
const NS_MEDIAN: Told = ("ns_per_tap_median", "the same, median run");
const SPREAD: Told = ("spread", "slowest less fastest of the repeats, over their median");

/// `work_precision.csv`.
pub const WORK: Table = table(
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
        SPREAD,
    ],
);
