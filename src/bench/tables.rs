//! The tables of a benchmark: names, columns, rows.

use super::Measured;
use super::place::Place;
use super::work::{Point, Solved};
use crate::error::Error;
use crate::sink::{csv::Text, table::Field};

/// A row: words, then numbers.
type Row<'a> = (Vec<&'a str>, Vec<Field>);

/// Text of every table, by file name.
///
/// # Errors
/// None in practice: tables are made in memory.
pub fn all(m: &Measured, places: &[Place]) -> Result<Vec<(&'static str, String)>, Error> {
    let at = |place: usize| -> Vec<&str> {
        let p = &places[place];
        let [backend, precision] = p.words();
        vec![backend, precision, p.choice.backend.adapter.as_deref().unwrap_or_default()]
    };
    let with = |first: &'static str, place: usize| -> Vec<&str> { [vec![first], at(place)].concat() };
    let numbers = |x: &[f64]| x.iter().copied().map(Field::Number).collect::<Vec<_>>();
    let work = m.points.iter().map(|p| {
        let words = [with(p.configuration, p.place), vec![p.solved.name()]].concat();
        (words, point(p))
    });
    let scaling = m.scaled.iter().map(|s| {
        let counts = [s.taps, s.solved, s.interpolated, s.failed].map(Field::Count).to_vec();
        let rate = s.taps as f64 / s.seconds.best;
        let times = numbers(&[s.seconds.best, s.seconds.median, rate, 1e9 / rate]);
        (with(s.shape.name(), s.place), [counts, times, vec![s.seconds.spread.into()]].concat())
    });
    let threads = m.threaded.iter().map(|t| {
        let times = numbers(&[t.times.best, t.times.median, t.speedup]);
        (at(t.place), [vec![Field::Count(t.threads as u64)], times, vec![t.times.spread.into()]].concat())
    });
    let texts = [table(&WORK, work)?, table(&SCALING, scaling)?, table(&THREADS, threads)?];
    Ok(COLUMNS.into_iter().map(|(file, _)| file).zip(texts).collect())
}

/// Every table and its columns.
pub const COLUMNS: [(&str, &[&str]); 3] =
    [("work_precision.csv", &WORK), ("scaling.csv", &SCALING), ("threads.csv", &THREADS)];

const WORK: [&str; 17] = [
    "configuration",
    "backend",
    "precision",
    "adapter",
    "kernel",
    "nodes",
    "tolerance",
    "taps",
    "failed",
    "ns_per_tap",
    "ns_per_tap_median",
    "kernel_ns_per_tap",
    "sweeps_mean",
    "strain_error_median",
    "strain_error_p99",
    "strain_error_max",
    "spread",
];

const SCALING: [&str; 13] = [
    "shape",
    "backend",
    "precision",
    "adapter",
    "taps",
    "solved",
    "interpolated",
    "failed",
    "seconds",
    "seconds_median",
    "taps_per_second",
    "ns_per_tap",
    "spread",
];

const THREADS: [&str; 8] =
    ["backend", "precision", "adapter", "threads", "ns_per_tap", "ns_per_tap_median", "speedup", "spread"];

fn point(p: &Point) -> Vec<Field> {
    let nodes = match p.solved {
        Solved::Nodes(n) => Field::Count(n as u64),
        _ => None.into(),
    };
    let error = |f: fn(&super::work::Quantiles) -> f64| Field::from(p.errors.as_ref().map(f));
    vec![
        nodes,
        p.tolerance.into(),
        Field::Count(p.taps as u64),
        Field::Count(p.failed as u64),
        Field::Number(p.whole.best),
        Field::Number(p.whole.median),
        p.kernel.map(|k| k.best).into(),
        p.sweeps.into(),
        error(|e| e.median),
        error(|e| e.p99),
        error(|e| e.worst),
        p.whole.spread.into(),
    ]
}

fn table<'a>(columns: &[&str], rows: impl Iterator<Item = Row<'a>>) -> Result<String, Error> {
    let mut text = Text::default();
    text.header(columns)?;
    for (words, numbers) in rows {
        let words = words.into_iter().map(|word| Field::Text(word.to_owned()));
        text.row(&mut words.chain(numbers).collect())?;
    }
    String::from_utf8(text.into_bytes()).map_err(|e| Error::Run(e.to_string()))
}
