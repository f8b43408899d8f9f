//! From rows to points and to the curve through them, and their tables.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use indexmap::IndexMap;
use serde_json::{Value, json};

use super::curve::{Arc, Chosen, Curve, Kind, Nothing, Sample, choose};
use super::point::{Noise, Point, placed};
use super::stroke::{Followed, swept};
use crate::error::{Error, InputError, SolveError};
use crate::locate::{AnsweredRow, Locator, Readings};
use crate::sink::{Field, Frame, heading};
use crate::{measure::Skin, scene::Drive, simulate::object::Object, status::Status};

/// Standard deviation that every point of a curve has at least in all directions, mm: else one whose heading is certain would have none across.
const LEAST: f64 = 1e-3;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceOptions {
    pub noise: Noise,
    /// Contact on the surface of the whisker, or on its centreline; as its model says if not said.
    pub surface: Option<bool>,
    /// Each row is a tap, whatever its stroke.
    pub taps: bool,
    /// Kind of the curve; that which is best if not said.
    pub kind: Option<Kind>,
}

#[derive(Debug, Clone)]
pub struct Trace {
    pub points: Vec<Point>,
    /// Distance to the left of the curve (mm) and over the standard deviation of each; NaN without.
    pub off: Vec<[f64; 2]>,
    pub strokes: Vec<Followed>,
    pub samples: Vec<Sample>,
    pub curve: Result<Chosen, Nothing>,
    pub on_surface: bool,
}

impl Trace {
    pub fn new(
        locator: &Locator,
        readings: &Readings,
        asked: &TraceOptions,
        stop: &AtomicBool,
    ) -> Result<Self, Error> {
        let go_on = || if stop.load(Ordering::Relaxed) { Err(SolveError::Stopped) } else { Ok(()) };
        let places = placed(readings)?;
        let n = places.len();
        Skin::is_known(&locator.rig)?;
        let skin = Skin::new(&locator.rig, asked.surface);
        let with_strokes = !asked.taps && places.iter().any(|(_, stroke)| stroke.is_some());
        if with_strokes && locator.rig.setup.drive == Drive::Displacement {
            let error =
                InputError::new("a stroke turns the whisker; these readings are of an object that is moved");
            let error = error.at(readings.file.clone(), Some(1)).key("stroke");
            return Err(error.allowed("theta_deg; or --taps").into());
        }
        let tap = |i: usize| Point::of_tap(locator, &skin, &places[i].0, &readings.rows[i], &asked.noise);
        let mut points: Vec<Point> = (0..n).map(tap).collect();
        let mut groups: Vec<usize> = (0..n).collect();
        // Strokes and their rows, in the order of the file; readings of the zero belong to none.
        let mut members: IndexMap<u64, Vec<usize>> = IndexMap::new();
        for i in (0..n).filter(|i| with_strokes && !readings.rows[*i].rests) {
            // +0 and −0 are one number.
            places[i].1.iter().for_each(|s| members.entry((s + 0.0).to_bits()).or_default().push(i));
        }
        let mut strokes = Vec::new();
        for (number, rows) in members {
            go_on()?;
            let of: Vec<&AnsweredRow> = rows.iter().map(|&i| &readings.rows[i]).collect();
            let pose = &places[rows[0]].0;
            rows.iter().for_each(|&i| groups[i] = rows[0]);
            let as_taps = Followed::as_taps(f64::from_bits(number));
            let found = swept((locator, &skin), pose, &of, &asked.noise, as_taps);
            let (made, followed) = found.unwrap_or((Vec::new(), as_taps));
            for (&i, point) in rows.iter().zip(made) {
                // An outlier of its stroke keeps the place that it has as a tap.
                points[i] = if point.outlier { Point { outlier: true, ..points[i] } } else { point };
            }
            let there = rows.iter().filter(|&&i| points[i].is_there()).count();
            strokes.push(Followed { points: there, ..followed });
        }
        go_on()?;
        let used: Vec<usize> = (0..n).filter(|&i| points[i].is_there() && !points[i].outlier).collect();
        let sample = |&i: &usize| {
            let Point { at, covariance, share, .. } = points[i];
            Sample { at, covariance: covariance.plus(LEAST * LEAST), share, group: groups[i] }
        };
        let samples: Vec<Sample> = used.iter().map(sample).collect();
        let curve = choose(&samples, asked.kind);
        let mut off = vec![[f64::NAN; 2]; n];
        if let Ok(chosen) = &curve {
            for (i, (distance, over, outlier)) in used.iter().zip(&chosen.off) {
                off[*i] = [*distance, *over];
                points[*i].outlier |= outlier;
            }
        }
        Ok(Self { points, off, strokes, samples, curve, on_surface: skin.surface })
    }
}

/// Files of a contour, run.json apart.
pub const FILES: [&str; 3] = ["points.csv", "curve.csv", "contour.svg"];
/// Rows of curve.csv.
const PLACES: usize = 181;

/// The words of the status of a point, with that of an outlier behind them.
fn words(p: &Point) -> String {
    match p.outlier {
        true if p.status == Status::OK => "outlier".to_owned(),
        true => format!("{}+outlier", p.status),
        false => p.status.to_string(),
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
                    let sigma = arc.covariance[(1, 1)].max(0.0).sqrt().to_degrees();
                    with(&[("sigma_direction_deg", sigma)]);
                }
                Curve::Arc(arc) => {
                    if let (Some([x, y, radius]), Some([sx, sy, sigma])) =
                        (arc.circle(), arc.deviations_of(Arc::circle))
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
        words.split('+').for_each(|word| *status.entry(word.to_owned()).or_default() += 1);
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
    let n = there.len();
    Ok(json!({ "points_rms_mm": points, "places_rms_mm": apart, "curve_rms_mm": curve, "points": n }))
}
