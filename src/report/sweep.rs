//! Figures of a sweep: the paper's figures of its whiskers, and those of a space of designs.

use super::answer::{self, Recommended};
use super::designs::{self, Alike, DRIVES, Limits, SD, WHISKER};
use super::quantity::{self, distinct};
use super::search::{budget, least};
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
        None if tuples.is_none() => {
            source.table("designs.csv")?;
        }
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
        for figure in [
            designs::trade(table, [sd, other], &rows, &fine, None)?,
            designs::parallel(table, &rows, &fine, &[sd, other])?,
            designs::maps(table, &fine, sd)?,
            designs::maps(table, &fine, other)?,
        ] {
            figure.into_iter().for_each(|f| c.figure(f));
        }
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
        let best = least(total(true));
        without += usize::from(best.is_none());
        let parts = ["error_rms_mm", "noise_rms_mm", "total_rms_mm"].map(column);
        let broken = Path::new("a limit is broken", 7, sorted(total(false)));
        budget(&w.name, drive, parts, best.map(|at| ("least total", at)))
            .with(Mark::points(broken, Marker::Cross))
    });
    let panels = panels.collect();
    let none = match without {
        0 => String::new(),
        n => format!(
            "; {n} of {} whiskers shown keep their limits at no tap, and have no ring",
            whiskers.len()
        ),
    };
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
    let read = table.one_of(&["strain", "signal"])?;
    let columns = Taps {
        a: table.numbers("a_mm")?,
        drive: table.numbers(drive)?,
        strain: table.numbers(read)?,
        linear: &linear,
        k: table.numbers(k)?,
        distance: table.numbers("distance_mm")?,
        error: table.numbers("error_mm")?,
        names: ["a_mm", drive, k, read],
    };
    let two = table.has("strain_2");
    let what = match read == "strain" {
        true => format!("Strain of the {}", if two { "first gauge" } else { "gauge" }),
        false => "Moment, or force, on the root".to_owned(),
    };
    let share = if table.has("tilt_deg") { ", θ f cos² β" } else { "" };
    let theory = format!("{what}: exact rod (points) beside linear theory{share} (dashed)");
    let k =
        if two { "θ f(a) cos β̂/√(ε₁² + ε₂²), tan β̂ = ε₂/ε₁," } else { "θ f(a)/|ε|" };
    let located = "Distance estimated from the strain with the mean K of each tap angle, against the true one; dotted: equal";
    type Drawn = fn(&Taps<'_>, &Alike) -> Panel;
    let figures: [(&str, &str, String, Drawn); 5] = [
        (
            "strain_drive",
            "Strain against the tap",
            format!("{theory}, against the tap angle at {CURVES} distances or fewer"),
            |t, w| t.strain(w, 1),
        ),
        (
            "strain_distance",
            "Strain against the distance",
            format!("{theory}, against the contact distance at {CURVES} tap angles or fewer"),
            |t, w| t.strain(w, 0),
        ),
        ("K", "K over distance and tap", format!("K = {k} over contact distance and tap angle"), |t, w| {
            t.map(w)
        }),
        ("distance", "Estimated distance", located.to_owned(), |t, w| t.located(w, false)),
        (
            "distance_error",
            "Error of the estimated distance",
            "Estimated less true distance, against the true one".to_owned(),
            |t, w| t.located(w, true),
        ),
    ];
    for (name, title, caption, drawn) in figures {
        let panels = whiskers.iter().map(|w| drawn(&columns, w)).collect();
        c.figure(Figure::new(name, title, format!("{caption} (tuples.csv){left}."), panels));
    }
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

struct Taps<'a> {
    a: &'a [f64],
    drive: &'a [f64],
    strain: &'a [f64],
    linear: &'a [f64],
    k: &'a [f64],
    distance: &'a [f64],
    error: &'a [f64],
    names: [&'static str; 4],
}

impl Taps<'_> {
    /// At most [`CURVES`] values of `column` in `w`, evenly spread.
    fn some(&self, w: &Alike, column: &[f64]) -> Vec<f64> {
        let all = distinct(w.rows.iter().map(|r| column[*r]));
        let n = all.len().min(CURVES);
        (0..n).map(|i| all[if n < 2 { 0 } else { (i * (all.len() - 1) + (n - 1) / 2) / (n - 1) }]).collect()
    }

    /// Strain over the drive (`along` = 1) or the distance (0), a curve for each value of the other.
    fn strain(&self, w: &Alike, along: usize) -> Panel {
        let (x, other) = if along == 0 { (self.a, self.drive) } else { (self.drive, self.a) };
        let mut panel =
            Panel::new(w.name.clone(), quantity::axis(self.names[along]), quantity::axis(self.names[3]));
        let values = self.some(w, other);
        let names = quantity::told_apart(self.names[1 - along], &values);
        for (i, (value, name)) in values.into_iter().zip(names).enumerate() {
            let of =
                |y: &[f64]| sorted(w.rows.iter().filter(|r| other[**r] == value).map(|r| (x[*r], y[*r])));
            panel = panel
                .with(Mark::line(Path::new("linear theory", 4, of(self.linear)), 1))
                .with(Mark::series(i, name, of(self.strain)));
        }
        panel
    }

    fn map(&self, w: &Alike) -> Panel {
        let of = |column: &[f64]| w.rows.iter().map(|r| column[*r]).collect::<Vec<_>>();
        let (a, drive, k) = (of(self.a), of(self.drive), of(self.k));
        let columns: [(&str, &[f64]); 2] = [("a_mm", &a), (self.names[1], &drive)];
        quantity::every(&w.name, columns, |r| k[r], quantity::axis(self.names[2]))
    }

    fn located(&self, w: &Alike, error: bool) -> Panel {
        let y = if error { "error_mm" } else { "distance_mm" };
        let mut panel = Panel::new(w.name.clone(), quantity::axis("a_mm"), quantity::axis(y));
        let of = if error { self.error } else { self.distance };
        if !w.rows.iter().any(|r| of[*r].is_finite()) {
            return panel;
        }
        let ends = quantity::ends(w.rows.iter().map(|r| self.a[*r])).map(|a| (a, a));
        panel = panel.with(match error {
            true => Mark::zero(),
            false => Mark::line(Path::new("â = a", 4, ends), 2),
        });
        // Draw the smallest drives on top: larger ones spread around them.
        let drives = self.some(w, self.drive);
        let names = quantity::told_apart(self.names[1], &drives);
        for (i, (drive, name)) in drives.into_iter().zip(names).enumerate().rev() {
            let rows = w.rows.iter().filter(|r| self.drive[**r] == drive);
            panel = panel.with(Mark::series(i, name, sorted(rows.map(|r| (self.a[*r], of[*r])))));
        }
        panel
    }
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
