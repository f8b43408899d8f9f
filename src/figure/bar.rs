//! The scale of colours beside a map or a bundle of lines.

use ttf_parser::Face;

use super::axes::{self, LEADING};
use super::colour;
use super::data::Axis;
use super::drawing::{Anchor, Drawing, Rect};
use super::font::{length, lines};
use super::scale::value;
use super::shades::Shades;

/// Gap before it, as a multiple of the text's size.
const GAP: f64 = 0.7;
/// Its width, likewise.
const WIDE: f64 = 0.8;
/// Size of its text, likewise.
pub const TEXT: f64 = 0.9;
/// Steps of colour.
const STEPS: usize = 64;

/// Its numbers: share of the height, words.
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

/// Length of the longest of them, pt.
fn longest(numbers: &[(f64, String)], face: &Face<'_>, size: f64) -> f64 {
    numbers.iter().map(|(_, words)| length(face, words) * TEXT * size).fold(0.0, f64::max)
}

/// Width that it takes beside something that is `high`, pt.
pub fn width(of: &Axis, shades: &Shades, high: f64, face: &Face<'_>, size: f64) -> f64 {
    let numbers = longest(&numbers(of, shades, high, size), face, size);
    let title = lines(face, &of.text(), high / (TEXT * size)).len() as f64;
    (GAP + WIDE) * size + 3.0 + numbers + (title * LEADING + 0.3) * TEXT * size
}

/// Draws it right of `inside`.
pub fn draw(d: &mut Drawing, of: &Axis, shades: &Shades, inside: Rect, face: &Face<'_>, size: f64) {
    let bar = Rect { x: inside.x + inside.w + GAP * size, y: inside.y, w: WIDE * size, h: inside.h };
    // Bands have gaps between them, steps of a scale overlap by a hair.
    let (steps, more) = match shades {
        Shades::Scale(_) => (STEPS, 0.1),
        Shades::Bands(all) => (all.len(), -1.0),
    };
    for i in 0..steps {
        let h = bar.h / steps as f64;
        let step = Rect { y: bar.y + bar.h - (i + 1) as f64 * h - more, h: h + 2.0 * more, ..bar };
        let colour = match shades {
            Shades::Scale(_) => colour::along((i as f64 + 0.5) / steps as f64),
            Shades::Bands(all) => shades.colour(all[i]),
        };
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
