//! Lays out a figure: panels in rows, or parallel coordinates, the key below.

use ttf_parser::Face;

use super::axes::{self, LEADING};
use super::key::{self, Entry};
use super::marks::{self, Place};
use super::scale::{INK, MUTED, Shades, along};
use super::{Anchor, Drawing, Figure, MM, Panel, Parallel, Rect, Scale, Stroke, Style, length, lines, open};

const GUTTER: f64 = 5.0;
const GAP: f64 = 8.0;
/// Height over width of a panel's inside.
const ASPECT: f64 = 0.72;
/// Largest factor on the height for long titles.
const TALL: f64 = 1.3;
/// Least width of one of several panels, as a multiple of the text size.
const BESIDE: f64 = 8.0;
/// Least width of any panel, likewise.
const LEAST: f64 = 4.0;

pub fn lay(figure: &Figure, style: &Style) -> Drawing {
    let face = style.font.face();
    let size = style.size;
    if let Some(p) = &figure.parallel {
        return parallel(p, style);
    }
    let columns = figure.columns.clamp(1, figure.panels.len().max(1));
    let paper = MM * if columns > 1 { 2.0 * style.width + GUTTER } else { style.width };
    let panels: Vec<(&Panel, [Scale; 2])> = figure.panels.iter().map(|p| (p, axes::scales(p))).collect();
    let titled = |t: &Table| panels.iter().all(|(p, _)| length(&face, &p.x.text()) * size <= t.cell);
    let table = (1..=columns)
        .rev()
        .map(|n| Table::of(&panels, n, paper, &face, size))
        .find(|t| t.columns == 1 || t.wide >= BESIDE * size && titled(t))
        .expect("one column is taken as it is");
    let paper = paper.max(table.left + table.wide + table.right);
    let mut drawing = Drawing { size: [paper, 0.0], items: Vec::new() };
    let mut top = 0.0;
    for (row, room) in panels.chunks(table.columns).zip(&table.rows) {
        for (i, (panel, scales)) in row.iter().enumerate() {
            let from = i as f64 * (table.cell + GAP);
            let inside = Rect { x: from + table.left, y: top + room.title, w: table.wide, h: room.high };
            one(&mut drawing, panel, inside, [from, from + table.cell], *scales, style);
        }
        top += room.title + room.high + room.below + 4.0;
    }
    top = key::draw(&mut drawing, &key::entries(figure), [table.left, top], paper, style);
    drawing.size[1] = top + 3.0;
    drawing
}

/// Heights of a row of panels, pt.
struct Row {
    title: f64,
    high: f64,
    below: f64,
}

/// Columns of equal width and margins, pt.
struct Table {
    columns: usize,
    cell: f64,
    left: f64,
    wide: f64,
    right: f64,
    rows: Vec<Row>,
}

impl Table {
    /// Margins depend on heights (ticks, broken titles) and heights on margins: iterates until they fit.
    fn of(panels: &[(&Panel, [Scale; 2])], columns: usize, paper: f64, face: &Face<'_>, size: f64) -> Self {
        let cell = (paper - GAP * (columns - 1) as f64) / columns as f64;
        let (mut left, mut right) = (0f64, 1.3 * size);
        loop {
            let wide = (cell - left - right).max(LEAST * size);
            let rows = panels.chunks(columns).map(|row| stacked(row, cell, wide, face, size));
            let rows: Vec<Row> = rows.collect();
            let (mut more_left, mut more_right) = (left, right);
            for (row, room) in panels.chunks(columns).zip(&rows) {
                for (panel, [_, y]) in row {
                    more_left = more_left.max(axes::left(panel, y, room.high, face, size));
                    if let Some(cells) = panel.map() {
                        let bar = key::bar_width(&cells.of, &Shades::of(cells), room.high, face, size);
                        more_right = more_right.max(bar);
                    }
                }
            }
            if more_left <= left && more_right <= right {
                return Self { columns, cell, left, wide, right, rows };
            }
            (left, right) = (more_left, more_right);
        }
    }
}

fn stacked(row: &[(&Panel, [Scale; 2])], cell: f64, wide: f64, face: &Face<'_>, size: f64) -> Row {
    let most =
        |of: &dyn Fn(&Panel, &[Scale; 2]) -> f64| row.iter().map(|(p, s)| of(p, s)).fold(0.0, f64::max);
    let named = most(&|p, _| lines(face, &p.title, cell / size).len() as f64);
    Row {
        title: if named > 0.0 { 1.7 + LEADING * (named - 1.0) } else { 0.6 } * size,
        high: most(&|p, s| height(p, s, wide, face, size)),
        below: most(&|p, _| axes::below(p, cell, face, size)),
    }
}

/// Height of a panel; more for a long title of the y axis, within bounds.
fn height(panel: &Panel, [x, y]: &[Scale; 2], wide: f64, face: &Face<'_>, size: f64) -> f64 {
    if panel.to_scale {
        return (wide * (y.ends[1] - y.ends[0]) / (x.ends[1] - x.ends[0])).clamp(0.2 * wide, 2.0 * wide);
    }
    let bar = panel.map().map_or(0.0, |c| key::TEXT * length(face, &c.of.text()));
    let titles = length(face, &panel.y.text()).max(bar) * size + 0.01;
    let words = panel.y.words.len() as f64;
    (ASPECT * wide).max(titles.min(TALL * wide)).max(11.0 * words)
}

fn one(d: &mut Drawing, panel: &Panel, inside: Rect, cell: [f64; 2], scales: [Scale; 2], style: &Style) {
    let ([mut x, mut y], face, size) = (scales, style.font.face(), style.size);
    if panel.to_scale {
        let each = f64::max((x.ends[1] - x.ends[0]) / inside.w, (y.ends[1] - y.ends[0]) / inside.h);
        for (scale, long) in [(&mut x, inside.w), (&mut y, inside.h)] {
            let more = 0.5 * (each * long - (scale.ends[1] - scale.ends[0]));
            scale.ends = [scale.ends[0] - more, scale.ends[1] + more];
        }
    }
    let place = Place { inside, x, y, size: 0.85 * size };
    axes::draw(d, panel, &place, cell, &face, size);
    let bands = [&panel.x, &panel.y].map(|axis| !axis.words.is_empty());
    panel.marks.iter().for_each(|m| marks::draw(d, &place, m, bands));
    marks::draw_notes(d, panel, &place, &face);
    axes::edge(d, inside);
    let room = cell[1] - cell[0];
    let title = lines(&face, &panel.title, room / size);
    for (i, line) in title.iter().rev().enumerate() {
        let line = fitted(line, room, |t| length(&face, t) * size);
        let half = 0.5 * length(&face, &line) * size;
        let middle = (inside.x + 0.5 * inside.w).min(cell[1] - half).max(cell[0] + half);
        let base = inside.y - 0.5 * size - i as f64 * LEADING * size;
        d.text([middle, base], line, size, Anchor::Middle, false);
    }
    if let Some(cells) = panel.map() {
        key::draw_bar(d, &cells.of, &Shades::of(cells), inside, &face, size);
    }
}

fn fitted(text: &str, room: f64, long: impl Fn(&str) -> f64) -> String {
    let mut text = text.to_owned();
    let whole = long(&text) <= room;
    while !text.is_empty() && long(&text) > room - if whole { 0.0 } else { long("…") } {
        text.pop();
    }
    if whole { text } else { text + "…" }
}

/// Least height of an axis, as a multiple of the text size.
const LEAST_HIGH: f64 = 14.0;

pub fn parallel(p: &Parallel, style: &Style) -> Drawing {
    let (face, size) = (style.font.face(), style.size);
    let w = MM * (2.0 * style.width + 5.0);
    let values = |k: usize| p.values.iter().map(move |row| row[k]);
    let scales: Vec<Scale> = p.axes.iter().enumerate().map(|(k, a)| Scale::of(a, values(k))).collect();
    let by = &p.axes[p.colour];
    let kept = values(p.colour).zip(&p.muted).filter(|(_, muted)| !**muted).map(|(x, _)| x);
    let colours = Scale::tight(by, kept);
    let shades = Shades::Scale(colours);
    let (left, bottom) = (4.0 * size, 1.2 * size);
    // Labels of the last axis extend beyond it.
    let right = 2.5 * size + key::bar_width(by, &shades, MM * 0.5 * style.width, &face, size);
    let gap = ((w - left - right) / (p.axes.len().max(2) - 1) as f64).max(2.0 * size);
    let broken = |room: f64| p.axes.iter().map(|a| lines(&face, &a.label, (room - 4.0) / size)).collect();
    let fits = |all: &[Vec<String>]| all.iter().flatten().all(|l| length(&face, l) * size <= gap - 4.0);
    let mut labels: Vec<Vec<String>> = broken(gap);
    let most = |all: &[Vec<String>]| all.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let (mut raised, mut stacks) = (0.0, 1.0);
    if !fits(&labels) {
        labels = broken(2.0 * gap);
        (raised, stacks) = ((LEADING * most(&labels) + 1.2) * size, 2.0);
    }
    let top = (0.8 + stacks * (1.2 + LEADING * most(&labels))) * size;
    let high = (MM * 0.8 * style.width - top - bottom).max(LEAST_HIGH * size);
    let last = left + gap * (p.axes.len().max(2) - 1) as f64;
    let h = top + high + bottom;
    let mut d = Drawing { size: [w, h], items: Vec::new() };
    let at = |k: usize, x: f64| [left + k as f64 * gap, top + (1.0 - scales[k].share(x)) * high];
    let muted = |i: usize| p.muted[i] || !colours.share(p.values[i][p.colour]).is_finite();
    let mut order: Vec<usize> = (0..p.values.len()).collect();
    order.sort_by(|a, b| p.values[*b][p.colour].total_cmp(&p.values[*a][p.colour]));
    // Muted rows first, so that the best lie on top.
    order.sort_by_key(|i| !muted(*i));
    for i in order {
        let points: Vec<[f64; 2]> = p.values[i].iter().enumerate().map(|(k, x)| at(k, *x)).collect();
        let colour = if muted(i) { MUTED } else { along(colours.share(p.values[i][p.colour])) };
        d.stroke(open(&points), Stroke::solid(colour, 0.5), None);
    }
    let wanted = ((high / (2.0 * size)) as usize).clamp(3, 6);
    for (k, (axis, scale)) in p.axes.iter().zip(&scales).enumerate() {
        let x = at(k, scale.ends[0])[0];
        d.stroke(open(&[[x, top], [x, h - bottom]]), Stroke::solid(INK, 0.8), None);
        let foot = top - if k % 2 == 1 { raised } else { 0.0 };
        for (i, line) in labels[k].iter().rev().enumerate() {
            let base = foot - (1.7 + LEADING * i as f64) * size;
            d.text([x, base], line.clone(), size, Anchor::Middle, false);
        }
        let unit = if axis.unit.is_empty() { String::new() } else { format!("({})", axis.unit) };
        d.text([x, foot - 0.6 * size], unit, 0.9 * size, Anchor::Middle, false);
        for (value, words) in scale.ticks(wanted).0 {
            let [x, y] = at(k, value);
            d.stroke(open(&[[x - 2.5, y], [x, y]]), Stroke::solid(INK, 0.6), None);
            marks::plated(&mut d, [x - 3.5, y + 0.3 * size], &words, 0.85 * size, Anchor::End, &face);
        }
    }
    let beside = Rect { x: left, y: top, w: last - left + 1.5 * size, h: high };
    key::draw_bar(&mut d, by, &shades, beside, &face, size);
    if (0..p.values.len()).any(muted) {
        let entry = Entry { name: p.why.clone(), line: Some((MUTED, 0)), ..Entry::default() };
        d.size[1] = key::draw(&mut d, &[entry], [left, h], w, style) + 3.0;
    }
    d.size[0] = w.max(last + right);
    d
}
