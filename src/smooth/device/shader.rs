//! The shader of a scope: `design(i, …)` with everything that depends on the sizes of the chart unrolled.

use std::fmt::Write;

use super::tuples::Tuples;
use crate::scene::{Per, RankBy};
use crate::smooth::rod::unit;
use crate::smooth::scope::Scope;

/// Invocations of one workgroup.
pub const WORKGROUP: u32 = 64;

/// Most numbers that an invocation keeps of its taps.
const MOST_KEPT: usize = 1024;

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
    /// Squares carried, terms over p and over s.
    m: usize,
    terms: usize,
    places: usize,
    distances: usize,
    drives: usize,
    own: bool,
    /// Numbers of an angle in the tables, and where they start.
    angle: usize,
    angles_at: usize,
    /// Numbers kept of a tap.
    kept: usize,
}

impl Shader {
    /// Of `scope` over the designs of `layout`; `None` where an invocation would have to keep too much.
    pub fn new(scope: &Scope, layout: &crate::plan::Layout) -> Option<Self> {
        let own = scope.angles.is_empty();
        let m = if own { 1 } else { scope.chart.squares.len() };
        let pairs = m * (m + 1) / 2;
        let s = Sizes {
            m,
            terms: scope.chart.terms,
            places: scope.chart.place_terms,
            distances: scope.distances.len(),
            drives: scope.angles.len().max(1),
            own,
            angle: 3 + m + pairs,
            angles_at: DISTANCE * scope.distances.len(),
            kept: m + 6,
        };
        if s.kept * s.distances > MOST_KEPT {
            return None;
        }
        let mut tables: Vec<f32> = Vec::new();
        for d in &scope.distances {
            tables.extend([d.a, 1.0 / d.a, d.ends[0], d.ends[1]].map(|x| x as f32));
        }
        for a in &scope.angles {
            let l = &a.basis;
            tables.extend([a.angle as f32, (a.angle * a.angle) as f32, f32::from_bits(a.place)]);
            tables.extend(l.iter().map(|&x| x as f32));
            let pairs = (0..m).flat_map(|k| (k..m).map(move |n| (k, n)));
            tables.extend(pairs.map(|(k, n)| (l[k] * l[n] * if k == n { 1.0 } else { 2.0 }) as f32));
        }
        let tuples = Tuples::new(layout, tables.len())?;
        tables.extend(&tuples.tables);
        let wgsl = [
            constants(scope, &s),
            include_str!("../../../shaders/smooth.wgsl").to_owned(),
            tuples.wgsl,
            design(scope, &s),
        ]
        .concat();
        Some(Self { wgsl, tables, lengths: tuples.lengths })
    }
}

fn constants(scope: &Scope, s: &Sizes) -> String {
    let range = &scope.chart.range;
    let distances = scope.distances.iter().map(|d| d.a);
    let slack = 1e-6;
    let named = [
        ("NEAREST", distances.clone().fold(f64::INFINITY, f64::min)),
        ("FARTHEST", distances.fold(0.0, f64::max)),
        ("TAPER_LO", range.taper[0] - slack),
        ("TAPER_HI", range.taper[1] + slack),
        ("PLACE_LO", range.place[0] * (1.0 - slack)),
        ("PLACE_HI", range.place[1] * (1.0 + slack)),
        ("STRAIN_LIMIT", scope.strain_limit),
        ("NOISE", scope.noise),
        ("FIXED", scope.fixed.unwrap_or(0.0)),
    ];
    let mut text = format!(
        "const WORKGROUP = {WORKGROUP}u;\nconst NA = {}u;\nconst DRIVES = {}u;\nconst ANGLES = {}u;\nconst ANGLE = {}u;\n",
        s.distances, s.drives, s.angles_at, s.angle
    );
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

/// A polynomial through per-square `values` at drive `j`.
fn read(s: &Sizes, values: &str) -> String {
    if s.own {
        return format!("{values}0");
    }
    sum((0..s.m).map(|k| (format!("tables[row + {}u]", 3 + k), format!("{values}{k}"))))
}

/// `design`: statistics over the distances, words, rows.
fn design(scope: &Scope, s: &Sizes) -> String {
    let mut t = String::new();
    let own_chart = if s.own { own(scope) } else { String::new() };
    let (angle_last, square_last) = if s.own {
        ("w.angle".to_owned(), "own".to_owned())
    } else {
        let last = s.angles_at + (s.drives - 1) * s.angle;
        (format!("tables[{last}u]"), format!("tables[{}u]", last + 1))
    };
    let _ = write!(
        t,
        "fn design(i: u32, w: Whisker, words: ptr<function, Words>) {{
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
        let square = if s.own { "own".to_owned() } else { lit(scope.chart.squares[k]) };
        let _ = write!(
            t,
            "        let old{k} = kappa{k} - mean{k};
        mean{k} = fma(old{k}, share, mean{k});
        low{k} = min(low{k}, kappa{k});
        high{k} = max(high{k}, kappa{k});
        largest = max(largest, abs({square} * deviation{k}));
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
    let _ = write!(
        t,
        "        let room = (w.L_a - a) * inverse;
        var above = DRIVES;
        var slipped = DRIVES;
        {{
            let row = {last_row}u;
            let angle = {angle_last};
            let square = {square_last};
            if {strain_at} > STRAIN_LIMIT {{ above = 0u; }}
            if {arc_at} > room {{ slipped = 0u; }}
        }}
{search}        complete = min(complete, slipped);
        let at = n * {kept}u + {m}u;
        keep[at] = value;
        keep[at + 1u] = slope;
        keep[at + 2u] = beta;
        keep[at + 3u] = unit;
        keep[at + 4u] = f32(above);
        keep[at + 5u] = f32(slipped);
    }}
    if !(largest < 0.3) {{
        push_hard(i);
        return;
    }}
",
        last_row = s.angles_at + (s.drives - 1) * s.angle,
        search = if s.own { String::new() } else { search(&strain_at, &arc_at) },
        kept = s.kept,
        m = s.m,
    );
    if scope.estimates() {
        t += &estimated(scope, s);
    } else {
        t += &spread(scope, s);
    }
    t + "}\n"
}

/// The chart at the design's own angle.
fn own(scope: &Scope) -> String {
    let (chart, mut t) = (&scope.chart, String::new());
    let squares = &chart.squares;
    for (k, tk) in squares.iter().enumerate() {
        let scale: f64 = squares.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, tj)| tk - tj).product();
        let factors: Vec<String> = squares
            .iter()
            .enumerate()
            .filter(|(j, _)| *j != k)
            .map(|(_, tj)| format!("(own - {})", lit(*tj)))
            .collect();
        // Scaled first: products of small squares would underflow.
        let n = factors.len().max(1) as f64;
        let each = scale.abs().powf(-1.0 / n);
        let sign = if scale < 0.0 { "-" } else { "" };
        let scaled: Vec<String> = factors.iter().map(|f| format!("({f} * {})", lit(each))).collect();
        let product = if scaled.is_empty() { "1.0".to_owned() } else { scaled.join(" * ") };
        let _ = writeln!(t, "    let basis{k} = {sign}({product});");
    }
    for f in 0..2 + chart.place_terms {
        for i in 0..chart.terms {
            let terms = (0..squares.len()).map(|k| (format!("basis{k}"), lit(chart.values[k][f][i])));
            let _ = writeln!(t, "    let c{f}_{i} = {};", sum(terms));
        }
    }
    t
}

/// The rod, its gauge and its estimate at distance `n`.
fn tap(scope: &Scope, s: &Sizes) -> String {
    let chart = &scope.chart;
    let affine = |range: [f64; 2]| {
        let shift = unit(range, 0.0);
        (lit(unit(range, 1.0) - shift), lit(shift))
    };
    let (place, place_shift) = affine(chart.range.place);
    let (stiffness, stiffness_shift) = affine(chart.range.stiffness());
    let mut t = format!(
        "        let a = tables[{DISTANCE}u * n];
        let inverse = tables[{DISTANCE}u * n + 1u];
        let p = tau * a;
        let rest = 1.0 - p;
        let s1 = x1 * inverse;
        let s2 = x2 * inverse;
        let u1 = 1.0 - p * s1;
        let u2 = 1.0 - p * s2;
        let near = 1.0 - s1;
        let far = 1.0 - s2;
"
    );
    for k in 0..s.places {
        let _ = writeln!(t, "        var over{k} = 0.0;");
    }
    for (point, weight) in &scope.gauge {
        let _ = write!(
            t,
            "        {{
            let s = fma(s2 - s1, {}, s1);
            let u = 1.0 - p * s;
            let x = fma(s, {place}, {place_shift});
            let t0 = {} / (u * u * u);
            let t1 = t0 * x;
",
            lit(*point),
            lit(*weight)
        );
        for k in 0..s.places {
            if k > 1 {
                let _ = writeln!(t, "            let t{k} = 2.0 * x * t{} - t{};", k - 1, k - 2);
            }
            let _ = writeln!(t, "            over{k} += t{k};");
        }
        t += "        }\n";
    }
    let _ = write!(
        t,
        "        let whole = 1.0 / over0;
        let x = fma(1.0 / rest, {stiffness}, {stiffness_shift});
        let b0 = 1.0;
        let b1 = x;
"
    );
    for i in 2..s.terms {
        let _ = writeln!(t, "        let b{i} = 2.0 * x * b{} - b{};", i - 1, i - 2);
    }
    t += "        let lever = near * u2 + far * u1;\n        let ratio = (u1 + u2) / lever;\n";
    for k in 0..s.m {
        let series = |f: usize| {
            sum((0..s.terms).map(|i| {
                let c = if s.own { format!("c{f}_{i}") } else { lit(chart.values[k][f][i]) };
                (c, format!("b{i}"))
            }))
        };
        let shortening =
            sum((0..s.places).map(|place| (format!("({})", series(2 + place)), format!("over{place}"))));
        let square = if s.own { "own".to_owned() } else { lit(chart.squares[k]) };
        let _ = write!(
            t,
            "        let force{k} = {};
        let arc{k} = {};
        let shortening{k} = ({shortening}) * whole;
        let deviation{k} = fma(fma({square}, force{k}, 1.0) * ratio, arc{k} - shortening{k}, force{k});
        let kappa{k} = -deviation{k} / fma({square}, deviation{k}, 1.0);
",
            series(0),
            series(1)
        );
    }
    t + "        let b = 1.0 / (u1 * u2);
        let unit = 0.75 * w.D * inverse * b;
        let beta = (s1 * u2 + s2 * u1) * b;
        let value = rest * lever * b;
        let slope = lever * b - beta * rest;
        let strain = unit * value;
"
}

/// First drives above the limits, by bisection.
fn search(strain_at: &str, arc_at: &str) -> String {
    let one = |name: &str, value: &str, limit: &str| {
        format!(
            "        if {name} == 0u {{
            var hi = DRIVES - 1u;
            while {name} < hi {{
                let mid = ({name} + hi) / 2u;
                let row = ANGLES + mid * ANGLE;
                let angle = tables[row];
                let square = tables[row + 1u];
                if {value} > {limit} {{ hi = mid; }} else {{ {name} = mid + 1u; }}
            }}
        }}
"
        )
    };
    one("above", strain_at, "STRAIN_LIMIT") + &one("slipped", arc_at, "room")
}

/// K̄ − 1 and q of a tap whose numbers are kept at `n`.
fn miss(scope: &Scope, s: &Sizes) -> (String, String) {
    let calibration = match scope.fixed {
        Some(_) => "FIXED".to_owned(),
        None => format!("square * ({})", read(s, "mean")),
    };
    let kept = if s.own {
        format!("keep[n * {}u]", s.kept)
    } else {
        sum((0..s.m).map(|k| (format!("tables[row + {}u]", 3 + k), format!("keep[n * {}u + {k}u]", s.kept))))
    };
    (calibration, format!("square * ({kept})"))
}

/// `row`, `angle` and `square` of drive `j`.
fn drive(s: &Sizes) -> &'static str {
    if s.own {
        "let angle = w.angle;\n        let square = own;\n        let place = 0u;\n"
    } else {
        "let row = ANGLES + j * ANGLE;\n        let angle = tables[row];\n        let square = tables[row + 1u];\n        let place = bitcast<u32>(tables[row + 2u]);\n"
    }
}

fn elongation(scope: &Scope) -> &'static str {
    if scope.elongation { "(x2 - x1)" } else { "1.0" }
}

/// What is done with the rank of a row: rows or designs compete.
fn compete(scope: &Scope) -> (&'static str, &'static str, &'static str) {
    match scope.rank.per {
        Per::Row => ("", "if rank < job.bound { push_row(i, rank, place); }", ""),
        Per::Design => (
            "    var best = 3e38;\n    var best_place = 0u;\n",
            "if rank < best { best = rank; best_place = place; }",
            "    if found.complete > 0u && best < job.bound { push_row(i, best, best_place); }\n    found.complete = min(found.complete, 1u);\n",
        ),
    }
}

const FINISH: &str = "    (*words).ok += found.ok;
    (*words).slipped += found.slipped;
    (*words).strain += found.strain;
    (*words).rootless += found.rootless;
    (*words).ambiguous += found.ambiguous;
    (*words).complete += found.complete;
";

/// Words and rows ranked by the spread of K, which needs no estimates but those whose words depend on the angle.
fn spread(scope: &Scope, s: &Sizes) -> String {
    let (calibration, deviation) = miss(scope, s);
    let (before, take, after) = compete(scope);
    let lebesgue =
        scope.angles.iter().map(|a| a.basis.iter().map(|l| l.abs()).sum::<f64>()).fold(1.0, f64::max);
    let most_square = if s.own {
        "own".to_owned()
    } else {
        format!("tables[{}u]", s.angles_at + (s.drives - 1) * s.angle + 1)
    };
    let mut t = format!(
        "    for (var n = 0u; n < NA; n++) {{
        let at = n * {}u + {}u;
        let value = keep[at];
        let slope = keep[at + 1u];
        let beta = keep[at + 2u];
        let above = u32(keep[at + 4u]);
        let slipped = u32(keep[at + 5u]);
        var apart = 0.0;
",
        s.kept, s.m
    );
    for k in 0..s.m {
        let kappa = format!("keep[n * {}u + {k}u]", s.kept);
        let reach = match scope.fixed {
            Some(_) => format!("abs({kappa})"),
            None => format!("max(high{k} - {kappa}, {kappa} - low{k})"),
        };
        let _ = writeln!(t, "        apart = max(apart, {reach});");
    }
    let _ = write!(
        t,
        "        let most = fma({most_square} * {}, apart, 1.2 * abs(FIXED) + 1e-7);
        let limits = bounds(value, slope, beta, tables[{DISTANCE}u * n + 2u], tables[{DISTANCE}u * n + 3u]);
        let certain = most < limits.z;
        found.strain += DRIVES - above;
        found.slipped += DRIVES - slipped;
        if most > min(0.9 * (slope + beta) / value, 0.5) {{
            push_hard(i);
            return;
        }}
        if certain && (limits.x > most || limits.y < -most) {{
            found.ok += min(above, slipped);
        }} else if certain && limits.x < -most && limits.y > most {{
            found.ambiguous += DRIVES;
        }} else if complete < DRIVES {{
            push_hard(i);
            return;
        }} else {{
            for (var j = 0u; j < DRIVES; j++) {{
        {}                let deviation = {deviation};
                let q = ({calibration} - deviation) / (1.0 + deviation);
                let rootless = q > limits.z;
                let twice = q >= limits.x && q <= limits.y;
                found.rootless += u32(rootless);
                found.ambiguous += u32(twice);
                found.ok += u32(!rootless && !twice && j < above && j < slipped);
            }}
        }}
    }}
    found.complete = complete;
{before}    for (var j = 0u; j < complete; j++) {{
        {}",
        lit(1.2 * lebesgue),
        drive(s),
        drive(s)
    );
    let pairs = s.m * (s.m + 1) / 2;
    let square_sum = if s.own {
        "spread0".to_owned()
    } else {
        sum((0..pairs).map(|at| (format!("tables[row + {}u]", 3 + s.m + at), format!("spread{at}"))))
    };
    let share = (1.0 / (s.distances as f64 - 1.0)).sqrt();
    let _ = write!(
        t,
        "        let rank = square * sqrt(max({square_sum}, 0.0)) * {} * {};
        {take}
    }}
{after}{FINISH}",
        lit(share),
        elongation(scope)
    );
    t
}

/// Words and rows ranked by distance errors: an estimate per tap.
fn estimated(scope: &Scope, s: &Sizes) -> String {
    let (calibration, deviation) = miss(scope, s);
    let (before, take, after) = compete(scope);
    let share = 1.0 / s.distances as f64;
    let rank = match scope.rank.by {
        RankBy::ErrorMax => "largest_error".to_owned(),
        RankBy::NoiseRms => format!("sqrt(noises * {})", lit(share)),
        RankBy::TotalRms => format!("sqrt((squares + noises) * {})", lit(share)),
        _ => format!("sqrt(squares * {})", lit(share)),
    };
    format!(
        "{before}    for (var j = 0u; j < DRIVES; j++) {{
        {}        let calibration = {calibration};
        let noise = (1.0 + calibration) * NOISE / angle;
        var squares = 0.0;
        var noises = 0.0;
        var largest_error = 0.0;
        var whole_row = j < complete;
        for (var n = 0u; n < NA; n++) {{
            let at = n * {}u + {}u;
            let value = keep[at];
            let slope = keep[at + 1u];
            let beta = keep[at + 2u];
            let a = tables[{DISTANCE}u * n];
            let deviation = {deviation};
            let q = (calibration - deviation) / (1.0 + deviation);
            let read = value * q;
            let gap2 = slope * slope - 4.0 * beta * read;
            let gap = sqrt(max(gap2, 0.0));
            let eta = select(2.0 * read / (slope + gap), (slope - gap) / (2.0 * beta), slope < 0.0);
            let whole = 1.0 / (1.0 + eta);
            let error = a * eta * whole;
            squares = fma(error, error, squares);
            largest_error = max(largest_error, abs(error));
            let sigma = noise * a * whole * whole / max(keep[at + 3u] * gap, 1e-30);
            noises = fma(sigma, sigma, noises);
            let limits = bounds(value, slope, beta, tables[{DISTANCE}u * n + 2u], tables[{DISTANCE}u * n + 3u]);
            let rootless = gap2 < 0.0 || 1.0 + eta < 1e-6;
            let twice = !rootless && q >= limits.x && q <= limits.y;
            let over = f32(j) >= keep[at + 4u];
            let off = f32(j) >= keep[at + 5u];
            whole_row = whole_row && !rootless;
            found.rootless += u32(rootless);
            found.ambiguous += u32(twice);
            found.strain += u32(over);
            found.slipped += u32(off);
            found.ok += u32(!(rootless || twice || over || off));
        }}
        if whole_row {{
            found.complete += 1u;
            let rank = {rank};
            {take}
        }}
    }}
{after}{FINISH}",
        drive(s),
        s.kept,
        s.m
    )
}
