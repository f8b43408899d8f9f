//! Figures of a search, and of the best tap of one whisker.

use super::designs::{self, DRIVES, Limits, SD, WHISKER};
use super::quantity::{self, distinct, said};
use super::{Content, Drawn, Point, Source, answer};
use crate::error::Error;
use crate::figure::{Along, Axis, Figure, Mark, Marker, Panel, Path};
use crate::scene::RankBy;
use crate::sink::Frame;

pub fn of_optimise(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let result = &source.run["result"];
    let history = source.table("history.csv")?;
    let sd = history.one_of(&SD)?;
    let best = result["best"][sd].as_f64().zip(result["best"]["total_rms_mm"].as_f64());
    let front = source.maybe("pareto.csv")?;
    c.answer = answer::of_search(source, front.as_ref(), sd)?;
    if let Some(front) = front {
        let (rows, how) = designs::chosen(&front, sd)?;
        let fine = Limits::of(source).kept(&front);
        c.figure(designs::trade(&front, [sd, "total_rms_mm"], &rows, &fine, best)?);
        c.figure(designs::parallel(&front, &rows, &fine, &[sd, "total_rms_mm"])?);
        c.table(&front, rows, &how, true);
    }
    let column = match result["objective"].as_str().unwrap_or("sd") {
        // The starts of a front minimise the total error.
        "distance" | "pareto" => "total_rms_mm",
        "weighted" => "weighted",
        _ => sd,
    };
    c.figure(convergence(&history, column)?);
    if let Some(table) = source.maybe("sensitivity.csv")? {
        c.figure(sensitivity(&table)?);
    }
    c.figure(robust(source, sd));
    c.figure(split(source));
    for name in WHISKER.into_iter().chain(designs::properties()).chain(DRIVES) {
        if let Some(x) = result["best"][name].as_f64() {
            let text = said(name, x);
            let (symbol, value) = text.split_once(" = ").unwrap_or((name, &text));
            c.facts.push((format!("best {symbol}"), value.to_owned()));
        }
    }
    c.fact("spread of K", &result["best"][sd]);
    c.fact("bias, mm", &result["best"]["error_rms_mm"]);
    c.fact("noise, mm", &result["best"]["noise_rms_mm"]);
    c.fact("total error, mm", &result["best"]["total_rms_mm"]);
    c.fact("why", &result["why"]);
    c.first(&history, false);
    c.first_rows(source, &["sensitivity.csv"])?;
    Ok(c)
}

fn convergence(history: &Frame, column: &str) -> Drawn {
    let (n, start) = (history.numbers("evaluations")?, history.numbers("start")?);
    let (value, broken) = (history.numbers(column)?, history.numbers("violation")?);
    let starts = distinct(start.iter().copied());
    let mut panel = Panel::new("", Axis::log("evaluations", ""), quantity::axis(column));
    for (i, s) in starts.iter().enumerate() {
        let rows: Vec<usize> = history.rows(|r| start[r] == *s);
        let kept = rows.iter().filter(|r| broken[**r] == 0.0).map(|r| (n[*r], value[*r]));
        panel = panel.with(Mark::series(i, format!("start {s}"), kept));
        let over = rows.iter().filter(|r| broken[**r] > 0.0).map(|r| (n[*r], value[*r]));
        panel = panel.with(Mark::points(Path::new("a limit is broken", 7, over), Marker::Cross));
    }
    let caption =
        "Best row so far against the evaluations that were spent on it, where it got better (history.csv).";
    Ok(Figure::new("convergence", "Convergence", caption, vec![panel]))
}

fn sensitivity(table: &Frame) -> Drawn {
    let parameters: Vec<String> = (0..table.len()).map(|r| table.word("parameter", r)).collect();
    let mut panels = Vec::new();
    let share = |of: &str| format!("share of the variance of ln {of}");
    let (both, orders) = (["spread of K", "total error"], ["first order", "total"]);
    let sets = [
        (
            "at the optimum",
            "elasticity, % per %".to_owned(),
            both,
            ["K_sd_elasticity", "total_rms_elasticity"],
        ),
        ("spread of K, over the box", share("K_sd"), orders, ["K_sd_first", "K_sd_total"]),
        ("total error, over the box", share("total"), orders, ["total_rms_first", "total_rms_total"]),
    ];
    for (title, label, names, columns) in sets {
        let mut panel = Panel::new(title, Axis::new(&label, ""), Axis::words("", parameters.clone()));
        let there: Vec<_> = names.into_iter().zip(columns).filter(|(_, column)| table.has(column)).collect();
        for (i, (name, column)) in there.iter().enumerate() {
            let points = table.numbers(column)?.iter().enumerate().map(|(r, x)| (*x, r as f64));
            let path = Path::new(*name, if names == both { i } else { i + 2 }, points);
            panel = panel.with(Mark::Bars { path, among: [i, there.len()] });
        }
        panels.push(panel);
    }
    panels.retain(|panel| !panel.marks.is_empty());
    let caption = "How much each parameter moves the result: elasticities ∂ln/∂ln at the optimum, and shares of the variance of the logarithm over the box of the variables (Sobol’ indices; sensitivity.csv).";
    Ok(Figure::new("sensitivity", "Sensitivity", caption, panels))
}

/// The best design as designed, and over the sampled whiskers.
fn robust(source: &Source, sd: &str) -> Option<Figure> {
    let result = &source.run["result"];
    let robust = result["robust"].as_object()?;
    let both = [("K_sd", sd), ("total_rms_mm", "total_rms_mm")];
    let panels = both.into_iter().filter_map(|(key, column)| {
        let over = robust.get(key)?.as_f64()?;
        let at = result["best"][column].as_f64().unwrap_or(f64::NAN);
        let axis = Axis { log: false, ..quantity::axis(column) };
        Some(bars(axis, &[("as designed", at), ("over the samples", over)]))
    });
    let n = robust.get("samples").and_then(serde_json::Value::as_u64).unwrap_or(0);
    let measure = source.in_force("optimise.robust").unwrap_or_default();
    let caption = format!(
        "The best design as designed, and what the search made small over {n} sampled whiskers ({measure}; run.json)."
    );
    Some(Figure::new("robust", "Robust spread", caption, panels.collect()))
}

fn split(source: &Source) -> Option<Figure> {
    let best = &source.run["result"]["best"];
    let parts = [("bias", "error_rms_mm"), ("noise", "noise_rms_mm"), ("total", "total_rms_mm")];
    let values = parts.map(|(name, key)| (name, best[key].as_f64().unwrap_or(f64::NAN)));
    let panel = bars(Axis::new("error of the distance, rms", "mm"), &values);
    let caption = "Bias and noise of the best design; they add in quadrature (run.json).";
    values[1].1.is_finite().then(|| Figure::new("split", "Error of the best design", caption, vec![panel]))
}

/// Bars of named values, the first on top.
fn bars(axis: Axis, values: &[(&str, f64)]) -> Panel {
    let words = values.iter().rev().map(|(name, _)| (*name).to_owned()).collect();
    let path = Path::new("", 0, values.iter().rev().enumerate().map(|(i, (_, x))| (*x, i as f64)));
    Panel::new("", axis, Axis::words("", words)).with(Mark::Bars { path, among: [0, 1] })
}

const LARGEST: [&str; 2] = ["strain_max", "signal_max"];

const BEST: &str = "best within the limits";

pub fn of_tap(source: &Source) -> Result<Content, Error> {
    let table = source.table("tap.csv")?;
    let (drive, sd) = (table.one_of(&DRIVES)?, table.one_of(&SD)?);
    let result = &source.run["result"];
    let at = |of: &str, column: &str| result[of][drive].as_f64().zip(result[of][column].as_f64());
    let column = |name: &str| -> Drawn<Vec<Point>> {
        Ok(table.numbers(drive)?.iter().copied().zip(table.numbers(name)?.iter().copied()).collect())
    };
    let free = |panel: Panel, column: &str| {
        let free = at("unconstrained", column).filter(|p| Some(*p) != at("optimum", column));
        panel.with(Mark::points(Path::new("best whatever the strain", 1, free), Marker::Star))
    };
    let optimum = |panel: Panel, column: &str| {
        free(panel.with(Mark::points(Path::new(BEST, 4, at("optimum", column)), Marker::Ring)), column)
    };
    let mut c = Content { answer: answer::of_tap(result, drive, sd), ..Content::default() };
    // Older results have the other name only.
    let bias = if table.has("error_rms_mm") { "error_rms_mm" } else { RankBy::BIAS };
    let parts = [column(bias)?, column("noise_rms_mm")?, column("total_rms_mm")?];
    let best = at("optimum", "total_rms_mm").map(|at| (BEST, at));
    let errors = free(budget("", drive, parts, best), "total_rms_mm");
    let why = result["why"].as_str().unwrap_or_default();
    let caption = format!("Bias of the estimate and noise of the gauge add in quadrature (tap.csv). {why}");
    c.figure(Figure::new("budget", "Error of the distance", caption, vec![errors]));
    let spread = Panel::new("", quantity::axis(drive), quantity::axis(sd))
        .with(Mark::line(Path::new("SD of K", 0, column(sd)?), 0));
    let caption = "Standard deviation of K over the distances (tap.csv).";
    c.figure(Figure::new("sd", "Spread of K", caption, vec![optimum(spread, sd)]));
    let limit = source.in_force("gauge.strain_limit").and_then(|t| t.parse().ok()).unwrap_or(f64::NAN);
    let most = table.one_of(&LARGEST)?;
    let (what, title) = match most == LARGEST[0] {
        true => ("strain", "Strain of the gauge"),
        false => ("signal", "What the sensor reads"),
    };
    let mut strain = Panel::new("", quantity::axis(drive), quantity::axis(most))
        .with(Mark::line(Path::new(format!("largest {what}"), 0, column(most)?), 0));
    let largest = table.numbers(most)?.iter().copied().fold(0.0, f64::max);
    if limit < 1.5 * largest {
        strain = strain.with(Mark::rule(Along::X, limit, "strain limit", (1, 1)));
    }
    let caption = format!("Largest {what} over the distances (tap.csv).");
    c.figure(Figure::new("strain", title, caption, vec![optimum(strain, most)]));
    if let Some(best) = result["optimum"][drive].as_f64() {
        c.facts.push(("best tap".to_owned(), quantity::said(drive, best)));
    }
    c.fact("total error, mm", &result["optimum"]["total_rms_mm"]);
    c.fact("bias, mm", &result["optimum"][bias]);
    c.fact("noise, mm", &result["optimum"]["noise_rms_mm"]);
    c.fact("spread of K", &result["optimum"][sd]);
    c.fact("limited by", &result["limited_by"]);
    c.first(&table, false);
    Ok(c)
}

/// Bias, noise and total of one whisker as (drive, mm) by ascending drive, and the ringed tap with its name.
pub fn budget(title: &str, drive: &str, parts: [Vec<Point>; 3], best: Option<(&str, Point)>) -> Panel {
    let [bias, noise, total] = parts;
    let y = Axis { label: "error of the distance, rms".to_owned(), ..quantity::axis("total_rms_mm") };
    let mut panel = Panel::new(title, quantity::axis(drive), y)
        .with(Mark::dotted(Path::new("bias", 0, bias), Marker::Circle))
        .with(Mark::dotted(Path::new("noise", 1, noise), Marker::Square))
        .with(Mark::dotted(Path::new("total", 4, total), Marker::Triangle));
    if let Some((name, (x, y))) = best {
        panel = panel
            .with(Mark::rule(Along::Y, x, "", (7, 2)))
            .with(Mark::points(Path::new(name, 4, [(x, y)]), Marker::Ring))
            .with(Mark::Note { x, y, text: said(drive, x) });
    }
    panel
}
