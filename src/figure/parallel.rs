//! Parallel coordinates on paper.

use super::Style;
use super::colour::{INK, MUTED, along};
use super::data::Parallel;
use super::drawing::{Anchor, Drawing, MM, Stroke, open};
use super::scale::Scale;

/// Two columns of the paper wide.
pub fn lay(p: &Parallel, style: &Style) -> Drawing {
    let size = style.size;
    let [w, h] = [MM * (2.0 * style.width + 5.0), MM * 0.8 * style.width];
    let mut d = Drawing { size: [w, h], items: Vec::new() };
    let values = |k: usize| p.values.iter().map(move |row| row[k]);
    let scales: Vec<Scale> = p.axes.iter().enumerate().map(|(k, a)| Scale::of(a, values(k))).collect();
    let (left, right, top, bottom) = (3.0 * size, 4.0 * size, 3.2 * size, 1.2 * size);
    let gap = (w - left - right) / (p.axes.len().max(2) - 1) as f64;
    let at =
        |k: usize, x: f64| [left + k as f64 * gap, top + (1.0 - scales[k].share(x)) * (h - top - bottom)];
    let by =
        Scale::tight(&p.axes[p.colour], values(p.colour).zip(&p.muted).filter(|(_, m)| !**m).map(|(x, _)| x));
    // What is muted lies below, and of the rest the best, which are dark, on top.
    let mut order: Vec<usize> = (0..p.values.len()).collect();
    order.sort_by(|a, b| {
        let key = |i: &usize| (!p.muted[*i], -p.values[*i][p.colour]);
        key(a).0.cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1))
    });
    for i in order {
        let points: Vec<[f64; 2]> = p.values[i].iter().enumerate().map(|(k, x)| at(k, *x)).collect();
        let colour = if p.muted[i] { MUTED } else { along(by.share(p.values[i][p.colour])) };
        d.stroke(open(&points), Stroke::solid(colour, 0.5), None);
    }
    for (k, (axis, scale)) in p.axes.iter().zip(&scales).enumerate() {
        let x = at(k, scale.ends[0])[0];
        d.stroke(open(&[[x, top], [x, h - bottom]]), Stroke::solid(INK, 0.8), None);
        d.text([x, top - 1.7 * size], axis.label.clone(), size, Anchor::Middle, false);
        let unit = if axis.unit.is_empty() { String::new() } else { format!("({})", axis.unit) };
        d.text([x, top - 0.6 * size], unit, 0.9 * size, Anchor::Middle, false);
        for (value, words) in scale.ticks(6).0 {
            let [x, y] = at(k, value);
            d.stroke(open(&[[x, y], [x + 2.5, y]]), Stroke::solid(INK, 0.6), None);
            d.text([x + 3.5, y + 0.32 * size], words, 0.85 * size, Anchor::Start, false);
        }
    }
    d
}
