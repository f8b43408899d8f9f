//! Rows of designs: columns that vary, limits, and figures of many designs (front, parallel coordinates, maps).

use serde::Deserialize;

use super::content::SHOWN;
use super::quantity::{self, distinct, grouped, map};
use super::{Drawn, Point, Source};
use crate::error::InputError;
use crate::figure::{Figure, Mark, Marker, Panel, Parallel, Path};
use crate::optimise::front::unbeaten;
use crate::scene::Property;
use crate::sink::frame::Frame;

pub use crate::sink::table::WHISKER;
pub fn properties() -> impl Iterator<Item = &'static str> {
    Property::ALL.into_iter().map(|property| property.about().column)
}
pub const DIRECTIONS: [&str; 2] = ["tilt_deg", "lean_deg"];
pub const SD: [&str; 2] = ["K_sd", "K_sd_mm"];
pub const DRIVES: [&str; 2] = ["theta_deg", "delta_mm"];

fn named() -> impl Iterator<Item = &'static str> {
    WHISKER.into_iter().chain(properties()).chain(DIRECTIONS).chain(DRIVES)
}

pub fn varying(table: &Frame) -> Result<Vec<&'static str>, InputError> {
    let there = named().filter(|name| table.has(name)).map(|name| Ok((name, table.numbers(name)?)));
    let columns = there.collect::<Result<Vec<_>, InputError>>()?.into_iter();
    Ok(columns.filter(|(_, x)| x.iter().any(|y| *y != x[0])).map(|(name, _)| name).collect())
}

/// Rows for the page, in table order: half of them the best by `by`, the others spread evenly over the rest.
pub fn chosen(table: &Frame, by: &str) -> Result<(Vec<usize>, String), InputError> {
    let values = table.numbers(by)?;
    if table.len() <= SHOWN {
        return Ok(((0..table.len()).collect(), "all".to_owned()));
    }
    let mut order: Vec<usize> = (0..table.len()).filter(|r| values[*r].is_finite()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let best = order.len().min(SHOWN / 2);
    let mut rows = order[..best].to_vec();
    let rest = &order[best..];
    let wanted = (SHOWN - best).min(rest.len());
    rows.extend((0..wanted).map(|i| rest[i * rest.len() / wanted]));
    rows.sort_unstable();
    Ok((rows, format!("the {best} with the least {by} and {wanted} from all ranks of the others")))
}

/// Pareto front of `x` and `y` (smaller is better), by ascending x.
pub fn front(x: &[f64], y: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..x.len()).filter(|i| x[*i].is_finite() && y[*i].is_finite()).collect();
    unbeaten(&mut order, |i| [x[*i], y[*i]]);
    order
}

/// Trade-off of two quantities: the page's rows, the front of the `fine` rows, and the chosen design.
pub fn trade(
    table: &Frame,
    [x, y]: [&str; 2],
    rows: &[usize],
    fine: &[bool],
    chosen: Option<Point>,
) -> Drawn<Option<Figure>> {
    if !table.has(x) || !table.has(y) || table.len() < 3 {
        return Ok(None);
    }
    let (xs, ys) = (table.numbers(x)?, table.numbers(y)?);
    let keeps: Vec<f64> = ys.iter().zip(fine).map(|(y, ok)| if *ok { *y } else { f64::NAN }).collect();
    let best = front(xs, &keeps);
    let of = |name: &str, colour, keep: &dyn Fn(usize) -> bool, marker| {
        let places: Vec<usize> = (0..rows.len()).filter(|k| keep(rows[*k])).collect();
        let path = Path::new(name, colour, places.iter().map(|k| (xs[rows[*k]], ys[rows[*k]])));
        Mark::Points { path, marker, error: Vec::new(), rows: places, notes: Vec::new() }
    };
    let is_best: std::collections::HashSet<usize> = best.iter().copied().collect();
    let line = Path::new("front", 1, best.iter().map(|i| (xs[*i], ys[*i])));
    let panel = Panel::new("", quantity::axis(x), quantity::axis(y))
        .with(of("a limit is broken", 7, &|r| !fine[r], Marker::Cross))
        .with(of("rows", 5, &|r| fine[r] && !is_best.contains(&r), Marker::Circle))
        .with(Mark::line(line, 0))
        .with(of("front", 1, &|r| is_best.contains(&r), Marker::Diamond))
        .with(Mark::points(Path::new("chosen design", 4, chosen), Marker::Ring));
    let ([x, y], all, some) = ([x, y].map(|name| quantity::axis(name).label), table.len(), best.len());
    let caption = format!(
        "Trade-off of {x} and {y}, both better when smaller: each point is a row of the table below, the front is of those of all {all} rows that keep their limits ({some} lie on it)."
    );
    Ok(Some(Figure::new("front", "Trade-off", caption, vec![panel])))
}

/// Parallel coordinates of `rows`, coloured by the first available column of `by`; rows that are not `fine` in grey.
pub fn parallel(table: &Frame, rows: &[usize], fine: &[bool], by: &[&str]) -> Drawn<Option<Figure>> {
    let mut names: Vec<&str> = varying(table)?;
    let first = names.len();
    if !by.iter().any(|n| table.has(n)) || first < 2 || rows.len() < 3 {
        return Ok(None);
    }
    let beside = by.iter().copied().chain(["strain_max", "signal_max", "force_max_N"]);
    names.extend(beside.filter(|n| table.has(n)));
    let columns = names.iter().map(|n| table.numbers(n)).collect::<Result<Vec<_>, _>>()?;
    let missing = |r: usize| columns.iter().any(|c| !c[r].is_finite());
    let axis = |n: &&str| {
        let mut axis = quantity::axis(n);
        if named().any(|short| short == *n) {
            axis.label = axis.label.rsplit(' ').next().unwrap_or_default().to_owned();
        }
        axis
    };
    let parallel = Parallel {
        axes: names.iter().map(axis).collect(),
        values: rows.iter().map(|r| columns.iter().map(|c| c[*r]).collect()).collect(),
        colour: first,
        muted: rows.iter().map(|r| !fine[*r] || missing(*r)).collect(),
        why: "a limit is broken, or a value is missing".to_owned(),
    };
    let caption = format!(
        "A line for each row of the table below, coloured by {} (blue is small); grey lines break a limit or miss a value.",
        quantity::axis(names[first]).label
    );
    let figure = Figure::new("parallel", "Parallel coordinates", caption, Vec::new());
    Ok(Some(Figure { parallel: Some(parallel), ..figure }))
}

/// Maps of `quantity` over each pair of varying columns: the least value over the other columns, among `fine` rows.
pub fn maps(table: &Frame, fine: &[bool], quantity: &str) -> Drawn<Option<Figure>> {
    let axes = varying(table)?;
    if !table.has(quantity) || axes.len() < 2 {
        return Ok(None);
    }
    let values = table.numbers(quantity)?;
    let kept = |r: usize| if fine[r] { values[r] } else { f64::NAN };
    let mut panels = Vec::new();
    let mut binned = false;
    for (i, x) in axes.iter().enumerate() {
        for y in &axes[i + 1..] {
            let columns = [(*x, table.numbers(x)?), (*y, table.numbers(y)?)];
            let (panel, bins) = map("", columns, kept, quantity::axis(quantity));
            binned |= bins;
            panels.push(panel);
        }
    }
    let rest = if axes.len() > 2 { ", the best over all other axes" } else { "" };
    let bins = format!("; axes with more than {} values in as many bins", quantity::BINS);
    let bins = if binned { &*bins } else { "" };
    let (label, all) = (quantity::axis(quantity).label, table.len());
    let caption = format!(
        "Least {label} in each cell{rest}, of the rows that keep their limits, of all {all} rows{bins}; cells without such a row are empty."
    );
    let title = format!("Map of {label}");
    Ok(Some(Figure::new(&format!("map_{quantity}"), &title, caption, panels)))
}

/// Rows grouped by whisker and direction, and the number of groups. At most `most`, those with the least `by` in a `fine` row.
pub fn whiskers(table: &Frame, fine: &[bool], by: &str, most: usize) -> Drawn<(Vec<Alike>, usize)> {
    let beside = properties().chain(DIRECTIONS).filter(|name| table.has(name));
    let names: Vec<&str> = WHISKER.into_iter().chain(beside).collect();
    let values = table.numbers(by)?;
    let rank = |r: usize| if fine[r] && values[r].is_finite() { values[r] } else { f64::INFINITY };
    alike(table, &names, 0..table.len(), rank, most)
}

/// Groups of `rows` with equal values in the columns `names`, and the number of groups. At most `most`, those with the least `rank`.
pub fn alike(
    table: &Frame,
    names: &[&str],
    rows: impl IntoIterator<Item = usize>,
    rank: impl Fn(usize) -> f64,
    most: usize,
) -> Drawn<(Vec<Alike>, usize)> {
    let columns = names.iter().map(|n| table.numbers(n)).collect::<Result<Vec<_>, _>>()?;
    let key = |r: usize| columns.iter().map(|column| (column[r] + 0.0).to_bits()).collect::<Vec<_>>();
    let mut all: Vec<Vec<usize>> = grouped(rows, key).into_values().collect();
    let count = all.len();
    let values =
        |k: usize, all: &[Vec<usize>]| -> Vec<f64> { all.iter().map(|rows| columns[k][rows[0]]).collect() };
    // Before dropping groups, so that a name also contains values that the remaining groups share.
    let differ: Vec<usize> = (0..names.len()).filter(|k| distinct(values(*k, &all)).len() > 1).collect();
    if count > most {
        let least = |rows: &Vec<usize>| rows.iter().map(|r| rank(*r)).fold(f64::INFINITY, f64::min);
        let mut ranked: Vec<_> = all.into_iter().map(|rows| (least(&rows), rows)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        all = ranked.into_iter().take(most).map(|(_, rows)| rows).collect();
    }
    let told: Vec<Vec<String>> =
        differ.iter().map(|k| quantity::told_apart(names[*k], &values(*k, &all))).collect();
    let named = |(i, rows): (usize, Vec<usize>)| {
        let name = told.iter().map(|names| names[i].as_str()).collect::<Vec<_>>().join(", ");
        Alike { name, rows }
    };
    Ok((all.into_iter().enumerate().map(named).collect(), count))
}

#[derive(Debug, Clone)]
pub struct Alike {
    /// Values that differ from other groups, in words.
    pub name: String,
    pub rows: Vec<usize>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Limits {
    /// True if ambiguous rows break the limits.
    unambiguous: bool,
    strain: Option<f64>,
}

impl Limits {
    /// Those in force, TOML such as `{ strain = 0.02, unambiguous = true }`.
    pub fn of(source: &Source) -> Self {
        let written = source.in_force("optimise.limits").and_then(|text| text.parse::<toml::Value>().ok());
        written.and_then(|limits| limits.try_into().ok()).unwrap_or_default()
    }

    /// For each row: true if it keeps the limits. A second distance breaks them only with `unambiguous`.
    pub fn kept(&self, table: &Frame) -> Vec<bool> {
        let keeps = |row: usize, word: &str| match (word, self.strain) {
            ("ok" | "", _) => true,
            ("ambiguous", _) => !self.unambiguous,
            ("strain_limit", Some(limit)) => table.number("strain_max", row) <= limit,
            _ => false,
        };
        (0..table.len()).map(|r| table.word("status", r).split('+').all(|word| keeps(r, word))).collect()
    }
}
