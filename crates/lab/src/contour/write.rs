//! Tables and figures in numbers of a traced object.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::curve::{Curve, Kind};
use super::trace::Trace;
use crate::error::Error;
use crate::locate::table::Readings;
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::values::Field;
use crate::status::Status;

/// Files of a contour, run.json apart.
pub const FILES: [&str; 3] = ["points.csv", "curve.csv", "contour.svg"];
/// Rows of curve.csv.
const PLACES: usize = 181;
/// The word of a point that is off.
pub const OUTLIER: &str = "outlier";

/// The words of a status, with that of an outlier behind them.
pub fn words(status: Status, outlier: bool) -> String {
    match (status == Status::OK, outlier) {
        (true, true) => OUTLIER.to_owned(),
        (false, true) => format!("{status}+{OUTLIER}"),
        (_, false) => status.to_string(),
    }
}

/// points.csv.
pub fn points(trace: &Trace, readings: &Readings) -> Result<Frame, Error> {
    let mut table = readings.empty.clone();
    for (i, row) in readings.rows.iter().enumerate() {
        let p = &trace.points[i];
        let z = if p.is_there() { trace.heights[i] } else { f64::NAN };
        let ([major, minor], axis) = p.covariance.ellipse();
        let ([a, sigma], [off, off_sigma]) = (p.distance, trace.off[i]);
        let numbers = [a, sigma, p.at[0], p.at[1], z, major, minor, axis, off, off_sigma].map(Field::from);
        let words = words(p.status, trace.outliers[i]).into();
        table.row(row.kept.iter().cloned().chain(numbers).chain([words]))?;
    }
    Ok(table)
}

/// curve.csv; without rows where there is no curve.
pub fn curve(trace: &Trace) -> Result<Frame, Error> {
    let mut table = heading("curve").frame(&[]);
    if let Ok(chosen) = &trace.curve {
        let (mut s, mut last): (f64, Option<[f64; 2]>) = (0.0, None);
        for (at, direction, sigma) in chosen.curve.traced(&trace.samples, PLACES) {
            s += last.map_or(0.0, |p| (at[0] - p[0]).hypot(at[1] - p[1]));
            last = Some(at);
            table.row([s, at[0], at[1], direction.to_degrees(), sigma].map(Field::from))?;
        }
    }
    Ok(table)
}

/// What was found, for run.json and `--json`.
pub fn described(trace: &Trace) -> Value {
    let curve = match &trace.curve {
        Err(why) => json!({ "kind": Value::Null, "why": why.to_string() }),
        Ok(chosen) => {
            let mut v = json!({ "kind": chosen.kind, "scale": chosen.scale, "judged": chosen.judged });
            let mut with =
                |numbers: &[(&str, f64)]| numbers.iter().for_each(|(key, x)| v[*key] = (*x).into());
            match &chosen.curve {
                Curve::Point(spot) => {
                    let ([x, y], [xx, xy, yy]) = (spot.at, spot.covariance.0);
                    with(&[("x_mm", x), ("sigma_x_mm", xx.sqrt()), ("y_mm", y), ("sigma_y_mm", yy.sqrt())]);
                    with(&[("corr", xy / (xx * yy).sqrt())]);
                }
                Curve::Arc(arc) if chosen.kind == Kind::Line => {
                    let ([x, y], direction) = arc.at(0.0);
                    with(&[("x_mm", x), ("y_mm", y), ("direction_deg", direction.to_degrees())]);
                    with(&[("sigma_direction_deg", arc.deviations()[1].to_degrees())]);
                }
                Curve::Arc(arc) => {
                    if let (Some(([x, y], radius)), Some(([sx, sy], sigma))) =
                        (arc.circle(), arc.circle_deviations())
                    {
                        with(&[("x_mm", x), ("sigma_x_mm", sx), ("y_mm", y), ("sigma_y_mm", sy)]);
                        with(&[("radius_mm", radius), ("sigma_radius_mm", sigma)]);
                    }
                }
                Curve::Smooth(_) => {}
            }
            v
        }
    };
    json!({ "curve": curve, "strokes": trace.strokes, "contact_on_surface": trace.on_surface })
}

/// Rows, points and words.
pub fn counts(trace: &Trace, readings: &Readings) -> Value {
    let (mut status, mut combinations) = (BTreeMap::<String, u64>::new(), BTreeMap::<String, u64>::new());
    for (p, outlier) in trace.points.iter().zip(&trace.outliers) {
        let words = words(p.status, *outlier);
        for word in words.split('+') {
            *status.entry(word.to_owned()).or_default() += 1;
        }
        *combinations.entry(words).or_default() += 1;
    }
    json!({
        "rows": readings.rows.len(), "points": trace.points.iter().filter(|p| p.is_there()).count(),
        "zero_readings": readings.rows.iter().filter(|r| r.rests).count(),
        "outliers": trace.outliers.iter().filter(|o| **o).count(), "strokes": trace.strokes.len(), "status": status,
        "combinations": combinations,
    })
}
