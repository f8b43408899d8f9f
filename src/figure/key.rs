//! The key: every name of a figure once, with all that is drawn under it.

use ttf_parser::Face;

use super::colour::{self, Rgb};
use super::data::{Figure, Mark, Marker};
use super::drawing::{Anchor, Drawing, Rect, Stroke, open};
use super::font::length;
use super::marks::{DOT, LINE, point};

/// One name and its looks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Entry {
    name: String,
    line: Option<(Rgb, u8)>,
    points: Option<(Rgb, Marker)>,
    area: Option<Rgb>,
}

/// Width of a sign, pt.
const SIGN: f64 = 16.0;

/// Entries of `figure`, in the order in which their names come first.
pub fn entries(figure: &Figure) -> Vec<Entry> {
    let mut all: Vec<Entry> = Vec::new();
    for mark in figure.panels.iter().flat_map(|p| &p.marks) {
        let (name, colour) = match mark {
            Mark::Line { path, .. }
            | Mark::Points { path, .. }
            | Mark::Bars { path, .. }
            | Mark::Area { path, .. } => (&path.name, path.colour),
            Mark::Rule { name, colour, .. } => (name, *colour),
            Mark::Cells(_) | Mark::Note { .. } => continue,
        };
        if name.is_empty() {
            continue;
        }
        let at = all.iter().position(|e| e.name == *name).unwrap_or_else(|| {
            all.push(Entry { name: name.clone(), ..Entry::default() });
            all.len() - 1
        });
        let (entry, c) = (&mut all[at], colour::of(colour));
        match mark {
            Mark::Line { dash, marker, .. } => {
                entry.line = entry.line.or(Some((c, *dash)));
                entry.points = entry.points.or(marker.map(|m| (c, m)));
            }
            Mark::Rule { dash, .. } => entry.line = entry.line.or(Some((c, *dash))),
            Mark::Points { marker, .. } => entry.points = entry.points.or(Some((c, *marker))),
            _ => entry.area = entry.area.or(Some(c)),
        }
    }
    all
}

/// Rows of entries that fit into `width`.
pub fn rows(entries: &[Entry], face: &Face<'_>, size: f64, width: f64) -> Vec<Vec<(f64, Entry)>> {
    let mut rows: Vec<Vec<(f64, Entry)>> = Vec::new();
    let mut at = f64::INFINITY;
    for entry in entries {
        let long = SIGN + 4.0 + length(face, &entry.name) * size + 10.0;
        if at + long > width + 10.0 && (at > 0.0 || rows.is_empty()) {
            rows.push(Vec::new());
            at = 0.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push((at, entry.clone()));
        }
        at += long;
    }
    rows
}

/// Draws an entry whose text has its baseline at `y`.
pub fn draw(d: &mut Drawing, entry: &Entry, [x, y]: [f64; 2], size: f64) {
    let middle = y - 0.34 * size;
    if let Some(c) = entry.area {
        d.fill(
            Rect { x: x + 2.0, y: middle - 0.35 * size, w: SIGN - 4.0, h: 0.7 * size }.steps(),
            c,
            0.5,
            None,
        );
    }
    if let Some((c, dash)) = entry.line {
        d.stroke(open(&[[x, middle], [x + SIGN, middle]]), Stroke::of(c, LINE, dash), None);
    }
    if let Some((c, marker)) = entry.points {
        point(d, [x + 0.5 * SIGN, middle], marker, c, DOT);
    }
    d.text([x + SIGN + 4.0, y], entry.name.clone(), size, Anchor::Start, false);
}
