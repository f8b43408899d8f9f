//! Draws parallel coordinates.

use super::axes::LEADING;
use super::colour::Shades;
use super::colour::{INK, MUTED, along};
use super::data::Parallel;
use super::drawing::{Anchor, Drawing, MM, Rect, Stroke, open};
use super::font::{length, lines};
use super::key::Entry;
use super::scale::Scale;
use super::{Style, key, marks};

/// Least height of an axis, as a multiple of the text size.
const LEAST: f64 = 14.0;

pub fn lay(p: &Parallel, style: &Style) -> Drawing {
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
    let broken = |room: f64| -> Vec<Vec<String>> {
        p.axes.iter().map(|a| lines(&face, &a.label, (room - 4.0) / size)).collect()
    };
    let fits = |all: &[Vec<String>]| all.iter().flatten().all(|l| length(&face, l) * size <= gap - 4.0);
    let mut labels = broken(gap);
    let most = |all: &[Vec<String>]| all.iter().map(Vec::len).max().unwrap_or(0) as f64;
    // If labels are longer than the gap, every second label is raised.
    let (mut raised, mut stacks) = (0.0, 1.0);
    if !fits(&labels) {
        labels = broken(2.0 * gap);
        (raised, stacks) = ((LEADING * most(&labels) + 1.2) * size, 2.0);
    }
    let top = (0.8 + stacks * (1.2 + LEADING * most(&labels))) * size;
    let high = (MM * 0.8 * style.width - top - bottom).max(LEAST * size);
    let last = left + gap * (p.axes.len().max(2) - 1) as f64;
    let h = top + high + bottom;
    let mut d = Drawing { size: [w, h], items: Vec::new() };
    let at = |k: usize, x: f64| [left + k as f64 * gap, top + (1.0 - scales[k].share(x)) * high];
    let muted = |i: usize| p.muted[i] || !colours.share(p.values[i][p.colour]).is_finite();
    // Draw muted rows first, and the best (dark) rows last.
    let mut order: Vec<usize> = (0..p.values.len()).collect();
    order.sort_by(|a, b| {
        let key = |i: &usize| (!muted(*i), -p.values[*i][p.colour]);
        key(a).0.cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1))
    });
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
        let entry = Entry::line(&p.why, MUTED);
        d.size[1] = key::draw(&mut d, &[entry], [left, h], w, &face, size) + 3.0;
    }
    d.size[0] = w.max(last + right);
    d
}
