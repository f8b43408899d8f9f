//! Axis ends that a few outliers do not stretch.

use super::quantity::ends;
use crate::digits::short;
use crate::figure::{Mark, Panel};

/// Points within this many median deviations of the median always fit: 4.7 σ of a normal distribution.
const WIDE: f64 = 7.0;
/// At most this share of the samples at either end is cut.
const SHARE: f64 = 0.1;
/// An axis is cut only if it becomes shorter by this factor.
const WORTH: f64 = 2.0;
/// Free space at either end for arrows, as a share of the bulk.
const ROOM: f64 = 0.08;

/// Range of `samples` without outliers; `None` if it is a single value.
fn bulk(samples: &[f64]) -> Option<[f64; 2]> {
    let mut all: Vec<f64> = samples.iter().copied().filter(|x| x.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    let last = all.len().checked_sub(1)?;
    let at = |share: f64| all[(share * last as f64).round() as usize];
    let middle = at(0.5);
    let mut off: Vec<f64> = all.iter().map(|x| (x - middle).abs()).collect();
    off.sort_by(f64::total_cmp);
    let wide = WIDE * off[off.len() / 2];
    let (low, high) = ((middle - wide).min(at(SHARE)), (middle + wide).max(at(1.0 - SHARE)));
    let [least, most] = ends(all.into_iter().filter(|x| (low..=high).contains(x)));
    (least < most).then_some([least, most])
}

/// Fits the y axis to the points called `name` and their bars. Other points are drawn at the edge, and the key counts them.
pub fn cut(mut panel: Panel, name: &str) -> Panel {
    let points = || {
        panel.marks.iter().filter_map(|m| match m {
            Mark::Points { path, error, .. } => Some((path, error)),
            _ => None,
        })
    };
    let mut errors: Vec<f64> =
        points().flat_map(|(_, error)| error).copied().filter(|e| e.is_finite()).collect();
    errors.sort_by(f64::total_cmp);
    // Bars longer than the median may be cut at the edge.
    let usual = errors.get(errors.len() / 2).copied().unwrap_or(0.0);
    let samples: Vec<f64> =
        points().filter(|(path, _)| path.name == name).flat_map(|(path, _)| &path.y).copied().collect();
    let Some([low, high]) = bulk(&samples).map(|[low, high]| [low - usual, high + usual]) else {
        return panel;
    };
    let [least, most] = ends(panel.marks.iter().flat_map(Mark::reach).map(|p| p.1));
    if most - least <= WORTH * (high - low) {
        return panel;
    }
    let room = ROOM * (high - low);
    let axis = [low - room, high + room];
    let out = |y: &f64| *y < axis[0] || *y > axis[1];
    let taps: Vec<f64> =
        points().flat_map(|(path, _)| &path.y).copied().filter(|y| y.is_finite() && out(y)).collect();
    let ends_of = |(y, e): (&f64, &f64)| [y - e, y + e].iter().any(|end| end.is_finite() && out(end));
    let bars =
        points().flat_map(|(path, error)| path.y.iter().zip(error)).filter(|bar| ends_of(*bar)).count();
    let farthest = taps.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
    let unit = if panel.y.unit.is_empty() { String::new() } else { format!(" {}", panel.y.unit) };
    let mut words = Vec::new();
    if let Some(far) = farthest {
        let sign = if far < 0.0 { "−" } else { "" };
        words.push(match taps.len() {
            1 => format!("1 tap, at {sign}{}{unit}", short(far.abs())),
            n => format!("{n} taps, the farthest at {sign}{}{unit}", short(far.abs())),
        });
    }
    if bars > 0 {
        words.push(format!("the bars of {bars}"));
    }
    panel.beyond = format!("beyond the axis: {}", words.join(", "));
    panel.y.ends = Some(axis);
    panel
}
