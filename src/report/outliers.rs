//! Ends of an axis that a few points far away do not flatten.

use super::quantity::short;
use crate::figure::{Mark, Panel};

/// Median deviations about the median that always have room: 4.7 σ of a normal distribution.
const WIDE: f64 = 7.0;
/// Share of the samples at either end that may have none.
const SHARE: f64 = 0.1;
/// An axis is cut where it gets shorter by this factor.
const WORTH: f64 = 2.0;

/// Ends about the bulk of `samples`; none where all of them have room.
fn ends(samples: &[f64]) -> Option<[f64; 2]> {
    let mut all: Vec<f64> = samples.iter().copied().filter(|x| x.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    let (least, most) = (*all.first()?, *all.last()?);
    let at = |share: f64| all[(share * (all.len() - 1) as f64).round() as usize];
    let middle = at(0.5);
    let mut off: Vec<f64> = all.iter().map(|x| (x - middle).abs()).collect();
    off.sort_by(f64::total_cmp);
    let wide = WIDE * off[off.len() / 2];
    let (low, high) = ((middle - wide).min(at(SHARE)), (middle + wide).max(at(1.0 - SHARE)));
    let within = all.iter().copied().filter(|x| (low..=high).contains(x));
    let [low, high] = within.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
    let room = 0.08 * (high - low);
    (high > low && most - least > WORTH * (high - low)).then(|| [low - room, high + room])
}

/// `panel` with an axis up that fits the bulk of its points named `bulk` and of their bars. What lies beyond is drawn at the edge, and
/// the key says how many taps that are.
pub fn cut(mut panel: Panel, bulk: &str) -> Panel {
    let points = || {
        panel.marks.iter().filter_map(|m| match m {
            Mark::Points { path, error, .. } => Some((path, error)),
            _ => None,
        })
    };
    let samples: Vec<f64> = points()
        .filter(|(path, _)| path.name == bulk)
        .flat_map(|(path, error)| {
            let bar = |i: usize| error.get(i).copied().filter(|e| e.is_finite()).unwrap_or(0.0);
            path.y.iter().enumerate().flat_map(move |(i, y)| [*y, y - bar(i), y + bar(i)])
        })
        .collect();
    let Some(reach) = ends(&samples).or_else(|| suspects(&samples, points().flat_map(|(path, _)| &path.y)))
    else {
        return panel;
    };
    let out = |y: &f64| *y < reach[0] || *y > reach[1];
    let taps: Vec<f64> =
        points().flat_map(|(path, _)| &path.y).copied().filter(|y| y.is_finite() && out(y)).collect();
    let ends_of_bars =
        points().flat_map(|(path, error)| path.y.iter().zip(error).flat_map(|(y, e)| [y - e, y + e]));
    let bars = ends_of_bars.filter(|y| y.is_finite() && out(y)).count();
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
        words.push(format!("{bars} ends of bars"));
    }
    panel.beyond = format!("beyond the axis: {}", words.join(", "));
    panel.y.ends = Some(reach);
    panel
}

/// Ends that hold all of `bulk`, where other points would make the axis much longer.
fn suspects<'a>(bulk: &[f64], all: impl Iterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let reach = |[a, b]: [f64; 2], x: f64| if x.is_finite() { [a.min(x), b.max(x)] } else { [a, b] };
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = bulk.iter().copied().fold(none, reach);
    let [least, most] = all.copied().fold([low, high], reach);
    let room = 0.08 * (high - low);
    (high > low && most - least > WORTH * (high - low)).then(|| [low - room, high + room])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_far_from_the_bulk_is_cut() {
        let bulk: Vec<f64> = (0..50).map(|i| (f64::from(i) * 0.7).sin()).collect();
        assert_eq!(ends(&bulk), None);
        for outliers in [1, 3, 5] {
            let mut all = bulk.clone();
            all.extend((0..outliers).map(|i| 80.0 + f64::from(i)));
            let [low, high] = ends(&all).expect("cut");
            assert!(
                bulk.iter().all(|x| (low..=high).contains(x)) && high < 1.5 && low > -1.5,
                "{low} {high}"
            );
        }
        // Values that are spread evenly over decades are no outliers, nor is one value alone.
        assert_eq!(ends(&[0.5; 20]), None);
        assert_eq!(ends(&[]), None);
        let even: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(ends(&even), None);
    }
}
