//! Figures of a census of taps: errors (`verify`), time against error (`bench`).

use std::collections::BTreeSet;

use super::designs::front;
use super::quantity::grouped;
use super::{Content, Drawn, Source, answer};
use crate::error::Error;
use crate::figure::{Axis, Figure, Mark, Marker, Panel, Path, Scale, series};
use crate::sink::Frame;

const TIME: (&str, &str) = ("time per tap", "ns");
/// Slower peers are left out of the figure, ns per tap.
const SLOWEST: f64 = 1e8;

pub fn of_bench(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let work = source.table("work_precision.csv")?;
    figures(&work, source.maybe("peers.csv")?.as_ref())?.into_iter().for_each(|f| c.figure(f));
    c.first_rows(source, &["work_precision.csv", "peers.csv"])?;
    c.answer = answer::of_bench(&work)?;
    Ok(c)
}

/// Figures of the table `work`, with other programs on the same taps.
pub fn figures(work: &Frame, peers: Option<&Frame>) -> Drawn<Vec<Figure>> {
    let mut all = vec![precision(work, peers)?, configurations(work)?];
    all.retain(|f| !f.is_empty());
    Ok(all)
}

/// Label and rows of each backend of `table`, in order of appearance; software adapters are marked.
fn places(table: &Frame) -> Vec<(String, Vec<usize>)> {
    let rows = grouped(0..table.len(), |r| ["backend", "precision", "adapter"].map(|c| table.word(c, r)));
    let named = |([backend, precision, adapter], rows): ([String; 3], Vec<usize>)| {
        let (lower, short) = (adapter.to_lowercase(), adapter.split(" (").next().unwrap_or(&adapter));
        let name = match (backend.as_str(), SOFTWARE.iter().any(|word| lower.contains(word))) {
            ("gpu", true) => format!("software GPU {precision} ({short})"),
            ("gpu", false) => format!("GPU {precision} ({adapter})"),
            ("cpu", _) => format!("CPU {precision}"),
            _ => format!("{backend} {precision}"),
        };
        (name, rows)
    };
    rows.into_iter().map(named).collect()
}

/// Words in the names of adapters that are software.
const SOFTWARE: [&str; 5] = ["llvmpipe", "lavapipe", "swiftshader", "basic render", "software"];

/// For each place the `error` of its kernels in `configuration` over the time: points, and a line through those that none beats, which never turns back.
fn reached(work: &Frame, mut panel: Panel, configuration: &str, error: &[f64]) -> Drawn<Panel> {
    let time = work.numbers("ns_per_tap")?;
    for (i, (name, rows)) in places(work).iter().enumerate() {
        let is = |r: &&usize| is_solved(work, **r) && work.word("configuration", **r) == configuration;
        let points = rows.iter().filter(is).map(|r| (time[*r], error[*r]));
        let (x, y): (Vec<f64>, Vec<f64>) = points.filter(|p| p.1 > 0.0).unzip();
        let (colour, marker) = series(i);
        let line = Path::new(name, colour, front(&x, &y).into_iter().map(|i| (x[i], y[i])));
        let points = Path::new(name, colour, x.iter().copied().zip(y.iter().copied()));
        panel = panel.with(Mark::line(line, 0)).with(Mark::points(points, marker));
    }
    Ok(panel)
}

fn is_solved(work: &Frame, row: usize) -> bool {
    matches!(work.word("kernel", row).as_str(), "exact" | "reference")
}

/// The first configuration only: every kernel, and the peers.
fn precision(work: &Frame, peers: Option<&Frame>) -> Drawn {
    let first = if !work.is_empty() { work.word("configuration", 0) } else { String::new() };
    let (mut panels, mut beyond) = (Vec::new(), BTreeSet::new());
    for (title, column, theirs) in
        [("99 of 100 taps are better", "strain_error_p99", "p99"), ("worst tap", "strain_error_max", "worst")]
    {
        let error = work.numbers(column)?;
        let mut panel = Panel::new(title, Axis::log(TIME.0, TIME.1), Axis::log("strain error, relative", ""));
        panel = reached(work, panel, &first, error)?;
        if let Some(peers) = peers {
            let (rate, error) = (peers.numbers("taps_per_second")?, peers.numbers(theirs)?);
            for r in peers.rows(|r| !peers.word("name", r).starts_with("vibrissa") && error[r] > 0.0) {
                if 1e9 / rate[r] > SLOWEST {
                    let seconds = crate::digits::short(1.0 / rate[r]);
                    beyond.insert(format!("{} at {seconds} s a tap", peers.word("name", r)));
                    continue;
                }
                let name = peers.word("name", r);
                let family = name.split([' ', ',']).next().unwrap_or_default().to_owned();
                let known = ["scipy", "JAX", "numba", "PyElastica", "diffrax"];
                let after = known.iter().position(|f| *f == family).unwrap_or(known.len());
                let (colour, marker) = series(places(work).len() + after);
                let path = Path::new(family, colour, [(1e9 / rate[r], error[r])]);
                let (error, rows, notes) = (Vec::new(), Vec::new(), vec![name]);
                panel = panel.with(Mark::Points { path, marker, error, rows, notes });
            }
        }
        panels.push(panel);
    }
    share(&mut panels);
    let slow = beyond.into_iter().collect::<Vec<_>>().join(", ");
    let slow = if slow.is_empty() { slow } else { format!("; beyond the axis: {slow}") };
    let others = format!(" Points without a line: other programs on the same taps (peers.csv){slow}.");
    let beside = peers.map_or(String::new(), |_| others);
    let caption = format!(
        "{first}, frictionless exact rod: time of a tap against its strain error, lower left is better. Each point is one tolerance; a line joins those that no other beats (work_precision.csv).{beside}"
    );
    Ok(Figure::new("work_precision", "Work against precision", caption, panels))
}

fn share(panels: &mut [Panel]) {
    let reach: Vec<(f64, f64)> = panels.iter().flat_map(|p| &p.marks).flat_map(Mark::reach).collect();
    for p in panels {
        p.x.ends = Some(Scale::of(&p.x, reach.iter().map(|r| r.0)).ends);
        p.y.ends = Some(Scale::of(&p.y, reach.iter().map(|r| r.1)).ends);
    }
}

fn configurations(work: &Frame) -> Drawn {
    let error = work.numbers("strain_error_p99")?;
    let names = grouped(work.rows(|r| is_solved(work, r)), |r| work.word("configuration", r));
    let panel = |c: &String| {
        let panel = Panel::new(c.clone(), Axis::log(TIME.0, TIME.1), Axis::log("strain error, 99 %", ""));
        reached(work, panel, c, error)
    };
    let mut panels = names.keys().map(panel).collect::<Result<Vec<_>, _>>()?;
    share(&mut panels);
    let caption = "Time of a tap against the strain error that 99 of 100 taps keep, of every configuration over tolerances; a line joins the points that no other beats (work_precision.csv).";
    Ok(Figure::new("configurations", "Every configuration", caption, panels))
}

pub fn of_verify(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let table = source.table("verify.csv")?;
    c.answer = answer::of_verify(&table)?;
    let places = grouped(0..table.len(), |r| ["backend", "precision"].map(|name| table.word(name, r)));
    let mut panels = Vec::new();
    for (place, rows) in places {
        let names = rows.iter().rev().map(|r| table.word("configuration", *r)).collect();
        let (x, y) = (Axis::log("strain error, relative", ""), Axis::words("", names));
        let mut panel = Panel::new(place.join(" "), x, y);
        for (name, column, colour, marker) in [
            ("median", "strain_error_median", 2, Marker::Circle),
            ("99 % of taps below", "strain_error_p99", 0, Marker::Square),
            ("worst tap", "strain_error_worst", 1, Marker::Diamond),
            ("bound", "bound", 4, Marker::Cross),
        ] {
            let values = table.numbers(column)?;
            let points = rows.iter().rev().enumerate().map(|(i, r)| (values[*r], i as f64));
            let points = Path::new(name, colour, points.filter(|p| p.0 > 0.0));
            panel = panel.with(Mark::points(points, marker));
        }
        panels.push(panel);
    }
    c.figure(Figure::new("errors", "Errors against the reference", "Strain error of every configuration on every backend, against the f64 reference (verify.csv); an error of 0 has no place on the axis.", panels));
    c.first_rows(source, &["verify.csv"])?;
    Ok(c)
}
