//! An object that is known, beside what was traced of it.

use serde_json::{Value, json};

use super::trace::Trace;
use crate::error::InputError;
use crate::locate::table::Readings;

/// Steps along the outline of a known object; along a traced curve half as many.
const OUTLINE: usize = 400;

/// The edge of a known object. Lengths in mm.
pub trait Edge {
    /// How far a place is from it.
    fn off(&self, at: [f64; 2]) -> f64;

    /// Places along it in `steps` even steps, from its beginning to its end.
    fn along(&self, steps: usize) -> Vec<[f64; 2]>;
}

/// What is drawn of it.
pub fn outline(edge: &dyn Edge) -> Vec<[f64; 2]> {
    edge.along(OUTLINE)
}

/// Distances of points from the object; where the data say what was touched (`true_x_mm`, `true_y_mm` by the readings of a stroke,
/// `touch_x_mm`, `touch_y_mm` first), from these places.
///
/// # Errors
/// A word in the place of such a number.
pub fn compared(trace: &Trace, readings: &Readings, edge: &dyn Edge) -> Result<Value, InputError> {
    let there: Vec<usize> =
        (0..trace.points.len()).filter(|&i| trace.points[i].is_there() && !trace.outliers[i]).collect();
    let rms = |all: Vec<f64>| {
        let known: Vec<f64> = all.into_iter().filter(|x| x.is_finite()).collect();
        (known.iter().map(|x| x * x).sum::<f64>() / known.len() as f64).sqrt()
    };
    let points = rms(there.iter().map(|&i| edge.off(trace.points[i].at)).collect());
    let places = |name: &str| -> Result<Option<[Vec<f64>; 2]>, InputError> {
        let x = readings.numbers(&format!("{name}_x_mm"))?;
        Ok(x.zip(readings.numbers(&format!("{name}_y_mm"))?).map(|(x, y)| [x, y]))
    };
    let (now, first) = (places("true")?, places("touch")?);
    let apart = now.zip(first).map(|(now, first)| {
        let one = |&i: &usize| {
            let [x, y] = if trace.swept[i] { &now } else { &first };
            let at = trace.points[i].at;
            (at[0] - x[i]).hypot(at[1] - y[i])
        };
        rms(there.iter().map(one).collect())
    });
    let curve = trace.curve.as_ref().ok().map(|chosen| {
        let traced = chosen.curve.traced(&trace.samples, OUTLINE / 2);
        rms(traced.iter().map(|(at, ..)| edge.off(*at)).collect())
    });
    Ok(
        json!({ "points_rms_mm": points, "places_rms_mm": apart, "curve_rms_mm": curve, "points": there.len() }),
    )
}
