//! Figures of a sweep: the paper's figures of its whiskers, and those of a space of designs.

use super::answer::{self, Recommended};
use super::designs::{self, Alike, DRIVES, Limits, SD, WHISKER};
use super::quantity::{self, distinct};
use super::search::budget;
use super::{Content, Source};
use crate::error::{Error, InputError};
use crate::figure::{self, Figure, Mark, Marker, Panel, Path};
use crate::recommend::recommended;
use crate::sink::Frame;
use crate::status::Status;

const WHISKERS: usize = 4;
const CURVES: usize = 5;

pub fn content(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let limits = Limits::of(source);
    let designs = source.maybe("designs.csv")?;
    let tuples = source.maybe("tuples.csv")?;
    if let Some(tuples) = &tuples {
        c.answer = answer::of_taps(tuples);
        of_taps(&mut c, tuples, limits)?;
    }
    match &designs {
        Some(designs) if !designs.is_empty() => {
            of_designs(&mut c, designs, limits)?;
            c.answer = answer(source, designs)?;
        }
        Some(_) => c.notes.push("designs.csv has no rows".to_owned()),
        None if tuples.is_none() => drop(source.table("designs.csv")?),
        None => {}
    }
    if let Some(tuples) = tuples {
        c.first(&tuples, false);
    }
    c.first_rows(source, &["distances.csv"])?;
    if c.figures.is_empty() {
        c.notes.push("no row of the tables has values to draw: see their status".to_owned());
    }
    Ok(c)
}

/// The recommended row of designs, by the sweep's rule.
fn answer(source: &Source, table: &Frame) -> Result<String, InputError> {
    let (sd, drive) = (table.one_of(&SD)?, table.one_of(&DRIVES)?);
    let total = if table.has("total_rms_mm") { "total_rms_mm" } else { sd };
    // Older versions did not write `ranking`.
    let ranking = &source.run["ranking"];
    let by = ranking["by"].as_str().unwrap_or(total);
    let values = table.numbers(if by == "K_sd" { sd } else { by })?;
    let row = |r: usize| (Status::of_words(&table.word("status", r)), values[r]);
    let rows = || (0..table.len()).map(row);
    let Some((best, standing)) = recommended(rows()) else {
        let why = "in a complete row every distance counts, and this column has a value";
        return Ok(format!("No complete row to rank by {by}: {why}."));
    };
    let count = |key: &str| source.run["counts"][key].as_u64();
    let complete = rows().filter(|(status, value)| status.counts() && value.is_finite()).count() as u64;
    let varying: Vec<&str> = match ranking["varying"].as_array() {
        Some(names) => names.iter().filter_map(|name| name.as_str()).collect(),
        None => designs::varying(table)?.into_iter().filter(|name| *name != drive).collect(),
    };
    Ok(answer::of_best(&Recommended {
        number: &|name| Some(table.number(name, best)).filter(|x| x.is_finite()),
        varying: &varying,
        names: [sd, by, drive],
        complete: count("complete_rows").unwrap_or(complete),
        kept: count("kept_rows"),
        standing,
    }))
}

fn of_designs(c: &mut Content, table: &Frame, limits: Limits) -> Result<(), Error> {
    let (sd, drive) = (table.one_of(&SD)?, table.one_of(&DRIVES)?);
    let by = if table.has("total_rms_mm") { "total_rms_mm" } else { sd };
    let fine = limits.kept(table);
    let (whiskers, of) = designs::whiskers(table, &fine, by, figure::SERIES)?;
    let left = left_out(table, whiskers.len(), of, by);
    let drives = distinct(table.numbers(drive)?.iter().copied());
    if drives.len() > 1 {
        let mut panel = Panel::new("", quantity::axis(drive), quantity::axis(sd));
        for (i, w) in whiskers.iter().enumerate() {
            let points = w.rows.iter().map(|r| (table.number(drive, *r), table.number(sd, *r)));
            let name = if w.name.is_empty() { "the whisker".to_owned() } else { w.name.clone() };
            panel = panel.with(Mark::series(i, name, sorted(points)));
        }
        let caption =
            format!("Standard deviation of K over the distances of each tap angle (designs.csv){left}.");
        c.figure(Figure::new("sd", "Spread of K", caption, vec![panel]));
        if table.has("noise_rms_mm") && table.numbers("noise_rms_mm")?.iter().any(|x| *x > 0.0) {
            let shown = &whiskers[..whiskers.len().min(WHISKERS)];
            c.figure(budgets(table, shown, &fine, drive, &left_out(table, shown.len(), of, by)));
        }
    }
    let (rows, how) = designs::chosen(table, by)?;
    let other = if table.has("total_rms_mm") { "total_rms_mm" } else { "error_rms_mm" };
    if designs::varying(table)?.len() > 1 {
        c.figure(designs::trade(table, [sd, other], &rows, &fine, None)?);
        c.figure(designs::parallel(table, &rows, &fine, &[sd, other])?);
        c.figure(designs::maps(table, &fine, sd)?);
        c.figure(designs::maps(table, &fine, other)?);
    }
    c.table(table, rows, &how, true);
    Ok(())
}

/// Bias, noise and total of each whisker; its best tap within the limits is ringed.
fn budgets(table: &Frame, whiskers: &[Alike], fine: &[bool], drive: &str, left: &str) -> Figure {
    let mut without = 0;
    let panels = whiskers.iter().map(|w| {
        let point = |name: &str, r: usize| (table.number(drive, r), table.number(name, r));
        let column = |name: &str| sorted(w.rows.iter().map(|r| point(name, *r)));
        let total = |keeps: bool| {
            w.rows.iter().filter(move |r| fine[**r] == keeps).map(|r| point("total_rms_mm", *r))
        };
        let best = total(true).filter(|p| p.1.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1));
        without += usize::from(best.is_none());
        let parts = ["error_rms_mm", "noise_rms_mm", "total_rms_mm"].map(column);
        let broken = Path::new("a limit is broken", 7, sorted(total(false)));
        budget(&w.name, drive, parts, best.map(|at| ("least total", at)))
            .with(Mark::points(broken, Marker::Cross))
    });
    let panels = panels.collect();
    let all = whiskers.len();
    let none = format!("; {without} of {all} whiskers shown keep their limits at no tap, and have no ring");
    let none = if without > 0 { &*none } else { "" };
    let caption = format!(
        "Bias of the estimate and noise of the gauge add in quadrature; ringed is the tap with the least total of those that keep every limit{none} (designs.csv){left}."
    );
    Figure::new("budget", "Error of the distance", caption, panels)
}

fn of_taps(c: &mut Content, table: &Frame, limits: Limits) -> Result<(), Error> {
    let (k, drive) = (table.one_of(&["K", "K_mm"])?, table.one_of(&DRIVES)?);
    for name in WHISKER {
        table.numbers(name)?;
    }
    if table.is_empty() {
        c.notes.push("tuples.csv has no rows".to_owned());
        return Ok(());
    }
    let (whiskers, of) = designs::whiskers(table, &limits.kept(table), k, WHISKERS)?;
    let left = left_out(table, whiskers.len(), of, k);
    let linear = linear(table)?;
    let column = |name| table.numbers(name).map(|numbers| (name, numbers));
    let [a, drive] = [column("a_mm")?, column(drive)?];
    let (strain, k) = (column(table.one_of(&["strain", "signal"])?)?, column(k)?);
    let (distance, error) = (column("distance_mm")?, column("error_mm")?);
    let two = table.has("strain_2");
    let what = match strain.0 == "strain" {
        true => format!("Strain of the {}", if two { "first gauge" } else { "gauge" }),
        false => "Moment, or force, on the root".to_owned(),
    };
    let share = if table.has("tilt_deg") { ", θ f cos² β" } else { "" };
    let theory = format!("{what}: exact rod (points) beside linear theory{share} (dashed)");
    let formula =
        if two { "θ f(a) cos β̂/√(ε₁² + ε₂²), tan β̂ = ε₂/ε₁," } else { "θ f(a)/|ε|" };
    let mut draw = |name, title, caption: &str, panel: &dyn Fn(&Alike) -> Panel| {
        let panels = whiskers.iter().map(panel).collect();
        c.figure(Figure::new(name, title, format!("{caption} (tuples.csv){left}."), panels));
    };
    let caption = format!("{theory}, against the tap angle at {CURVES} distances or fewer");
    let over_drive = |w: &Alike| strains(w, [drive, a], strain, &linear);
    draw("strain_drive", "Strain against the tap", &caption, &over_drive);
    let caption = format!("{theory}, against the contact distance at {CURVES} tap angles or fewer");
    let over_distance = |w: &Alike| strains(w, [a, drive], strain, &linear);
    draw("strain_distance", "Strain against the distance", &caption, &over_distance);
    let caption = format!("K = {formula} over contact distance and tap angle");
    draw("K", "K over distance and tap", &caption, &|w| {
        let of = |(_, values): Column<'_>| w.rows.iter().map(|r| values[*r]).collect::<Vec<_>>();
        let [x, y, z] = [a, drive, k].map(of);
        quantity::every(&w.name, [(a.0, &x[..]), (drive.0, &y[..])], |r| z[r], quantity::axis(k.0))
    });
    let caption = "Distance estimated from the strain with the mean K of each tap angle, against the true one; dotted: equal";
    draw("distance", "Estimated distance", caption, &|w| located(w, [a, drive], distance));
    let caption = "Estimated less true distance, against the true one";
    let of_error = |w: &Alike| located(w, [a, drive], error);
    draw("distance_error", "Error of the estimated distance", caption, &of_error);
    Ok(())
}

/// Strain by linear theory, for an upright pole; cos² β of it for a tilt β (model §6.3).
fn linear(table: &Frame) -> Result<Vec<f64>, InputError> {
    let upright = table.numbers(table.one_of(&["strain_linear", "signal_linear"])?)?;
    if !table.has("tilt_deg") {
        return Ok(upright.to_vec());
    }
    let share = |tilt: &f64| tilt.to_radians().cos().powi(2);
    Ok(upright.iter().zip(table.numbers("tilt_deg")?).map(|(x, tilt)| x * share(tilt)).collect())
}

/// Name and values.
type Column<'a> = (&'static str, &'a [f64]);

/// Of at most [`CURVES`] values of `other` in `w`, evenly spread: the value in words, and its rows by ascending `x`.
fn curves(w: &Alike, x: Column<'_>, other: Column<'_>) -> Vec<(String, Vec<usize>)> {
    let all = distinct(w.rows.iter().map(|r| other.1[*r]));
    let n = all.len().min(CURVES);
    let place = |i| if n < 2 { 0 } else { (i * (all.len() - 1) + (n - 1) / 2) / (n - 1) };
    let some: Vec<f64> = (0..n).map(|i| all[place(i)]).collect();
    let rows = |value: &f64| {
        let mut rows: Vec<usize> = w.rows.iter().copied().filter(|r| other.1[*r] == *value).collect();
        rows.sort_by(|p, q| x.1[*p].total_cmp(&x.1[*q]));
        rows
    };
    quantity::told_apart(other.0, &some).into_iter().zip(some.iter().map(rows)).collect()
}

/// Strain over `x`, a curve for each value of the other column.
fn strains(w: &Alike, [x, other]: [Column<'_>; 2], strain: Column<'_>, linear: &[f64]) -> Panel {
    let mut panel = Panel::new(w.name.clone(), quantity::axis(x.0), quantity::axis(strain.0));
    for (i, (name, rows)) in curves(w, x, other).into_iter().enumerate() {
        let of = |y: &[f64]| rows.iter().map(|r| (x.1[*r], y[*r])).collect::<Vec<_>>();
        panel = panel.with(Mark::line(Path::new("linear theory", 4, of(linear)), 1)).with(Mark::series(
            i,
            name,
            of(strain.1),
        ));
    }
    panel
}

/// Estimated distances, or their errors, over the true ones, a curve for each drive.
fn located(w: &Alike, [a, drive]: [Column<'_>; 2], (y, values): Column<'_>) -> Panel {
    let mut panel = Panel::new(w.name.clone(), quantity::axis(a.0), quantity::axis(y));
    if !w.rows.iter().any(|r| values[*r].is_finite()) {
        return panel;
    }
    let ends = quantity::ends(w.rows.iter().map(|r| a.1[*r])).map(|a| (a, a));
    panel = panel.with(match y {
        "error_mm" => Mark::zero(),
        _ => Mark::line(Path::new("â = a", 4, ends), 2),
    });
    // Draw the smallest drives on top: larger ones spread around them.
    for (i, (name, rows)) in curves(w, a, drive).into_iter().enumerate().rev() {
        panel = panel.with(Mark::series(i, name, rows.iter().map(|r| (a.1[*r], values[*r]))));
    }
    panel
}

fn sorted(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut points: Vec<_> = points.collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

fn left_out(table: &Frame, shown: usize, of: usize, by: &str) -> String {
    if shown == of {
        return String::new();
    }
    let what =
        if designs::DIRECTIONS.iter().any(|d| table.has(d)) { "whiskers and directions" } else { "whiskers" };
    format!("; of {of} {what} the {shown} with the least {by} are shown")
}
