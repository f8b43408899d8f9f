//! Axes of a panel: space for their labels; lines, ticks and labels.

use ttf_parser::Face;

use super::marks::Place;
use super::scale::{FAINT, INK};
use super::{Anchor, Axis, Drawing, Mark, Panel, Rect, Scale, Stroke, length, lines, open};

pub const LEADING: f64 = 1.15;

/// Labelled ticks, and small ones.
type Ticks = (Vec<(f64, String)>, Vec<f64>);

pub fn scales(panel: &Panel) -> [Scale; 2] {
    let reach: Vec<[f64; 2]> = panel.marks.iter().flat_map(Mark::reach).map(Into::into).collect();
    [(&panel.x, 0), (&panel.y, 1)].map(|(axis, k)| {
        let values = reach.iter().map(|p| p[k]);
        if panel.map().is_some() { Scale::tight(axis, values) } else { Scale::of(axis, values) }
    })
}

pub fn ticks(axis: &Axis, scale: &Scale, long: f64, size: f64, upright: bool) -> Ticks {
    if !axis.words.is_empty() {
        return (axis.words.iter().enumerate().map(|(i, w)| (i as f64, w.clone())).collect(), Vec::new());
    }
    let each = if upright { 1.8 * size } else { 3.6 * size };
    scale.ticks(((long / each) as usize).clamp(3, 8))
}

fn stacked(count: usize, size: f64) -> f64 {
    if count == 0 { 0.0 } else { (1.5 + LEADING * (count - 1) as f64) * size }
}

/// Width of the labels left of a panel, pt.
pub fn left(panel: &Panel, y: &Scale, high: f64, face: &Face<'_>, size: f64) -> f64 {
    let (named, _) = ticks(&panel.y, y, high, size, true);
    let longest = named.iter().map(|(_, w)| length(face, w) * size).fold(0.0, f64::max);
    longest + stacked(lines(face, &panel.y.text(), high / size).len(), size) + 7.0
}

/// Height of the labels below a panel of width `wide`, pt.
pub fn below(panel: &Panel, wide: f64, face: &Face<'_>, size: f64) -> f64 {
    stacked(lines(face, &panel.x.text(), wide / size).len(), size) + words_below(panel, size) + 5.0
}

fn turned(panel: &Panel) -> bool {
    panel.x.words.len() > 6
}

fn words_below(panel: &Panel, size: f64) -> f64 {
    if turned(panel) { 6.0 * size } else { 1.3 * size }
}

/// Draws grid and ticks, below the data. Labels below the panel stay within `cell`, the ends of its column.
pub fn draw(d: &mut Drawing, panel: &Panel, p: &Place, cell: [f64; 2], face: &Face<'_>, size: f64) {
    let Rect { x, y, w, h } = p.inside;
    let mapped = panel.map().is_some();
    let (across, small_x) = ticks(&panel.x, &p.x, w, size, false);
    let (up, small_y) = ticks(&panel.y, &p.y, h, size, true);
    let (thin, faint) = (Stroke::solid(INK, 0.6), Stroke::solid(FAINT, 0.5));
    let (mut widest, mut last) = (0f64, f64::NEG_INFINITY);
    for (value, words) in &across {
        let at = p.at(*value, p.y.ends[0])[0];
        if !mapped {
            d.stroke(open(&[[at, y], [at, y + h]]), faint, None);
        }
        d.stroke(open(&[[at, y + h], [at, y + h + 2.5]]), thin, None);
        let long = length(face, words) * size;
        if turned(panel) {
            d.text([at + 0.35 * size, y + h + 4.5], words.clone(), 0.85 * size, Anchor::End, true);
        } else if at - 0.5 * long > last + 2.0 {
            d.text([at, y + h + 4.0 + 0.8 * size], words.clone(), size, Anchor::Middle, false);
            last = at + 0.5 * long;
        }
    }
    for (value, words) in &up {
        let at = p.at(p.x.ends[0], *value)[1];
        if !mapped {
            d.stroke(open(&[[x, at], [x + w, at]]), faint, None);
        }
        d.stroke(open(&[[x - 2.5, at], [x, at]]), thin, None);
        d.text([x - 4.5, at + 0.35 * size], words.clone(), size, Anchor::End, false);
        widest = widest.max(length(face, words) * size);
    }
    let small_x = small_x.iter().map(|value| p.at(*value, p.y.ends[0])[0]);
    let small_y = small_y.iter().map(|value| p.at(p.x.ends[0], *value)[1]);
    let small = small_x.map(|at| [[at, y + h], [at, y + h + 1.4]]);
    let small = small.chain(small_y.map(|at| [[x - 1.4, at], [x, at]]));
    small.for_each(|ends| d.stroke(open(&ends), Stroke::solid(INK, 0.4), None));
    let mut base = y + h + 4.0 + words_below(panel, size) + size;
    for line in lines(face, &panel.x.text(), (cell[1] - cell[0]) / size) {
        let half = 0.5 * length(face, &line) * size;
        let middle = (x + 0.5 * w).min(cell[1] - half).max(cell[0] + half);
        d.text([middle, base], line, size, Anchor::Middle, false);
        base += LEADING * size;
    }
    let lines = lines(face, &panel.y.text(), h / size);
    let mut beside = x - 6.5 - widest - 0.35 * size - LEADING * size * lines.len().saturating_sub(1) as f64;
    for line in lines {
        d.text([beside, y + 0.5 * h], line, size, Anchor::Middle, true);
        beside += LEADING * size;
    }
}

pub fn edge(d: &mut Drawing, inside: Rect) {
    d.stroke(inside.steps(), Stroke::solid(INK, 0.6), None);
}
