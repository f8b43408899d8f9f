//! The answer of a result in one sentence, with which a report begins.

use serde_json::Value;

use super::Source;
use super::designs::{DRIVES, WHISKER, properties};
use super::quantity::{distinct, ends, said};
use crate::digits::{percent, rounded};
use crate::error::InputError;
use crate::recommend::Standing;
use crate::sink::frame::Frame;

/// Largest strain error of a kernel that the benchmark's answer may name, relative.
const ACCURATE: f64 = 1e-4;

fn count(n: impl std::fmt::Display, word: &str) -> String {
    let n = n.to_string();
    format!("{n} {word}{}", if n == "1" { "" } else { "s" })
}

fn range(numbers: impl Iterator<Item = f64>, say: impl Fn(f64) -> String, unit: &str) -> Option<String> {
    let all = ends(numbers);
    let words = all.map(say);
    let [least, most] = &words;
    let said = || if least == most { format!("{least}{unit}") } else { format!("{least} to {most}{unit}") };
    (all[0] <= all[1]).then(said)
}

/// Spread of K: as a share of its mean, or in mm for elongation.
fn spread(sd: &str, x: f64, mean: f64) -> String {
    if sd == "K_sd_mm" { format!("{} mm", rounded(x)) } else { percent(x / mean) }
}

/// Error of the distance and spread of K of a row, where known.
fn worth(row: impl Fn(&str) -> Option<f64>, sd: &str) -> String {
    let error = row("total_rms_mm").map(|x| format!("the error of a distance is {} mm rms", rounded(x)));
    let mean = row("K_mean").unwrap_or(1.0);
    let varies = row(sd).map(|x| format!("K varies by {}", spread(sd, x, mean)));
    [error, varies].into_iter().flatten().collect::<Vec<_>>().join(" and ")
}

/// “tapped by θ = 5°”, or “pushed by δ = 3 mm”.
fn tapped(drive: &str, x: f64) -> String {
    format!("{} by {}", if drive == "theta_deg" { "tapped" } else { "pushed" }, said(drive, x))
}

/// The recommended row of designs.
pub struct Recommended<'a> {
    /// Value of a column in the row.
    pub number: &'a dyn Fn(&str) -> Option<f64>,
    /// Columns with several values.
    pub varying: &'a [&'a str],
    /// Columns of the spread of K, of the ranking, of the drive.
    pub names: [&'a str; 3],
    /// Number of complete rows.
    pub complete: u64,
    /// Number of complete rows kept by `top`, which limits the choice.
    pub kept: Option<u64>,
    /// Relation to the strain limit.
    pub standing: Standing,
}

/// Words for the row that a sweep recommends, used by the sweep and its report.
pub fn of_best(best: &Recommended<'_>) -> String {
    let Recommended { number, varying, names: [sd, by, drive], complete, kept, standing } = *best;
    let kept = kept.filter(|kept| *kept < complete);
    let within = match (standing, kept) {
        (Standing::BestWithin, None) => " of those within the strain limit",
        (Standing::BestWithin, Some(_)) => " of those within the strain limit that `top` keeps",
        _ => "",
    };
    let beyond = match (standing, kept) {
        (Standing::Beyond, None) if complete == 1 => "; that is beyond its strain limit".to_owned(),
        (Standing::Beyond, None) => "; that is beyond its strain limit, and so is every other row".to_owned(),
        (Standing::Beyond, Some(kept)) => format!(
            "; that is beyond its strain limit, and so are all {} that `top` keeps: a larger `top`, or per = \"row\", may keep one within it",
            count(kept, "row")
        ),
        _ => String::new(),
    };
    let whisker: Vec<String> = varying.iter().filter_map(|name| Some(said(name, number(name)?))).collect();
    let whisker = if whisker.is_empty() { String::new() } else { format!(" with {}", whisker.join(", ")) };
    let tap = tapped(drive, number(drive).unwrap_or(f64::NAN));
    let what = match (by, number("K_mean").or(number("K_mean_mm")).zip(number(sd)), number(by)) {
        (by, Some((mean, x)), _) if by == "K_sd" || by == sd => {
            let varies = spread(sd, x, mean);
            format!("has the steadiest K{within}: it varies by {varies} from distance to distance")
        }
        ("total_rms_mm", _, Some(x)) => {
            let noisy = number("noise_rms_mm").is_some_and(|noise| noise > 0.0);
            let parts =
                if noisy { "bias and noise together are" } else { "the bias, as no noise is given, is" };
            format!("tells distance best{within}: {parts} {} mm rms", rounded(x))
        }
        _ => format!("has the least {by}{within}"),
    };
    let strain =
        number("strain_max").map_or(String::new(), |x| format!(", with strains up to {}", percent(x)));
    let of = count(complete, "complete row");
    format!("Of {of}, the whisker{whisker}, {tap}, {what}{strain}{beyond}.")
}

/// A sweep with single taps only.
pub fn of_taps(table: &Frame) -> String {
    let fine = table.rows(|r| table.word("status", r) == "ok" && table.has("strain"));
    let strain = range(fine.iter().map(|r| 100.0 * table.number("strain", *r)), rounded, " %");
    let strain = strain.map_or(String::new(), |s| format!("; their strains are {s}"));
    let are = if fine.len() == 1 { "is" } else { "are" };
    format!("Of {} {} {are} ok{strain}.", count(table.len(), "tap"), fine.len())
}

/// The best tap of one whisker.
pub fn of_tap(result: &Value, drive: &str, sd: &str) -> String {
    let best = &result["optimum"];
    let Some(at) = best[drive].as_f64() else {
        return "No tap of the interval keeps every limit.".to_owned();
    };
    let limit = match result["limited_by"].as_str() {
        Some("bias") => "; most of the error is bias of the estimate",
        Some("noise") => "; most of the error is noise of the gauge",
        Some("strain_limit") => "; more would strain the gauge beyond its limit",
        Some("bound") => "; it is the end of the interval that was asked for",
        Some("complete_rows") => "; beyond it a distance has no answer",
        _ => "",
    };
    format!("The best tap is {}: {} there{limit}.", said(drive, at), worth(|name| best[name].as_f64(), sd))
}

/// A search: the chosen design, or the ends of the front.
pub fn of_search(source: &Source, front: Option<&Frame>, sd: &str) -> Result<String, InputError> {
    let best = &source.run["result"]["best"];
    if let Some(front) = front.filter(|t| t.len() > 1) {
        let (x, y) = (front.numbers(sd)?, front.numbers("total_rms_mm")?);
        let by = |p: &usize, q: &usize| x[*p].total_cmp(&x[*q]);
        let there = || (0..front.len()).filter(|r| x[*r].is_finite() && y[*r].is_finite());
        let row = |r: usize| worth(|name| Some(front.number(name, r)).filter(|x| x.is_finite()), sd);
        if let (Some(first), Some(last)) = (there().min_by(by), there().max_by(by)) {
            let (designs, first, last) = (count(front.len(), "design"), row(first), row(last));
            let ends = format!("from one where {first} to one where {last}");
            return Ok(format!("No design is best in both: the front has {designs}, {ends}."));
        }
    }
    let asked = source.in_force("optimise.variables").unwrap_or_default();
    let varied = |name: &str| {
        let key = name.trim_end_matches("_mm").trim_end_matches("_tip");
        asked.is_empty() || asked.split([' ', '{', ',', '=']).any(|word| word == key)
    };
    let names = WHISKER.into_iter().filter(|name| varied(name)).chain(properties());
    let design: Vec<String> = names.filter_map(|name| Some(said(name, best[name].as_f64()?))).collect();
    let tap = DRIVES.into_iter().find_map(|name| Some(tapped(name, best[name].as_f64()?)));
    let with = (!design.is_empty()).then(|| format!("with {}", design.join(", ")));
    let told: Vec<String> = with.into_iter().chain(tap).collect();
    if told.is_empty() {
        return Ok("The search found no whisker that keeps every limit.".to_owned());
    }
    let worth = worth(|name| best[name].as_f64(), sd);
    Ok(format!("The best whisker found is the one {}: {worth}.", told.join(", ")))
}

fn within(share: &Value) -> String {
    share.as_f64().map_or(String::new(), |x| {
        format!(", {} of them within the standard deviation that is given with them", percent(x))
    })
}

/// A calibration: held-out errors of its estimator.
pub fn of_calibration(source: &Source) -> String {
    let (result, counts) = (&source.run["result"], &source.run["counts"]);
    let name = result["estimator"].as_str().unwrap_or("none");
    let sides = result["sides"].as_array().map_or(&[][..], Vec::as_slice);
    let errors = sides.iter().filter_map(|s| s["estimators"][name]["held_out_rms_mm"].as_f64());
    let number = |v: &Value| v.as_u64().unwrap_or(0);
    let used = format!("{} of {} used", number(&counts["used"]), count(number(&counts["taps"]), "tap"));
    let Some(error) = range(errors, rounded, " mm") else {
        return format!("No estimator could be judged on distances that it has not seen ({used}).");
    };
    let within = within(&result["coverage"]["all"]["within_1"]);
    format!("The estimator “{name}” tells distances that it has not seen to {error} rms{within} ({used}).")
}

/// A calibration of several channels.
pub fn of_channels(source: &Source) -> String {
    let (result, number) =
        (&source.run["result"], |v: &Value| v.as_f64().map_or("unknown".to_owned(), rounded));
    let alone = |c: &Value| {
        format!("{} to {} mm", c["name"].as_str().unwrap_or_default(), number(&c["held_out_rms_mm"]))
    };
    let channels: Vec<String> = result["channels"].as_array().into_iter().flatten().map(alone).collect();
    let (channels, rms) = (channels.join(", "), number(&result["rms_mm"]));
    let taps = count(result["taps"].as_u64().unwrap_or(0), "calibrated tap");
    let within = within(&result["within_sigma"]);
    format!(
        "All channels together tell the distances of {taps} to {rms} mm rms{within}. Each alone tells distances that it has not seen: {channels}."
    )
}

/// Located readings; the `zeros` zero readings among them have no distance.
pub fn of_readings(table: &Frame, zeros: usize) -> Result<String, InputError> {
    let (distance, sigma) = (table.numbers("distance_mm")?, table.numbers("sigma_mm")?);
    let answered = table.rows(|r| distance[r].is_finite());
    if table.len() <= zeros {
        return Ok("All readings are at rest: none is a tap.".to_owned());
    }
    let readings = count(table.len() - zeros, "reading");
    let Some(where_) = range(answered.iter().map(|r| distance[*r]), rounded, " mm") else {
        return Ok(format!("None of {readings} has a distance."));
    };
    let mut sigmas: Vec<f64> = answered.iter().map(|r| sigma[*r]).filter(|s| s.is_finite()).collect();
    sigmas.sort_by(f64::total_cmp);
    let half = match &*sigmas {
        [] => String::new(),
        [s] => format!(", with a standard deviation of {} mm", rounded(*s)),
        all => {
            let s = rounded(all[all.len() / 2]);
            format!(", half of them with a standard deviation of at most {s} mm")
        }
    };
    let have = if answered.len() == 1 { "has" } else { "have" };
    Ok(format!("{} of {readings} {have} a distance: {where_}{half}.", answered.len()))
}

/// A traced object.
pub fn of_contour(source: &Source, points: usize) -> String {
    let curve = &source.run["result"]["curve"];
    let points = count(points, "point");
    let with = |name: &str, sigma: &str, unit: &str| {
        let sigma = curve[sigma].as_f64().map_or(String::new(), |s| format!(" ± {}", rounded(s)));
        curve[name].as_f64().map(|x| format!("{}{sigma}{unit}", rounded(x)))
    };
    let kind = match curve["kind"].as_str() {
        None => return format!("No curve was found through {points}."),
        Some("smooth") => "smooth curve",
        Some(kind) => kind,
    };
    let at = curve["x_mm"].as_f64().zip(curve["y_mm"].as_f64());
    let at = at.map_or(String::new(), |(x, y)| format!("x = {} mm, y = {} mm", rounded(x), rounded(y)));
    let form = match (
        with("radius_mm", "sigma_radius_mm", " mm"),
        with("direction_deg", "sigma_direction_deg", "°"),
    ) {
        (Some(radius), _) => format!("a {kind} with a radius of {radius} about {at}"),
        (_, Some(direction)) => format!("a {kind} through {at} in the direction {direction}"),
        _ if at.is_empty() => format!("a {kind}"),
        _ => format!("a {kind} at {at}"),
    };
    format!("What fits {points} on the object best is {form}.")
}

/// A benchmark: the fastest kernel that is accurate enough.
pub fn of_bench(work: &Frame) -> Result<String, InputError> {
    let (time, error) = (work.numbers("ns_per_tap")?, work.numbers("strain_error_p99")?);
    let whole = |r: &usize| time[*r] > 0.0 && error[*r].is_finite();
    let ladder = work.rows(|r| matches!(work.word("kernel", r).as_str(), "exact" | "reference"));
    let all: Vec<usize> = ladder.into_iter().filter(whole).collect();
    let accurate: Vec<usize> = all.iter().copied().filter(|r| error[*r] <= ACCURATE).collect();
    let of = if accurate.is_empty() { &all } else { &accurate };
    let Some(best) = of.iter().copied().min_by(|a, b| time[*a].total_cmp(&time[*b])) else {
        return Ok("No kernel has a time and an error.".to_owned());
    };
    let [backend, precision] = ["backend", "precision"].map(|name| work.word(name, best));
    let (ns, millions, off) = (rounded(time[best]), rounded(1e3 / time[best]), percent(error[best]));
    Ok(format!(
        "The fastest, {backend} {precision}, solves a tap in {ns} ns ({millions} million taps a second) with 99 of 100 strains accurate to {off}."
    ))
}

/// A census of errors.
pub fn of_verify(table: &Frame) -> Result<String, InputError> {
    let (worst, bound, taps) =
        (table.numbers("strain_error_worst")?, table.numbers("bound")?, table.numbers("taps")?);
    let line = |r: usize| {
        let [backend, precision, of] = ["backend", "precision", "configuration"].map(|c| table.word(c, r));
        format!("{backend} {precision}, {of}")
    };
    let broken = table.rows(|r| table.word("verdict", r) != "ok");
    let near = |r: &usize| if bound[*r] > 0.0 { worst[*r] / bound[*r] } else { 0.0 };
    let nearest = |rows: Vec<usize>| {
        rows.into_iter().filter(|r| worst[*r].is_finite()).max_by(|a, b| near(a).total_cmp(&near(b)))
    };
    let told = |r: usize| {
        let (off, allowed) = (percent(worst[r]), percent(bound[r]));
        format!("{} is off by {off} of a strain at most, where {allowed} is allowed", line(r))
    };
    let all = count(taps.iter().filter(|n| n.is_finite()).sum::<f64>() as u64, "tap");
    let lines = count(table.len(), "check");
    if let Some(first) = broken.first() {
        let worst = nearest(broken.clone()).unwrap_or(*first);
        let verdict = table.word("verdict", worst);
        let what = if near(&worst) > 1.0 { told(worst) } else { line(worst) };
        return Ok(format!("{} of {lines} fail: {what} (verdict: {verdict}).", broken.len()));
    }
    let nearest = nearest((0..table.len()).collect())
        .map_or(String::new(), |r| format!("; nearest to its bound, {}", told(r)));
    Ok(format!(
        "Every backend keeps its bounds: {lines} against the reference passed, {all} in all{nearest}."
    ))
}

/// Bent whiskers.
pub fn of_shapes(contacts: &Frame, drive: &str) -> Result<String, InputError> {
    let solved = contacts.rows(|r| contacts.number("contact_x_mm", r).is_finite());
    let taps = count(solved.len(), "tap");
    let drives = distinct(solved.iter().map(|r| contacts.number(drive, *r)));
    let ends = match drives[..] {
        [] => return Ok(format!("None of {} has a shape.", count(contacts.len(), "tap"))),
        [one] => said(drive, one),
        [first, .., last] => {
            format!("{} to {}", said(drive, first), said(drive, last).rsplit("= ").next().unwrap_or_default())
        }
    };
    let column = |name: &'static str| solved.iter().map(move |r| contacts.number(name, *r));
    let parts = [
        range(column("strain").map(|x| 100.0 * x), rounded, " %")
            .map(|s| format!("the gauge is strained by {s}")),
        range(column("normal_force_N"), rounded, " N").map(|s| format!("the pole is pushed with {s}")),
    ];
    Ok(format!("In {taps} ({ends}) {}.", parts.into_iter().flatten().collect::<Vec<_>>().join(" and ")))
}
