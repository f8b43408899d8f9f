//! Specs that are refused, each with the place and the reason.

use crate::common::specs::{parse, with};

use vibrissa::scene::{Contact, Drive, Geometry, Material};

/// Checks line, key and a part of the whole message of a refused spec.
#[track_caller]
fn refused(text: &str, line: usize, key: &str, part: &str) {
    let error = parse(text).expect_err("this spec must be refused");
    let said = error.to_string();
    let key = Some(key).filter(|k| !k.is_empty());
    assert_eq!((error.line, error.key.as_deref()), (Some(line), key), "{said}");
    assert!(said.contains(part), "`{part}` is not in: {said}");
    assert_eq!(error.file.as_deref(), Some("whisker.toml"));
    assert!(error.snippet.is_some());
}

/// Changes of a line, each refused with the number of a line, a key and a part of the message.
#[track_caller]
fn all_refused(changes: &[(&str, &str, usize, &str, &str)]) {
    changes.iter().for_each(|(line, new, at, key, part)| refused(&with(line, new), *at, key, part));
}

#[test]
fn names_of_sections_and_keys() {
    all_refused(&[
        ("D = 10.0", "DD = 10.0", 3, "whisker.DD", "in [whisker]"),
        ("L_a = 96.0", "La = 96.0", 5, "whisker.La", "did you mean L_a?"),
        ("l = 2.0", "l = 2.0\nnoise-strain = 1e-5", 9, "gauge.noise-strain", "did you mean noise_strain?"),
        ("D = 10.0", "D = 10.0\nx_ss = 3", 4, "whisker.x_ss", "it belongs under [gauge]"),
        ("format = 1", "D = 10.0", 1, "D", "it belongs under [whisker]"),
        ("[whisker]", "[wisker]", 2, "wisker", "did you mean whisker?"),
        ("[model]", "[model]\nmaterial = { hook = 3.2 }", 13, "model.material.hook", "did you mean hooke?"),
        ("a = [30", "a = { form = 1, to = 2, steps = 2 } #", 10, "tap.a.form", "did you mean from?"),
        ("format = 1", "format = 2", 1, "format", "newer"),
        ("format = 1", "format = 0", 1, "format", "too small"),
    ]);
    refused("whisker = 3\n", 1, "whisker", "write [whisker]");
}

#[test]
fn what_is_missing() {
    all_refused(&[
        ("D = 10.0", "", 2, "whisker.D", "add a line such as D = "),
        ("theta =", "# theta =", 9, "tap.theta", "theta is missing from [tap]"),
        ("a = [30", "a = { from = 1, steps = 2 } #", 10, "tap.a", "to is missing"),
        ("a = [30", "a = { from = 1, to = 2 } #", 10, "tap.a", "steps (the number of values) or step"),
    ]);
    let error = parse("").unwrap_err();
    assert_eq!((error.line, error.key.as_deref()), (None, Some("whisker.D")));
    assert!(error.message.contains("[whisker] with D is missing"));
}

#[test]
fn toml_that_is_none() {
    all_refused(&[
        ("D = 10.0", "D = 10.0 mm", 3, "", "cannot be understood"),
        ("D = 10.0", "D = 10,0", 3, "", "numbers without unit"),
        ("d = 4", "D = 4", 4, "", "duplicate key"),
        ("[run]", "[run", 15, "", "cannot be understood"),
        ("l = 2.0", "l = 2.0\nside = far", 9, "", "words in quotes"),
    ]);
}

#[test]
fn numbers_of_the_wrong_kind() {
    all_refused(&[
        ("D = 10.0", "D = \"10 mm\"", 3, "whisker.D", "a number, without unit and quotes"),
        ("D = 10.0", "D = true", 3, "whisker.D", "a number or an axis"),
        ("D = 10.0", "D = nan", 3, "whisker.D", "finite"),
        ("D = 10.0", "D = inf", 3, "whisker.D", "finite"),
        ("D = 10.0", "D = 1e999", 3, "whisker.D", "finite"),
        ("D = 10.0", "D = [8, nan]", 3, "whisker.D", "finite"),
        ("[30, 50, 70]", "[30,\n 50,\n \"70\"]", 12, "tap.a", "without unit and quotes"),
        ("D = 10.0", "D = -10.0", 3, "whisker.D", "D = -10.0: this value is out of range (allowed: > 0 mm)"),
        ("D = 10.0", "D = 0", 3, "whisker.D", "> 0 mm"),
        ("x_ss = 6.0", "x_ss = -0.1", 7, "gauge.x_ss", "≥ 0 mm"),
        ("D = 10.0", "D = 10.0\nhub = -1", 4, "whisker.hub", "≥ 0 mm"),
        ("steps = 3", "steps = 2.5", 11, "tap.theta.steps", "whole number"),
        ("steps = 3", "steps = -3", 11, "tap.theta.steps", "too small"),
        ("steps = 3", "steps = 0", 11, "tap.theta.steps", "too small"),
    ]);
}

#[test]
fn axes() {
    all_refused(&[
        ("[30, 50, 70]", "[]", 10, "tap.a", "list is empty"),
        ("from = 2, to = 4", "from = 4, to = 2", 11, "tap.theta.to", "from is larger than to"),
        ("steps = 3", "step = 0", 11, "tap.theta.step", "larger than zero"),
        ("steps = 3", "step = -1", 11, "tap.theta.step", "larger than zero"),
        ("steps = 3", "steps = 1", 11, "tap.theta.steps", "both ends"),
        ("steps = 3", "steps = 3, step = 1", 11, "tap.theta.step", "contradict"),
        ("steps = 3", "step = 1, scale = \"log\"", 11, "tap.theta.step", "needs steps"),
        ("steps = 3", "steps = 3, scale = \"logarithmic\"", 11, "tap.theta.scale", "\"log\""),
        ("steps = 3", "steps = 3, seed = 1", 11, "tap.theta.seed", "belongs to samples"),
        ("theta = { from = 2, to = 4", "theta = { from = 2, to = 90", 11, "tap.theta.to", "90 degrees"),
    ]);
    let log = "{ from = 0, to = 5, steps = 3, scale = \"log\" }";
    refused(&with("x_ss = 6.0", &format!("x_ss = {log}")), 7, "gauge.x_ss.from", "logarithmic");
    parse(&with("theta = { from = 2, to = 4, steps = 3", "theta = { from = 0.5, to = 90, step = 1")).unwrap();
    let many = "{ from = 1, to = 2, steps = 9007199254740991 }";
    let text = with("D = 10.0", &format!("D = {many}")).replace("d = 4", &format!("d = {many}"));
    refused(&text, 4, "whisker.d", "2^64 tuples");
}

#[test]
fn sampled_axes() {
    let d = |keys: &str| with("D = 10.0", &format!("D = {{ min = 8, max = 12, {keys} }}"));
    refused(&d("samples = 0"), 3, "whisker.D.samples", "too small");
    refused(&d("samples = 4294967297"), 3, "whisker.D.samples", "2^32");
    refused(&d("samples = 8, seed = -1"), 3, "whisker.D.seed", "too small");
    refused(&d("samples = 8, seed = 0.5"), 3, "whisker.D.seed", "whole number");
    refused(&d("samples = 8, sampler = \"halton\""), 3, "whisker.D.sampler", "\"sobol\", \"random\"");
    refused(&d("seed = 8"), 3, "whisker.D", "samples is missing");
    refused(&with("D = 10.0", "D = { min = 12, max = 8, samples = 2 }"), 3, "whisker.D.max", "min is larger");
    refused(&with("D = 10.0", "D = { min = -1, max = 8, samples = 2 }"), 3, "whisker.D.min", "> 0 mm");

    let two = |keys: &str| d("samples = 8").replace("d = 4", &format!("d = {{ min = 2, max = 4, {keys} }}"));
    refused(&two("samples = 9"), 4, "whisker.d.samples", "whisker.D and whisker.d are sampled together");
    refused(&two("samples = 8, seed = 3"), 4, "whisker.d.seed", "differ in seed");
    refused(&two("samples = 8, sampler = \"random\""), 4, "whisker.d.sampler", "differ in sampler");
    let a = d("samples = 8").replace("[30, 50, 70]", "{ min = 30, max = 60, samples = 8 }");
    refused(&a, 10, "tap.a", "whisker.D and tap.a are both sampled");
}

#[test]
fn values_that_no_tuple_can_satisfy() {
    all_refused(&[
        ("x_ss = 6.0", "x_ss = 95.0", 7, "gauge.x_ss", "x_ss + l = 95 + 2 mm"),
        ("x_ss = 6.0", "x_ss = [6, 95]", 7, "gauge.x_ss", "gauge.x_ss = 95"),
        ("x_ss = 6.0", "x_ss = { from = 6, to = 95, steps = 90 }", 7, "gauge.x_ss.to", "95 + 2 mm"),
        ("l = 2.0", "l = [2, 91]", 8, "gauge.l", "gauge.l = 91"),
        ("70]", "97]", 10, "tap.a", "tap.a = 97: the whisker is too short"),
        ("L_a = 96.0", "L_a = [96, 29]", 5, "whisker.L_a", "shorter than the smallest a, 30 mm"),
    ]);
    refused(&with("70]", "97]\n").replace("L_a = 96.0", "L_a = [80, 90]"), 10, "tap.a", "a ≤ 90 mm");
    let text = with("L_a = 96.0", "L_a = [96, 29]").replace("[30", "[20").replace("x_ss = 6.0", "x_ss = 28");
    refused(&text, 5, "whisker.L_a", "shorter than the smallest x_ss + l, 28 + 2 mm");
    let sampled = "{ min = 95, max = 99, samples = 8 }";
    refused(&with("x_ss = 6.0", &format!("x_ss = {sampled}")), 7, "gauge.x_ss", "beyond the whisker");

    // Outside only in combination, or only in part of the samples: rows of the table, not errors.
    parse(&with("L_a = 96.0", "L_a = [96, 40]")).unwrap();
    parse(&with("x_ss = 6.0", "x_ss = { min = 6, max = 99, samples = 8 }")).unwrap();
    parse(&with("x_ss = 6.0", "x_ss = 9.7").replace("l = 2.0", "l = 20.3").replace("96.0", "70")).unwrap();
}

#[test]
fn drives() {
    all_refused(&[
        ("[tap]", "[tap]\ndrive = \"displacement\"", 12, "tap.theta", "theta has no meaning"),
        ("[tap]", "[tap]\ndelta = 1.0", 10, "tap.delta", "drive = \"displacement\""),
        ("[tap]", "[tap]\ndrive = \"force\"", 10, "tap.drive", "\"angle\", \"displacement\""),
    ]);
    let moved = |delta: &str| with("theta = {", &format!("drive = \"displacement\"\ndelta = {delta} # {{"));
    refused(&moved("0"), 12, "tap.delta", "> 0 mm");
    let spec = parse(&moved("120")).unwrap();
    assert_eq!(spec.study.setup.drive, Drive::Displacement);
}

#[test]
fn models() {
    let model = |keys: &str| with("[model]", &format!("[model]\n{keys}"));
    let linear = |keys: &str| model(&format!("geometry = \"linear\"\n{keys}"));
    refused(&model("geometry = \"exakt\""), 13, "model.geometry", "did you mean exact?");
    refused(&model("nu = 0.6"), 13, "model.nu", "0 … 0.5");
    refused(&model("shear = \"true\""), 13, "model.shear", "without quotes");
    refused(&model("pole_radius = -1"), 13, "model.pole_radius", "≥ 0 mm");
    refused(&model("material = { hooke = 0 }"), 13, "model.material.hooke", "> 0 MPa");
    refused(&model("material = { hooke = 1, yeoh = [1, 0, 0] }"), 13, "model.material", "exactly one");
    refused(&model("material = { yeoh = [1, 0] }"), 13, "model.material.yeoh", "3 numbers are needed, not 2");
    refused(&model("material = { yeoh = [-1, 0, 0] }"), 13, "model.material.yeoh", "E0 is -6 MPa");
    let mooney = model("material = { mooney-rivlin = [0.2, -0.2] }");
    refused(&mooney, 13, "model.material.mooney-rivlin", "E0 is 0 MPa");
    refused(&model("material = \"hooke\""), 13, "model.material", "{ hooke = E }");
    refused(&model("contact = { coulomb = -0.1 }\nextension = true"), 13, "model.contact.coulomb", "≥ 0");
    let curve = |name: &str| model(&format!("material = {{ curve = {name} }}"));
    refused(&curve("\"no such file.csv\""), 13, "model.material.curve", "no such curve file");
    refused(&curve("\".\""), 13, "model.material.curve", "folder");
    refused(&curve("3.2"), 13, "model.material.curve", "in quotes");
    refused(&model("contact = \"sticky\""), 13, "model.contact", "{ coulomb = 0.3 }");
    refused(&model("contact = \"stick\""), 13, "model.contact", "needs extension = true");
    let soft = "contact = { coulomb = 0.3 }\nextension = true\npole_radius = 1\nindentation = true";
    refused(&model(soft), 13, "model.contact", "needs indentation = false");
    refused(&linear("extension = true"), 14, "model.extension", "takes only shear, nu, hub, side");
    refused(&linear("surface = true"), 14, "model.surface", "takes only");
    refused(&linear("pole_radius = 1"), 14, "model.pole_radius", "takes only");
    refused(&linear("contact = \"stick\""), 14, "model.contact", "takes only");
    refused(&linear("material = { neo-hookean = 3.2 }"), 14, "model.material", "takes only");

    let spec = parse(&linear("shear = true\nnu = 0\nextension = false\npole_radius = 0")).unwrap();
    let model = spec.study.setup.model;
    assert!(model.geometry == Geometry::Linear && model.shear && model.nu == 0.0);
}

#[test]
fn every_effect_of_the_exact_rod() {
    let model =
        |keys: &str| parse(&with("[model]", &format!("[model]\n{keys}"))).expect(keys).study.setup.model;
    assert!(model("shear = true").shear);
    assert!(model("extension = true").extension);
    assert!(model("surface = true").surface);
    let pole = model("pole_radius = 2");
    assert!(pole.pole_radius == 2.0 && !pole.surface);
    assert_eq!(model("extension = true\ncontact = \"stick\"").contact, Contact::Stick);
    let coulomb = model("extension = true\nsurface = true\ncontact = { coulomb = 0.3 }");
    assert_eq!(coulomb.contact, Contact::Coulomb(0.3));
    let on_a_pole = model("extension = true\npole_radius = 2\ncontact = { coulomb = 0.3 }");
    assert_eq!((on_a_pole.contact, on_a_pole.pole_radius), (Contact::Coulomb(0.3), 2.0));
    assert_eq!(model("material = { neo-hookean = 3.2 }").material, Material::NeoHookean(3.2));
    let mooney = Material::MooneyRivlin([0.35, 0.15]);
    assert_eq!(model("material = { mooney-rivlin = [0.35, 0.15] }").material, mooney);
    let yeoh = Material::Yeoh([0.5, -0.08, 0.02]);
    assert_eq!(model("material = { yeoh = [0.5, -0.08, 0.02] }").material, yeoh);
}

#[test]
fn other_sections() {
    let gauge = |key: &str| with("l = 2.0", &format!("l = 2.0\n{key}"));
    refused(&gauge("side = \"left\""), 9, "gauge.side", "\"contact\", \"far\"");
    refused(&gauge("noise_strain = -1e-6"), 9, "gauge.noise_strain", "≥ 0");
    refused(&gauge("strain_limit = 0"), 9, "gauge.strain_limit", "> 0");
    refused(&gauge("factor = 0"), 9, "gauge.factor", "> 0");
    let estimate = |key: &str| with("[estimate]", &format!("[estimate]\n{key}"));
    refused(&estimate("theory = \"euler\""), 14, "estimate.theory", "\"euler-bernoulli\"");
    refused(&estimate("K = 0"), 14, "estimate.K", "> 0");
    refused(&estimate("range = [50, 20]"), 14, "estimate.range", "a_min < a_max");
    refused(&estimate("range = [0, 20]"), 14, "estimate.range", "0 < a_min");
    refused(&estimate("range = 20"), 14, "estimate.range", "a list of numbers");
    let output = |key: &str| with("[output]", &format!("[output]\n{key}"));
    refused(&output("format = \"hdf5\""), 15, "output.format", "\"csv\", \"parquet\"");
    refused(&output("top = 0"), 15, "output.top", "≥ 1");
    refused(&output("by = \"k_sd\""), 15, "output.by", "did you mean K_sd?");
    refused(&output("per = \"tap\""), 15, "output.per", "\"row\", \"design\"");
    let run = |key: &str| with("[run]", &format!("[run]\n{key}"));
    refused(&run("tolerance = 1"), 16, "run.tolerance", "0 < tolerance < 1");
    refused(&run("threads = 0"), 16, "run.threads", "≥ 1");
    refused(&run("backend = \"cuda\""), 16, "run.backend", "\"gpu\"");
    refused(&run("out = 3"), 16, "run.out", "in quotes");
}

#[test]
fn tuple_files_and_specs() {
    let both = "[whisker]\nD = 10\n[tuples]\nfile = \"taps.csv\"\n";
    refused(both, 2, "whisker.D", "comes from the tuple file");
    refused("[tuples]\nfile = \"taps.csv\"\n[tap]\ntheta = 2\n", 4, "tap.theta", "comes from the tuple file");
    refused("[tuples]\nfile = \"no such file.csv\"\n", 2, "tuples.file", "no such tuple file");
    refused("[tuples]\nfile = \".\"\n", 2, "tuples.file", "folder");
    refused("[tuples]\n", 1, "tuples.file", "file is missing");
}
