//! Figures of the best tap of one whisker.

use super::content::Content;
use super::designs::{DRIVES, SD};
use super::quantity::said;
use super::source::Source;
use super::{answer, quantity};
use crate::error::{Error, InputError};
use crate::figure::{Along, Figure, Mark, Marker, Panel, Path};
use crate::scene::RankBy;

const LARGEST: [&str; 2] = ["strain_max", "signal_max"];

const BEST: &str = "best within the limits";

pub fn content(source: &Source) -> Result<Content, Error> {
    let table = source.table("tap.csv")?;
    let (drive, sd) = (table.one_of(&DRIVES)?, table.one_of(&SD)?);
    let result = &source.run["result"];
    let at =
        |which: &str, column: &str| Some((result[which][drive].as_f64()?, result[which][column].as_f64()?));
    let column = |name: &str| -> Result<Vec<(f64, f64)>, InputError> {
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
        strain = strain.with(Mark::Rule {
            along: Along::X,
            at: limit,
            name: "strain limit".into(),
            colour: 1,
            dash: 1,
        });
    }
    let caption = format!("Largest {what} over the distances (tap.csv).");
    c.figure(Figure::new("strain", title, caption, vec![optimum(strain, most)]));
    if let Some(best) = result["optimum"][drive].as_f64() {
        c.facts.push(("best tap".to_owned(), quantity::said(drive, best)));
    }
    for (name, key) in [
        ("total error, mm", "total_rms_mm"),
        ("bias, mm", bias),
        ("noise, mm", "noise_rms_mm"),
        ("spread of K", sd),
    ] {
        c.fact(name, &result["optimum"][key]);
    }
    c.fact("limited by", &result["limited_by"]);
    c.first(&table, false);
    Ok(c)
}

/// Bias, noise and total of one whisker as (drive, mm) by ascending drive, and the ringed tap with its name.
pub fn budget(
    title: &str,
    drive: &str,
    [bias, noise, total]: [Vec<(f64, f64)>; 3],
    best: Option<(&str, (f64, f64))>,
) -> Panel {
    let mut y = quantity::axis("total_rms_mm");
    y.label = "error of the distance, rms".to_owned();
    let mut panel = Panel::new(title, quantity::axis(drive), y)
        .with(Mark::dotted(Path::new("bias", 0, bias), Marker::Circle))
        .with(Mark::dotted(Path::new("noise", 1, noise), Marker::Square))
        .with(Mark::dotted(Path::new("total", 4, total), Marker::Triangle));
    if let Some((name, (x, y))) = best {
        panel = panel
            .with(Mark::Rule { along: Along::Y, at: x, name: String::new(), colour: 7, dash: 2 })
            .with(Mark::points(Path::new(name, 4, [(x, y)]), Marker::Ring))
            .with(Mark::Note { x, y, text: said(drive, x) });
    }
    panel
}

pub fn least(points: impl Iterator<Item = (f64, f64)>) -> Option<(f64, f64)> {
    points.filter(|p| p.1.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1))
}
