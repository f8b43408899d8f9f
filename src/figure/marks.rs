//! Draws the marks of a panel; its notes as near to their points as possible without covering data.

use ttf_parser::Face;

use super::drawing::{circle, closed, open};
use super::scale::{self, INK, LOOK, Shades};
use super::{Along, Anchor, Cells, Drawing, Mark, Marker, Panel, Rect, Rgb, Scale, Stroke, length};

pub const LINE: f64 = 1.1;
pub const DOT: f64 = 1.9;
/// Above this number, points are smaller.
const MANY: usize = 300;
/// Above this number of points, a line has markers this far apart, pt.
const CROWD: (usize, f64) = (60, 18.0);
/// Gap at each side of a band of a map, as a share of the band.
const BETWEEN: f64 = 0.04;

#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub inside: Rect,
    pub x: Scale,
    pub y: Scale,
    /// Text size of notes, pt.
    pub size: f64,
}

impl Place {
    pub fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let r = &self.inside;
        [r.x + self.x.share(x) * r.w, r.y + (1.0 - self.y.share(y)) * r.h]
    }

    pub fn all(&self, x: &[f64], y: &[f64]) -> Vec<[f64; 2]> {
        x.iter().zip(y).map(|(x, y)| self.at(*x, *y)).collect()
    }

    pub fn rule(&self, along: Along, at: f64) -> [[f64; 2]; 2] {
        match along {
            Along::X => self.x.ends.map(|x| self.at(x, at)),
            Along::Y => self.y.ends.map(|y| self.at(at, y)),
        }
    }

    /// Draws a point; above or below the panel, an arrow at the edge.
    fn point(&self, d: &mut Drawing, [x, y]: [f64; 2], marker: Marker, c: Rgb, r: f64) {
        let Rect { x: left, y: top, w, h } = self.inside;
        let over = top - 0.5 - y;
        let under = y - (top + h + 0.5);
        if !(left - 0.5..=left + w + 0.5).contains(&x) || y.is_nan() {
            return;
        }
        match (over > 0.0, under > 0.0) {
            (true, _) => point(d, [x, top + 2.0 * r], Marker::Arrow, c, r),
            (_, true) => point(d, [x, top + h - 2.0 * r], Marker::Arrow, c, -r),
            _ => point(d, [x, y], marker, c, r),
        }
    }
}

/// Draws `mark`; `bands`: true for axes with few values.
pub fn draw(d: &mut Drawing, p: &Place, mark: &Mark, bands: [bool; 2]) {
    let clip = Some(p.inside);
    match mark {
        Mark::Line { path, dash, marker } => {
            let points = p.all(&path.x, &path.y);
            d.stroke(open(&points), Stroke::of(scale::of(path.colour), LINE, *dash), clip);
            if let Some(marker) = marker {
                marked(&points).for_each(|at| p.point(d, at, *marker, scale::of(path.colour), DOT));
            }
        }
        Mark::Points { path, marker, error, .. } => {
            let c = scale::of(path.colour);
            for ((x, y), e) in path.x.iter().zip(&path.y).zip(error) {
                let (low, high) = (p.at(*x, y - e), p.at(*x, y + e));
                d.stroke(open(&[low, high]), Stroke::solid(c, 0.6), clip);
            }
            let radius = if path.x.len() > MANY { 0.6 * DOT } else { DOT };
            p.all(&path.x, &path.y).into_iter().for_each(|at| p.point(d, at, *marker, c, radius));
        }
        Mark::Bars { path, among: [which, of] } => {
            let thick = 0.8 * p.inside.h / (p.y.ends[1] - p.y.ends[0]) / *of as f64;
            for (x, y) in path.x.iter().zip(&path.y) {
                let ([x0, middle], [x1, _]) = (p.at(0.0, *y), p.at(*x, *y));
                let top = middle + thick * (*which as f64 - 0.5 * *of as f64);
                let bar = Rect { x: x0.min(x1), y: top, w: (x1 - x0).abs(), h: 0.92 * thick };
                if bar.w.is_finite() {
                    d.fill(bar.steps(), scale::of(path.colour), 1.0, clip);
                }
            }
        }
        Mark::Area { path, outlined } => {
            let (steps, c) = (closed(&p.all(&path.x, &path.y)), scale::of(path.colour));
            d.fill(steps.clone(), c, opacity(*outlined), clip);
            if *outlined {
                d.stroke(steps, Stroke::solid(c, 0.6), clip);
            }
        }
        Mark::Note { .. } => {}
        Mark::Cells(cells) => map(d, p, cells, bands),
        Mark::Rule { along, at, colour: c, dash, .. } => {
            d.stroke(open(&p.rule(*along, *at)), Stroke::of(scale::of(*c), 0.8, *dash), clip);
        }
    }
}

pub fn opacity(outlined: bool) -> f64 {
    if outlined { 0.35 } else { 0.18 }
}

/// Text on a white plate that covers lines below it.
pub fn plated(d: &mut Drawing, [x, y]: [f64; 2], text: &str, size: f64, anchor: Anchor, face: &Face<'_>) {
    let long = length(face, text) * size;
    let plate = Rect { x: x - anchor.share() * long - 0.6, y: y - 0.8 * size, w: long + 1.2, h: size };
    d.fill(plate.steps(), [255; 3], 0.8, None);
    d.text([x, y], text, size, anchor, false);
}

/// Points that get markers: all, or with a minimum distance for long lines.
fn marked(points: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + '_ {
    let apart = if points.len() > CROWD.0 { CROWD.1 } else { 0.0 };
    let mut since = f64::INFINITY;
    (0..points.len()).filter_map(move |i| {
        if i > 0 {
            let by = (points[i][0] - points[i - 1][0]).hypot(points[i][1] - points[i - 1][1]);
            since += if by.is_finite() { by } else { 0.0 };
        }
        (since >= apart).then(|| {
            since = 0.0;
            points[i]
        })
    })
}

/// A map. Axes with few values have gaps between cells; on others, cells overlap slightly to avoid seams.
fn map(d: &mut Drawing, p: &Place, cells: &Cells, bands: [bool; 2]) {
    let shades = Shades::of(cells);
    let columns = cells.x.len() - 1;
    for (k, z) in cells.z.iter().enumerate().filter(|(_, z)| z.is_finite()) {
        let (i, j) = (k % columns, k / columns);
        let ([x0, y0], [x1, y1]) = (p.at(cells.x[i], cells.y[j]), p.at(cells.x[i + 1], cells.y[j + 1]));
        let [(x, w), (y, h)] =
            [(x0, x1 - x0, bands[0]), (y1, y0 - y1, bands[1])].map(|(from, long, band)| {
                let less = if band { BETWEEN * long } else { 0.0 };
                (from + less, if band { long - 2.0 * less } else { long + 0.15 })
            });
        d.fill(Rect { x, y, w, h }.steps(), shades.colour(*z), 1.0, Some(p.inside));
    }
}

/// A marker of size `r` with a white rim.
pub fn point(d: &mut Drawing, at: [f64; 2], marker: Marker, c: Rgb, r: f64) {
    if !at.iter().all(|x| x.is_finite()) {
        return;
    }
    let place = |[u, v]: &[f64; 2]| [at[0] + u * r, at[1] + v * r];
    let rim = Some(Stroke::solid([255; 3], 0.3));
    match marker {
        Marker::Ring => d.path(circle(at, 1.7 * r), None, Some(Stroke::solid(c, 1.2)), 1.0, None),
        Marker::Circle => d.path(circle(at, r), Some(c), rim, 1.0, None),
        _ => {
            let (corners, strokes) = &LOOK.markers[&marker];
            let strokes = strokes.iter().flat_map(|ends| open(&ends.map(|end| place(&end))));
            d.stroke(strokes.collect(), Stroke::solid(c, 1.1), None);
            if !corners.is_empty() {
                let corners: Vec<[f64; 2]> = corners.iter().map(place).collect();
                d.path(closed(&corners), Some(c), rim, 1.0, None);
            }
        }
    }
}

const APART: f64 = 1.5;
/// A note farther from its point than this multiple of the text size has a line to it.
const FAR: f64 = 1.5;

/// A straight segment, pt.
type Piece = [[f64; 2]; 2];

/// Writes the notes of `panel`. Notes without room are left out; caption and page contain them too.
pub fn draw_notes(d: &mut Drawing, panel: &Panel, p: &Place, face: &Face<'_>) {
    let mut taken: Vec<Piece> = panel.marks.iter().flat_map(|m| pieces(m, p)).collect();
    for mark in &panel.marks {
        let Mark::Note { x, y, text } = mark else { continue };
        let (at, size) = (p.at(*x, *y), [length(face, text) * p.size, p.size]);
        let Some(plate) = free(at, size, p.inside, &taken) else { continue };
        let near = nearest(plate, at);
        let gap = (near[0] - at[0]).hypot(near[1] - at[1]);
        if gap > FAR * p.size {
            let from = 1.8 * DOT / gap;
            let begin = [0, 1].map(|k| at[k] + from * (near[k] - at[k]));
            d.stroke(open(&[begin, near]), Stroke::solid(INK, 0.4), None);
        }
        d.text([plate.x, plate.y + 0.8 * p.size], text, p.size, Anchor::Start, false);
        let [x1, y1] = [plate.x + plate.w, plate.y + plate.h];
        taken.extend([[[plate.x, plate.y], [x1, y1]], [[plate.x, y1], [x1, plate.y]]]);
    }
}

fn pieces(mark: &Mark, p: &Place) -> Vec<Piece> {
    let joined = |points: &[[f64; 2]]| -> Vec<Piece> {
        let pairs = points.windows(2).map(|w| [w[0], w[1]]);
        pairs.filter(|w| w.iter().flatten().all(|x| x.is_finite())).collect()
    };
    let crossed = |[x, y]: [f64; 2], r: f64| [r, -r].map(|up| [[x - r, y - up], [x + r, y + up]]);
    match mark {
        Mark::Line { path, marker, .. } => {
            let points = p.all(&path.x, &path.y);
            let dots = points.iter().filter(|_| marker.is_some()).flat_map(|at| crossed(*at, 1.2 * DOT));
            joined(&points).into_iter().chain(dots).collect()
        }
        Mark::Area { path, .. } => {
            let points = p.all(&path.x, &path.y);
            joined(&[&points[..], &points[..points.len().min(1)]].concat())
        }
        Mark::Points { path, marker, error, .. } => {
            let r = if *marker == Marker::Ring { 1.8 * DOT } else { 1.2 * DOT };
            let bars = path.x.iter().zip(&path.y).zip(error);
            let bars = bars.flat_map(|((x, y), e)| joined(&[p.at(*x, y - e), p.at(*x, y + e)]));
            p.all(&path.x, &path.y).into_iter().flat_map(|at| crossed(at, r)).chain(bars).collect()
        }
        Mark::Rule { along, at, .. } => joined(&p.rule(*along, *at)),
        Mark::Bars { .. } | Mark::Cells(_) | Mark::Note { .. } => Vec::new(),
    }
}

/// The free rectangle of `size` nearest to `at`.
fn free(at: [f64; 2], size: [f64; 2], inside: Rect, taken: &[Piece]) -> Option<Rect> {
    let step = 0.5 * size[1];
    let along = |from: f64, long: f64, wide: f64| {
        let count = ((long - wide - 2.0 * APART) / step).floor();
        (0..=count as usize).filter(move |_| count >= 0.0).map(move |i| from + APART + i as f64 * step)
    };
    let mut places: Vec<(f64, Rect)> = along(inside.y, inside.h, size[1])
        .flat_map(|y| along(inside.x, inside.w, size[0]).map(move |x| Rect { x, y, w: size[0], h: size[1] }))
        .map(|plate| {
            let near = nearest(plate, at);
            ((near[0] - at[0]).hypot(near[1] - at[1]), plate)
        })
        .collect();
    places.sort_by(|p, q| p.0.total_cmp(&q.0));
    places.into_iter().map(|p| p.1).find(|plate| !taken.iter().any(|piece| crosses(*plate, piece)))
}

fn nearest(plate: Rect, [x, y]: [f64; 2]) -> [f64; 2] {
    [x.clamp(plate.x, plate.x + plate.w), y.clamp(plate.y, plate.y + plate.h)]
}

/// True if `piece` crosses `plate` or comes nearer than [`APART`] (Liang and Barsky 1984).
fn crosses(plate: Rect, [from, to]: &Piece) -> bool {
    let low = [plate.x - APART, plate.y - APART];
    let high = [plate.x + plate.w + APART, plate.y + plate.h + APART];
    let (mut enters, mut leaves) = (0f64, 1f64);
    for k in 0..2 {
        let by = to[k] - from[k];
        if by == 0.0 {
            if from[k] < low[k] || from[k] > high[k] {
                return false;
            }
            continue;
        }
        let (a, b) = ((low[k] - from[k]) / by, (high[k] - from[k]) / by);
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    enters <= leaves
}
