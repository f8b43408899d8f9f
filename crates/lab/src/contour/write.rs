//! Tables and figures in numbers of a traced object.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::curve::{Curve, Kind};
use super::point::Point;
use super::trace::Trace;
use crate::error::{Error, InputError};
use crate::locate::table::Readings;
use crate::simulate::object::Object;
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::values::Field;
use crate::status::Status;

/// Files of a contour, run.json apart.
pub const FILES: [&str; 3] = ["points.csv", "curve.csv", "contour.svg"];
/// Rows of curve.csv.
const PLACES: usize = 181;

/// The words of the status of a point, with that of an outlier behind them.
fn words(p: &Point) -> String {
    let status = p.status;
    match (status == Status::OK, p.outlier) {
        (true, true) => "outlier".to_owned(),
        (false, true) => format!("{status}+outlier"),
        (_, false) => status.to_string(),
    }
}

pub fn points(trace: &Trace, readings: &Readings) -> Result<Frame, Error> {
    let mut table = readings.empty.clone();
    for (i, row) in readings.rows.iter().enumerate() {
        let p = &trace.points[i];
        let [x, y, z] = p.coordinates();
        let ([major, minor], axis) = p.covariance.ellipse();
        let ([a, sigma], [off, off_sigma]) = (p.distance, trace.off[i]);
        let numbers = [a, sigma, x, y, z, major, minor, axis, off, off_sigma].map(Field::from);
        table.row(row.kept.iter().cloned().chain(numbers).chain([words(p).into()]))?;
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

pub fn counts(trace: &Trace, readings: &Readings) -> Value {
    let (mut status, mut combinations) = (BTreeMap::<String, u64>::new(), BTreeMap::<String, u64>::new());
    for words in trace.points.iter().map(words) {
        for word in words.split('+') {
            *status.entry(word.to_owned()).or_default() += 1;
        }
        *combinations.entry(words).or_default() += 1;
    }
    json!({
        "rows": readings.rows.len(), "points": trace.points.iter().filter(|p| p.is_there()).count(),
        "zero_readings": readings.rows.iter().filter(|r| r.rests).count(),
        "outliers": trace.points.iter().filter(|p| p.outlier).count(), "strokes": trace.strokes.len(), "status": status,
        "combinations": combinations,
    })
}

/// Steps along the outline of a known object; along a traced curve half as many.
pub const OUTLINE: usize = 400;

/// Distances from the object, and from the places that were touched where the data have them (`true_…` in strokes, else `touch_…`).
pub fn compared(trace: &Trace, readings: &Readings, object: &Object) -> Result<Value, InputError> {
    let there: Vec<usize> =
        (0..trace.points.len()).filter(|&i| trace.points[i].is_there() && !trace.points[i].outlier).collect();
    let rms = |all: Vec<f64>| {
        let known: Vec<f64> = all.into_iter().filter(|x| x.is_finite()).collect();
        (known.iter().map(|x| x * x).sum::<f64>() / known.len() as f64).sqrt()
    };
    let points = rms(there.iter().map(|&i| object.distance(trace.points[i].at)).collect());
    let places = |name: &str| -> Result<Option<[Vec<f64>; 2]>, InputError> {
        let x = readings.numbers(&format!("{name}_x_mm"))?;
        Ok(x.zip(readings.numbers(&format!("{name}_y_mm"))?).map(|(x, y)| [x, y]))
    };
    let (now, first) = (places("true")?, places("touch")?);
    let apart = now.zip(first).map(|(now, first)| {
        let one = |&i: &usize| {
            let Point { at, swept, .. } = trace.points[i];
            let [x, y] = if swept { &now } else { &first };
            (at[0] - x[i]).hypot(at[1] - y[i])
        };
        rms(there.iter().map(one).collect())
    });
    let curve = trace.curve.as_ref().ok().map(|chosen| {
        let traced = chosen.curve.traced(&trace.samples, OUTLINE / 2);
        rms(traced.iter().map(|(at, ..)| object.distance(*at)).collect())
    });
    Ok(
        json!({ "points_rms_mm": points, "places_rms_mm": apart, "curve_rms_mm": curve, "points": there.len() }),
    )
}
