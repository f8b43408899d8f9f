//! The chart at one distance, with its coefficients as literals.

use std::fmt::Write;

use super::{DISTANCE, Sizes, lit, sum};
use crate::smooth::rod::squares;
use crate::smooth::scope::Scope;
use vibrissa_core::physics::chebyshev::{matrix, scaled};

/// The chart at the design's own angle.
pub(super) fn own(scope: &Scope) -> String {
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
pub(super) fn tap(scope: &Scope, s: &Sizes) -> String {
    let chart = &scope.chart;
    let affine = |range: [f64; 2]| {
        let shift = scaled(range, 0.0);
        (lit(scaled(range, 1.0) - shift), lit(shift))
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
    let back = matrix(chart.values.len());
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
