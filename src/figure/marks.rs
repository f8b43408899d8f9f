//! Marks of a panel on paper.

use ttf_parser::Face;

use super::colour::{self, Rgb};
use super::data::{Along, Cells, Mark, Marker};
use super::drawing::{Anchor, Drawing, Rect, Step, Stroke, circle, closed, open};
use super::font::length;
use super::scale::Scale;

/// Width of lines of data, pt.
pub const LINE: f64 = 1.1;
/// Radius of points, pt.
pub const DOT: f64 = 1.9;
/// From a point to its note, pt.
const OFF: f64 = 5.0;
/// Points of which more are drawn smaller.
const MANY: usize = 300;

/// Where values lie.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// The panel's inside.
    pub inside: Rect,
    /// Across.
    pub x: Scale,
    /// Up.
    pub y: Scale,
    /// Of notes, pt.
    pub size: f64,
}

impl Place {
    /// Point of paper.
    pub fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let r = &self.inside;
        [r.x + self.x.share(x) * r.w, r.y + (1.0 - self.y.share(y)) * r.h]
    }

    fn all(&self, x: &[f64], y: &[f64]) -> Vec<[f64; 2]> {
        x.iter().zip(y).map(|(x, y)| self.at(*x, *y)).collect()
    }
}

/// Draws `mark` at its place.
pub fn draw(d: &mut Drawing, p: &Place, mark: &Mark, face: &Face<'_>) {
    let clip = Some(p.inside);
    match mark {
        Mark::Line { path, dash, marker } => {
            let points = p.all(&path.x, &path.y);
            d.stroke(open(&points), Stroke::of(colour::of(path.colour), LINE, *dash), clip);
            if let Some(marker) = marker {
                points.iter().for_each(|at| point(d, *at, *marker, colour::of(path.colour), DOT));
            }
        }
        Mark::Points { path, marker, error, .. } => {
            let c = colour::of(path.colour);
            for ((x, y), e) in path.x.iter().zip(&path.y).zip(error) {
                let (low, high) = (p.at(*x, y - e), p.at(*x, y + e));
                d.stroke(open(&[low, high]), Stroke::solid(c, 0.6), clip);
            }
            let radius = if path.x.len() > MANY { 0.6 * DOT } else { DOT };
            p.all(&path.x, &path.y).iter().for_each(|at| point(d, *at, *marker, c, radius));
        }
        Mark::Bars { path, among: [which, of] } => {
            let thick = 0.8 * p.inside.h / (p.y.ends[1] - p.y.ends[0]) / *of as f64;
            for (x, y) in path.x.iter().zip(&path.y) {
                let ([x0, middle], [x1, _]) = (p.at(0.0, *y), p.at(*x, *y));
                let top = middle + thick * (*which as f64 - 0.5 * *of as f64);
                let bar = Rect { x: x0.min(x1), y: top, w: (x1 - x0).abs(), h: 0.92 * thick };
                if bar.w.is_finite() {
                    d.fill(bar.steps(), colour::of(path.colour), 1.0, clip);
                }
            }
        }
        Mark::Area { path, outlined } => {
            let (steps, c) = (closed(&p.all(&path.x, &path.y)), colour::of(path.colour));
            d.fill(steps.clone(), c, opacity(*outlined), clip);
            if *outlined {
                d.stroke(steps, Stroke::solid(c, 0.6), clip);
            }
        }
        Mark::Cells(cells) => map(d, p, cells),
        Mark::Rule { along, at, colour: c, dash, .. } => {
            let ([x0, x1], [y0, y1]) = (p.x.ends, p.y.ends);
            let ends = match along {
                Along::X => [p.at(x0, *at), p.at(x1, *at)],
                Along::Y => [p.at(*at, y0), p.at(*at, y1)],
            };
            d.stroke(open(&ends), Stroke::of(colour::of(*c), 0.8, *dash), clip);
        }
        Mark::Note { x, y, text } => {
            let [at, base] = p.at(*x, *y);
            let right = at > p.inside.x + 0.6 * p.inside.w;
            let (anchor, off) = if right { (Anchor::End, -OFF) } else { (Anchor::Start, OFF) };
            let up = base - OFF - p.size >= p.inside.y;
            let base = if up { base - OFF } else { base + OFF + p.size };
            plated(d, [at + off, base], text, p.size, anchor, face);
        }
    }
}

/// Opacity of an area.
pub fn opacity(outlined: bool) -> f64 {
    if outlined { 0.35 } else { 0.18 }
}

/// Text on a plate of paper, so that lines below it do not cross it.
pub fn plated(d: &mut Drawing, [x, y]: [f64; 2], text: &str, size: f64, anchor: Anchor, face: &Face<'_>) {
    let long = length(face, text) * size;
    let plate = Rect { x: x - anchor.share() * long - 0.6, y: y - 0.8 * size, w: long + 1.2, h: size };
    d.fill(plate.steps(), [255; 3], 0.8, None);
    d.text([x, y], text, size, anchor, false);
}

/// A map of values; cells overlap by a hair, so that no seams are seen between them.
fn map(d: &mut Drawing, p: &Place, cells: &Cells) {
    let scale = Scale::tight(&cells.of, cells.z.iter().copied());
    let columns = cells.x.len() - 1;
    for (k, z) in cells.z.iter().enumerate().filter(|(_, z)| z.is_finite()) {
        let (i, j) = (k % columns, k / columns);
        let ([x0, y0], [x1, y1]) = (p.at(cells.x[i], cells.y[j]), p.at(cells.x[i + 1], cells.y[j + 1]));
        let cell = Rect { x: x0, y: y1, w: x1 - x0 + 0.15, h: y0 - y1 + 0.15 };
        d.fill(cell.steps(), colour::along(scale.share(*z)), 1.0, Some(p.inside));
    }
}

/// A point of radius `r`, with a white rim that parts it from its neighbours.
pub fn point(d: &mut Drawing, at: [f64; 2], marker: Marker, c: Rgb, r: f64) {
    if !at.iter().all(|x| x.is_finite()) {
        return;
    }
    let [x, y] = at;
    let around = |corners: &[[f64; 2]]| {
        closed(&corners.iter().map(|[u, v]| [x + u * r, y + v * r]).collect::<Vec<_>>())
    };
    let steps: Vec<Step> = match marker {
        Marker::Circle | Marker::Ring => circle(at, r),
        Marker::Square => around(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
        Marker::Triangle => around(&[[0.0, -1.2], [1.1, 0.8], [-1.1, 0.8]]),
        Marker::Diamond => around(&[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]]),
        Marker::Cross => {
            let k = 1.1 * r;
            let mut both = open(&[[x - k, y - k], [x + k, y + k]]);
            both.extend(open(&[[x - k, y + k], [x + k, y - k]]));
            return d.stroke(both, Stroke::solid(c, 1.1), None);
        }
    };
    match marker {
        Marker::Ring => d.path(circle(at, 1.7 * r), None, Some(Stroke::solid(c, 1.2)), 1.0, None),
        _ => d.path(steps, Some(c), Some(Stroke::solid([255; 3], 0.3)), 1.0, None),
    }
}
