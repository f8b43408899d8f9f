//! Figures of a calibration.

use super::content::points_of;
use super::designs::{DRIVES, SD};
use super::quantity::{self, distinct, grouped};
use super::{Content, Drawn, Point, Source, answer};
use crate::error::{Error, InputError};
use crate::figure::{Axis, Figure, Mark, Marker, Panel, Path, series};
use crate::sink::Frame;

const CURVES: usize = 6;
/// Caption of panels whose axis may be cut.
const CUT: &str = "The axis fits the bulk of the taps; an arrow at the edge stands for a tap beyond it.";

pub fn content(source: &Source) -> Result<Content, Error> {
    if let Some(taps) = source.maybe("channels.csv")? {
        return of_channels(source, &taps);
    }
    let mut c = Content { answer: answer::of_calibration(source), ..Content::default() };
    let rows = source.table("rows.csv")?;
    let cells = source.table("K_table.csv")?;
    let signal = cells.one_of(&["strain", "reading", "moment_Nmm", "force_N"])?;
    let drive = rows.one_of(&DRIVES)?;
    let drives = Drives::of(source, &cells, drive)?;
    c.figure(curves(&rows, &cells, drive, signal, &drives)?);
    c.figure(residuals(&rows, signal)?);
    c.figure(held_out(&rows)?);
    let seen = ["held_out_error_mm", "distances left out", "rows.csv"];
    c.figure(coverage(&rows, &used(&rows)[0], seen)?);
    if let Some(designs) = source.maybe("designs.csv")?
        && let Some(sd) = designs.first(&SD)
        && designs.has(sd)
    {
        let points = designs.numbers(drive)?.iter().copied().zip(designs.numbers(sd)?.iter().copied());
        let line = Path::new("SD of K", 0, points);
        let panel = Panel::new("", quantity::axis(drive), quantity::axis(sd))
            .with(Mark::dotted(line, Marker::Circle));
        let caption = "Standard deviation of K over the distances of each tap (designs.csv).";
        c.figure(Figure::new("sd", "Spread of K", caption, vec![panel]));
    }
    let result = &source.run["result"];
    c.fact("estimator", &result["estimator"]);
    c.fact("noise of one reading", &result["noise"]);
    c.fact("noise from", &result["noise_from"]);
    c.first(&rows, true);
    c.first_rows(source, &["K_table.csv", "designs.csv", "distances.csv"])?;
    Ok(c)
}

/// A sensor of several channels: residuals of each channel, and distances from all together.
fn of_channels(source: &Source, taps: &Frame) -> Result<Content, Error> {
    let mut c = Content { answer: answer::of_channels(source), ..Content::default() };
    let channels = source.run["result"]["channels"].as_array().cloned().unwrap_or_default();
    let of = |word: &str| (word.to_owned(), taps.rows(|r| taps.word("use", r) == word));
    let groups = ["used", "suspect"].map(of);
    let mut panels = Vec::new();
    for channel in &channels {
        let name = channel["name"].as_str().unwrap_or_default();
        let column = match channel["signal"].as_str() {
            Some(signal) if taps.has(signal) => signal,
            _ => name,
        };
        let (signal, expected) = (taps.numbers(name)?, taps.numbers(&format!("{name}_expected"))?);
        let left: Vec<f64> = signal.iter().zip(expected).map(|(y, e)| y - e).collect();
        let y = Axis::new(&format!("{name} − expected"), &quantity::axis(column).unit);
        panels.push(over_distance(taps, (name, y), (&left, &[]), &groups)?);
    }
    let caption = format!("Signal of each channel less what its calibration expects (channels.csv). {CUT}");
    c.figure(Figure::new("residuals", "Residuals of each channel", caption, panels));
    let errors = (taps.numbers("error_mm")?, taps.numbers("sigma_mm")?);
    let panel = over_distance(taps, ("", Axis::new("error â − a", "mm")), errors, &groups)?;
    let caption = format!(
        "Error of the distance that all channels tell together, of calibrated taps, with the standard deviation that is given for it (channels.csv). {CUT}"
    );
    c.figure(Figure::new("errors", "Errors of all channels together", caption, vec![panel]));
    c.figure(coverage(taps, &groups[0].1, ["error_mm", "calibrated distances", "channels.csv"])?);
    for channel in &channels {
        let name = channel["name"].as_str().unwrap_or_default();
        c.fact(&format!("noise of {name}"), &channel["noise"]);
        c.fact(&format!("{name} alone, on distances left out, mm"), &channel["held_out_rms_mm"]);
    }
    c.first(taps, true);
    Ok(c)
}

struct Drives {
    names: Vec<String>,
    /// Means; empty if no drive was recorded: all taps then have the same.
    centres: Vec<f64>,
}

impl Drives {
    fn of(source: &Source, cells: &Frame, drive: &str) -> Result<Self, InputError> {
        let result = &source.run["result"];
        if result["drive_recorded"] == false {
            return Ok(Self { names: vec!["one drive (not recorded)".to_owned()], centres: Vec::new() });
        }
        let groups = &result["grouped"][1];
        let centres = match groups["centres"].as_array() {
            Some(all) => distinct(all.iter().filter_map(|x| x.as_f64())),
            None => distinct(cells.numbers(drive)?.iter().copied()),
        };
        let mut names = quantity::told_apart(drive, &centres);
        if groups["width"].as_f64().is_some_and(|width| width > 0.0) {
            names.iter_mut().for_each(|name| *name = name.replacen(" = ", " ≈ ", 1));
        }
        Ok(Self { names, centres })
    }

    /// Index of the nearest group.
    fn place(&self, x: f64) -> Option<usize> {
        if self.centres.is_empty() {
            return Some(0);
        }
        let off = |i: &usize| (self.centres[*i] - x).abs();
        (0..self.centres.len()).filter(|_| x.is_finite()).min_by(|i, j| off(i).total_cmp(&off(j)))
    }
}

fn curves(rows: &Frame, cells: &Frame, drive: &str, signal: &str, drives: &Drives) -> Drawn {
    let (a, at, mean) = (cells.numbers("a_mm")?, cells.numbers(drive)?, cells.numbers(signal)?);
    let sd = cells.numbers(&format!("{signal}_sd"))?;
    let (ra, rd, expected) = (rows.numbers("a_mm")?, rows.numbers(drive)?, rows.numbers("expected")?);
    let all = drives.names.len();
    let n = all.min(CURVES);
    let some = (0..n).map(|i| if n < 2 { 0 } else { i * (all - 1) / (n - 1) });
    let mut panel = Panel::new("", quantity::axis("a_mm"), quantity::axis(signal));
    for (i, d) in some.enumerate() {
        let there = rows.rows(|r| drives.place(rd[r]) == Some(d) && expected[r].is_finite());
        let mut line: Vec<Point> = there.into_iter().map(|r| (ra[r], expected[r])).collect();
        line.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
        line.dedup_by(|p, q| p.0 == q.0);
        let here = cells.rows(|r| drives.place(at[r]) == Some(d));
        let name = drives.names[d].as_str();
        let (colour, marker) = series(i);
        let points = Path::new(name, colour, here.iter().map(|r| (a[*r], mean[*r])));
        let bars = here.iter().map(|r| sd[*r]).collect();
        panel =
            panel.with(Mark::line(Path::new(name, colour, line), 0)).with(Mark::barred(points, marker, bars));
    }
    let left = if n < all { format!("; {n} of {all} taps are shown") } else { String::new() };
    let caption = format!(
        "Points: mean signal of each distance, with the standard deviation of one tap (K_table.csv). Lines: what the estimator that won expects there, joined from distance to distance (rows.csv){left}."
    );
    Ok(Figure::new("curves", "Data over the fitted curves", caption, vec![panel]))
}

fn used(rows: &Frame) -> [Vec<usize>; 2] {
    let tap = |r: usize| rows.number("a_mm", r).is_finite() && rows.number("distance_mm", r).is_finite();
    let of = |word: &str| rows.rows(|r| rows.word("use", r) == word && (tap(r) || word == "suspect"));
    [of("used"), of("suspect")]
}

/// Values with half bars, over distance, for each group of rows; the axis fits the first. Each point has its line and the reason it is suspect.
fn over_distance(
    table: &Frame,
    (title, y): (&str, Axis),
    (values, error): (&[f64], &[f64]),
    groups: &[(String, Vec<usize>)],
) -> Drawn<Panel> {
    let a = table.numbers("a_mm")?;
    let note = |r: usize| {
        let reason = table.word("reason", r);
        let why = if reason.is_empty() { String::new() } else { format!(": {reason}") };
        format!("line {}{why}", table.word("line", r))
    };
    let mut panel = Panel::new(title, quantity::axis("a_mm"), y).with(Mark::zero());
    for (i, (name, rows)) in groups.iter().enumerate() {
        let (colour, marker) = series(i);
        let path = Path::new(name, colour, rows.iter().map(|r| (a[*r], values[*r])));
        panel = panel.with(points_of(table, (path, marker), rows, error, note));
    }
    Ok(quantity::cut(panel, &groups[0].0))
}

fn residuals(rows: &Frame, signal: &str) -> Drawn {
    let [used, suspect] = used(rows);
    let y = Axis::new(&format!("{signal} − expected"), &quantity::axis(signal).unit);
    let reason = |r| rows.word("reason", r).split([':', ',']).next().unwrap_or_default().trim().to_owned();
    let reasons = grouped(suspect, reason);
    let why = reasons.iter().map(|(w, all)| format!("{} {w}", all.len())).collect::<Vec<_>>().join(", ");
    let why = if why.is_empty() { "no row is suspect".to_owned() } else { format!("suspect: {why}") };
    let suspect = reasons.into_iter().map(|(why, rows)| (format!("suspect: {why}"), rows));
    let groups: Vec<_> = std::iter::once(("used".to_owned(), used)).chain(suspect).collect();
    let panel = over_distance(rows, ("", y), (rows.numbers("residual")?, &[]), &groups)?;
    let caption = format!("Signal less what the estimator expects, of every tap; {why} (rows.csv). {CUT}");
    Ok(Figure::new("residuals", "Residuals by distance", caption, vec![panel]))
}

fn held_out(rows: &Frame) -> Drawn {
    let [used, _] = used(rows);
    let errors = (rows.numbers("held_out_error_mm")?, rows.numbers("sigma_mm")?);
    let groups = [("error ± σ".to_owned(), used)];
    let panel = over_distance(rows, ("", Axis::new("error â − a", "mm")), errors, &groups)?;
    let caption = format!(
        "Error of each tap when its distance is left out of the calibration, with the standard deviation that is given for it (rows.csv). {CUT}"
    );
    Ok(Figure::new("held_out", "Errors on distances left out", caption, vec![panel]))
}

/// Share of taps whose |error|/σ is below x, compared with the normal distribution.
fn coverage(rows: &Frame, used: &[usize], [column, distances, file]: [&str; 3]) -> Drawn<Option<Figure>> {
    let (error, sigma) = (rows.numbers(column)?, rows.numbers("sigma_mm")?);
    let mut ratios: Vec<f64> =
        used.iter().map(|r| error[*r].abs() / sigma[*r]).filter(|x| x.is_finite()).collect();
    if ratios.len() < 5 {
        return Ok(None);
    }
    ratios.sort_by(f64::total_cmp);
    let n = ratios.len() as f64;
    let steps = ratios.iter().enumerate().map(|(i, x)| (*x, (i + 1) as f64 / n)).filter(|p| p.0 <= 4.0);
    let normal = (0..=80).map(|i| f64::from(i) / 20.0).map(|x| (x, normal_within(x)));
    let x = Axis { ends: Some([0.0, 4.0]), ..Axis::new("|error|/σ", "") };
    let y = Axis { ends: Some([0.0, 1.02]), ..Axis::new("share of taps below", "") };
    let panel = Panel::new("", x, y)
        .with(Mark::line(Path::new(format!("errors on {distances}"), 0, steps), 0))
        .with(Mark::line(Path::new("normal distribution", 4, normal), 1));
    let beyond = ratios.iter().filter(|x| **x > 4.0).count();
    let caption = format!(
        "Share of {} taps whose error on {distances} is within so many of its standard deviations; {beyond} lie beyond 4 ({file}).",
        ratios.len()
    );
    Ok(Some(Figure::new("coverage", "Coverage", caption, vec![panel])))
}

/// Share of a normal distribution within `x` standard deviations, by Simpson's rule: error 1e-9 for x ≤ 4.
fn normal_within(x: f64) -> f64 {
    const PARTS: usize = 64;
    let density = |t: f64| (-0.5 * t * t).exp() * (2.0 / std::f64::consts::PI).sqrt();
    let h = x / PARTS as f64;
    let weight = |i: usize| match i {
        0 | PARTS => 1.0,
        i if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=PARTS).map(|i| weight(i) * density(i as f64 * h)).sum::<f64>() * h / 3.0
}
