//! The sections.

use super::form::{ANGLES, Form, LARGEST, LEANING, LENGTHS, PLACES, RANKED, above, between, of, of_term};
use super::inline::{BUDGET, CONTACT, CORE, FOIL, LIMITS, MATERIAL, ROBUST, ROOT, VARIABLES, WEIGHTS};
use super::{Key, Section, key, section};
use crate::scene::{Property, TERMS};

/// `[whisker]`.
pub const WHISKER: Section = section(
    "whisker",
    "The whisker: a straight, solid, round taper (model §1).",
    &[
        key("D", "mm", "base diameter", "10.0").holds(LENGTHS),
        key("d", "mm", "tip diameter", "[4, 7, 10]").holds(LENGTHS)
            .note("d > D is a whisker that widens"),
        key("L_a", "mm", "length from clamp to tip", "50.0").holds(LENGTHS),
        key("hub", "mm", "distance of the motor's axis behind the clamp", "20.0").holds(PLACES),
        key("profile", "mm", "diameter along the whisker, in place of D, d and L_a (model §7)", "[[0, 14], [8, 9], [50, 4]]").holds(Form::Any(&[Form::Pairs, Form::Text]))
            .absent("the cone of D and d")
            .note("Linear between its pairs [s, D]; or a CSV file with the columns s_mm, D_mm and perhaps bore_mm or core_mm. Tables show D(0), D(L_a), L_a"),
        key("scale", "", "factor of the profile's diameters", "1.1").holds(Form::Axis(of(Property::Scale))).absent("1").note("Bore and core keep their diameter. Tables show the scaled D(0) and D(L_a)"),
        key("exponent", "", "n of D(s) = d + (D − d)(1 − s/L_a)ⁿ", "2.0").holds(Form::Axis(of(Property::Exponent))).absent("1: the cone"),
        key("bore", "mm", "diameter of a concentric bore, or [[s, diameter], …]", "3.0").holds(Form::Any(&[PLACES, Form::Pairs])).absent("none").note("With a hooke material. A number may be a list or an axis; 0: none"),
        key("core", "", "a bonded concentric core: diameter, and modulus in MPa", "{ diameter = 0.5, modulus = 60000 }").holds(Form::Table(&CORE, 1, 2))
            .absent("none")
            .note("With a hooke material. Both numbers may be lists or axes"),
        key("curvature", "1/mm", "curvature at rest κ_base, positive where the whisker bends away from the object", "0.01").holds(Form::Axis(of(Property::Curvature))).absent("0"),
        key("curvature_slope", "1/mm²", "its growth along the whisker κ_slope", "-1e-4").holds(Form::Axis(of(Property::CurvatureSlope))).absent("0"),
        key("root", "", "springs between motor and base", "{ k_theta = 500, k_y = 20 }").holds(Form::Table(&ROOT, 1, 3)).absent("none: the base does not give way").note("f is then that of the whisker with its root. Each stiffness may be a list or an axis"),
    ],
);

/// `[gauge]`.
pub const GAUGE: Section = section(
    "gauge",
    "The strain gauge, bonded along the whisker in the plane of rotation (model §1).",
    &[
        key("x_ss", "mm", "start of the gauge's grid, axial distance from the clamp", "5.0").holds(PLACES)
            .note("x_ss + l ≤ L_a"),
        key("l", "mm", "length of the grid, along the surface", "2.0").holds(LENGTHS),
        key("side", "", "side of the whisker, towards the object or away from it", "\"far\"").holds(Form::Words(&["contact", "far"]))
            .note("Tension is positive: the far side reads negative"),
        key("noise_strain", "", "standard deviation of one strain reading", "20e-6").holds(Form::Axis(of(Property::Noise)))
            .note("Objectives that hold the noise need it written; 0 means none"),
        key("strain_limit", "", "|strain| above which a tap is `strain_limit`", "0.02").holds(Form::Number(above(0.0))),
        key("factor", "", "gauge factor", "2.1").holds(Form::Number(above(0.0)))
            .note("Used for bridge_mV_per_V by calibrate, locate and simulate"),
        key("second", "", "a second, equal gauge 90° round the whisker", "true").holds(Form::Flag)
            .note("It measures the tilt of the object's edge (model §6): columns strain_2, bending_azimuth_deg, slide_mm"),
        key("foil", "", "a foil that is stiffer than the skin (model §8)", "{ stiffness = 100, length = 6.3, width = 2.8 }").holds(Form::Any(&[Form::Words(&["KFGS-2-120"]), Form::Table(&FOIL, 3, 5)]))
            .absent("none: the bare strain of the skin")
            .note("strain is then what the foil reads, some twentieth of that of the bare skin, and K is that much larger; strain_limit stays that of the skin. Its stiffness may be a list or an axis"),
    ],
);

/// What can be read.
const SIGNALS: &[&str] = &["strain", "moment", "force"];

/// `[sensor]`.
pub const SENSOR: Section = section(
    "sensor",
    "The signal that is measured (model §7). K, errors and distances belong to it.",
    &[
        key("signal", "", "the strain under the gauge, or the moment M₀ or the force F_y on the base", "\"moment\"").holds(Form::Any(&[Form::Words(SIGNALS), Form::Several(SIGNALS)]))
            .note("A list reads several at once, such as [\"moment\", \"force\"]. \"moment\" and \"force\" need no gauge; the columns of tuples.csv are then signal (N mm, or N) and signal_linear"),
        key("matrix", "", "channels of the sensor, each a sum of the moment M₀, the forces F_x and F_y, and perhaps the strain", "[[1, 0, 0], [0, 0, 1]]").holds(Form::Matrix(2, 6)).absent("none: signal says what is read")
            .note("A row [M₀, F_x, F_y] or [M₀, F_x, F_y, strain] for each channel. Distance and contact force are then the most likely given all channels"),
        key("noise", "N mm or N", "standard deviation of one reading of a moment or a force", "0.02").holds(PLACES).absent("none").note("Of several channels one number for each, in its unit"),
        key("fixed", "", "whether the moment is that about where the base rests, in place of about the base, which springs k_x and k_y of a root let move", "true").holds(Form::Flag).note("M₀ + u F_y − v F_x, u and v the ways of the base; a sensor that the springs do not carry"),
        key("covariance", "", "covariance of the noise of several channels, in their units", "[[4e-4, 1e-5], [1e-5, 1e-6]]").holds(Form::Matrix(2, 6)).absent("none: noise, or no noise"),
    ],
);

/// `[tap]`.
pub const TAP: Section = section(
    "tap",
    "Where the whisker is touched, and how far it is driven (model §1).",
    &[
        key("drive", "", "what moves", "\"displacement\"").holds(Form::Words(&["angle", "displacement"])).note("\"angle\": the base turns by theta; \"displacement\": the base stays and the object moves by delta"),
        key("a", "mm", "contact distance, axial from the clamp", "[20, 30, 40]").holds(LENGTHS).note("a ≤ L_a"),
        key("abscissa", "", "whether a is measured along the base tangent of the whisker at rest, in place of along the whisker", "true").holds(Form::Flag)
            .note("They differ where the whisker is curved: a_mm of tuples.csv is the arc then, x_a_mm the abscissa"),
        key("tilt", "degrees", "turns the object's edge, and the contact, round the whisker's axis", "{ from = -30, to = 30, steps = 7 }").holds(LEANING)
            .note("Model §6; frictionless, or stick on the centreline"),
        key("lean", "degrees", "leans the object's edge along the whisker", "[0, 10]").holds(LEANING),
        key("theta", "degrees", "tap angle", "{ from = 1, to = 10, step = 0.5 }").holds(Form::Axis(ANGLES))
            .absent("required, or delta")
            .note("For `tap` the ends of the interval, 0.1 … 10 if left out"),
        key("delta", "mm", "displacement of the object", "[1, 2, 3]").holds(LENGTHS).absent("required with drive = \"displacement\"").note("In place of theta with drive = \"displacement\""),
    ],
);

/// `[tuples]`.
pub const TUPLES: Section = section(
    "tuples",
    "A list of taps in place of axes. `[whisker]` D, d, L_a and the keys x_ss, l, a, theta (delta) are then left out.",
    &[key(
        "file",
        "",
        "CSV file with the columns D_mm, d_mm, L_a_mm, x_ss_mm, l_mm, a_mm, theta_deg (delta_mm), and perhaps those of the rig (exponent, bore_mm, … noise)",
        "\"tuples.csv\"",
    )
    .absent("axes")
    .note("In any order; lines with # are skipped, other columns ignored; relative to the spec")],
);

const GEOMETRY: Key = key("geometry", "", "the exact rod, or the linear theory", "\"linear\"")
    .holds(Form::Words(&["exact", "linear"]))
    .note("\"linear\" takes only shear, nu, hub, side and a hooke material");
const NU: Key = key(
    "nu",
    "",
    "Poisson's ratio, which enters shear, and with clamp or indentation how the solid gives way",
    "0.49",
)
.holds(Form::Axis(of(Property::Nu)));
const FRICTION: Key = key("contact", "", "friction at the contact", "{ coulomb = 0.3 }")
    .holds(Form::Any(&[Form::Words(&["frictionless", "stick"]), Form::Table(&CONTACT, 1, 1)]))
    .note("stick and coulomb need extension = true. The coefficient may be a list or an axis");
const LAW: Key = key("material", "MPa", "material law and its moduli", "{ neo-hookean = 3.2 }")
    .holds(Form::Table(&MATERIAL, 1, 1))
    .note("Without a foil strain, K and distances do not depend on a common factor of the moduli; forces do. The modulus of the first two may be a list or an axis");

const SOLID: Key = key("solid", "", "all effects of a three-dimensional rubber rod (model §8)", "true")
    .holds(Form::Flag)
    .note("surface, shear, extension, clamp = \"bonded\", indentation, section = \"distorting\"; what is written beside it wins; needs pole_radius > 0");

/// Those of the model: its effects between the geometry and what they need.
const MODEL_KEYS: [Key; TERMS.len() + 5] = {
    let mut keys = [GEOMETRY; TERMS.len() + 5];
    let mut i = 0;
    while i < TERMS.len() {
        keys[i + 1] =
            key(TERMS[i].key, TERMS[i].unit, TERMS[i].what, TERMS[i].example).holds(of_term(&TERMS[i]));
        i += 1;
    }
    keys[i + 1] = NU;
    keys[i + 2] = FRICTION;
    keys[i + 3] = LAW;
    keys[i + 4] = SOLID;
    keys
};

/// `[model]`.
pub const MODEL: Section = section(
    "model",
    "The rod and its effects (model §3; what each changes: `sweep --explain`, docs/effects.md).",
    &MODEL_KEYS,
);

/// `[estimate]`.
pub const ESTIMATE: Section = section(
    "estimate",
    "How a distance is computed from a strain (model §4).",
    &[
        key("theory", "", "the theory that is inverted", "\"exact\"").holds(Form::Words(&["euler-bernoulli", "timoshenko", "exact"])).note(
            "\"euler-bernoulli\": f, the paper's formula; \"timoshenko\": f_T, with shear; \"exact\": the model itself, as `locate --estimator exact` (§4.7). K stays that of f, and the curve that of upright edges (§4.8). With a second gauge \"exact\" computes distance and tilt from both strains (§6.4), for a frictionless contact",
        ),
        key("convention", "", "what f is", "\"elongation\"").holds(Form::Words(&["mean", "elongation"]))
            .note("\"elongation\": f times x2 − x1, so that K is in mm, as printed in the paper"),
        key("range", "mm", "range of interest of the distance", "[15, 45]").holds(Form::Ends(above(0.0)))
            .absent("from the smallest to the largest a")
            .note("A second distance in it that gives the same reading makes a tap `ambiguous`"),
        key("K", "", "K̄ of every row", "1.0").holds(Form::Number(above(0.0)))
            .absent("mean of K over the row")
            .note("1 is the uncalibrated formula; with theory = \"exact\" it plays no part"),
    ],
);

/// `[optimise]`.
pub const OPTIMISE: Section = section(
    "optimise",
    "What `optimise` searches for (docs/search.md); other commands do not read it.",
    &[
        key("objective", "", "what is minimised", "\"distance\"").holds(Form::Words(&["sd", "distance", "weighted", "pareto"])).note(
            "\"sd\": K_sd; \"distance\": total_rms_mm; \"weighted\": w_sd K_sd/K_mean + w_distance total_rms_mm/L_a; \"pareto\": the front of K_sd and total_rms_mm. All but sd need noise_strain",
        ),
        key("weights", "", "weights of \"weighted\"", "{ sd = 1.0, distance = 2.0 }").holds(Form::Table(&WEIGHTS, 0, 2)),
        key("seed", "", "seed of swarms and samples", "7").holds(Form::Whole(0, LARGEST)),
        key("budget", "", "what the search may spend", "{ evaluations = 20000, seconds = 30 }").holds(Form::Table(&BUDGET, 1, 2)).absent("until several starts agree"),
        key("variables", "", "what may vary", "{ d = [2, 10], theta = [0.5, 10] }").holds(Form::Table(&VARIABLES, 1, 99)),
        key("limits", "", "what a design must keep", "{ strain = 0.02 }").holds(Form::Table(&LIMITS, 0, 4)).absent("gauge.strain_limit and complete rows"),
        key("robust", "", "tolerances of manufacture and bonding", "{ d = 0.05, x_ss = 0.3 }").holds(Form::Table(&ROBUST, 1, 99)).absent("none"),
    ],
);

/// `[output]`.
pub const OUTPUT: Section = section(
    "output",
    "What `sweep` writes.",
    &[
        key("tuples", "", "write tuples.csv", "false")
            .holds(Form::Flag)
            .note("A default of more than 10 GB is refused until the spec says it"),
        key("designs", "", "write designs.csv", "true").holds(Form::Flag),
        key("distances", "", "write distances.csv", "false").holds(Form::Flag),
        key("format", "", "format of the tables", "\"parquet\"")
            .holds(Form::Words(&["csv", "parquet"]))
            .note("Parquet has the same columns and words, typed, with units and spec in its metadata"),
        key("top", "", "keep only the best N complete rows", "20")
            .holds(Form::Whole(1, LARGEST))
            .absent("all rows"),
        key("by", "", "column of designs.csv by which rows are ranked, smaller first", "\"total_rms_mm\"")
            .holds(RANKED)
            .note("If neither by nor top is written and the gauge has noise, the printed list is by total_rms_mm"),
        key("per", "", "what is ranked: every row, or each design at its best drive", "\"design\"")
            .holds(Form::Words(&["row", "design"])),
        key("wrench", "", "write force and moment on the base into tuples.csv (model §7)", "true")
            .holds(Form::Flag),
    ],
);

/// `[run]`.
pub const RUN: Section = section(
    "run",
    "Options of the command line, which has precedence. Paths are relative to the spec.",
    &[
        key("out", "", "folder of the result", "\"results/mine\"")
            .absent("results/<name>, with -<command> after it but for sweep"),
        key("force", "", "write also into a folder that holds another result", "true").holds(Form::Flag)
            .absent("false")
            .note("docs/folders.md says what that removes"),
        key("backend", "", "where to compute", "\"cpu\"").holds(Form::Words(&["auto", "gpu", "cpu", "reference"]))
            .absent("\"auto\"")
            .note("\"auto\": a hardware adapter where the CPU would need over two seconds, else the CPU kernels; a software adapter with \"gpu\""),
        key("adapter", "", "part of the adapter's name", "\"llvmpipe\"")
            .absent("any")
            .note("`vibrissa devices` lists them"),
        key("precision", "", "floating-point type of the fast kernels", "\"f64\"").holds(Form::Words(&["f32", "f64"])).absent("\"f32\""),
        key(
            "tolerance",
            "",
            "bound on each row's strain error, relative to max(|ε|, 1e-3 of the peak)",
            "1e-6",
        ).holds(Form::Number(between(0.0, 1.0)))
        .absent("1e-5 with f32, 1e-8 with f64"),
        key(
            "model_error",
            "",
            "largest joint change of strain by effects that may be left off",
            "1e-3",
        ).holds(Form::Number(between(0.0, 1.0)))
        .absent("nothing is left off")
        .note("sweep, tap and optimise; relative as tolerance is, and at least twice that (docs/effects.md)"),
        key("threads", "", "CPU threads", "4").holds(Form::Whole(1, 4096)).absent("all cores"),
        key("plan", "", "show what would run; run nothing", "true").holds(Form::Flag).absent("false"),
        key("quiet", "", "no progress, no summary", "true").holds(Form::Flag).absent("false"),
        key("json", "", "one JSON object on stdout", "true").holds(Form::Flag).absent("false"),
    ],
);
