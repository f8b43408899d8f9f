//! The shader of a scope: `design(i, …)` with everything that depends on the sizes of the chart unrolled.

use std::fmt::Write;

use super::tuples::Tuples;
use crate::scene::{Per, RankBy};
use crate::smooth::rod::{squares, to_coefficients, unit};
use crate::smooth::scope::Scope;

/// Invocations of one workgroup.
pub const WORKGROUP: u32 = 64;

/// Most numbers that an invocation keeps of its taps.
const MOST_KEPT: usize = 1024;

/// Distances up to which the loop of estimates is unrolled: their numbers then stay in registers.
const UNROLLED: usize = 16;

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
    pub fn new(scope: &Scope, layout: &crate::plan::Layout) -> Option<Self> {
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
        "const WORKGROUP = {WORKGROUP}u;\nconst NA = {}u;\nconst DRIVES = {}u;\nconst ANGLES = {}u;\n",
        s.distances, s.drives, s.angles_at
    );
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

/// The chart at the design's own angle.
fn own(scope: &Scope) -> String {
    let (chart, mut t) = (&scope.chart, String::new());
    let m = chart.values.len();
    let _ = writeln!(t, "    let at1 = fma(own, {}, -1.0);", lit(2.0 / chart.square));
    for k in 2..m {
        let before = if k == 2 { "1.0".to_owned() } else { format!("at{}", k - 2) };
        let _ = writeln!(t, "    let at{k} = fma(2.0 * at1, at{}, -{before});", k - 1);
    }
    for f in 0..2 + chart.place_terms {
        for i in 0..chart.terms {
            let coefficient = |k: usize| chart.values[k][f].get(i).copied();
            let first = lit(coefficient(0).unwrap_or(0.0));
            let sum = (1..m)
                .filter_map(|k| Some((k, coefficient(k)?)))
                .fold(first, |sum, (k, c)| format!("fma(at{k}, {}, {sum})", lit(c)));
            let _ = writeln!(t, "    let c{f}_{i} = {sum};");
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
    // A series over p; `None` where nothing of it matters.
    let series = |k: usize, f: usize| {
        let count =
            if s.own { chart.values.iter().map(|v| v[f].len()).max()? } else { chart.values[k][f].len() };
        let c = |i: usize| if s.own { format!("c{f}_{i}") } else { lit(chart.values[k][f][i]) };
        (count > 0).then(|| (1..count).fold(c(0), |sum, i| format!("fma({}, b{i}, {sum})", c(i))))
    };
    for k in 0..s.m {
        let zero = || "0.0".to_owned();
        let _ = writeln!(t, "        let force{k} = {};", series(k, 0).unwrap_or_else(zero));
        let _ = writeln!(t, "        let arc{k} = {};", series(k, 1).unwrap_or_else(zero));
        let terms = (0..s.places).filter_map(|place| Some((place, series(k, 2 + place)?)));
        let shortening = terms.fold(zero(), |sum, (place, x)| format!("fma({x}, over{place}, {sum})"));
        let _ = writeln!(t, "        let excess{k} = arc{k} - ({shortening}) * whole;");
    }
    let points = squares(chart.square, chart.values.len());
    for n in 0..s.m {
        let (square, basis) =
            if s.own { ("own".to_owned(), vec![]) } else { (lit(points[n]), chart.basis(points[n])) };
        let at = |name: &str| {
            (1..s.m).fold(format!("{name}0"), |sum, k| format!("fma({name}{k}, {}, {sum})", lit(basis[k])))
        };
        let _ = write!(
            t,
            "        let w_{n} = {};
        let d_{n} = fma(fma({square}, w_{n}, 1.0) * ratio, {}, w_{n});
        let q_{n} = -d_{n} / fma({square}, d_{n}, 1.0);
        largest = max(largest, abs({square} * d_{n}));
",
            at("force"),
            at("excess")
        );
    }
    let back = to_coefficients(chart.values.len());
    for k in 0..s.m {
        let coefficient = |name: &str| match s.own {
            true => format!("{name}_0"),
            false => sum((0..s.m).map(|n| (format!("{name}_{n}"), lit(back[k][n])))),
        };
        let _ = writeln!(t, "        let deviation{k} = {};", coefficient("d"));
        let _ = writeln!(t, "        let kappa{k} = {};", coefficient("q"));
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

/// K̄ − 1 of the row at hand.
fn calibration(scope: &Scope, s: &Sizes) -> String {
    match scope.fixed {
        Some(_) => "FIXED".to_owned(),
        None => format!("square * ({})", read(s, "mean")),
    }
}

fn elongation(scope: &Scope) -> &'static str {
    if scope.elongation { "(x2 - x1)" } else { "1.0" }
}

/// A design's place goes to one of two lists; its rows are not written here, for only a few designs have any below the bound.
const FINISH: &str = "    if is_hard {
        hard[atomicAdd(&tally[1], 1u)] = i;
        return;
    }
    if below {
        best[atomicAdd(&tally[0], 1u)] = i;
    }
    (*words).ok += found.ok;
    (*words).slipped += found.slipped;
    (*words).strain += found.strain;
    (*words).rootless += found.rootless;
    (*words).ambiguous += found.ambiguous;
    (*words).complete += select(found.complete, min(found.complete, 1u), PER_DESIGN);
";

/// Words and rows ranked by the spread of K, which needs no estimates but those whose words depend on the angle.
fn spread(scope: &Scope, s: &Sizes) -> String {
    let mut t = format!(
        "    let least_angle = {};
    let most_angle = {};
    for (var n = 0u; n < NA; n++) {{
{}    var apart = 0.0;
",
        if s.own { "w.angle".to_owned() } else { lit(scope.angles[0].angle) },
        if s.own { "w.angle".to_owned() } else { lit(scope.angles[s.drives - 1].angle) },
        kept(s, "n", "_")
    );
    let mean = |k: usize| if scope.fixed.is_some() { "0.0".to_owned() } else { format!("mean{k}") };
    let around: Vec<String> = (1..s.m).map(|k| format!("abs({} - kappa_{k})", mean(k))).collect();
    let _ = writeln!(t, "    let middle = {} - kappa_0;", mean(0));
    let _ =
        writeln!(t, "    let around = 0.0{};", around.iter().map(|a| format!(" + {a}")).collect::<String>());
    for k in 0..s.m {
        let _ = writeln!(t, "        apart += max(high{k} - kappa_{k}, kappa_{k} - low{k});");
    }
    let hull = if scope.fixed.is_some() { "false" } else { "complete < DRIVES" };
    let _ = write!(
        t,
        "        let lo = select(middle - around, -apart, {hull});
        let hi = select(middle + around, apart, {hull});
        let lo_q = fma(lo, select(least_angle * least_angle, most_angle * most_angle, lo < 0.0), FIXED);
        let hi_q = fma(hi, select(most_angle * most_angle, least_angle * least_angle, hi < 0.0), FIXED);
        let least = lo_q * select(0.99999 - largest, 1.00001 + largest, lo_q < 0.0) - 1e-7;
        let most = hi_q * select(1.00001 + largest, 0.99999 - largest, hi_q < 0.0) + 1e-7;
        let above = u32(above_);
        let slipped = u32(slipped_);
        let peak = slope_ * slope_ / (4.0 * beta_ * value_);
        let certain = most < peak;
        found.strain += DRIVES - above;
        found.slipped += DRIVES - slipped;
        is_hard = is_hard || most > 0.5 || least < max(-0.9 * (slope_ + beta_) / value_, -0.5);
        if certain && (low_ > most || high_ < least) {{
            found.ok += min(above, slipped);
        }} else if certain && low_ < least && high_ > most {{
            found.ambiguous += DRIVES;
        }} else if complete < DRIVES {{
            is_hard = true;
        }} else {{
            for (var j = 0u; j < DRIVES; j++) {{
                {}
                let deviation = square * ({});
                let apart = {} - deviation;
                let growth = 1.0 + deviation;
                let rootless = apart > peak * growth;
                let twice = apart >= low_ * growth && apart <= high_ * growth;
                found.rootless += u32(rootless);
                found.ambiguous += u32(twice);
                found.ok += u32(!rootless && !twice && j < above && j < slipped);
            }}
        }}
    }}
    found.complete = complete;
    for (var j = 0u; j < DRIVES; j++) {{
        {}",
        drive(scope, s, "j"),
        read(s, "kappa_"),
        calibration(scope, s),
        drive(scope, s, "j")
    );
    let share = (1.0 / (s.distances as f64 - 1.0)).sqrt();
    let _ = write!(
        t,
        "        let rank = square * sqrt(max({}, 0.0)) * {} * {};
        below = below || (j < complete && rank < job.bound);
    }}
{FINISH}",
        quadratic(s),
        lit(share),
        elongation(scope)
    );
    t
}

/// Σ_kl Cov_kl T_k T_l from the pairs k ≤ l.
fn quadratic(s: &Sizes) -> String {
    let mut at = 0;
    let mut rows = Vec::new();
    for k in 0..s.m {
        let diagonal = format!("0.5 * spread{at}");
        let mut row = if k == 0 { diagonal } else { format!("{diagonal} * basis{k}") };
        at += 1;
        for l in k + 1..s.m {
            row = format!("fma(basis{l}, spread{at}, {row})");
            at += 1;
        }
        rows.push(if k == 0 { row } else { format!("basis{k} * ({row})") });
    }
    format!("2.0 * ({})", rows.join(" + "))
}

/// Words and rows ranked by distance errors: an estimate per tap.
fn estimated(scope: &Scope, s: &Sizes) -> String {
    let share = 1.0 / s.distances as f64;
    let rank = match scope.rank.by {
        RankBy::ErrorMax => "largest_error".to_owned(),
        RankBy::NoiseRms => format!("sqrt(noises * {})", lit(share)),
        RankBy::TotalRms => format!("sqrt((squares + noises) * {})", lit(share)),
        _ => format!("sqrt(squares * {})", lit(share)),
    };
    let (hoisted, taps) = if s.distances <= UNROLLED {
        let each = |n: usize| {
            let tag = format!("{n}_");
            (
                kept(s, &format!("{n}u"), &tag),
                format!("{{ let a = {}; {} }}\n", lit(scope.distances[n].a), estimate(s, &tag)),
            )
        };
        let (hoisted, taps): (Vec<_>, Vec<_>) = (0..s.distances).map(each).unzip();
        (hoisted.concat(), taps.concat())
    } else {
        let (kept, estimate) = (kept(s, "n", "_"), estimate(s, "_"));
        let body = format!("let a = tables[{DISTANCE}u * n];\n{kept}{estimate}");
        (String::new(), format!("for (var n = 0u; n < NA; n++) {{ {body} }}\n"))
    };
    format!(
        "{hoisted}    for (var j = 0u; j < DRIVES; j++) {{
        {}        let calibration = {};
        let noise = (1.0 + calibration) * NOISE / angle;
        var squares = 0.0;
        var noises = 0.0;
        var largest_error = 0.0;
        var whole_row = j < complete;
        {taps}
        let rank = {rank};
        found.complete += u32(whole_row);
        below = below || (whole_row && rank < job.bound);
    }}
{FINISH}",
        drive(scope, s, "j"),
        calibration(scope, s),
    )
}

/// The estimate of the tap whose numbers end in `tag`.
fn estimate(s: &Sizes, tag: &str) -> String {
    let [value, slope, beta, unit, low, high, above, slipped] = KEPT.map(|name| format!("{name}{tag}"));
    format!(
        "let deviation = square * ({});
            let q = (calibration - deviation) / (1.0 + deviation);
            let read = {value} * q;
            let gap2 = {slope} * {slope} - 4.0 * {beta} * read;
            let gap = sqrt(max(gap2, 0.0));
            let eta = select(2.0 * read / ({slope} + gap), ({slope} - gap) / (2.0 * {beta}), {slope} < 0.0);
            let whole = 1.0 / (1.0 + eta);
            let error = a * eta * whole;
            squares = fma(error, error, squares);
            largest_error = max(largest_error, abs(error));
            let sigma = noise * a * whole * whole / max({unit} * gap, 1e-30);
            noises = fma(sigma, sigma, noises);
            let rootless = gap2 < 0.0 || 1.0 + eta < 1e-6;
            let twice = !rootless && q >= {low} && q <= {high};
            let over = f32(j) >= {above};
            let off = f32(j) >= {slipped};
            whole_row = whole_row && !rootless;
            found.rootless += u32(rootless);
            found.ambiguous += u32(twice);
            found.strain += u32(over);
            found.slipped += u32(off);
            found.ok += u32(!(rootless || twice || over || off));",
        read(s, &format!("kappa{tag}"))
    )
}
