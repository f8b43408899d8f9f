//! Assembles a shader: constants, tables and layouts emitted from Rust, then the WGSL of one kernel; naga validates every text.

use std::fmt::Write;

use crate::{
    Chart, Effects, Job, Rule, Solution, Tap,
    cpu::{pack::Scalar, series},
    nodes::{Nodes, gauss},
    rule::limits,
};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Precision;

/// Invocations of one workgroup.
pub const WORKGROUP: u32 = 64;

/// Specialisation of a compute pipeline.
#[derive(Debug, Clone, Copy)]
pub struct Variant<'a> {
    /// Effects, rule, tolerance, section law.
    pub job: Job<'a>,
    /// Type of every number.
    pub precision: Precision,
}

impl Variant<'_> {
    /// Name in messages.
    pub fn name(&self) -> String {
        let Rule { nodes, terms, .. } = self.job.rule;
        format!("{:?} {:?} nodes={nodes} terms={terms}", self.job.effects, self.precision).to_lowercase()
    }

    /// The whole WGSL text; two variants with the same text are the same pipeline.
    pub fn wgsl(&self) -> String {
        [
            &header(self),
            &tables(self, &self.job.effects),
            include_str!("../../../../shaders/exact.wgsl"),
            include_str!("../../../../shaders/sweep.wgsl"),
            include_str!("../../../../shaders/newton.wgsl"),
            include_str!("../../../../shaders/gauge.wgsl"),
            include_str!("../../../../shaders/main.wgsl"),
        ]
        .join("\n")
    }
}

/// A literal of the variant's type.
pub fn literal(precision: Precision, x: f64) -> String {
    match precision {
        Precision::F32 => format!("{:?}f", x as f32),
        Precision::F64 => format!("{x:?}lf"),
    }
}

/// Largest relative error of one rounding.
pub fn rounding(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => f32::ROUNDING,
        Precision::F64 => f64::ROUNDING,
    }
}

/// The type of every number, the size of a workgroup, and constants.
pub fn reals(precision: Precision, named: impl IntoIterator<Item = (&'static str, f64)>) -> String {
    let real = format!("{precision:?}").to_lowercase();
    let mut text = format!("alias real = {real};\nconst WORKGROUP = {WORKGROUP}u;\n");
    for (name, x) in named {
        let _ = writeln!(text, "const {name}: real = {};", literal(precision, x));
    }
    text
}

/// Structures of numbers, by their names and those of their fields.
fn structures(all: &[(&str, &[&str])]) -> String {
    let member = |field: &&str| format!("{field}: real");
    let fields = |fields: &[&str]| fields.iter().map(member).collect::<Vec<_>>().join(", ");
    all.iter().map(|(name, of)| format!("struct {name} {{ {} }}\n", fields(of))).collect()
}

fn header(v: &Variant<'_>) -> String {
    let named = [
        ("ZERO", 0.0),
        ("SIXTH", 1.0 / 6.0),
        ("THIRD", 1.0 / 3.0),
        ("ONE", 1.0),
        ("TWO", 2.0),
        ("THREE", 3.0),
        ("TOLERANCE", v.job.tolerance),
        ("MAX_ANGLE", v.job.rule.max_angle()),
        ("LEAST_REST", v.job.rule.least_rest()),
        ("ROUNDING", rounding(v.precision)),
    ];
    reals(v.precision, named.into_iter().chain(limits::NAMED))
        + &structures(&[("Tap", Tap::<f32>::FIELDS), ("Solution", Solution::<f32>::FIELDS)])
}

/// Tables of the exact kernel as unrolled sums with literal coefficients.
fn tables(v: &Variant<'_>, effects: &Effects) -> String {
    let (n, lit) = (v.job.rule.nodes, |x: f64| literal(v.precision, x));
    let nodes = Nodes::new(n);
    let list = |x: &[f64]| x.iter().map(|&x| lit(x)).collect::<Vec<_>>().join(", ");
    let dot = |row: &[f64]| {
        let first = format!("{} * y[0]", lit(row[0]));
        (1..n).fold(first, |sum, j| format!("fma({}, y[{j}], {sum})", lit(row[j])))
    };
    let rows = |m: &[Vec<f64>]| m.iter().map(|r| dot(r)).collect::<Vec<_>>().join(",\n        ");
    let (gauge_points, gauge_weights) = gauss(v.job.rule.gauge_points());
    let mut text = format!(
        "const N = {n}u;\nconst SWEEPS = {}u;\nconst GAUGE_N = {}u;\nalias Nodes = array<real, {n}>;\n",
        v.job.rule.sweeps,
        gauge_points.len()
    );
    for (name, x) in
        [("POINTS", &nodes.points), ("GAUGE_POINTS", &gauge_points), ("GAUGE_WEIGHTS", &gauge_weights)]
    {
        let _ = writeln!(text, "const {name} = array<real, {}>({});", x.len(), list(x));
    }
    let _ = writeln!(text, "fn weigh(y: Nodes) -> real {{\n    return {};\n}}", dot(&nodes.weights));
    for (name, m) in [("integrate", &nodes.integral), ("coefficients", &nodes.legendre)] {
        let _ =
            writeln!(text, "fn {name}(y: Nodes) -> Nodes {{\n    return Nodes(\n        {});\n}}", rows(m));
    }
    text += &turns(v.precision, v.job.rule.terms);
    text + &legendre("primitive", n, &lit)
        + &legendre("legendre", n, &lit)
        + &switches(effects, &v.job)
        + &section(v.job.chart, &lit)
}

fn turns(precision: Precision, terms: usize) -> String {
    let lit = |x: f64| literal(precision, x);
    let mut text = String::new();
    for (name, power, first) in [("one_minus_cos", "z", 2), ("x_minus_sin", "x * z", 3)] {
        let c = series(terms, first);
        let begun = lit(c[c.len() - 1]);
        let sum = c[..c.len() - 1].iter().rev().fold(begun, |sum, &c| format!("fma({sum}, z, {})", lit(c)));
        let _ = writeln!(
            text,
            "fn {name}(x: real) -> real {{\n    let z = x * x;\n    return {power} * ({sum});\n}}"
        );
    }
    text
}

/// Switches, which the device's compiler folds, and what depends on them.
fn switches(e: &Effects, job: &Job<'_>) -> String {
    let (rule, names) = (job.rule, ["PLAIN", "SHEAR", "EXTENSION", "OFFSET", "LAW"]);
    let switches = names.iter().zip([e.plain(), e.shear, e.extension, e.offset, e.law]);
    let list: String = switches.map(|(name, on)| format!("const {name} = {on};\n")).collect();
    let side = if e.far { "-" } else { "" };
    format!(
        "{list}const SIDE: real = {side}1.0;\nconst LEAST_SWEEPS = {}u;\nconst LARGEST_RATE: real = {:?};\nconst SMALLEST_RATE: real = {:?};\nconst STOP: real = {:?};\n",
        Rule::least(e, job.tolerance),
        rule.largest_rate(),
        rule.smallest_rate(),
        rule.stop(e),
    )
}

/// The section law as nested polynomials; without a chart it adds nothing.
fn section(chart: Option<&Chart>, lit: &dyn Fn(f64) -> String) -> String {
    let mut text =
        "struct Section { extra: real, chi: real, load: real }\nfn section(t: real, b: real) -> Section {\n"
            .to_owned();
    let Some(chart) = chart else {
        return text + "    return Section(ZERO, ZERO, ZERO);\n}\nconst CHART_ERROR: real = 0.0;\n";
    };
    let nested = |c: &[String], x: &str| {
        c[..c.len() - 1].iter().rev().fold(c[c.len() - 1].clone(), |sum, c| format!("fma({sum}, {x}, {c})"))
    };
    let line = |c: &[f64]| nested(&c.iter().map(|&c| lit(c)).collect::<Vec<_>>(), "x");
    let _ = writeln!(text, "    let most = fma(t, {}, {});", lit(chart.bending[1]), lit(chart.bending[0]));
    let _ = writeln!(
        text,
        "    let b2 = b * b;\n    let beta = b2 / (most * most);\n    let s = t * {};",
        lit(chart.scale)
    );
    let _ = writeln!(text, "    let x = clamp(s, -ONE, ONE);\n    let y = fma(min(beta, ONE), TWO, -ONE);");
    for (name, plane) in [("p", &chart.p), ("q", &chart.q)] {
        let rows: Vec<String> = plane.iter().map(|row| line(row)).collect();
        for (i, row) in rows.iter().enumerate() {
            let _ = writeln!(text, "    let {name}{i} = {row};");
        }
        let names: Vec<String> = (0..rows.len()).map(|i| format!("{name}{i}")).collect();
        let _ = writeln!(text, "    let {name} = {};", nested(&names, "y"));
    }
    let _ = writeln!(text, "    let r = {};\n    let c = {};", line(&chart.r), line(&chart.c));
    let load = if chart.covers { "abs(s)" } else { "max(beta, abs(s))" };
    let _ = writeln!(text, "    return Section(t * t * r + b2 * p, t * c + b2 * q, {load});\n}}");
    text + &format!("const CHART_ERROR: real = {};\n", lit(chart.error))
}

/// The Legendre series at `w`, or as `primitive` its integral from 0 to `w`.
fn legendre(name: &str, n: usize, lit: &dyn Fn(f64) -> String) -> String {
    let primitive = name == "primitive";
    let first = if primitive { "series[0] * w" } else { "series[0] + series[1] * x" };
    let mut text = format!(
        "fn {name}(series: Nodes, w: real) -> real {{\n    let x = fma(w, TWO, -ONE);\n    let p0 = ONE;\n    let p1 = x;\n    var sum = {first};\n"
    );
    for k in if primitive { 1..n } else { 1..n - 1 } {
        let (kf, last, next) = (k as f64, k - 1, k + 1);
        let (a, b, c) = (lit(2.0 * kf + 1.0), lit(kf), lit(1.0 / (kf + 1.0)));
        let term = match primitive {
            true => format!("series[{k}] * (p{next} - p{last}) * {}", lit(0.5 / (2.0 * kf + 1.0))),
            false => format!("series[{next}] * p{next}"),
        };
        let _ =
            writeln!(text, "    let p{next} = ({a} * x * p{k} - {b} * p{last}) * {c};\n    sum += {term};");
    }
    text + "    return sum;\n}\n"
}

/// Parses and validates a shader text; the error names the variant and shows the place.
pub fn validate(name: &str, wgsl: &str) -> Result<naga::Module, SolveError> {
    let refused = |why: &str| SolveError::Device(format!("shader {name}: {why}"));
    let module =
        naga::front::wgsl::parse_str(wgsl).map_err(|e| refused(&e.emit_to_string_with_path(wgsl, name)))?;
    let capabilities = naga::valid::Capabilities::FLOAT64;
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
        .validate(&module)
        .map_err(|e| refused(&e.emit_to_string_with_path(wgsl, name)))?;
    Ok(module)
}
