//! The inline tables.

use super::super::searched::{UNSURE, VARIED};
use super::form::{
    ANGLES, ANY, Form, LARGEST, PLACES, Range, above, below, between, from, of as held, within,
};
use super::{Key, Section, THAT_OF_THE_KEY, inline, key};
use crate::scene::Property;

/// Many values of a quantity.
pub const AXIS: Section = inline(
    "axis",
    "Many values of D, d, L_a, x_ss, l, a, theta or delta, or of a property of the rig (exponent, scale, bore, core, curvature, root, hub, E, nu, \
     pole_radius, mu, foil, noise), besides a list [4, 7, 10]. Axes are crossed with each other, the last fastest; sampled ones are zipped: they share samples, sampler and seed, and `a` is sampled only alone.",
    &[
        "{ from = 2, to = 8, steps = 4 }",
        "{ from = 1, to = 100, steps = 3, scale = \"log\" }",
        "{ from = 2, to = 8, step = 0.5 }",
        "{ min = 2, max = 8, samples = 1024, sampler = \"random\", seed = 1 }",
    ],
    &[
        key("from", THAT_OF_THE_KEY, "first value", "").holds(Form::Number(ANY)),
        key("to", THAT_OF_THE_KEY, "last value", "")
            .holds(Form::Number(ANY))
            .note("Belongs to the axis with steps, and with step if it falls on one"),
        key("steps", "", "number of values, both ends included", "")
            .holds(Form::Whole(1, LARGEST))
            .absent("required, or step"),
        key("step", THAT_OF_THE_KEY, "distance of the values", "")
            .holds(Form::Number(above(0.0)))
            .absent("required, or steps"),
        key("scale", "", "even steps of the value or of its logarithm", "")
            .holds(Form::Words(&["linear", "log"]))
            .absent("\"linear\""),
        key("min", THAT_OF_THE_KEY, "smallest value of samples", "").holds(Form::Number(ANY)),
        key("max", THAT_OF_THE_KEY, "largest value of samples", "").holds(Form::Number(ANY)),
        key("samples", "", "number of samples", "").holds(Form::Whole(1, 1 << 32)),
        key("sampler", "", "Sobol points (scrambled, unless seed is 0), or random ones", "")
            .holds(Form::Words(&["sobol", "random"]))
            .absent("\"sobol\""),
        key("seed", "", "seed of the samples", "").holds(Form::Whole(0, LARGEST)).absent("0"),
    ],
);

/// `contact` in `[model]`.
pub const CONTACT: Section = inline(
    "model.contact",
    "Friction with a coefficient (model §3.5).",
    &["{ coulomb = 0.3 }"],
    &[key("coulomb", "", "coefficient of friction μ", "").holds(Form::Axis(held(Property::Friction)))],
);

/// `root` in `[whisker]`.
pub const ROOT: Section = inline(
    "whisker.root",
    "Springs between the motor and the base section, unloaded at rest (model §7); one of them at least.",
    &["{ k_theta = 500 }", "{ k_theta = 500, k_y = 20, k_x = 100 }"],
    &[
        key("k_theta", "N mm/rad", "stiffness against turning", "")
            .holds(Form::Axis(held(Property::Turn)))
            .absent("rigid"),
        key("k_y", "N/mm", "stiffness across the whisker", "")
            .holds(Form::Axis(held(Property::Across)))
            .absent("rigid"),
        key("k_x", "N/mm", "stiffness along the whisker", "")
            .holds(Form::Axis(held(Property::Along)))
            .absent("rigid"),
    ],
);

/// `core` in `[whisker]`.
pub const CORE: Section = inline(
    "whisker.core",
    "A bonded concentric core of another modulus (model §7).",
    &["{ diameter = 0.5, modulus = 60000 }", "{ diameter = [[0, 1.0], [40, 0.5]], modulus = 60000 }"],
    &[
        key("diameter", "mm", "its diameter, or [[s, diameter], …]", "")
            .holds(Form::Any(&[PLACES, Form::Pairs]))
            .absent("required, unless the profile's file has core_mm"),
        key("modulus", "MPa", "its modulus", "").holds(Form::Axis(held(Property::CoreModulus))),
    ],
);

/// `foil` in `[gauge]`.
pub const FOIL: Section = inline(
    "gauge.foil",
    "A foil that is stiffer than the skin it is bonded to (model §8), centred on the grid.",
    &[
        "{ stiffness = 100, length = 6.3, width = 2.8 }",
        "{ thickness = 0.033, modulus = 3000, length = 6.3, width = 2.8 }",
        "\"KFGS-2-120\"",
    ],
    &[
        key("stiffness", "N/mm", "modulus times thickness", "")
            .holds(Form::Axis(held(Property::Foil)))
            .absent("required, or thickness and modulus"),
        key("thickness", "mm", "thickness", "")
            .holds(Form::Number(Range { open: [true, false], ..within(0.0, 2.0) }))
            .absent("required, or stiffness"),
        key("modulus", "MPa", "modulus", "")
            .holds(Form::Number(between(0.0, 1e6)))
            .absent("required, or stiffness"),
        key("length", "mm", "length of the base along the whisker", "").holds(Form::Number(above(0.0))),
        key("width", "mm", "width of the base", "").holds(Form::Number(above(0.0))),
        key("strain_limit", "", "largest |strain| of the foil itself, compared with its reading", "")
            .holds(Form::Number(above(0.0)))
            .absent("none"),
    ],
);

/// `material` in `[model]`.
pub const MATERIAL: Section = inline(
    "model.material",
    "One material law (model §3.3).",
    &[
        "{ hooke = 3.2 }",
        "{ neo-hookean = 3.2 }",
        "{ mooney-rivlin = [0.35, 0.15] }",
        "{ yeoh = [0.5, -0.08, 0.02] }",
    ],
    &[
        key("hooke", "MPa", "Young's modulus E of Hooke's law", "")
            .holds(Form::Axis(held(Property::Modulus)))
            .absent("required: one of these"),
        key("neo-hookean", "MPa", "initial modulus E₀ = 6 C10", "")
            .holds(Form::Axis(held(Property::Modulus)))
            .absent("required: one of these"),
        key("mooney-rivlin", "MPa", "[C10, C01]; E₀ = 6 (C10 + C01)", "")
            .holds(Form::Numbers(2))
            .absent("required: one of these"),
        key("yeoh", "MPa", "[C10, C20, C30]; E₀ = 6 C10", "")
            .holds(Form::Numbers(3))
            .absent("required: one of these"),
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

/// `weights` in `[optimise]`.
pub const WEIGHTS: Section = inline(
    "optimise.weights",
    "Weights of the objective \"weighted\"; one of them at least is above 0.",
    &["{ sd = 1.0, distance = 2.0 }"],
    &[
        key("sd", "", "weight of K_sd/K_mean", "").holds(Form::Number(from(0.0))).absent("1.0"),
        key("distance", "", "weight of total_rms_mm/L_a", "").holds(Form::Number(from(0.0))).absent("1.0"),
    ],
);

/// `budget` in `[optimise]`.
pub const BUDGET: Section = inline(
    "optimise.budget",
    "Limits of the search; the first that is reached ends it.",
    &["{ evaluations = 20000, seconds = 30 }"],
    &[
        key(
            "evaluations",
            "",
            "evaluations: one design at one drive, over all distances and robust samples",
            "",
        )
        .holds(Form::Whole(1, LARGEST))
        .absent("no limit"),
        key("seconds", "s", "wall time", "").holds(Form::Number(above(0.0))).absent("no limit"),
    ],
);

/// `variables` in `[optimise]`.
pub const VARIABLES: Section = inline(
    "optimise.variables",
    "What may vary: some of these, each [min, max]. A number under the key in its own section is the first start.",
    &[
        "{ D = [8, 12], d = [2, 10], L_a = [40, 60], x_ss = [3, 15], l = [1, 4], theta = [0.5, 10] }",
        "{ exponent = [0.5, 3], hub = [0, 5], k_theta = [100, 5000], E = [1, 5] }",
    ],
    &with::<6, 15, 21>(&COLUMNS_VARIED, &VARIED, "fixed", true),
);

/// Columns that may be variables.
const COLUMNS_VARIED: [Key; 6] = [
    key("D", "mm", "base diameter", "").holds(Form::Ends(above(0.0))).absent("fixed"),
    key("d", "mm", "tip diameter", "").holds(Form::Ends(above(0.0))).absent("fixed"),
    key("L_a", "mm", "length", "").holds(Form::Ends(above(0.0))).absent("fixed"),
    key("x_ss", "mm", "start of the grid", "").holds(Form::Ends(from(0.0))).absent("fixed"),
    key("l", "mm", "length of the grid", "").holds(Form::Ends(above(0.0))).absent("fixed"),
    key("theta", "degrees", "tap angle", "")
        .holds(Form::Ends(ANGLES))
        .absent("fixed")
        .note("delta (mm) with drive = \"displacement\""),
];

/// `limits` in `[optimise]`.
pub const LIMITS: Section = inline(
    "optimise.limits",
    "Limits that a design must keep. Its row must also be complete.",
    &["{ strain = 0.02, force_N = 1.0, unambiguous = true, tip_not_wider = true }"],
    &[
        key("strain", "", "largest |strain|", "")
            .holds(Form::Number(above(0.0)))
            .absent("gauge.strain_limit"),
        key("force_N", "N", "largest contact force", "").holds(Form::Number(above(0.0))).absent("no limit"),
        key("unambiguous", "", "the peak of the theory's curve lies below the range of distances", "")
            .holds(Form::Flag)
            .absent("false"),
        key("tip_not_wider", "", "d ≤ D", "").holds(Form::Flag).absent("false"),
    ],
);

/// `robust` in `[optimise]`.
pub const ROBUST: Section = inline(
    "optimise.robust",
    "Standard deviations of independent normal errors, cut at three standard deviations; all candidates have the same samples.",
    &[
        "{ D = 0.05, d = 0.05, L_a = 0.1, x_ss = 0.3, l = 0.05, theta = 0.1, tilt = 5, lean = 2 }",
        "{ d = 0.05, samples = 64, measure = \"cvar90\", calibrated = \"each\" }",
    ],
    &with::<11, 16, 27>(&TOLERANCES, &UNSURE, "0", false),
);

/// Columns that may have a tolerance, and what is done with it.
const TOLERANCES: [Key; 11] = [
    key("D", "mm", "of the base diameter", "").holds(Form::Number(from(0.0))).absent("0"),
    key("d", "mm", "of the tip diameter", "").holds(Form::Number(from(0.0))).absent("0"),
    key("L_a", "mm", "of the length", "").holds(Form::Number(from(0.0))).absent("0"),
    key("x_ss", "mm", "of the gauge's place", "").holds(Form::Number(from(0.0))).absent("0"),
    key("l", "mm", "of the grid's length", "").holds(Form::Number(from(0.0))).absent("0"),
    key("theta", "degrees", "of the tap angle", "")
        .holds(Form::Number(from(0.0)))
        .absent("0")
        .note("delta (mm) with drive = \"displacement\""),
    key("tilt", "degrees", "of the tilt of the object's edge", "")
        .holds(Form::Number(below(0.0, 30.0)))
        .absent("0")
        .note("The calibration does not include it: K̄ and f come from taps at upright edges (model §6)"),
    key("lean", "degrees", "of its lean", "")
        .holds(Form::Number(below(0.0, 30.0)))
        .absent("0")
        .note("As tilt"),
    key("samples", "", "whiskers sampled for each candidate", "").holds(Form::Whole(2, 1 << 16)).absent("64"),
    key("measure", "", "their mean, or the mean of the worst tenth", "")
        .holds(Form::Words(&["mean", "cvar90"]))
        .absent("\"mean\""),
    key("calibrated", "", "K̄ and f of each sampled whisker, or of the nominal one", "")
        .holds(Form::Words(&["each", "nominal"]))
        .absent("\"each\""),
];

/// `keys`, and those of `properties` in a table of `[optimise]`.
const fn with<const N: usize, const P: usize, const M: usize>(
    keys: &[Key; N],
    properties: &[Property; P],
    absent: &'static str,
    varied: bool,
) -> [Key; M] {
    let mut all = [keys[0]; M];
    let mut k = 0;
    while k < N + P {
        all[k] = if k < N { keys[k] } else { of(properties[k - N], absent, varied) };
        k += 1;
    }
    all
}

/// Bounds of a variable, or a tolerance.
const fn of(property: Property, absent: &'static str, varied: bool) -> Key {
    let about = property.about();
    let name = match property {
        Property::Turn => "k_theta",
        Property::Across => "k_y",
        Property::Along => "k_x",
        Property::Modulus => "E",
        Property::Friction => "mu",
        _ => about.key,
    };
    let form = if varied { Form::Ends(held(property)) } else { Form::Number(from(0.0)) };
    key(name, about.unit, about.what, "").holds(form).absent(absent)
}
