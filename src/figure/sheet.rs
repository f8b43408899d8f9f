//! A figure on paper: panels in rows, a key below them.

use super::data::{Axis, Cells, Figure, Mark, Panel};
use super::drawing::{Anchor, Drawing, MM, Rect};
use super::font::length;
use super::marks::{self, Place};
use super::scale::Scale;
use super::{Style, axes, colour, key, parallel};

/// Gap between the columns of a paper, mm.
const GUTTER: f64 = 5.0;
/// Height over width of a panel's inside.
const ASPECT: f64 = 0.72;
/// Room of a scale of colours, as a multiple of the text's size.
const SCALE: f64 = 7.0;

/// Lays out `figure`.
pub fn lay(figure: &Figure, style: &Style) -> Drawing {
    let face = style.font.face();
    let size = style.size;
    if let Some(p) = &figure.parallel {
        return parallel::lay(p, style);
    }
    let columns = figure.columns.clamp(1, figure.panels.len().max(1));
    let paper = MM * if columns > 1 { 2.0 * style.width + GUTTER } else { style.width };
    let cell = (paper - 8.0 * (columns - 1) as f64) / columns as f64;
    let scales: Vec<[Scale; 2]> = figure.panels.iter().map(axes::scales).collect();
    let guess = ASPECT * cell;
    let margin = |(p, s): (&Panel, &[Scale; 2])| axes::left(p, &s[1], guess, &face, size);
    let left = figure.panels.iter().zip(&scales).map(margin).fold(0.0, f64::max);
    let right = if figure.panels.iter().any(|p| mapped(p).is_some()) { SCALE * size } else { 1.3 * size };
    let wide = (cell - left - right).max(30.0);
    let title = if figure.panels.iter().any(|p| !p.title.is_empty()) { 1.7 * size } else { 0.6 * size };
    let mut drawing = Drawing { size: [paper, 0.0], items: Vec::new() };
    let mut top = 0.0;
    for row in figure.panels.chunks(columns).zip(scales.chunks(columns)) {
        let high = row.0.iter().zip(row.1).map(|(p, s)| height(p, s, wide)).fold(0.0, f64::max);
        let below = row.0.iter().map(|p| axes::below(p, size)).fold(0.0, f64::max);
        for (i, (panel, scales)) in row.0.iter().zip(row.1).enumerate() {
            let inside = Rect { x: i as f64 * (cell + 8.0) + left, y: top + title, w: wide, h: high };
            one(&mut drawing, panel, inside, *scales, style);
        }
        top += title + high + below + 4.0;
    }
    let entries = key::entries(figure);
    // A single unnamed thing needs no key; a single named one does.
    for row in key::rows(&entries, &face, size, paper - left) {
        let base = top + 1.1 * size;
        row.iter().for_each(|(x, entry)| key::draw(&mut drawing, entry, [left + x, base], size));
        top += 1.55 * size;
    }
    drawing.size[1] = top + 3.0;
    drawing
}

/// The map of a panel.
fn mapped(panel: &Panel) -> Option<&Cells> {
    panel.marks.iter().find_map(|m| if let Mark::Cells(c) = m { Some(c) } else { None })
}

fn height(panel: &Panel, [x, y]: &[Scale; 2], wide: f64) -> f64 {
    let words = panel.y.words.len() as f64;
    match panel.to_scale {
        true => (wide * (y.ends[1] - y.ends[0]) / (x.ends[1] - x.ends[0])).clamp(0.2 * wide, 2.0 * wide),
        false => (ASPECT * wide).max(11.0 * words),
    }
}

fn one(d: &mut Drawing, panel: &Panel, inside: Rect, [x, mut y]: [Scale; 2], style: &Style) {
    let face = style.font.face();
    if panel.to_scale {
        // Rows may be higher than this panel asks: what is more goes to both ends.
        let each = (x.ends[1] - x.ends[0]) / inside.w;
        let more = 0.5 * (each * inside.h - (y.ends[1] - y.ends[0]));
        y.ends = [y.ends[0] - more, y.ends[1] + more];
    }
    let place = Place { inside, x, y, size: 0.85 * style.size };
    axes::draw(d, panel, &place, &face, style.size);
    panel.marks.iter().for_each(|m| marks::draw(d, &place, m));
    axes::edge(d, inside);
    let title = fitted(&panel.title, inside.w + 0.1 * inside.x, |t| length(&face, t) * style.size);
    d.text(
        [inside.x + 0.5 * inside.w, inside.y - 0.5 * style.size],
        title,
        style.size,
        Anchor::Middle,
        false,
    );
    if let Some(cells) = mapped(panel) {
        let scale = Scale::tight(&cells.of, cells.z.iter().copied());
        beside(d, &cells.of, &scale, inside, style);
    }
}

/// What of `text` fits.
fn fitted(text: &str, room: f64, long: impl Fn(&str) -> f64) -> String {
    let mut text = text.to_owned();
    let whole = long(&text) <= room;
    while !text.is_empty() && long(&text) > room - if whole { 0.0 } else { long("…") } {
        text.pop();
    }
    if whole { text } else { text + "…" }
}

/// Scale of colours right of a map.
fn beside(d: &mut Drawing, of: &Axis, scale: &Scale, inside: Rect, style: &Style) {
    const STEPS: usize = 64;
    let size = style.size;
    let bar = Rect { x: inside.x + inside.w + 0.7 * size, y: inside.y, w: 0.8 * size, h: inside.h };
    for i in 0..STEPS {
        let share = (i as f64 + 0.5) / STEPS as f64;
        let h = bar.h / STEPS as f64;
        let step = Rect { y: bar.y + bar.h - (i + 1) as f64 * h - 0.1, h: h + 0.2, ..bar };
        d.fill(step.steps(), colour::along(share), 1.0, Some(bar));
    }
    axes::edge(d, bar);
    let face = style.font.face();
    let (named, _) = axes::ticks(of, scale, bar.h, size, true);
    let mut widest = 0f64;
    for (value, words) in named {
        let at = bar.y + (1.0 - scale.share(value)) * bar.h;
        widest = widest.max(length(&face, &words) * 0.9 * size);
        d.text([bar.x + bar.w + 2.5, at + 0.32 * size], words, 0.9 * size, Anchor::Start, false);
    }
    let x = (bar.x + bar.w + 3.0 + widest + size).min(inside.x + inside.w + SCALE * size);
    d.text([x, bar.y + 0.5 * bar.h], of.text(), 0.9 * size, Anchor::Middle, true);
}
