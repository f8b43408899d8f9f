//! The key: each name of a figure with its lines, markers and areas.

use indexmap::IndexMap;
use ttf_parser::Face;

use super::axes::{self, LEADING};
use super::marks::{DOT, LINE, opacity, point};
use super::scale::{self, INK, Shades, value};
use super::{
    Anchor, Axis, Drawing, Figure, Mark, Marker, NO_VALUE, Rect, Rgb, Stroke, Style, length, lines, open,
};

/// Colour, opacity, and colour of the edge.
type Area = (Rgb, f64, Option<Rgb>);

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Entry {
    pub name: String,
    pub line: Option<(Rgb, u8)>,
    pub points: Option<(Rgb, Marker)>,
    pub area: Option<Area>,
}

const SIGN: f64 = 16.0;
const AFTER: f64 = 4.0;

/// Entries of `figure` in order of appearance.
pub fn entries(figure: &Figure) -> Vec<Entry> {
    let mut all: IndexMap<&str, Entry> = IndexMap::new();
    for mark in figure.panels.iter().flat_map(|p| &p.marks) {
        // Name and colour; dash of the line, marker of the points, opacity and edge of the area.
        let (name, colour, dash, marker, area) = match mark {
            Mark::Line { path, dash, marker } => (&path.name, path.colour, Some(*dash), *marker, None),
            Mark::Rule { name, colour, dash, .. } => (name, *colour, Some(*dash), None, None),
            Mark::Points { path, marker, .. } => (&path.name, path.colour, None, Some(*marker), None),
            Mark::Bars { path, .. } => (&path.name, path.colour, None, None, Some((1.0, false))),
            Mark::Area { path, outlined: edge } => {
                (&path.name, path.colour, None, None, Some((opacity(*edge), *edge)))
            }
            Mark::Cells(_) | Mark::Note { .. } => continue,
        };
        if name.is_empty() {
            continue;
        }
        let new = || Entry { name: name.clone(), ..Entry::default() };
        let (entry, c) = (all.entry(name).or_insert_with(new), scale::of(colour));
        entry.line = entry.line.or(dash.map(|dash| (c, dash)));
        entry.points = entry.points.or(marker.map(|marker| (c, marker)));
        entry.area = entry.area.or(area.map(|(opacity, edge)| (c, opacity, edge.then_some(c))));
    }
    let mut all: Vec<Entry> = all.into_values().collect();
    for panel in figure.panels.iter().filter(|p| !p.beyond.is_empty()) {
        let points = Some((INK, Marker::Arrow));
        all.push(Entry { name: panel.beyond.clone(), points, ..Entry::default() });
    }
    let has_gaps = |m: &Mark| matches!(m, Mark::Cells(c) if c.z.iter().any(|z| z.is_nan()));
    if figure.panels.iter().flat_map(|p| &p.marks).any(has_gaps) {
        let area = Some(([255; 3], 1.0, Some(INK)));
        all.push(Entry { name: NO_VALUE.to_owned(), area, ..Entry::default() });
    }
    all
}

/// Draws `entries` in rows from `[x, y]` down; returns the lower end.
pub fn draw(d: &mut Drawing, entries: &[Entry], [left, mut top]: [f64; 2], paper: f64, style: &Style) -> f64 {
    let (room, face, size) = (paper - left, &style.font.face(), style.size);
    let (mut at, mut high) = (0.0, 0.0);
    for entry in entries {
        let names = lines(face, &entry.name, (room - SIGN - AFTER) / size);
        let longest = names.iter().map(|n| length(face, n) * size).fold(0.0, f64::max);
        let long = SIGN + AFTER + longest;
        if at > 0.0 && at + long > room {
            top += high;
            (at, high) = (0.0, 0.0);
        }
        one(d, entry, &names, [left + at, top + 1.1 * size], size);
        at += long + 10.0;
        high = f64::max(high, (0.4 + LEADING * names.len() as f64) * size);
    }
    top + high
}

fn one(d: &mut Drawing, entry: &Entry, names: &[String], [x, y]: [f64; 2], size: f64) {
    let middle = y - 0.34 * size;
    if let Some((c, opacity, edge)) = entry.area {
        let swatch = Rect { x: x + 2.0, y: middle - 0.35 * size, w: SIGN - 4.0, h: 0.7 * size }.steps();
        d.fill(swatch.clone(), c, opacity, None);
        if let Some(edge) = edge {
            d.stroke(swatch, Stroke::solid(edge, 0.6), None);
        }
    }
    if let Some((c, dash)) = entry.line {
        d.stroke(open(&[[x, middle], [x + SIGN, middle]]), Stroke::of(c, LINE, dash), None);
    }
    if let Some((c, marker)) = entry.points {
        point(d, [x + 0.5 * SIGN, middle], marker, c, DOT);
    }
    for (i, name) in names.iter().enumerate() {
        let base = y + i as f64 * LEADING * size;
        d.text([x + SIGN + AFTER, base], name.clone(), size, Anchor::Start, false);
    }
}

/// Gap left of the colour bar, as a multiple of the text size.
const GAP: f64 = 0.7;
/// Width of the bar, likewise.
const WIDE: f64 = 0.8;
pub const TEXT: f64 = 0.9;
const STEPS: usize = 64;

/// Labels of the bar: share of the height, and text.
fn numbers(of: &Axis, shades: &Shades, high: f64, size: f64) -> Vec<(f64, String)> {
    match shades {
        Shades::Scale(scale) => {
            axes::ticks(of, scale, high, size, true).0.into_iter().map(|(x, w)| (scale.share(x), w)).collect()
        }
        Shades::Bands(all) => {
            all.iter().enumerate().map(|(i, x)| ((i as f64 + 0.5) / all.len() as f64, value(*x))).collect()
        }
    }
}

fn longest(numbers: &[(f64, String)], face: &Face<'_>, size: f64) -> f64 {
    numbers.iter().map(|(_, words)| length(face, words) * TEXT * size).fold(0.0, f64::max)
}

pub fn bar_width(of: &Axis, shades: &Shades, high: f64, face: &Face<'_>, size: f64) -> f64 {
    let numbers = longest(&numbers(of, shades, high, size), face, size);
    let title = lines(face, &of.text(), high / (TEXT * size)).len() as f64;
    (GAP + WIDE) * size + 3.0 + numbers + (title * LEADING + 0.3) * TEXT * size
}

pub fn draw_bar(d: &mut Drawing, of: &Axis, shades: &Shades, inside: Rect, face: &Face<'_>, size: f64) {
    let bar = Rect { x: inside.x + inside.w + GAP * size, y: inside.y, w: WIDE * size, h: inside.h };
    let (steps, more) = match shades {
        Shades::Scale(_) => (STEPS, 0.1),
        Shades::Bands(all) => (all.len(), -1.0),
    };
    for i in 0..steps {
        let h = bar.h / steps as f64;
        let step = Rect { y: bar.y + bar.h - (i + 1) as f64 * h - more, h: h + 2.0 * more, ..bar };
        let band = if let Shades::Bands(all) = shades { all.get(i) } else { None };
        let middle = || scale::along((i as f64 + 0.5) / steps as f64);
        let colour = band.map_or_else(middle, |z| shades.colour(*z));
        d.fill(step.steps(), colour, 1.0, Some(bar));
    }
    axes::edge(d, bar);
    let small = TEXT * size;
    let numbers = numbers(of, shades, bar.h, size);
    let first = bar.x + bar.w + 3.0 + longest(&numbers, face, size) + LEADING * small;
    for (share, words) in numbers {
        let at = bar.y + (1.0 - share) * bar.h;
        d.text([bar.x + bar.w + 2.5, at + 0.32 * size], words, small, Anchor::Start, false);
    }
    for (i, line) in lines(face, &of.text(), bar.h / small).into_iter().enumerate() {
        let at = [first + i as f64 * LEADING * small, bar.y + 0.5 * bar.h];
        d.text(at, line, small, Anchor::Middle, true);
    }
}
