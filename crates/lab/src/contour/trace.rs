//! From rows to points, and to the curve through them.

use std::sync::atomic::{AtomicBool, Ordering};

use indexmap::IndexMap;

use super::curve::{Chosen, Kind, Nothing, Sample, choose};
use super::point::{Noise, Point, placed};
use super::stroke::{Followed, swept};
use crate::error::{Error, InputError, SolveError};
use crate::locate::Locator;
use crate::locate::table::{AnsweredRow, Readings};
use crate::measure::Skin;
use crate::scene::Drive;

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
    /// A point for each row.
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
        let sample = |&i: &usize| Sample {
            at: points[i].at,
            covariance: points[i].covariance.plus(LEAST * LEAST),
            share: points[i].share,
            group: groups[i],
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
