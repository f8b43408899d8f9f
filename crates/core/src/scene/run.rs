//! Options of a run and of its tables.

use std::path::PathBuf;

choices! {
    /// Backend asked for; `Auto` takes a hardware adapter, else a software one, else the CPU kernels.
    BackendChoice {
        Auto = "auto", "Best there is";
        Gpu = "gpu", "WGSL kernels through wgpu";
        Cpu = "cpu", "Vectorised CPU kernels";
        Reference = "reference", "Adaptive f64 shooting: slow, the yardstick";
    }
}

choices! {
    /// Floating-point type of the fast kernels.
    Precision {
        F32 = "f32", "Single";
        F64 = "f64", "Double";
    }
}

/// `[run]` and the command line; `None` if not given.
#[derive(Debug, Clone, Default, PartialEq, serde::Deserialize)]
pub struct RunOptions {
    /// Output folder.
    pub out: Option<PathBuf>,
    /// Replace a folder that belongs to another spec.
    pub force: Option<bool>,
    /// Backend asked for.
    pub backend: Option<BackendChoice>,
    /// Substring of the adapter's name.
    pub adapter: Option<String>,
    /// Precision of the fast kernels.
    pub precision: Option<Precision>,
    /// Bound on each row's strain error, relative to max(|ε|, 1e-3 θ f_max).
    pub tolerance: Option<f64>,
    /// Bound on the strain change by effects that are left off, relative as `tolerance`.
    pub model_error: Option<f64>,
    /// CPU threads.
    pub threads: Option<usize>,
    /// Print the plan only.
    pub plan: Option<bool>,
    /// No progress, no summary.
    pub quiet: Option<bool>,
    /// One JSON object on stdout.
    pub json: Option<bool>,
}

words! {
    /// Column of the designs table by which rows are ranked, smaller first.
    RankBy {
        /// Spread of K.
        KSd = "K_sd",
        /// Root mean square distance error.
        #[serde(alias = "bias_rms_mm")]
        ErrorRms = "error_rms_mm",
        /// Largest absolute distance error.
        ErrorMax = "error_max_mm",
        /// Root mean square of the noise part.
        NoiseRms = "noise_rms_mm",
        /// Error and noise in quadrature.
        TotalRms = "total_rms_mm",
        /// Largest absolute strain.
        StrainMax = "strain_max",
        /// Largest contact force.
        ForceMax = "force_max_N",
    }
}

impl RankBy {
    /// Name of [`Self::ErrorRms`] in former tables of `tap`; it is read in its place.
    pub const BIAS: &str = "bias_rms_mm";
}

words! {
    /// Unit of `top`: rows, or the best row of each design.
    Per {
        /// Every (design, θ) competes.
        Row = "row",
        /// Each design competes with its best θ.
        Design = "design",
    }
}

/// `[output]`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
pub struct Output {
    /// Write tuples.csv; `None` when not written in the spec (then true, but not beyond 10 GB).
    pub tuples: Option<bool>,
    /// Write designs.csv.
    pub designs: bool,
    /// Write distances.csv.
    pub distances: bool,
    /// Keep only the best N complete rows.
    pub top: Option<usize>,
    /// Ranking column.
    pub by: RankBy,
    /// True if the user named it.
    #[serde(skip)]
    pub by_said: bool,
    /// Rows or designs.
    pub per: Per,
}

impl Default for Output {
    fn default() -> Self {
        let (by, per) = (RankBy::KSd, Per::Row);
        Self { tuples: None, designs: true, distances: true, top: None, by, by_said: false, per }
    }
}
