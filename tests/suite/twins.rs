//! Functions that exist twice, in WGSL and in Rust, are the same: parameters, numbers, calls, formulas. Read from the texts of both, so that no
//! GPU is needed; what they compute is compared where there is one. See `docs/twins.md`.

mod formula;
mod function;
mod shader;
mod source;
mod table;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::LazyLock;

use formula::number;
use function::Function;
use shader::Shader;
use source::Context;
use table::{FILES, RENAMED, RUST_ONLY, STRUCTS, TWINS, WGSL_ONLY};
use vibrissa::chart::ranker::Ranker;
use vibrissa::kernel::gpu::ranking::Shader as Ranking;
use vibrissa::kernel::gpu::shader::{Variant, WORKGROUP};
use vibrissa::kernel::ranking::Charts;
use vibrissa::kernel::rule::{chart_range, limits, rules_of_devices};
use vibrissa::kernel::{Chart, Effects, Job, Rule};
use vibrissa::scene::axis::Points;
use vibrissa::scene::sampler::Sampler;
use vibrissa::scene::{Axis, Material, Output, Per, Precision, RankBy, Setup, Space, Study};

/// A function of the shaders and what says the same in Rust.
#[derive(Debug)]
struct Twin {
    wgsl: &'static str,
    /// File, function, and closure where it is one.
    rust: &'static str,
    /// The shader has it in a larger function: parameters are not compared, and the shader may have more numbers.
    part: bool,
    /// Parameters that only one of them has: on the device the job is in constants, and a function has no captures.
    only_wgsl: &'static [&'static str],
    only_rust: &'static [&'static str],
    /// What Rust calls otherwise: (there, in WGSL). Of `heads` the parameter only.
    renamed: &'static [(&'static str, &'static str)],
    heads: &'static [(&'static str, &'static str)],
    /// Order of the common parameters in WGSL where it is not that of Rust.
    order: Option<&'static str>,
    /// The shader has the rounds of its loop one by one.
    unrolled: bool,
    /// Numbers that only one of them writes down, each with its reason in the table.
    numbers: &'static [&'static str],
    /// Formulas and calls that are the same, term by term; the others say the same in another way.
    same: usize,
}

impl Twin {
    const NONE: Self = Self {
        wgsl: "",
        rust: "",
        part: false,
        only_wgsl: &[],
        only_rust: &[],
        renamed: &[],
        heads: &[],
        order: None,
        unrolled: false,
        numbers: &[],
        same: 0,
    };

    /// Parameters of the Rust function as WGSL has them, one by one.
    fn parameters(&self, names: &[String]) -> Vec<String> {
        let one = |name: &String| match parts(name) {
            list if list.is_empty() => {
                let renamed = self.heads.iter().chain(self.renamed).find(|(from, _)| from == name);
                vec![renamed.map_or(name.clone(), |(_, to)| (*to).to_owned())]
            }
            list => list,
        };
        names.iter().filter(|n| *n != "self").flat_map(one).collect()
    }
}

/// What Rust keeps in an array and WGSL in names.
fn parts(name: &str) -> Vec<String> {
    let list: &[&str] = match name {
        "state.steps" => &["state.step_force", "state.step_other"],
        "state.noise" => &["state.noise_force", "state.noise_other"],
        "noise" => &["noise_across", "noise_along"],
        _ => &[],
    };
    list.iter().map(|s| (*s).to_owned()).collect()
}

/// Names that a shader has for plain numbers.
const PLAIN: [&str; 6] = ["ZERO", "ONE", "TWO", "THREE", "SIXTH", "THIRD"];

/// Names of sizes, which Rust has in its types and tables.
const SIZES: [&str; 9] =
    ["N", "GAUGE_N", "SWEEPS", "LEAST_SWEEPS", "TOLERANCE", "SIDE", "NA", "DRIVES", "ANGLES"];

/// A shader's text.
#[derive(Debug, Clone)]
struct Text {
    name: String,
    wgsl: String,
    /// Numbers that it has names for.
    named: BTreeMap<&'static str, f64>,
}

/// Texts of every kind of exact kernel; the first has every effect but a sticking contact.
fn exact() -> Vec<Text> {
    let mut texts = Vec::new();
    let all = Effects {
        shear: true,
        extension: true,
        offset: true,
        stick: false,
        rolls: false,
        law: true,
        far: false,
        spatial: false,
    };
    let friction = Effects { extension: true, offset: true, ..Effects::default() };
    let kinds = [
        ("everything", Effects { spatial: true, ..all }, Some(Material::MooneyRivlin([0.35, 0.15]))),
        ("plain", Effects::default(), None),
        ("tilted", Effects { spatial: true, ..Effects::default() }, None),
        ("friction", friction, None),
        ("sticking", Effects { stick: true, ..all }, Some(Material::NeoHookean(3.2))),
        ("far", Effects { offset: false, far: true, ..all }, Some(Material::Yeoh([0.5, -0.08, 0.02]))),
    ];
    for precision in [Precision::F32, Precision::F64] {
        for rule in rules_of_devices(precision) {
            for (name, effects, material) in &kinds {
                let (axial, bending) = chart_range(precision, &rule);
                let chart = material.as_ref().and_then(|m| Chart::new(m, axial, bending, [1e-4, 1e-3]));
                let job = Job { effects: *effects, rule: &rule, tolerance: 1e-5, chart: chart.as_ref() };
                let v = Variant { job, precision };
                texts.push(Text { name: format!("{name}: {}", v.name()), wgsl: v.wgsl(), named: named(&v) });
            }
        }
    }
    texts
}

/// What the named numbers of `v` are in the CPU kernel.
fn named(v: &Variant<'_>) -> BTreeMap<&'static str, f64> {
    let (rule, effects) = (v.job.rule, &v.job.effects);
    let rounding = match v.precision {
        Precision::F32 => 0.5 * f64::from(f32::EPSILON),
        Precision::F64 => 0.5 * f64::EPSILON,
    };
    let rest = [
        ("ZERO", 0.0),
        ("ONE", 1.0),
        ("TWO", 2.0),
        ("THREE", 3.0),
        ("THIRD", 1.0 / 3.0),
        ("SIXTH", 1.0 / 6.0),
        ("N", rule.nodes as f64),
        ("GAUGE_N", rule.gauge_points() as f64),
        ("SWEEPS", f64::from(rule.sweeps)),
        ("LEAST_SWEEPS", f64::from(Rule::least(effects, v.job.tolerance))),
        ("LARGEST_RATE", rule.largest_rate()),
        ("SMALLEST_RATE", rule.smallest_rate()),
        ("STOP", rule.stop(effects)),
        ("MAX_ANGLE", rule.max_angle()),
        ("LEAST_REST", rule.least_rest()),
        ("TOLERANCE", v.job.tolerance),
        ("CHART_ERROR", v.job.chart.map_or(0.0, |c| c.error)),
        ("SIDE", if effects.far { -1.0 } else { 1.0 }),
        ("ROUNDING", rounding),
        ("WORKGROUP", f64::from(WORKGROUP)),
    ];
    rest.into_iter().chain(limits::NAMED).collect()
}

/// Shaders that rank by the spread of K and by distance errors, over Sobol and over random points.
fn ranking() -> Vec<Text> {
    let kinds = [("spread", RankBy::KSd, Sampler::Sobol), ("errors", RankBy::TotalRms, Sampler::Random)];
    let text = |(name, by, sampler): (&str, RankBy, Sampler)| {
        let points = Points { samples: 1 << 14, sampler, seed: 7 };
        let sampled = |min, max, dimension| Axis::Samples { min, max, log: false, points, dimension };
        let list =
            |from: f64, step: f64, n: u32| Axis::List((0..n).map(|i| from + step * f64::from(i)).collect());
        let (big, small, place) = (sampled(8.0, 12.0, 0), sampled(2.0, 7.0, 1), sampled(3.0, 15.0, 2));
        let (length, grid) = (Axis::Value(50.0), Axis::Value(2.0));
        let space = Space::grid([big, small, length, place, grid, list(21.0, 9.0, 4), list(0.5, 0.8, 12)]);
        let space = space.expect("a grid");
        let layout = space.layout().expect("a grid");
        let output = Output { top: Some(10), by, per: Per::Design, ..Output::default() };
        let study = Study { setup: Setup::default(), space, output };
        let ranker = Ranker::new(&study, &layout, 1e-4).expect("solved").expect("charts");
        let wgsl = Ranking::new(&ranker.sheet().expect("charts of cones"), &layout).expect("a shader").wgsl;
        Text { name: name.to_owned(), wgsl, named: BTreeMap::new() }
    };
    kinds.into_iter().map(text).collect()
}

static TEXTS: LazyLock<Vec<Text>> = LazyLock::new(|| ranking().into_iter().chain(exact()).collect());

/// Texts whose formulas are compared: the rankings and the first exact kernel.
const READ: usize = 3;

/// Sources of the Rust side, by what the table calls them.
static SOURCES: LazyLock<BTreeMap<&str, String>> = LazyLock::new(|| {
    let root = Path::new(crate::common::ROOT);
    let read =
        |path: &str| std::fs::read_to_string(root.join(path)).unwrap_or_else(|e| panic!("{path}: {e}"));
    FILES.iter().map(|(name, path)| (*name, read(path))).collect()
});

/// The side of the shaders, all texts together.
#[derive(Default)]
struct Shaders {
    functions: BTreeMap<String, Function>,
    /// Numbers that the texts have names for whose formulas are compared.
    named: BTreeMap<String, f64>,
    structs: BTreeMap<String, Vec<String>>,
    faults: Vec<String>,
}

impl Shaders {
    fn new(texts: &[Text]) -> Self {
        let mut all = Self::default();
        for (i, text) in texts.iter().enumerate() {
            match Shader::new(&text.wgsl, TWINS) {
                Ok(shader) => all.add(shader, text, i < READ),
                Err(e) => all.faults.push(format!("{}: {e}", text.name)),
            }
        }
        all
    }

    fn add(&mut self, shader: Shader, text: &Text, read: bool) {
        for (name, x) in &text.named {
            match shader.constants.get(*name) {
                Some(y) if (x - y).abs() <= 1e-7 * x.abs() => {}
                other => self.faults.push(format!("{}: {name} is {other:?}, on the CPU {x}", text.name)),
            }
        }
        for (name, found) in shader.functions {
            self.faults.extend(found.crossed.iter().map(|c| format!("{name}: {c} is in another's place")));
            let start = || Function { parameters: found.parameters.clone(), ..Function::default() };
            let all = self.functions.entry(name.clone()).or_insert_with(start);
            if all.parameters != found.parameters {
                self.faults.push(format!("{}: parameters of {name}: {:?}", text.name, found.parameters));
            }
            all.constants.extend(found.constants);
            if read {
                all.formulas.extend(found.formulas);
            }
        }
        // A ranking's sizes are its own.
        if read && !text.named.is_empty() {
            self.named.extend(shader.constants);
        }
        self.structs.extend(shader.structs);
    }
}

/// Everything in which the two sides differ, and is not said to, in lines; and how many functions, numbers and formulas were compared.
fn differences(shaders: &Shaders, sources: &BTreeMap<&str, String>) -> (Vec<String>, [usize; 3]) {
    let Shaders { functions: wgsl, named, structs, faults } = shaders;
    let mut faults = faults.clone();
    let files: BTreeMap<&str, syn::File> =
        sources.iter().map(|(name, text)| (*name, syn::parse_file(text).expect("valid Rust"))).collect();
    let functions: BTreeMap<String, source::Source<'_>> = files
        .iter()
        .flat_map(|(file, f)| {
            source::functions(f).into_iter().map(move |(name, s)| (format!("{file}:{name}"), s))
        })
        .collect();
    let signatures = functions.iter().map(|(name, s)| (name.clone(), s.parameters.clone())).collect();
    let constants = files.values().flat_map(source::constants).collect();
    let context = Context { twins: TWINS, named, constants: &constants, signatures: &signatures };

    // Every function is in a list.
    let twins: BTreeSet<&str> = TWINS.iter().map(|t| t.wgsl).collect();
    for name in wgsl.keys().filter(|n| !twins.contains(n.as_str()) && !WGSL_ONLY.iter().any(|(w, _)| w == *n))
    {
        faults.push(format!("{name} is new in WGSL: a twin, or WGSL only?"));
    }
    for name in twins.iter().chain(WGSL_ONLY.iter().map(|(name, _)| name)).filter(|n| !wgsl.contains_key(**n))
    {
        faults.push(format!("{name} is not in the shaders any more"));
    }
    let paired: BTreeSet<&str> = TWINS.iter().map(|t| t.rust).collect();
    let lone = |name: &str| RUST_ONLY.iter().any(|(list, _)| list.contains(&name));
    for name in functions.keys().map(String::as_str).filter(|n| !paired.contains(n) && !lone(n)) {
        // Closures are part of their function unless the table names them.
        if !name.rsplit_once(':').is_some_and(|(_, f)| f.contains('/')) {
            faults.push(format!("{name} is new in Rust: a twin, or Rust only?"));
        }
    }
    let all = paired.iter().chain(RUST_ONLY.iter().flat_map(|(list, _)| *list));
    for name in all.filter(|n| !functions.contains_key(**n)) {
        faults.push(format!("{name} is not in the sources any more"));
    }

    let (mut numbers, mut formulas) = (0, 0);
    let mut wholes: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for twin in TWINS {
        let (Some(w), Some(found)) = (wgsl.get(twin.wgsl), functions.get(twin.rust)) else { continue };
        let (name, r) = (twin.rust, source::read(context, twin, found));
        if !twin.part {
            let rust: Vec<String> = twin.parameters(&r.parameters);
            let rust: Vec<&str> =
                rust.iter().map(String::as_str).filter(|p| !twin.only_rust.contains(p)).collect();
            let here: Vec<&str> =
                w.parameters.iter().map(String::as_str).filter(|p| !twin.only_wgsl.contains(p)).collect();
            let ordered = twin.order.map_or(rust.clone(), |order| order.split(' ').collect());
            let same_names = rust.iter().collect::<BTreeSet<_>>() == ordered.iter().collect();
            if here != ordered || !same_names {
                faults.push(format!("{name}: parameters {rust:?}, in WGSL {here:?}"));
            }
        }
        let plain = |c: &String| if PLAIN.contains(&c.as_str()) { number(named[c]) } else { c.clone() };
        // Nothing, one and two are everywhere; a size is not a number.
        let counts = |c: &&String| !["0", "1", "2"].contains(&c.as_str()) && !SIZES.contains(&c.as_str());
        let here: BTreeSet<String> = w.constants.iter().map(plain).collect();
        let here: BTreeSet<&String> = here.iter().filter(counts).collect();
        let there: BTreeSet<&String> = r.constants.iter().filter(counts).collect();
        numbers += here.intersection(&there).count();
        let parts = wholes.entry(twin.wgsl).or_insert_with(|| here.iter().map(|c| (*c).clone()).collect());
        parts.retain(|c| !there.contains(c) && !twin.numbers.contains(&c.as_str()));
        let more = here.iter().filter(|c| !there.contains(**c) && !twin.part);
        let apart: BTreeSet<&str> = there.difference(&here).chain(more).map(|c| c.as_str()).collect();
        let said: BTreeSet<&str> = twin.numbers.iter().copied().collect();
        if apart != said {
            let wrong: Vec<_> = apart.symmetric_difference(&said).collect();
            faults.push(format!("{name}: numbers {wrong:?} of {there:?}, in WGSL {here:?}"));
        }
        let same = w.formulas.intersection(&r.formulas).count();
        formulas += same;
        if same != twin.same {
            let lines = |a: &Function, b: &Function| {
                a.formulas.difference(&b.formulas).map(|f| format!("\n        {f}")).collect::<String>()
            };
            let here = if twin.part { "\n        (a part)".to_owned() } else { lines(w, &r) };
            faults.push(format!(
                "{name}: {same} formulas and calls are the same, not {}.\n    Only in WGSL:{here}\n    Only in Rust:{}",
                twin.same,
                lines(&r, w)
            ));
        }
    }

    for (name, left) in wholes.iter().filter(|(_, left)| !left.is_empty()) {
        faults.push(format!("{name}: numbers {left:?} are in no part of it in Rust"));
    }

    for (wgsl, rust, renamed) in STRUCTS {
        let (file, name) = rust.split_once(':').expect("a file and a struct");
        let here: Option<BTreeSet<String>> = structs.get(*wgsl).map(|f| f.iter().cloned().collect());
        let field = |f: String| match renamed.iter().find(|(from, _)| *from == f) {
            Some((_, to)) => to.split_whitespace().map(str::to_owned).collect(),
            None => vec![f],
        };
        let mut fields = files.get(file).map(source::structs).unwrap_or_default();
        let there: Option<BTreeSet<String>> =
            fields.remove(name).map(|list| list.into_iter().flat_map(field).collect());
        if here.is_none() || here != there {
            faults.push(format!("struct {wgsl}: fields {here:?}, in Rust {there:?}"));
        }
    }
    (faults, [TWINS.len(), numbers, formulas])
}

#[test]
fn twins_are_the_same() {
    let (faults, [functions, numbers, formulas]) = differences(&Shaders::new(&TEXTS), &SOURCES);
    println!("{functions} functions: {numbers} numbers and {formulas} formulas the same");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Every shader there is has been read: no other text has an entry point.
#[test]
fn no_shader_is_forgotten() {
    fn walk(folder: &Path, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()) {
            if entry.is_dir() {
                walk(&entry, found);
            } else if entry.extension().is_some_and(|e| e == "rs" || e == "wgsl")
                && std::fs::read_to_string(&entry).is_ok_and(|t| t.contains("@compute"))
            {
                let inside = entry.strip_prefix(crate::common::ROOT).expect("a file of the project");
                found.push(inside.to_string_lossy().into_owned());
            }
        }
    }
    let mut found = Vec::new();
    for folder in ["shaders", "crates", "src"] {
        walk(&Path::new(crate::common::ROOT).join(folder), &mut found);
    }
    found.sort();
    // That of built whiskers is compared by what it computes: `every_case_on_every_backend`, and 16 taps of every batch.
    assert_eq!(found, ["shaders/built.wgsl", "shaders/main.wgsl", "shaders/ranking/main.wgsl"]);
}

/// One side changed, the other not: (file, or WGSL, what stands there, what comes in its place).
const CHANGED: &[(&str, &str, &str)] = &[
    // Numbers, written out and named, in a shader, in what writes shaders, and in Rust.
    ("WGSL", "0.5 * b1 * b2 * x", "0.6 * b1 * b2 * x"),
    ("WGSL", "clamp(abs(1.0 + strain), 1e-3, ONE)", "clamp(abs(1.0 + strain), 1e-4, ONE)"),
    ("WGSL", "0x3d20adeau", "0x3d20adebu"),
    ("WGSL", "const LEFT: real = 0.25f", "const LEFT: real = 0.26f"),
    ("WGSL", "const HOPELESS: real = 1000000000.0f", "const HOPELESS: real = 2000000000.0f"),
    ("WGSL", "const STOP: real = 0.05", "const STOP: real = 0.1"),
    ("WGSL", "select(HOPELESS, LOST, astray)", "select(LOST, LOST, astray)"),
    ("WGSL", "c2 > LEFT * tap.width", "c2 > GROWN * tap.width"),
    ("WGSL", "(9.0f * x * p4 - 4.0f * p3)", "(9.0f * x * p4 - 5.0f * p3)"),
    ("exact/gauge.rs", "of(12.0) * m", "of(11.0) * m"),
    ("exact/legendre.rs", "of(2.0 * kf + 1.0) * x * now", "of(2.0 * kf + 2.0) * x * now"),
    ("exact/gauge.rs", "of(HEIGHT_TAIL)", "of(BENDING_TAIL)"),
    ("exact/mod.rs", "ARC_ROUNDINGS", "ROUNDINGS"),
    ("exact/newton.rs", "of(1.0 / 3.0) * reach", "of(1.0 / 2.0) * reach"),
    ("exact/sweep.rs", "x.mul_add(x + of(3.0), of(3.0))", "x.mul_add(x + of(3.0), of(4.0))"),
    ("scene/sampler.rs", "0xbb67_ae85", "0xbb67_ae86"),
    // Two arguments, where a function is called and where it is made.
    (
        "WGSL",
        "fn truncation(tap: Tap, state: ptr<function, State>, series: Nodes, m: real, g2: real,",
        "fn truncation(tap: Tap, state: ptr<function, State>, series: Nodes, g2: real, m: real,",
    ),
    ("WGSL", "truncation(tap, state, series, m, g2,", "truncation(tap, state, series, g2, m,"),
    ("WGSL", "x, w_force, contact_radius, base,", "x, contact_radius, w_force, base,"),
    ("WGSL", "x0, y0, cosine, sine);", "x0, y0, sine, cosine);"),
    (
        "WGSL",
        "heights, across, along, noise_across, noise_along);",
        "heights, along, across, noise_across, noise_along);",
    ),
    ("WGSL", "state.step_force, state.step_other);", "state.step_other, state.step_force);"),
    ("WGSL", "error, rounded, felt.across, sweeps);", "rounded, error, felt.across, sweeps);"),
    ("WGSL", "select(clear, on_gauge, tap.far < 0.0)", "select(on_gauge, clear, tap.far < 0.0)"),
    ("WGSL", "place(c1, u1, c, g)", "place(u1, c1, c, g)"),
    ("WGSL", "high(0xcd9e8d57u, c.z)", "high(0xd2511f53u, c.z)"),
    ("exact/gauge.rs", "[m, g2, sensitivity]:", "[g2, m, sensitivity]:"),
    ("exact/gauge.rs", "[m, g2, sensitivity(offset, tap, x)]", "[g2, m, sensitivity(offset, tap, x)]"),
    ("exact/gauge.rs", "on_gauge_change, clear_change)", "clear_change, on_gauge_change)"),
    ("exact/mod.rs", "[error, rounded, across], sweeps)", "[rounded, error, across], sweeps)"),
    ("exact/newton.rs", "(m22 * across - m12 * along)", "(m22 * along - m12 * across)"),
    ("exact/sweep.rs", "[across, along], noise)", "[along, across], noise)"),
    ("exact/sweep.rs", "tables.section(axial[i], b.abs())", "tables.section(b.abs(), axial[i])"),
    // Signs, names and functions that only one side has.
    ("WGSL", "let slim = tap.taper * x / g2;", "let slim = -tap.taper * x / g2;"),
    ("WGSL", "along -= dx", "along += dx"),
    ("WGSL", "fn then(", "fn more() {}\nfn then("),
    ("exact/sweep.rs", "/// a + b + ab", "fn more() {}\n/// a + b + ab"),
    ("exact/sweep.rs", "pub fold: P,", "pub turned: P,"),
    ("exact/sweep.rs", "d_eta0 + hub * d_psi0", "d_eta0 + hub * psi0"),
];

#[test]
fn a_change_of_one_side_is_seen() {
    let plain = Shaders::new(&TEXTS[..READ]);
    assert!(differences(&plain, &SOURCES).0.is_empty());
    let mut unseen = Vec::new();
    for (place, from, to) in CHANGED {
        let mut sources = SOURCES.clone();
        let mut texts = TEXTS[..READ].to_vec();
        let changed = match sources.get_mut(place) {
            Some(text) => {
                let found = text.contains(from);
                *text = text.replacen(from, to, 1);
                found
            }
            None => {
                let found = texts.iter().any(|t| t.wgsl.contains(from));
                texts.iter_mut().for_each(|t| t.wgsl = t.wgsl.replacen(from, to, 1));
                found
            }
        };
        assert!(changed, "{place} does not say {from:?} any more");
        let faults = match *place {
            "WGSL" => differences(&Shaders::new(&texts), &SOURCES).0,
            _ => differences(&plain, &sources).0,
        };
        if faults.is_empty() {
            unseen.push((place, from));
        }
    }
    assert!(unseen.is_empty(), "{unseen:#?}");
}
