//! The figures of a benchmark.

use super::Measured;
use super::figure::{COLOURS, Marker, Panel, Series, Sheet, render};
use super::place::Place;
use super::scaling::Shape;
use super::work::{Point, Quantiles, Solved};
use crate::error::Error;
use crate::scene::{BackendChoice, Precision};

const TIME: &str = "time per tap (ns)";
const P99: &str = "strain error, 99 % of taps below";
const WORST: &str = "strain error, worst tap";

/// Bytes of every figure, by file name.
///
/// # Errors
/// A picture that cannot be made.
pub fn all(m: &Measured, places: &[Place]) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let sheets = [
        ("work_precision", work(m, places)),
        ("configurations", configurations(m, places)),
        ("scaling", scaling(m, places)),
        ("threads", threads(m, places)),
        ("roofline", roofline(m, places)),
    ];
    let mut files = Vec::new();
    for (name, sheet) in sheets {
        if let Some((svg, png)) = render(&sheet)? {
            files.push((format!("{name}.svg"), svg.into_bytes()));
            files.push((format!("{name}.png"), png));
        }
    }
    Ok(files)
}

fn colour(place: usize) -> &'static str {
    COLOURS[place % COLOURS.len()]
}

fn marker(p: &Place) -> Marker {
    match (p.backend, p.precision) {
        (BackendChoice::Reference, _) => Marker::Diamond,
        (_, Precision::F32) => Marker::Circle,
        (_, Precision::F64) => Marker::Square,
    }
}

/// Points of one place in one configuration that `keep` takes, as (time, error).
fn pick(
    m: &Measured,
    configuration: &str,
    place: usize,
    error: fn(&Quantiles) -> f64,
    keep: impl Fn(&Point) -> bool,
) -> Vec<(f64, f64)> {
    let ours = |p: &&Point| p.configuration == configuration && p.place == place && keep(p);
    m.points.iter().filter(ours).filter_map(|p| Some((p.whole.best, error(p.errors.as_ref()?)))).collect()
}

fn ladder(p: &Point) -> bool {
    matches!(p.solved, Solved::Ladder | Solved::Reference)
}

/// The simplest configuration: every kernel, p99 and worst.
fn work(m: &Measured, places: &[Place]) -> Sheet {
    let Some(first) = m.points.first().map(|p| p.configuration) else { return empty() };
    let panel = |title: &str, y, error: fn(&Quantiles) -> f64, named: bool| {
        let mut series = Vec::new();
        for (i, p) in places.iter().enumerate() {
            let name = |what: &str| named.then(|| format!("{}{what}", p.name));
            let of = |keep: fn(&Point) -> bool| pick(m, first, i, error, keep);
            let linear = of(|p| p.solved == Solved::Linear);
            if !linear.is_empty() {
                series.push(Series {
                    name: name(", linear theory"),
                    colour: colour(i),
                    marker: Marker::Triangle,
                    line: false,
                    dashed: false,
                    points: linear,
                });
            }
            series.push(Series {
                name: name(if p.is_reference() { "" } else { ", over tolerances" }),
                colour: colour(i),
                marker: marker(p),
                line: !p.is_reference(),
                dashed: false,
                points: of(ladder),
            });
            let mut nodes = of(|p| matches!(p.solved, Solved::Nodes(_)));
            nodes.sort_by(|a, b| b.1.total_cmp(&a.1));
            if !nodes.is_empty() {
                series.push(Series {
                    name: name(", over nodes"),
                    colour: colour(i),
                    marker: Marker::None,
                    line: true,
                    dashed: true,
                    points: nodes,
                });
            }
        }
        Panel { title: title.into(), x: TIME, y, series }
    };
    Sheet {
        title: format!("Work against precision, {first}: frictionless exact rod, lower left is better"),
        panels: vec![
            panel("99 of 100 taps", P99, |e| e.p99, true),
            panel("worst tap", WORST, |e| e.worst, false),
        ],
        columns: 2,
        size: (520.0, 420.0),
        shared: true,
    }
}

/// Every configuration over tolerances.
fn configurations(m: &Measured, places: &[Place]) -> Sheet {
    let mut names: Vec<&'static str> = Vec::new();
    for p in m.points.iter().filter(|p| ladder(p)) {
        if !names.contains(&p.configuration) {
            names.push(p.configuration);
        }
    }
    let panel = |(k, c): (usize, &&'static str)| {
        let series = places.iter().enumerate().map(|(i, p)| Series {
            name: (k == 0).then(|| p.name.clone()),
            colour: colour(i),
            marker: marker(p),
            line: !p.is_reference(),
            dashed: false,
            points: pick(m, c, i, |e| e.p99, ladder),
        });
        Panel { title: (*c).into(), x: TIME, y: P99, series: series.collect() }
    };
    Sheet {
        title: "Work against precision, every configuration, over tolerances".into(),
        columns: names.len().clamp(1, 4),
        panels: names.iter().enumerate().map(panel).collect(),
        size: (380.0, 320.0),
        shared: true,
    }
}

/// Seconds of whole sweeps.
fn scaling(m: &Measured, places: &[Place]) -> Sheet {
    let panel = |shape: Shape, title: &str| {
        let series = places.iter().enumerate().map(|(i, p)| {
            let ours = m.scaled.iter().filter(|s| s.place == i && s.shape == shape);
            Series {
                name: (shape == Shape::Independent).then(|| p.name.clone()),
                colour: colour(i),
                marker: marker(p),
                line: true,
                dashed: false,
                points: ours.map(|s| (s.taps as f64, s.seconds.best)).collect(),
            }
        });
        Panel { title: title.into(), x: "taps of the sweep", y: "whole sweep (s)", series: series.collect() }
    };
    Sheet {
        title: "Cost of whole sweeps, reduced to the 100 best designs".into(),
        panels: vec![
            panel(Shape::Independent, "independent taps"),
            panel(Shape::Gridded, "a grid with 100 tap angles"),
        ],
        columns: 2,
        size: (480.0, 380.0),
        shared: true,
    }
}

/// Time per tap against threads.
fn threads(m: &Measured, places: &[Place]) -> Sheet {
    let mut series: Vec<Series> = Vec::new();
    for (i, p) in places.iter().enumerate() {
        let ours = m.threaded.iter().filter(|t| t.place == i);
        let points: Vec<_> = ours.map(|t| (t.threads as f64, t.times.best)).collect();
        let Some(&(_, alone)) = points.iter().find(|(n, _)| *n == 1.0) else { continue };
        let ideal = points.iter().map(|&(n, _)| (n, alone / n)).collect();
        let of = |name, marker, dashed, points| Series {
            name,
            colour: colour(i),
            marker,
            line: true,
            dashed,
            points,
        };
        let first = series.is_empty();
        series.push(of(Some(p.name.clone()), marker(p), false, points));
        series.push(of(first.then(|| "ideal".into()), Marker::None, true, ideal));
    }
    let panel = Panel { title: String::new(), x: "CPU threads", y: TIME, series };
    Sheet {
        title: "The same taps on more threads".into(),
        panels: vec![panel],
        columns: 1,
        size: (560.0, 400.0),
        shared: true,
    }
}

/// Attained flops against flops per byte, under the measured roofs.
fn roofline(m: &Measured, places: &[Place]) -> Sheet {
    let intensities = || m.loads.iter().map(|l| l.flops() / l.bytes as f64);
    let (least, most) =
        intensities().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let mut series = Vec::new();
    for (i, p) in places.iter().enumerate() {
        let Some(peak) = m.peaks.iter().find(|k| k.place == i) else { continue };
        let ridge = peak.flops / peak.bytes;
        let roof = |x: f64| (x, (x * peak.bytes).min(peak.flops) / 1e9);
        series.push(Series {
            name: Some(format!("{}, roof", p.name)),
            colour: colour(i),
            marker: Marker::None,
            line: true,
            dashed: true,
            points: [0.5 * least.min(ridge), ridge, 2.0 * most.max(ridge)].map(roof).to_vec(),
        });
        let ours = m.loads.iter().filter(|l| l.place == i);
        series.push(Series {
            name: Some(p.name.clone()),
            colour: colour(i),
            marker: marker(p),
            line: false,
            dashed: false,
            points: ours.map(|l| (l.flops() / l.bytes as f64, l.flops_per_second() / 1e9)).collect(),
        });
    }
    let panel = Panel {
        title: String::new(),
        x: "counted flops per byte",
        y: "attained GFLOP/s in the kernel",
        series,
    };
    Sheet {
        title: "Kernels under measured roofs, one point per configuration".into(),
        panels: vec![panel],
        columns: 1,
        size: (640.0, 440.0),
        shared: true,
    }
}

fn empty() -> Sheet {
    Sheet { title: String::new(), panels: Vec::new(), columns: 1, size: (1.0, 1.0), shared: true }
}
