//! The inline tables.

use super::super::searched::{UNSURE, VARIED};
use super::form::{
    ANGLES, ANY, Form, LARGEST, NOT_NEGATIVE, PLACES, POSITIVE, Range, above, axis, below, between, from,
    of as held, within,
};
use super::{Key, Section, THAT_OF_THE_KEY, inline, key};
use crate::scene::Property;

/// A key of an inline table, which has the examples.
const fn part(name: &'static str, unit: &'static str, what: &'static str, form: Form) -> Key {
    key(name, unit, what, "").holds(form)
}

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
        part("from", THAT_OF_THE_KEY, "first value", Form::Number(ANY)),
        part("to", THAT_OF_THE_KEY, "last value", Form::Number(ANY))
            .note("Belongs to the axis with steps, and with step if it falls on one"),
        part("steps", "", "number of values, both ends included", Form::Whole(1, LARGEST))
            .absent("required, or step"),
        part("step", THAT_OF_THE_KEY, "distance of the values", POSITIVE).absent("required, or steps"),
        part("scale", "", "even steps of the value or of its logarithm", Form::Words(&["linear", "log"]))
            .absent("\"linear\""),
        part("min", THAT_OF_THE_KEY, "smallest value of samples", Form::Number(ANY)),
        part("max", THAT_OF_THE_KEY, "largest value of samples", Form::Number(ANY)),
        part("samples", "", "number of samples", Form::Whole(1, 1 << 32)),
        part(
            "sampler",
            "",
            "Sobol points (scrambled, unless seed is 0), or random ones",
            Form::Words(&["sobol", "random"]),
        )
        .absent("\"sobol\""),
        part("seed", "", "seed of the samples", Form::Whole(0, LARGEST)).absent("0"),
    ],
);

/// `contact` in `[model]`.
pub const CONTACT: Section = inline(
    "model.contact",
    "Friction with a coefficient (model §3.5).",
    &["{ coulomb = 0.3 }"],
    &[part("coulomb", "", "coefficient of friction μ", axis(Property::Friction))],
);

/// `root` in `[whisker]`.
pub const ROOT: Section = inline(
    "whisker.root",
    "Springs between the motor and the base section, unloaded at rest (model §7); one of them at least.",
    &["{ k_theta = 500 }", "{ k_theta = 500, k_y = 20, k_x = 100 }"],
    &[
        part("k_theta", "N mm/rad", "stiffness against turning", axis(Property::Turn)).absent("rigid"),
        part("k_y", "N/mm", "stiffness across the whisker", axis(Property::Across)).absent("rigid"),
        part("k_x", "N/mm", "stiffness along the whisker", axis(Property::Along)).absent("rigid"),
    ],
);

/// `core` in `[whisker]`.
pub const CORE: Section = inline(
    "whisker.core",
    "A bonded concentric core of another modulus (model §7).",
    &["{ diameter = 0.5, modulus = 60000 }", "{ diameter = [[0, 1.0], [40, 0.5]], modulus = 60000 }"],
    &[
        part("diameter", "mm", "its diameter, or [[s, diameter], …]", Form::Any(&[PLACES, Form::Pairs]))
            .absent("required, unless the profile's file has core_mm"),
        part("modulus", "MPa", "its modulus", axis(Property::CoreModulus)),
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
        part("stiffness", "N/mm", "modulus times thickness", axis(Property::Foil))
            .absent("required, or thickness and modulus"),
        part("thickness", "mm", "thickness", Form::Number(Range { open: [true, false], ..within(0.0, 2.0) }))
            .absent("required, or stiffness"),
        part("modulus", "MPa", "modulus", Form::Number(between(0.0, 1e6))).absent("required, or stiffness"),
        part("length", "mm", "length of the base along the whisker", POSITIVE),
        part("width", "mm", "width of the base", POSITIVE),
        part("strain_limit", "", "largest |strain| of the foil itself, compared with its reading", POSITIVE)
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
        part("hooke", "MPa", "Young's modulus E of Hooke's law", axis(Property::Modulus))
            .absent("required: one of these"),
        part("neo-hookean", "MPa", "initial modulus E₀ = 6 C10", axis(Property::Modulus))
            .absent("required: one of these"),
        part("mooney-rivlin", "MPa", "[C10, C01]; E₀ = 6 (C10 + C01)", Form::Numbers(2))
            .absent("required: one of these"),
        part("yeoh", "MPa", "[C10, C20, C30]; E₀ = 6 C10", Form::Numbers(3)).absent("required: one of these"),
        part(
            "curve",
            "",
            "CSV file with the columns strain, stress_MPa (nominal), to which Yeoh's law is fitted",
            Form::Text,
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
        part("sd", "", "weight of K_sd/K_mean", NOT_NEGATIVE).absent("1.0"),
        part("distance", "", "weight of total_rms_mm/L_a", NOT_NEGATIVE).absent("1.0"),
    ],
);

/// `budget` in `[optimise]`.
pub const BUDGET: Section = inline(
    "optimise.budget",
    "Limits of the search; the first that is reached ends it.",
    &["{ evaluations = 20000, seconds = 30 }"],
    &[
        part(
            "evaluations",
            "",
            "evaluations: one design at one drive, over all distances and robust samples",
            Form::Whole(1, LARGEST),
        )
        .absent("no limit"),
        part("seconds", "s", "wall time", POSITIVE).absent("no limit"),
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
    part("D", "mm", "base diameter", Form::Ends(above(0.0))),
    part("d", "mm", "tip diameter", Form::Ends(above(0.0))),
    part("L_a", "mm", "length", Form::Ends(above(0.0))),
    part("x_ss", "mm", "start of the grid", Form::Ends(from(0.0))),
    part("l", "mm", "length of the grid", Form::Ends(above(0.0))),
    part("theta", "degrees", "tap angle", Form::Ends(ANGLES))
        .note("delta (mm) with drive = \"displacement\""),
];

/// `limits` in `[optimise]`.
pub const LIMITS: Section = inline(
    "optimise.limits",
    "Limits that a design must keep. Its row must also be complete.",
    &["{ strain = 0.02, force_N = 1.0, unambiguous = true, tip_not_wider = true }"],
    &[
        part("strain", "", "largest |strain|", POSITIVE).absent("gauge.strain_limit"),
        part("force_N", "N", "largest contact force", POSITIVE).absent("no limit"),
        part(
            "unambiguous",
            "",
            "the peak of the theory's curve lies below the range of distances",
            Form::Flag,
        )
        .absent("false"),
        part("tip_not_wider", "", "d ≤ D", Form::Flag).absent("false"),
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
    part("D", "mm", "of the base diameter", NOT_NEGATIVE),
    part("d", "mm", "of the tip diameter", NOT_NEGATIVE),
    part("L_a", "mm", "of the length", NOT_NEGATIVE),
    part("x_ss", "mm", "of the gauge's place", NOT_NEGATIVE),
    part("l", "mm", "of the grid's length", NOT_NEGATIVE),
    part("theta", "degrees", "of the tap angle", NOT_NEGATIVE)
        .note("delta (mm) with drive = \"displacement\""),
    part("tilt", "degrees", "of the tilt of the object's edge", Form::Number(below(0.0, 30.0)))
        .note("The calibration does not include it: K̄ and f come from taps at upright edges (model §6)"),
    part("lean", "degrees", "of its lean", Form::Number(below(0.0, 30.0))).note("As tilt"),
    part("samples", "", "whiskers sampled for each candidate", Form::Whole(2, 1 << 16)).absent("64"),
    part("measure", "", "their mean, or the mean of the worst tenth", Form::Words(&["mean", "cvar90"]))
        .absent("\"mean\""),
    part(
        "calibrated",
        "",
        "K̄ and f of each sampled whisker, or of the nominal one",
        Form::Words(&["each", "nominal"]),
    )
    .absent("\"each\""),
];

/// `keys`, and those of `properties` in a table of `[optimise]`; `absent` holds of all of which nothing else is said.
const fn with<const N: usize, const P: usize, const M: usize>(
    keys: &[Key; N],
    properties: &[Property; P],
    absent: &'static str,
    varied: bool,
) -> [Key; M] {
    let mut all = [keys[0]; M];
    let mut k = 0;
    while k < N + P {
        let one = if k < N { keys[k] } else { of(properties[k - N], varied) };
        all[k] = if one.absent.is_empty() { one.absent(absent) } else { one };
        k += 1;
    }
    all
}

/// Bounds of a variable, or a tolerance.
const fn of(property: Property, varied: bool) -> Key {
    let about = property.about();
    let name = match property {
        Property::Turn => "k_theta",
        Property::Across => "k_y",
        Property::Along => "k_x",
        Property::Modulus => "E",
        Property::Friction => "mu",
        _ => about.key,
    };
    let form = if varied { Form::Ends(held(property)) } else { NOT_NEGATIVE };
    part(name, about.unit, about.what, form)
}
