//! The scale of colours beside a map or a bundle of lines.

use ttf_parser::Face;

use super::axes::{self, LEADING};
use super::colour;
use super::data::Axis;
use super::drawing::{Anchor, Drawing, Rect};
use super::font::{length, lines};
use super::scale::Scale;

/// Gap before it, as a multiple of the text's size.
const GAP: f64 = 0.7;
/// Its width, likewise.
const WIDE: f64 = 0.8;
/// Size of its text, likewise.
pub const TEXT: f64 = 0.9;
/// Steps of colour.
const STEPS: usize = 64;

/// Length of the longest of its numbers, pt.
fn numbers(of: &Axis, scale: &Scale, high: f64, face: &Face<'_>, size: f64) -> f64 {
    let (named, _) = axes::ticks(of, scale, high, size, true);
    named.iter().map(|(_, words)| length(face, words) * TEXT * size).fold(0.0, f64::max)
}

/// Width that it takes beside something that is `high`, pt.
pub fn width(of: &Axis, scale: &Scale, high: f64, face: &Face<'_>, size: f64) -> f64 {
    let title = lines(face, &of.text(), high / (TEXT * size)).len() as f64;
    (GAP + WIDE) * size + 3.0 + numbers(of, scale, high, face, size) + (title * LEADING + 0.3) * TEXT * size
}

/// Draws it right of `inside`.
pub fn draw(d: &mut Drawing, of: &Axis, scale: &Scale, inside: Rect, face: &Face<'_>, size: f64) {
    let bar = Rect { x: inside.x + inside.w + GAP * size, y: inside.y, w: WIDE * size, h: inside.h };
    for i in 0..STEPS {
        let share = (i as f64 + 0.5) / STEPS as f64;
        let h = bar.h / STEPS as f64;
        let step = Rect { y: bar.y + bar.h - (i + 1) as f64 * h - 0.1, h: h + 0.2, ..bar };
        d.fill(step.steps(), colour::along(share), 1.0, Some(bar));
    }
    axes::edge(d, bar);
    let small = TEXT * size;
    for (value, words) in axes::ticks(of, scale, bar.h, size, true).0 {
        let at = bar.y + (1.0 - scale.share(value)) * bar.h;
        d.text([bar.x + bar.w + 2.5, at + 0.32 * size], words, small, Anchor::Start, false);
    }
    let first = bar.x + bar.w + 3.0 + numbers(of, scale, bar.h, face, size) + LEADING * small;
    for (i, line) in lines(face, &of.text(), bar.h / small).into_iter().enumerate() {
        let at = [first + i as f64 * LEADING * small, bar.y + 0.5 * bar.h];
        d.text(at, line, small, Anchor::Middle, true);
    }
}
