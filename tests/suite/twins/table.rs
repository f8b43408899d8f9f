//! Which function is whose twin, and what stands alone.

use super::Twin;

/// The files of the Rust side, by what the table calls them.
pub const FILES: [(&str, &str); 9] = [
    ("exact/mod.rs", "crates/kernel/src/cpu/exact/mod.rs"),
    ("exact/sweep.rs", "crates/kernel/src/cpu/exact/sweep.rs"),
    ("exact/newton.rs", "crates/kernel/src/cpu/exact/newton.rs"),
    ("exact/gauge.rs", "crates/kernel/src/cpu/exact/gauge.rs"),
    ("exact/spatial.rs", "crates/kernel/src/cpu/exact/spatial.rs"),
    ("exact/legendre.rs", "crates/kernel/src/cpu/exact/legendre.rs"),
    ("exact/tables.rs", "crates/kernel/src/cpu/exact/tables.rs"),
    ("law.rs", "crates/kernel/src/cpu/law.rs"),
    ("scene/sampler.rs", "crates/core/src/scene/sampler.rs"),
];

/// Names of Rust that are others in every shader.
pub const RENAMED: [(&str, &str); 27] = [
    ("effects.shear", "SHEAR"),
    ("effects.extension", "EXTENSION"),
    ("effects.offset", "OFFSET"),
    ("effects.stick", "STICK"),
    ("effects.law", "LAW"),
    ("shear", "SHEAR"),
    ("extension", "EXTENSION"),
    ("offset", "OFFSET"),
    ("stick", "STICK"),
    ("law", "LAW"),
    ("tables.points", "POINTS"),
    ("state.steps[0]", "state.step_force"),
    ("state.steps[1]", "state.step_other"),
    ("state.noise[0]", "state.noise_force"),
    ("state.noise[1]", "state.noise_other"),
    ("noise[0]", "noise_across"),
    ("noise[1]", "noise_along"),
    ("step", "newton"),
    ("multiply", "high"),
    ("extra", "law.extra"),
    ("chi", "law.chi"),
    ("tables.weights[i]", "WEIGHTS[i]"),
    ("chart_error", "CHART_ERROR"),
    ("Bent.pole[0]", "Bent.pole_x"),
    ("Bent.pole[1]", "Bent.pole_y"),
    ("Bent.centre[0]", "Bent.centre_x"),
    ("Bent.centre[1]", "Bent.centre_y"),
];

/// What exists twice.
pub const TWINS: &[Twin] = &[
    Twin {
        wgsl: "solve",
        rust: "exact/mod.rs:taps",
        only_rust: &["tables", "rule", "effects", "tolerance"],
        renamed: &[("across", "felt.across"), ("strains", "felt.strains")],
        // Devices have no full Newton.
        numbers: &["SETTLE"],
        same: 20,
        ..Twin::NONE
    },
    Twin {
        wgsl: "shows",
        rust: "exact/mod.rs:shows",
        only_rust: &["stick"],
        renamed: &[("felt[0]", "felt.across"), ("felt[1]", "felt.along")],
        same: 2,
        ..Twin::NONE
    },
    Twin { wgsl: "then", rust: "exact/sweep.rs:then", same: 1, ..Twin::NONE },
    Twin {
        wgsl: "sweep",
        rust: "exact/sweep.rs:sweep",
        only_rust: &["tables", "effects", "rule", "stepping"],
        order: Some("tap state"),
        renamed: &[
            ("state.bending", "bending"),
            ("state.shortening", "shortening"),
            ("state.climb", "climb"),
            ("state.load", "load"),
            ("state.beyond", "beyond"),
            ("beyond", "law.load"),
            ("abs(b)", "b"),
            // Until the step has that name.
            ("dw", "grown"),
            ("first", "noise_across"),
            ("second", "noise_along"),
            ("ratio", "tap.ratio"),
        ],
        // Devices have no full Newton.
        numbers: &["PASSES"],
        same: 157,
        ..Twin::NONE
    },
    Twin {
        wgsl: "newton",
        rust: "exact/newton.rs:step",
        only_wgsl: &["y", "density", "heights"],
        only_rust: &["tables", "effects", "passes"],
        order: Some("tap bent state across along noise_across noise_along"),
        renamed: &[
            ("bent.y", "y"),
            ("bent.density", "density"),
            ("bent.heights", "heights"),
            ("x0", "bent.centre_x"),
            ("y0", "bent.centre_y"),
            ("vx", "bent.pole_x"),
            ("vy", "bent.pole_y"),
            ("toward[0]", "toward_x"),
            ("toward[1]", "toward_y"),
            ("base1", "first.base"),
            ("base2", "second.base"),
            ("Step.steps[0]", "Step.force"),
            ("Step.steps[1]", "Step.other"),
        ],
        same: 42,
        ..Twin::NONE
    },
    Twin {
        wgsl: "unit_force",
        rust: "exact/newton.rs:unit_force",
        only_rust: &["effects"],
        same: 2,
        ..Twin::NONE
    },
    Twin {
        wgsl: "unit_other",
        rust: "exact/newton.rs:unit_other",
        only_rust: &["effects"],
        same: 1,
        ..Twin::NONE
    },
    Twin {
        wgsl: "sensitivity",
        rust: "exact/gauge.rs:sensitivity",
        only_rust: &["offset"],
        same: 11,
        ..Twin::NONE
    },
    Twin { wgsl: "shares", rust: "exact/gauge.rs:shares", only_rust: &["effects"], same: 13, ..Twin::NONE },
    Twin { wgsl: "past", rust: "exact/gauge.rs:past", same: 1, ..Twin::NONE },
    Twin { wgsl: "place", rust: "exact/gauge.rs:place", same: 2, ..Twin::NONE },
    Twin {
        wgsl: "gauge",
        rust: "exact/gauge.rs:gauge",
        only_rust: &["tables", "rule", "effects"],
        renamed: &[
            ("axial", "EXTENSION"),
            ("beyond", "law.load"),
            ("point", "GAUGE_POINTS[i]"),
            ("side", "SIDE"),
        ],
        same: 100,
        ..Twin::NONE
    },
    Twin {
        wgsl: "spatial",
        rust: "exact/spatial.rs:spatial",
        only_rust: &["tables", "effects"],
        renamed: &[("point", "GAUGE_POINTS[i]"), ("weight", "GAUGE_WEIGHTS[i]")],
        same: 48,
        ..Twin::NONE
    },
    Twin {
        wgsl: "truncation",
        rust: "exact/gauge.rs:truncation",
        only_rust: &["n", "tables"],
        renamed: &[("sensitivity", "felt")],
        same: 2,
        ..Twin::NONE
    },
    // The halves of ∫P_k are written into the shader round by round, as 0.5/(2k + 1).
    Twin {
        wgsl: "primitive",
        rust: "exact/legendre.rs:primitive",
        only_rust: &["n"],
        unrolled: true,
        numbers: &["5.00000e-1"],
        same: 13,
        ..Twin::NONE
    },
    Twin {
        wgsl: "legendre",
        rust: "exact/legendre.rs:legendre",
        only_rust: &["n"],
        unrolled: true,
        same: 10,
        ..Twin::NONE
    },
    Twin { wgsl: "section", rust: "law.rs:Law::section", same: 3, ..Twin::NONE },
    Twin { wgsl: "one_minus_cos", rust: "exact/tables.rs:Tables::one_minus_cos", same: 1, ..Twin::NONE },
    Twin { wgsl: "x_minus_sin", rust: "exact/tables.rs:Tables::x_minus_sin", same: 1, ..Twin::NONE },
    Twin { wgsl: "owen", rust: "scene/sampler.rs:owen", heads: &[("x", "point")], same: 6, ..Twin::NONE },
    Twin { wgsl: "high", rust: "scene/sampler.rs:multiply", same: 7, ..Twin::NONE },
    Twin { wgsl: "philox", rust: "scene/sampler.rs:philox", same: 5, ..Twin::NONE },
];

/// Functions of WGSL without a twin.
pub const WGSL_ONLY: &[(&str, &str)] = &[
    ("main", "hands taps, or designs, to invocations"),
    ("seal", "the host takes the seal off again: its own test in gpu/seal.rs"),
    ("mix_bits", "a step of the seal"),
    ("is_finite", "what is no number does not leave a shader"),
    ("list_hard", "notes a design for the host"),
    ("weigh", "Σ weights_i y_i: `dot` with the weights of `Nodes`, which are its numbers"),
    ("integrate", "the same with its integral, row by row"),
    ("coefficients", "the same with its polynomials"),
    ("case_of", "`Scope::case` in f32; where it is within 1e-6 of a border, the host decides"),
    ("whisker", "`Layout::design` in f32, with the axes written into it"),
    ("fraction", "a line of `Axis::at`, in f32"),
    ("sobol", "the loop of `sobol` with the bits of `DIRECTIONS` written into it"),
    ("is_out", RANKING),
    ("note", RANKING),
    ("number", RANKING),
    ("size", RANKING),
    ("of_distance", RANKING),
    ("width_of", RANKING),
    ("design_of", RANKING),
    ("rank_design", RANKING),
    ("peak_of", RANKING),
    ("product", RANKING),
    ("grown", RANKING),
    ("bounds", RANKING),
    ("root_of", RANKING),
    ("powered", RANKING),
    ("variable", RANKING),
    ("placed", RANKING),
    ("fold", RANKING),
    ("series", RANKING),
    ("start_of", RANKING),
    ("polynomial", RANKING),
    ("choose", RANKING),
    ("to_series", RANKING),
    ("at_point", RANKING),
    ("read_tap", RANKING),
    ("range_of", RANKING),
    ("count", RANKING),
    ("estimate", RANKING),
    ("drive_at", RANKING),
    ("to_drive", RANKING),
    ("common_place", RANKING),
    ("at_drive", RANKING),
    ("first_beyond", RANKING),
    ("kept", RANKING),
    ("growth_of", RANKING),
    ("keep_theory", RANKING),
    ("kappa_at", RANKING),
    ("mean_at", RANKING),
    ("calibration", RANKING),
    ("miss", RANKING),
    ("deviation_at", RANKING),
    ("rows_of", RANKING),
];

/// Why no function of the ranking is compared by its text.
const RANKING: &str = "`crates/chart/src/lanes` goes through a pack of designs; every device compares its ranks with it, in `gpu/ranking/check.rs`";

/// Functions of Rust without a twin.
pub const RUST_ONLY: [(&[&str], &str); 7] = [
    (&["exact/sweep.rs:State::keep"], "lanes that are done wait; an invocation leaves its loop"),
    (
        &[
            "law.rs:Law::new",
            "exact/tables.rs:Tables::new",
            "exact/tables.rs:Tables::nodes",
            "exact/tables.rs:Tables::chart_error",
        ],
        "numbers that a shader has as literals",
    ),
    (&["exact/newton.rs:rolling"], "what rolls is solved on the CPU"),
    (&["exact/tables.rs:Tables::section"], "the law that there is, or none"),
    (
        &["exact/tables.rs:series", "law.rs:polynomial", "law.rs:plane", "exact/tables.rs:dot"],
        "written out in the shaders, term by term",
    ),
    (&["scene/sampler.rs:sobol"], "written out in the shaders, bit by bit"),
    (
        &[
            "scene/sampler.rs:Sampler::coordinate",
            "scene/sampler.rs:Sampler::each",
            "scene/sampler.rs:Sampler::scramble",
            "scene/sampler.rs:words",
            "scene/sampler.rs:hash",
            "scene/sampler.rs:directions",
            "scene/sampler.rs:flips",
        ],
        "known when the shader is written",
    ),
];

/// A struct of WGSL, that of Rust, and the fields that Rust has in arrays: (there, in WGSL).
type Struct = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

/// Structs that exist twice.
pub const STRUCTS: &[Struct] = &[
    (
        "State",
        "exact/sweep.rs:State",
        // What rolls is solved on the CPU.
        &[("steps", "step_force step_other"), ("noise", "noise_force noise_other"), ("rolled", "")],
    ),
    ("Turned", "exact/newton.rs:Turned", &[]),
    ("Spatial", "exact/spatial.rs:Spatial", &[]),
    (
        "Step",
        "exact/newton.rs:Step",
        &[("steps", "force other"), ("noise", "noise_force noise_other"), ("rolled", "")],
    ),
    // What is of nodes is an argument of its own in WGSL; H is for full Newton, which the CPU alone has.
    (
        "Bent",
        "exact/newton.rs:Bent",
        &[
            ("pole", "pole_x pole_y"),
            ("centre", "centre_x centre_y"),
            ("y", ""),
            ("density", ""),
            ("heights", ""),
            ("h_force", ""),
            ("ahead", ""),
        ],
    ),
    // `Tap` and `Solution` have one home. `Words` has a counter more in WGSL, of rows that are complete.
];
