//! Assembly of a shader: constants, tables and layouts emitted from Rust, then the WGSL of the kernel asked for and no
//! other. Every text is validated by naga before a device sees it.

use std::fmt::Write;

use crate::kernel::{
    Kernel, Rule,
    cpu::series,
    nodes::{Nodes, gauss},
    rule::limits,
    tap::{SOLUTION_FIELDS, TAP_FIELDS},
};
use crate::scene::Precision;

/// Invocations of one workgroup.
pub const WORKGROUP: u32 = 64;

/// What a compute pipeline is specialised on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Linear or exact.
    pub kernel: Kernel,
    /// Nodes, terms, sweeps.
    pub rule: Rule,
    /// Type of every number.
    pub precision: Precision,
    /// Tolerance, as bits so that variants can be compared.
    pub tolerance: u64,
}

impl Variant {
    /// `tolerance` as in [`crate::kernel::Solver::solve`].
    pub fn new(kernel: Kernel, rule: Rule, precision: Precision, tolerance: f64) -> Self {
        Self { kernel, rule, precision, tolerance: tolerance.to_bits() }
    }

    /// Name in messages.
    pub fn name(&self) -> String {
        let Rule { nodes, terms, .. } = self.rule;
        format!("{:?} {:?} nodes={nodes} terms={terms}", self.kernel, self.precision).to_lowercase()
    }

    /// The whole WGSL text.
    pub fn wgsl(&self) -> String {
        let body = match self.kernel {
            Kernel::Linear => include_str!("../../../shaders/linear.wgsl").to_owned(),
            Kernel::Exact => tables(self) + include_str!("../../../shaders/exact.wgsl"),
        };
        [header(self), body, include_str!("../../../shaders/main.wgsl").to_owned()].join("\n")
    }
}

/// A literal of the variant's type.
fn literal(precision: Precision, x: f64) -> String {
    match precision {
        Precision::F32 => format!("{:?}f", x as f32),
        Precision::F64 => format!("{x:?}lf"),
    }
}

/// Types, layouts and the named numbers that every kernel uses.
fn header(v: &Variant) -> String {
    let real = match v.precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    };
    let mut text = format!("alias real = {real};\nconst WORKGROUP = {WORKGROUP}u;\n");
    let named = [
        ("ZERO", 0.0),
        ("SIXTH", 1.0 / 6.0),
        ("ONE", 1.0),
        ("TWO", 2.0),
        ("THREE", 3.0),
        ("TOLERANCE", f64::from_bits(v.tolerance)),
        ("MAX_ANGLE", v.rule.max_angle()),
    ];
    for (name, x) in named.into_iter().chain(limits::NAMED) {
        let _ = writeln!(text, "const {name}: real = {};", literal(v.precision, x));
    }
    for (name, fields) in [("Tap", &TAP_FIELDS[..]), ("Solution", &SOLUTION_FIELDS[..])] {
        let members: Vec<_> = fields.iter().map(|f| format!("{f}: real")).collect();
        let _ = writeln!(text, "struct {name} {{ {} }}", members.join(", "));
    }
    text
}

/// Tables of the exact kernel as unrolled sums with literal coefficients.
fn tables(v: &Variant) -> String {
    let (n, lit) = (v.rule.nodes, |x: f64| literal(v.precision, x));
    let nodes = Nodes::new(n);
    let list = |x: &[f64]| x.iter().map(|&x| lit(x)).collect::<Vec<_>>().join(", ");
    let dot = |row: &[f64]| {
        let first = format!("{} * y[0]", lit(row[0]));
        (1..n).fold(first, |sum, j| format!("fma({}, y[{j}], {sum})", lit(row[j])))
    };
    let rows = |m: &[Vec<f64>]| m.iter().map(|r| dot(r)).collect::<Vec<_>>().join(",\n        ");
    let horner = |c: &[f64]| {
        c[..c.len() - 1]
            .iter()
            .rev()
            .fold(lit(c[c.len() - 1]), |sum, &c| format!("fma({sum}, z, {})", lit(c)))
    };
    let (gauge_points, gauge_weights) = gauss(v.rule.gauge_points());
    let mut text = format!(
        "const N = {n}u;\nconst SWEEPS = {}u;\nconst GAUGE_N = {}u;\nalias Nodes = array<real, {n}>;\n",
        v.rule.sweeps,
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
    for (name, power, first) in [("one_minus_cos", "z", 2), ("x_minus_sin", "x * z", 3)] {
        let sum = horner(&series(v.rule.terms, first));
        let _ = writeln!(
            text,
            "fn {name}(x: real) -> real {{\n    let z = x * x;\n    return {power} * ({sum});\n}}"
        );
    }
    text + &primitive(n, &lit)
}

/// ∫₀^w of a series of shifted Legendre polynomials, unrolled.
fn primitive(n: usize, lit: &dyn Fn(f64) -> String) -> String {
    let mut text = "fn primitive(series: Nodes, w: real) -> real {\n    let x = fma(w, TWO, -ONE);\n    let p0 = ONE;\n    let p1 = x;\n    var sum = series[0] * w;\n".to_owned();
    for k in 1..n {
        let kf = k as f64;
        let _ = writeln!(
            text,
            "    let p{next} = ({a} * x * p{k} - {b} * p{last}) * {c};\n    sum += series[{k}] * (p{next} - p{last}) * {d};",
            next = k + 1,
            last = k - 1,
            a = lit(2.0 * kf + 1.0),
            b = lit(kf),
            c = lit(1.0 / (kf + 1.0)),
            d = lit(0.5 / (2.0 * kf + 1.0)),
        );
    }
    text + "    return sum;\n}\n"
}

/// Parses and validates a shader text; the error names the variant and shows the place.
pub fn validate(name: &str, wgsl: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(wgsl)
        .map_err(|e| format!("shader {name}: {}", e.emit_to_string_with_path(wgsl, name)))?;
    let capabilities = naga::valid::Capabilities::FLOAT64;
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
        .validate(&module)
        .map_err(|e| format!("shader {name}: {}", e.emit_to_string_with_path(wgsl, name)))?;
    Ok(module)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{Solution, Tap, rule::every_rule};
    use std::mem::offset_of;

    fn variants() -> impl Iterator<Item = Variant> {
        [Precision::F32, Precision::F64].into_iter().flat_map(|p| {
            every_rule(p)
                .into_iter()
                .flat_map(move |r| [Kernel::Linear, Kernel::Exact].map(|k| Variant::new(k, r, p, 1e-5)))
        })
    }

    #[test]
    fn every_variant_is_valid_wgsl() {
        let mut seen = 0;
        for v in variants() {
            validate(&v.name(), &v.wgsl()).unwrap_or_else(|e| panic!("{e}"));
            seen += 1;
        }
        assert!(seen >= 12, "only {seen} variants");
    }

    #[test]
    fn linear_variant_holds_nothing_of_the_rod() {
        for v in variants().filter(|v| v.kernel == Kernel::Linear) {
            let module = validate(&v.name(), &v.wgsl()).unwrap();
            let names: Vec<_> = module.functions.iter().filter_map(|(_, f)| f.name.clone()).collect();
            assert_eq!(names, ["solve"]);
        }
    }

    #[test]
    fn struct_layouts_are_those_of_rust() {
        let v = Variant::new(Kernel::Exact, every_rule(Precision::F32)[0], Precision::F32, 1e-5);
        let module = validate("layout", &v.wgsl()).unwrap();
        let offsets = |name: &str| {
            let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
            let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
            (
                members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize)).collect::<Vec<_>>(),
                *span as usize,
            )
        };
        macro_rules! rust {
            ($t:ty: $($f:ident)*) => { (vec![$((stringify!($f).to_owned(), offset_of!($t, $f))),*], size_of::<$t>()) };
        }
        assert_eq!(offsets("Tap"), rust!(Tap<f32>: taper rest angle hub near far width shear weight));
        assert_eq!(offsets("Solution"), rust!(Solution<f32>: force arc strain error sweeps));
    }

    #[test]
    fn a_bad_shader_is_pointed_at() {
        let e = validate("broken", "fn f() -> f32 {\n    return nothing;\n}").unwrap_err();
        assert!(e.contains("broken") && e.contains("nothing") && e.contains(":2"), "{e}");
    }
}
