//! Figures of answered readings, and of a traced object.

use super::content::{SHOWN, points_of};
use super::{Content, Drawn, Point, Source, answer, quantity};
use crate::error::Error;
use crate::figure::{Figure, Mark, Marker, Panel, Path};
use crate::sink::Frame;

/// Most ellipses; of more points, every n-th has one.
const ELLIPSES: usize = 150;
const CORNERS: usize = 24;
const WIDE: f64 = 2.0;

pub fn of_contour(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let (points, curve) = (source.table("points.csv")?, source.table("curve.csv")?);
    let kind = source.run["result"]["curve"]["kind"].as_str().unwrap_or("");
    c.answer = answer::of_contour(source, points.rows(|r| points.number("x_mm", r).is_finite()).len());
    c.figure(figure(&points, &curve, kind, &[])?);
    if let Some(why) = source.run["result"]["curve"]["why"].as_str() {
        c.notes.push(format!("no curve: {why}"));
    }
    c.first(&points, false);
    c.first(&curve, false);
    Ok(c)
}

/// The figure of the tables; `outline` is the known object.
pub fn figure(points: &Frame, curve: &Frame, kind: &str, outline: &[[f64; 2]]) -> Drawn {
    let [x, y] = [points.numbers("x_mm")?, points.numbers("y_mm")?];
    let axes = [points.numbers("sigma_major_mm")?, points.numbers("sigma_minor_mm")?];
    let axis = points.numbers("axis_deg")?;
    let there = points.rows(|r| x[r].is_finite() && y[r].is_finite());
    let mut panel = Panel::new("", quantity::axis("x_mm"), quantity::axis("y_mm"));
    panel.to_scale = true;
    if !outline.is_empty() {
        panel = panel.with(Mark::line(Path::new("the object", 7, outline.iter().map(|p| (p[0], p[1]))), 1));
    }
    let every = there.len().div_ceil(ELLIPSES).max(1);
    for r in there.iter().copied().step_by(every) {
        let edge = ellipse([x[r], y[r]], axes.map(|half| WIDE * half[r]), axis[r], CORNERS);
        panel = panel.with(Mark::Area { path: Path::new("", 0, edge), outlined: false });
    }
    let [cx, cy, direction, sigma] = ["x_mm", "y_mm", "direction_deg", "sigma_mm"].map(|n| curve.numbers(n));
    let (cx, cy, direction, sigma) = (cx?, cy?, direction?, sigma?);
    let side = |k: usize, sign: f64| beside([cx[k], cy[k]], direction[k], sign * WIDE * sigma[k]);
    let n = curve.len();
    let band: Vec<(f64, f64)> = match n {
        1 => ellipse([cx[0], cy[0]], [WIDE * sigma[0]; 2], 0.0, CORNERS).collect(),
        _ => (0..n).map(|k| side(k, 1.0)).chain((0..n).rev().map(|k| side(k, -1.0))).collect(),
    };
    panel = panel.with(Mark::Area { path: Path::new("", 1, band), outlined: n == 1 });
    let of = |name: &str, colour, outlier: bool, marker| {
        let rows = there.iter().filter(|r| points.word("status", **r).contains("outlier") == outlier);
        Mark::points(Path::new(name, colour, rows.map(|r| (x[*r], y[*r]))), marker)
    };
    panel = panel
        .with(of("points", 0, false, Marker::Circle))
        .with(of("outliers", 5, true, Marker::Cross))
        .with(match n {
            1 => Mark::points(Path::new("one point", 1, [(cx[0], cy[0])]), Marker::Star),
            _ => Mark::line(Path::new(kind, 1, (0..n).map(|k| (cx[k], cy[k]))), 0),
        });
    let mut bases: Vec<(f64, f64)> = Vec::new();
    for r in &there {
        let base = (points.number("base_x_mm", *r), points.number("base_y_mm", *r));
        if base.0.is_finite() && !bases.contains(&base) {
            bases.push(base);
        }
    }
    let mut around = panel.clone().with(Mark::points(Path::new("motor's axis", 4, bases), Marker::Plus));
    around.title = "from where".into();
    panel.title = "closer".into();
    let caption = format!(
        "{} points where the whisker touched, with ellipses of two standard deviations (points.csv){}; the curve and its band of two standard \
         deviations (curve.csv){}.",
        there.len(),
        if every > 1 { format!(", of one in {every}") } else { String::new() },
        if outline.is_empty() { "" } else { "; dashed, the object as it was simulated" }
    );
    Ok(Figure::new("contour", "The object", caption, vec![around, panel]))
}

/// The edge of an ellipse about `centre` with these half axes, the first at `degrees` from x, in `corners` pieces.
pub fn ellipse(
    [x, y]: [f64; 2],
    axes: [f64; 2],
    degrees: f64,
    corners: usize,
) -> impl Iterator<Item = Point> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    (0..=corners).map(move |k| {
        let (v, u) = (std::f64::consts::TAU * k as f64 / corners as f64).sin_cos();
        let (u, v) = (axes[0] * u, axes[1] * v);
        (x + cos * u - sin * v, y + sin * u + cos * v)
    })
}

/// The place `by` to the left of this one, looking along `degrees` from x.
pub fn beside([x, y]: [f64; 2], degrees: f64, by: f64) -> (f64, f64) {
    let (sin, cos) = degrees.to_radians().sin_cos();
    (x - by * sin, y + by * cos)
}

const DRAWN: usize = 4000;

pub fn of_readings(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let table = source.table("located.csv")?;
    let zeros = source.run["counts"]["zero_readings"].as_u64().map_or(0, |n| n as usize);
    c.answer = answer::of_readings(&table, zeros)?;
    let [line, distance, sigma] = ["line", "distance_mm", "sigma_mm"].map(|n| table.numbers(n));
    let (line, distance, sigma) = (line?, distance?, sigma?);
    let answered = table.rows(|r| distance[r].is_finite());
    let every = answered.len().div_ceil(DRAWN).max(1);
    let drawn: Vec<usize> = answered.iter().copied().step_by(every).collect();
    let of = |name: &str, colour, fine: bool, marker| {
        let rows: Vec<usize> =
            drawn.iter().copied().filter(|r| (table.word("status", *r) == "ok") == fine).collect();
        let path = Path::new(name, colour, rows.iter().map(|r| (line[*r], distance[*r])));
        points_of(&table, (path, marker), &rows, sigma, |r| table.word("status", r))
    };
    let panel = Panel::new("", quantity::axis("line"), quantity::axis("distance_mm"))
        .with(of("distance ± σ", 0, true, Marker::Circle))
        .with(of("with another word than ok", 1, false, Marker::Cross));
    let left = if every > 1 { format!("; one in {every} is shown") } else { String::new() };
    let (some, all) = (answered.len(), table.len().saturating_sub(zeros));
    let caption = format!(
        "Distance of each reading, with its standard deviation; {some} of {all} readings have one (located.csv){left}."
    );
    c.figure(Figure::new("located", "Distances", caption, vec![panel]));
    if answered.is_empty() {
        c.notes.push("no reading has a distance: see their status".to_owned());
    }
    c.first(&table, table.len() <= SHOWN);
    Ok(c)
}
