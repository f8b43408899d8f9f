//! What can stand in a spec: every section, its keys, their units and meanings. The reader knows the names from here, and
//! `docs/reference.md` is made of them.

use super::{optimise, schema};

/// Unit, and range, of the ends of an axis.
pub const THAT_OF_THE_KEY: &str = "that of the key";

/// A key.
#[derive(Debug)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub what: &'static str,
    /// What holds where it is left out, unless it has a default value or is required.
    pub absent: &'static str,
    /// A value, as TOML; empty in an inline table, which has examples of its own.
    pub example: &'static str,
    /// What more there is to say; may be empty.
    pub note: &'static str,
}

/// A section, or an inline table of a key.
#[derive(Debug)]
pub struct Section {
    /// `gauge`, or `optimise.limits` for the inline table that stands under `limits` in `[optimise]`.
    pub name: &'static str,
    /// What it says.
    pub about: &'static str,
    /// Its keys, in the order in which values in force are listed.
    pub keys: &'static [Key],
    /// Whole inline tables; none of a section.
    pub examples: &'static [&'static str],
}

const fn key(name: &'static str, unit: &'static str, what: &'static str, example: &'static str) -> Key {
    Key { name, unit, what, absent: "", example, note: "" }
}

impl Key {
    const fn absent(self, absent: &'static str) -> Self {
        Self { absent, ..self }
    }

    const fn note(self, note: &'static str) -> Self {
        Self { note, ..self }
    }
}

const fn section(name: &'static str, about: &'static str, keys: &'static [Key]) -> Section {
    Section { name, about, keys, examples: &[] }
}

const fn inline(
    name: &'static str,
    about: &'static str,
    examples: &'static [&'static str],
    keys: &'static [Key],
) -> Section {
    Section { name, about, keys, examples }
}

impl Section {
    /// Names of its keys.
    pub fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|k| k.name).collect()
    }

    /// The key of this name.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|k| k.name == name)
    }
}

/// The key above all sections.
pub const FORMAT: Key =
    key("format", "", "format of the spec", "1").note("A higher one than the program knows is refused");

/// All sections.
pub const SECTIONS: [Section; 9] = [WHISKER, GAUGE, TAP, TUPLES, MODEL, ESTIMATE, OPTIMISE, OUTPUT, RUN];

/// Inline tables, by the key that takes them. `axis` is taken by D, d, L_a, x_ss, l, a, theta and delta.
pub const INLINE: [Section; 8] = [AXIS, CONTACT, MATERIAL, WEIGHTS, BUDGET, VARIABLES, LIMITS, ROBUST];

const WHISKER: Section = section(
    "whisker",
    "The whisker: a straight, solid, round taper (model §1).",
    &[
        key("D", "mm", "base diameter", "10.0").note("A value, a list or an axis"),
        key("d", "mm", "tip diameter", "[4, 7, 10]")
            .note("A value, a list or an axis; d > D is a whisker that widens"),
        key("L_a", "mm", "length from clamp to tip", "50.0").note("A value, a list or an axis"),
        key("hub", "mm", "distance of the motor's axis behind the clamp", "20.0"),
    ],
);

const GAUGE: Section = section(
    "gauge",
    "The strain gauge, bonded along the whisker in the plane of rotation (model §1).",
    &[
        key("x_ss", "mm", "start of the gauge's grid, axial distance from the clamp", "5.0")
            .note("A value, a list or an axis; x_ss + l ≤ L_a"),
        key("l", "mm", "length of the grid, along the surface", "2.0").note("A value, a list or an axis"),
        key("side", "", "side of the whisker, towards the object or away from it", "\"far\"")
            .note("Tension is positive: the far side reads negative"),
        key("noise_strain", "", "standard deviation of one strain reading", "20e-6")
            .note("Objectives that hold the noise need it written; 0 means none"),
        key("strain_limit", "", "|strain| above which a tap is `strain_limit`", "0.02"),
        key("factor", "", "gauge factor", "2.1")
            .note("Used for bridge_mV_per_V by calibrate, locate and simulate"),
    ],
);

const TAP: Section = section(
    "tap",
    "Where the whisker is touched, and how far it is driven (model §1).",
    &[
        key("drive", "", "what moves", "\"displacement\"").note("\"angle\": the base turns by theta; \"displacement\": the base stays and the object moves by delta"),
        key("a", "mm", "contact distance, axial from the clamp", "[20, 30, 40]").note("A value, a list or an axis; a ≤ L_a"),
        key("theta", "degrees", "tap angle", "{ from = 1, to = 10, step = 0.5 }")
            .absent("required, or delta")
            .note("A value, a list or an axis. For `tap` the ends of the interval, 0.1 … 10 if left out"),
        key("delta", "mm", "displacement of the object", "[1, 2, 3]").absent("required with drive = \"displacement\"").note("A value, a list or an axis; in place of theta with drive = \"displacement\""),
    ],
);

const TUPLES: Section = section(
    "tuples",
    "A list of taps in place of axes. `[whisker]` D, d, L_a and the keys x_ss, l, a, theta (delta) are then left out.",
    &[key(
        "file",
        "",
        "CSV file with the columns D_mm, d_mm, L_a_mm, x_ss_mm, l_mm, a_mm, theta_deg (delta_mm)",
        "\"tuples.csv\"",
    )
    .absent("axes")
    .note("In any order; lines with # are skipped, other columns ignored; relative to the spec")],
);

const MODEL: Section = section(
    "model",
    "The rod and its effects (model §3; what each changes: `sweep --explain`, docs/effects.md).",
    &[
        key("geometry", "", "the exact rod, or the linear theory", "\"linear\"")
            .note("\"linear\" takes only shear, nu, hub, side and a hooke material"),
        key("shear", "", "shear deformation (Timoshenko)", "true"),
        key("extension", "", "stretch of the axis", "true"),
        key("surface", "", "contact on the whisker's surface, not on its axis", "true"),
        key("pole_radius", "mm", "radius of the object", "3.0"),
        key("nu", "", "Poisson's ratio, which enters shear only", "0.49"),
        key("contact", "", "friction at the contact", "{ coulomb = 0.3 }")
            .note("stick and coulomb need extension = true and pole_radius = 0"),
        key("material", "MPa", "material law and its moduli", "{ neo-hookean = 3.2 }")
            .note("Strain, K and distances do not depend on a common factor of the moduli; forces do"),
    ],
);

const ESTIMATE: Section = section(
    "estimate",
    "How a distance is read from a strain (model §4).",
    &[
        key("theory", "", "theory that is inverted", "\"timoshenko\"")
            .note("\"euler-bernoulli\" is f, the paper's; \"timoshenko\" is f_T, with shear"),
        key("convention", "", "what f is", "\"elongation\"")
            .note("\"elongation\": f times x2 − x1, so that K is in mm, as printed in the paper"),
        key("range", "mm", "range of interest of the distance", "[15, 45]")
            .absent("from the smallest to the largest a")
            .note("A second distance in it that gives the same reading makes a tap `ambiguous`"),
        key("K", "", "K̄ of every row", "1.0")
            .absent("mean of K over the row")
            .note("1 is the uncalibrated formula"),
    ],
);

const OPTIMISE: Section = section(
    "optimise",
    "What `optimise` searches for (docs/search.md); other commands do not read it.",
    &[
        key("objective", "", "what is made small", "\"distance\"").note(
            "\"sd\": K_sd; \"distance\": total_rms_mm; \"weighted\": w_sd K_sd/K_mean + w_distance total_rms_mm/L_a; \"pareto\": the front of K_sd and total_rms_mm. All but sd need noise_strain",
        ),
        key("weights", "", "weights of \"weighted\"", "{ sd = 1.0, distance = 2.0 }"),
        key("seed", "", "seed of swarms and samples", "7"),
        key("budget", "", "what the search may spend", "{ evaluations = 20000, seconds = 30 }").absent("until several starts agree"),
        key("variables", "", "what is searched over", "{ d = [2, 10], theta = [0.5, 10] }"),
        key("limits", "", "what a design must keep", "{ strain = 0.02 }").absent("gauge.strain_limit and complete rows"),
        key("robust", "", "tolerances of manufacture and bonding", "{ d = 0.05, x_ss = 0.3 }").absent("none"),
    ],
);

const OUTPUT: Section = section(
    "output",
    "What `sweep` writes.",
    &[
        key("tuples", "", "write tuples.csv", "false")
            .note("A default of more than 10 GB is refused until the spec says it"),
        key("designs", "", "write designs.csv", "true"),
        key("distances", "", "write distances.csv", "false"),
        key("format", "", "format of the tables", "\"csv\""),
        key("top", "", "keep only the best N complete rows", "20").absent("all rows"),
        key("by", "", "column of designs.csv by which rows are ranked, smaller first", "\"total_rms_mm\""),
        key("per", "", "what competes: every row, or each design with its best drive", "\"design\""),
    ],
);

const RUN: Section = section(
    "run",
    "Options of the command line; what is typed there wins. Paths are relative to the spec.",
    &[
        key("out", "", "folder of the result", "\"results/mine\"")
            .absent("results/<name>, with -<command> after it but for sweep"),
        key("force", "", "write also into a folder that holds another result", "true")
            .absent("false")
            .note("docs/folders.md says what that removes"),
        key("backend", "", "where to compute", "\"cpu\"")
            .absent("\"auto\"")
            .note("\"auto\": a hardware adapter, else a software one, else the CPU kernels"),
        key("adapter", "", "part of the adapter's name", "\"llvmpipe\"")
            .absent("any")
            .note("`vibrissa devices` lists them"),
        key("precision", "", "floating-point type of the fast kernels", "\"f64\"").absent("\"f32\""),
        key(
            "tolerance",
            "",
            "bound on each row's strain error, relative to max(|ε|, 1e-3 of the peak)",
            "1e-6",
        )
        .absent("1e-5 with f32, 1e-8 with f64"),
        key("threads", "", "CPU threads", "4").absent("all cores"),
        key("plan", "", "say what would run, and run nothing", "true").absent("false"),
        key("quiet", "", "no progress, no summary", "true").absent("false"),
        key("json", "", "one JSON object on stdout", "true").absent("false"),
    ],
);

pub(super) const AXIS: Section = inline(
    "axis",
    "Many values of D, d, L_a, x_ss, l, a, theta or delta, besides a list [4, 7, 10]. Axes are crossed with each other, the last \
     fastest; sampled ones are zipped: they share samples, sampler and seed, and `a` is sampled only alone.",
    &[
        "{ from = 2, to = 8, steps = 4 }",
        "{ from = 1, to = 100, steps = 3, scale = \"log\" }",
        "{ from = 2, to = 8, step = 0.5 }",
        "{ min = 2, max = 8, samples = 1024, sampler = \"random\", seed = 1 }",
    ],
    &[
        key("from", THAT_OF_THE_KEY, "first value", ""),
        key("to", THAT_OF_THE_KEY, "last value", "")
            .note("Belongs to the axis with steps, and with step if it falls on one"),
        key("steps", "", "number of values, both ends included", "").absent("required, or step"),
        key("step", THAT_OF_THE_KEY, "distance of the values", "").absent("required, or steps"),
        key("scale", "", "even steps of the value or of its logarithm", "").absent("\"linear\""),
        key("min", THAT_OF_THE_KEY, "smallest value of samples", ""),
        key("max", THAT_OF_THE_KEY, "largest value of samples", ""),
        key("samples", "", "number of samples", ""),
        key("sampler", "", "Sobol points (scrambled, unless seed is 0), or random ones", "")
            .absent("\"sobol\""),
        key("seed", "", "seed of the samples", "").absent("0"),
    ],
);

pub(super) const CONTACT: Section = inline(
    "model.contact",
    "Friction with a coefficient (model §3.5).",
    &["{ coulomb = 0.3 }"],
    &[key("coulomb", "", "coefficient of friction μ", "")],
);

pub(super) const MATERIAL: Section = inline(
    "model.material",
    "One material law (model §3.3).",
    &[
        "{ hooke = 3.2 }",
        "{ neo-hookean = 3.2 }",
        "{ mooney-rivlin = [0.35, 0.15] }",
        "{ yeoh = [0.5, -0.08, 0.02] }",
    ],
    &[
        key("hooke", "MPa", "Young's modulus E of Hooke's law", "").absent("required: one of these"),
        key("neo-hookean", "MPa", "initial modulus E₀ = 6 C10", "").absent("required: one of these"),
        key("mooney-rivlin", "MPa", "[C10, C01]; E₀ = 6 (C10 + C01)", "").absent("required: one of these"),
        key("yeoh", "MPa", "[C10, C20, C30]; E₀ = 6 C10", "").absent("required: one of these"),
        key(
            "curve",
            "",
            "CSV file with the columns strain, stress_MPa (nominal), to which Yeoh's law is fitted",
            "",
        )
        .absent("required: one of these")
        .note("Five points or more, stress rising with strain; relative to the spec"),
    ],
);

pub(super) const WEIGHTS: Section = inline(
    "optimise.weights",
    "Weights of the objective \"weighted\"; one of them at least is above 0.",
    &["{ sd = 1.0, distance = 2.0 }"],
    &[
        key("sd", "", "weight of K_sd/K_mean", "").absent("1.0"),
        key("distance", "", "weight of total_rms_mm/L_a", "").absent("1.0"),
    ],
);

pub(super) const BUDGET: Section = inline(
    "optimise.budget",
    "What a search may spend; whichever ends first.",
    &["{ evaluations = 20000, seconds = 30 }"],
    &[
        key(
            "evaluations",
            "",
            "evaluations: one design at one drive, over all distances and robust samples",
            "",
        )
        .absent("no limit"),
        key("seconds", "s", "wall time", "").absent("no limit"),
    ],
);

const VARIABLES: Section = inline(
    "optimise.variables",
    "What is searched over: some of these, each [min, max]. A number under the key in its own section is the first start.",
    &["{ D = [8, 12], d = [2, 10], L_a = [40, 60], x_ss = [3, 15], l = [1, 4], theta = [0.5, 10] }"],
    &[
        key("D", "mm", "base diameter", "").absent("fixed"),
        key("d", "mm", "tip diameter", "").absent("fixed"),
        key("L_a", "mm", "length", "").absent("fixed"),
        key("x_ss", "mm", "start of the grid", "").absent("fixed"),
        key("l", "mm", "length of the grid", "").absent("fixed"),
        key("theta", "degrees", "tap angle", "")
            .absent("fixed")
            .note("delta (mm) with drive = \"displacement\""),
    ],
);

pub(super) const LIMITS: Section = inline(
    "optimise.limits",
    "What a design must keep. Complete rows are asked for always.",
    &["{ strain = 0.02, force_N = 1.0, unambiguous = true, tip_not_wider = true }"],
    &[
        key("strain", "", "largest |strain|", "").absent("gauge.strain_limit"),
        key("force_N", "N", "largest contact force", "").absent("no limit"),
        key("unambiguous", "", "the peak of the theory's curve lies below the range of distances", "")
            .absent("false"),
        key("tip_not_wider", "", "d ≤ D", "").absent("false"),
    ],
);

const ROBUST: Section = inline(
    "optimise.robust",
    "Standard deviations of independent normal errors, cut at three of them; the same seeded samples for every candidate.",
    &[
        "{ D = 0.05, d = 0.05, L_a = 0.1, x_ss = 0.3, l = 0.05, theta = 0.1 }",
        "{ d = 0.05, samples = 64, measure = \"cvar90\", calibrated = \"each\" }",
    ],
    &[
        key("D", "mm", "of the base diameter", "").absent("0"),
        key("d", "mm", "of the tip diameter", "").absent("0"),
        key("L_a", "mm", "of the length", "").absent("0"),
        key("x_ss", "mm", "of the gauge's place", "").absent("0"),
        key("l", "mm", "of the grid's length", "").absent("0"),
        key("theta", "degrees", "of the tap angle", "")
            .absent("0")
            .note("delta (mm) with drive = \"displacement\""),
        key("samples", "", "whiskers sampled for each candidate", "").absent("64"),
        key("measure", "", "their mean, or the mean of the worst tenth", "").absent("\"mean\""),
        key("calibrated", "", "K̄ and f of each sampled whisker, or of the nominal one", "")
            .absent("\"each\""),
    ],
);

/// What stands for `key` of `section` where the user says nothing, as TOML.
pub fn default(section: &str, key: &str) -> Option<String> {
    let all = schema::defaults(optimise::DEFAULTS);
    let table = if section.is_empty() { &all } else { all.get(section)?.get_ref().as_table()? };
    Some(schema::toml_text(table.get(key)?.get_ref()))
}
