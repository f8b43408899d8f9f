//! Words and rows of a design, ranked by the spread of K or by distance errors.

use std::fmt::Write;

use super::{DISTANCE, KEPT, Sizes, drive, kept, lit, read};
use crate::smooth::scope::Scope;
use vibrissa_core::scene::RankBy;

/// Distances up to which the loop of estimates is unrolled: their numbers then stay in registers.
const UNROLLED: usize = 16;

/// A design's place goes to one of two lists; its rows are not written here, for only a few designs have any below the bound.
const FINISH: &str = "    if is_hard {
        return list_hard(i);
    }
    if below {
        best[atomicAdd(&tally[0], 1u)] = job.stamp | i;
    }
    (*words).ok += found.ok;
    (*words).slipped += found.slipped;
    (*words).strain += found.strain;
    (*words).rootless += found.rootless;
    (*words).ambiguous += found.ambiguous;
    (*words).complete += select(found.complete, min(found.complete, 1u), PER_DESIGN);
    return 0u;
";

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

/// Words and rows ranked by the spread of K, which needs no estimates but those whose words depend on the angle.
pub(super) fn spread(scope: &Scope, s: &Sizes) -> String {
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
pub(super) fn estimated(scope: &Scope, s: &Sizes) -> String {
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
