//! The shader of a scope: `design(i, …)` with everything that depends on the sizes of the chart unrolled.

mod rows;
mod tap;

use std::fmt::Write;

use super::WEIGHTS;
use super::tuples::Tuples;
use crate::smooth::scope::Scope;
use rows::{estimated, spread};
use tap::{own, tap};
use vibrissa_core::scene::Per;

/// Invocations of one workgroup.
pub const WORKGROUP: u32 = 64;

/// Most numbers that an invocation keeps of its taps.
const MOST_KEPT: usize = 1024;

/// Numbers kept of a tap, beside the series of its K.
const KEPT: [&str; 8] = ["value", "slope", "beta", "unit", "low", "high", "above", "slipped"];

/// Numbers of a distance in the tables: a, 1/a, both ends of the range of interest.
const DISTANCE: usize = 4;

/// A number in WGSL.
fn lit(x: f64) -> String {
    format!("{:?}f", x as f32)
}

/// The chart and the axes that all designs share, as the shader reads them.
#[derive(Debug, Clone)]
pub struct Shader {
    /// The whole text.
    pub wgsl: String,
    /// What it reads: distances, angles, axes of the designs.
    pub tables: Vec<f32>,
    /// Lengths of the factors of a design.
    pub lengths: Vec<u32>,
}

/// Sizes of a scope.
struct Sizes {
    /// Terms over t that are carried, terms over p and over s.
    m: usize,
    terms: usize,
    places: usize,
    distances: usize,
    drives: usize,
    own: bool,
    /// Where the angles start in the tables.
    angles_at: usize,
    /// Numbers kept of a tap.
    kept: usize,
}

impl Shader {
    /// Of `scope` over the designs of `layout`; `None` where an invocation would have to keep too much.
    pub fn new(scope: &Scope, layout: &vibrissa_core::scene::Layout) -> Option<Self> {
        let own = scope.angles.is_empty();
        let m = if own { 1 } else { scope.chart.values.len() };
        let s = Sizes {
            m,
            terms: scope.chart.terms,
            places: scope.chart.place_terms,
            distances: scope.distances.len(),
            drives: scope.angles.len().max(1),
            own,
            angles_at: DISTANCE * scope.distances.len(),
            kept: m + KEPT.len(),
        };
        if s.kept * s.distances > MOST_KEPT {
            return None;
        }
        let mut tables: Vec<f32> = Vec::new();
        for d in &scope.distances {
            tables.extend([d.a, 1.0 / d.a, d.ends[0], d.ends[1]].map(|x| x as f32));
        }
        tables.extend(scope.angles.iter().map(|a| a.angle as f32));
        let tuples = Tuples::new(layout, tables.len())?;
        tables.extend(&tuples.tables);
        let wgsl = [
            constants(scope, &s),
            include_str!("../../../../../../shaders/smooth.wgsl").to_owned(),
            tuples.wgsl,
            design(scope, &s),
        ]
        .concat();
        Some(Self { wgsl, tables, lengths: tuples.lengths })
    }
}

fn constants(scope: &Scope, s: &Sizes) -> String {
    let range = &scope.chart.range;
    let [near, far] = scope.reach();
    let slack = 1e-6;
    let named = [
        ("NEAREST", near),
        ("FARTHEST", far),
        ("TAPER_LO", range.taper[0] - slack),
        ("TAPER_HI", range.taper[1] + slack),
        ("PLACE_LO", range.place[0] * (1.0 - slack)),
        ("PLACE_HI", range.place[1] * (1.0 + slack)),
        ("STRAIN_LIMIT", scope.strain_limit),
        ("NOISE", scope.noise),
        ("FIXED", scope.fixed.unwrap_or(0.0)),
    ];
    let mut text = format!(
        "const WORKGROUP = {WORKGROUP}u;\nconst NA = {}u;\nconst DRIVES = {}u;\nconst ANGLES = {}u;\n",
        s.distances, s.drives, s.angles_at
    );
    let weights = WEIGHTS.map(|w| format!("{w}u")).join(", ");
    let _ = writeln!(text, "const WEIGHTS = array<u32, {}>({weights});", WEIGHTS.len());
    let _ = writeln!(text, "const PER_DESIGN = {};", scope.rank.per == Per::Design);
    for (name, x) in named {
        let _ = writeln!(text, "const {name}: f32 = {};", lit(x));
    }
    text
}

/// Σ of products as nested fma.
fn sum(terms: impl DoubleEndedIterator<Item = (String, String)>) -> String {
    let mut terms = terms;
    let first = terms.next().map(|(a, b)| format!("{a} * {b}")).unwrap_or_default();
    terms.fold(first, |sum, (a, b)| format!("fma({a}, {b}, {sum})"))
}

/// The series of `values` at the drive at hand.
fn read(s: &Sizes, values: &str) -> String {
    if s.own {
        return format!("{values}0");
    }
    (1..s.m).fold(format!("{values}0"), |sum, k| format!("fma(basis{k}, {values}{k}, {sum})"))
}

/// θ of drive `j`: computed where the angles are evenly spaced, for a load costs more.
fn angle(scope: &Scope, j: &str) -> String {
    let (first, last) = (scope.angles[0].angle, scope.angles[scope.angles.len() - 1].angle);
    let step = if scope.angles.len() > 1 { (last - first) / (scope.angles.len() - 1) as f64 } else { 0.0 };
    let even = (0..)
        .zip(&scope.angles)
        .all(|(j, a)| (first + f64::from(j) * step - a.angle).abs() <= 1e-7 * a.angle);
    if even {
        return format!("fma(f32({j}), {}, {})", lit(step), lit(first));
    }
    format!("tables[ANGLES + {j}]")
}

/// `angle`, `square` and the polynomials over t of drive `j`.
fn drive(scope: &Scope, s: &Sizes, j: &str) -> String {
    if s.own {
        return "let angle = w.angle; let square = own;\n".into();
    }
    let mut t = format!(
        "let angle = {}; let square = angle * angle; let basis1 = fma(square, {}, -1.0);\n",
        angle(scope, j),
        lit(2.0 / scope.chart.square)
    );
    for k in 2..s.m {
        let before = if k == 2 { "1.0".to_owned() } else { format!("basis{}", k - 2) };
        let _ = writeln!(t, "let basis{k} = fma(2.0 * basis1, basis{}, -{before});", k - 1);
    }
    t
}

/// `design`: statistics over the distances, words, rows.
fn design(scope: &Scope, s: &Sizes) -> String {
    let own_chart = if s.own { own(scope) } else { String::new() };
    let mut t = format!(
        "fn design(i: u32, w: Whisker, words: ptr<function, Words>) -> u32 {{
    let tau = (w.D - w.d) / (w.D * w.L_a);
    let tan_alpha = 0.5 * (w.D - w.d) / w.L_a;
    let x1 = w.x_ss;
    let x2 = w.x_ss + w.l / sqrt(fma(tan_alpha, tan_alpha, 1.0));
    let own = w.angle * w.angle;
    var keep: array<f32, {}>;
    var complete = DRIVES;
    var largest = 0.0;
    var found = Words();
{own_chart}",
        s.kept * s.distances
    );
    for k in 0..s.m {
        let _ = writeln!(t, "    var mean{k} = 0.0;\n    var low{k} = 1e30;\n    var high{k} = -1e30;");
    }
    for at in 0..s.m * (s.m + 1) / 2 {
        let _ = writeln!(t, "    var spread{at} = 0.0;");
    }
    let _ = write!(t, "    for (var n = 0u; n < NA; n++) {{\n{}", tap(scope, s));
    let _ = writeln!(t, "        let share = 1.0 / f32(n + 1u);");
    for k in 0..s.m {
        let _ = write!(
            t,
            "        let old{k} = kappa{k} - mean{k};
        mean{k} = fma(old{k}, share, mean{k});
        low{k} = min(low{k}, kappa{k});
        high{k} = max(high{k}, kappa{k});
        keep[n * {kept}u + {k}u] = kappa{k};
",
            kept = s.kept
        );
    }
    let mut at = 0;
    for k in 0..s.m {
        for l in k..s.m {
            let _ = writeln!(t, "        spread{at} = fma(old{k}, kappa{l} - mean{l}, spread{at});");
            at += 1;
        }
    }
    let (strain_at, arc_at) = (
        format!("strain * angle * fma(square, {}, 1.0)", read(s, "deviation")),
        format!("square * ({})", read(s, "arc")),
    );
    let last = drive(scope, s, "(DRIVES - 1u)");
    let _ = write!(
        t,
        "        let room = (w.L_a - a) * inverse;
        var above = DRIVES;
        var slipped = DRIVES;
        {{
            {last}
            if {strain_at} > STRAIN_LIMIT {{ above = 0u; }}
            if {arc_at} > room {{ slipped = 0u; }}
        }}
{}        complete = min(complete, slipped);
        let limits = bounds(value, slope, beta, tables[{DISTANCE}u * n + 2u], tables[{DISTANCE}u * n + 3u]);
        let low = limits.x;
        let high = limits.y;
",
        if s.own { String::new() } else { search(scope, s, &strain_at, &arc_at) },
    );
    for (at, name) in KEPT.iter().enumerate() {
        let _ = writeln!(t, "        keep[n * {}u + {}u] = f32({name});", s.kept, s.m + at);
    }
    t += "    }\n    var below = false;\n    var is_hard = !(largest < 0.3);\n";
    t += &if scope.estimates() { estimated(scope, s) } else { spread(scope, s) };
    t + "}\n"
}

/// The numbers kept of tap `n`, as names that end in `tag`.
fn kept(s: &Sizes, n: &str, tag: &str) -> String {
    let mut t = String::new();
    let series = (0..s.m).map(|k| format!("kappa{tag}{k}"));
    for (at, name) in series.chain(KEPT.iter().map(|name| format!("{name}{tag}"))).enumerate() {
        let _ = writeln!(t, "    let {name} = keep[{n} * {}u + {at}u];", s.kept);
    }
    t
}

/// First drives above the limits, by bisection.
fn search(scope: &Scope, s: &Sizes, strain_at: &str, arc_at: &str) -> String {
    let one = |name: &str, value: &str, limit: &str| {
        format!(
            "        if {name} == 0u {{
            var hi = DRIVES - 1u;
            while {name} < hi {{
                let mid = ({name} + hi) / 2u;
                {}
                if {value} > {limit} {{ hi = mid; }} else {{ {name} = mid + 1u; }}
            }}
        }}
",
            drive(scope, s, "mid")
        )
    };
    one("above", strain_at, "STRAIN_LIMIT") + &one("slipped", arc_at, "room")
}
