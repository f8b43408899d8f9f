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
            let judged: Vec<Value> = chosen
                .judged
                .iter()
                .map(|j| {
                    json!({
                        "kind": j.kind.word(), "loss": j.loss, "left_out_rms_mm": j.left_out_rms, "outliers": j.outliers,
                        "loss_more_than_best": j.more[0], "loss_more_se": j.more[1],
                    })
                })
                .collect();
            let mut v = json!({ "kind": chosen.kind.word(), "scale": chosen.scale, "judged": judged });
            if let Curve::Point(spot) = &chosen.curve {
                let [xx, xy, yy] = spot.covariance.0;
                v["x_mm"] = spot.at[0].into();
                v["sigma_x_mm"] = xx.sqrt().into();
                v["y_mm"] = spot.at[1].into();
                v["sigma_y_mm"] = yy.sqrt().into();
                v["corr"] = (xy / (xx * yy).sqrt()).into();
            }
            if let Curve::Arc(arc) = &chosen.curve {
                if let (Some((centre, radius)), Some((of_centre, of_radius))) =
                    (arc.circle(), arc.circle_deviations())
                {
                    v["x_mm"] = centre[0].into();
                    v["sigma_x_mm"] = of_centre[0].into();
                    v["y_mm"] = centre[1].into();
                    v["sigma_y_mm"] = of_centre[1].into();
                    v["radius_mm"] = radius.into();
                    v["sigma_radius_mm"] = of_radius.into();
                } else if chosen.kind == Kind::Line {
                    let (at, direction) = arc.at(0.0);
                    v["x_mm"] = at[0].into();
                    v["y_mm"] = at[1].into();
                    v["direction_deg"] = direction.to_degrees().into();
                    v["sigma_direction_deg"] = arc.deviations()[1].to_degrees().into();
                }
            }
            v
        }
    };
    let strokes: Vec<Value> = trace
        .strokes
        .iter()
        .map(|s| {
            json!({
                "stroke": s.number, "points": s.points, "object": s.sharp.map(|sharp| if sharp { "sharp" } else { "smooth" }), "touched_before_deg": s.touch[0],
                "sigma_touched_before_deg": s.touch[1], "chi2": s.chi2,
            })
        })
        .collect();
    json!({ "curve": curve, "strokes": strokes, "contact_on_surface": trace.on_surface })
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
