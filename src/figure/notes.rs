//! Notes in a panel: as near to their point as possible without covering data.

use ttf_parser::Face;

use super::colour::INK;
use super::data::{Mark, Marker, Panel};
use super::drawing::{Anchor, Drawing, Rect, Stroke, open};
use super::font::length;
use super::marks::{DOT, Place};

const APART: f64 = 1.5;
/// A note farther from its point than this multiple of the text size has a line to it.
const FAR: f64 = 1.5;

/// A straight segment, pt.
type Piece = [[f64; 2]; 2];

/// Writes the notes of `panel`. Notes without room are left out; caption and page contain them too.
pub fn draw(d: &mut Drawing, panel: &Panel, p: &Place, face: &Face<'_>) {
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
        points
            .windows(2)
            .map(|w| [w[0], w[1]])
            .filter(|w| w.iter().flatten().all(|x| x.is_finite()))
            .collect()
    };
    let crossed =
        |[x, y]: [f64; 2], r: f64| [[[x - r, y - r], [x + r, y + r]], [[x - r, y + r], [x + r, y - r]]];
    match mark {
        Mark::Line { path, marker, .. } => {
            let points = p.all(&path.x, &path.y);
            let dots = points.iter().filter(|_| marker.is_some()).flat_map(|at| crossed(*at, 1.2 * DOT));
            joined(&points).into_iter().chain(dots).collect()
        }
        Mark::Area { path, .. } => {
            let mut points = p.all(&path.x, &path.y);
            points.extend(points.first().copied());
            joined(&points)
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
