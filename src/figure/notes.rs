//! Words in a panel: as near to their point as there is room, and on nothing that is drawn.

use ttf_parser::Face;

use super::colour::INK;
use super::data::{Along, Mark, Marker, Panel};
use super::drawing::{Anchor, Drawing, Rect, Stroke, open};
use super::font::length;
use super::marks::{DOT, Place};

/// Free space around words, pt.
const APART: f64 = 1.5;
/// Words farther from their point than so many of their sizes have a line to it.
const FAR: f64 = 1.5;

/// A straight piece of what is drawn, pt.
type Piece = [[f64; 2]; 2];

/// Writes the notes of `panel`. Words without room are left out: the caption and the page say them too.
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

/// What `mark` covers.
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
        Mark::Rule { along, at, .. } => {
            let ([x0, x1], [y0, y1]) = (p.x.ends, p.y.ends);
            joined(&match along {
                Along::X => [p.at(x0, *at), p.at(x1, *at)],
                Along::Y => [p.at(*at, y0), p.at(*at, y1)],
            })
        }
        Mark::Bars { .. } | Mark::Cells(_) | Mark::Note { .. } => Vec::new(),
    }
}

/// The place of `size` inside of `inside` that is nearest to `at` and free of `taken`.
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

/// The point of `plate` that is nearest to `at`.
fn nearest(plate: Rect, [x, y]: [f64; 2]) -> [f64; 2] {
    [x.clamp(plate.x, plate.x + plate.w), y.clamp(plate.y, plate.y + plate.h)]
}

/// Whether `piece` goes through `plate` or nearer to it than [`APART`] (Liang and Barsky 1984).
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

#[cfg(test)]
mod tests {
    use super::super::data::{Axis, Figure, Path};
    use super::super::drawing::{Item, Step};
    use super::super::font::Font;
    use super::super::{Style, sheet};
    use super::*;

    /// Places on the lines of data that are drawn, four to the point of paper.
    fn on_lines(d: &Drawing) -> Vec<[f64; 2]> {
        let mut all = Vec::new();
        for item in &d.items {
            let Item::Path { steps, stroke: Some(_), clip: Some(_), .. } = item else { continue };
            let mut last = [f64::NAN; 2];
            for step in steps {
                let next = match step {
                    Step::To(p) | Step::Line(p) => *p,
                    _ => continue,
                };
                let long = (next[0] - last[0]).hypot(next[1] - last[1]);
                if matches!(step, Step::Line(_)) {
                    let n = (4.0 * long).ceil();
                    all.extend(
                        (0..=n as usize)
                            .map(|i| [0, 1].map(|k| last[k] + (next[k] - last[k]) * i as f64 / n)),
                    );
                }
                last = next;
            }
        }
        all
    }

    #[test]
    fn words_lie_on_no_curve() {
        let mut written = 0;
        for case in 0..40 {
            let wave =
                |i: usize, x: f64| (x * (1.0 + 0.3 * case as f64) + 2.0 * i as f64).sin() + 0.4 * i as f64;
            let curve = |i: usize| (0..200).map(move |k| f64::from(k) / 20.0).map(move |x| (x, wave(i, x)));
            let x = 0.25 * f64::from(case);
            let mut panel = Panel::new("", Axis::new("x", ""), Axis::new("y", "")).with(Mark::Rule {
                along: Along::Y,
                at: x,
                name: String::new(),
                colour: 7,
                dash: 2,
            });
            for i in 0..3 {
                panel = panel
                    .with(Mark::line(Path::new(i.to_string(), i, curve(i)), 0))
                    .with(Mark::points(Path::new("", 4, [(x, wave(i, x))]), Marker::Ring))
                    .with(Mark::Note { x, y: wave(i, x), text: format!("θ = {x}° of {i}") });
            }
            for (width, size, n) in [(88.0, 8.0, 1), (60.0, 12.0, 1), (88.0, 8.0, 4)] {
                let style = Style { width, size, font: Font::built_in() };
                let d = sheet::lay(&Figure::new("f", "F", "", vec![panel.clone(); n]), &style);
                let lines = on_lines(&d);
                assert!(lines.len() > 1000);
                for item in &d.items {
                    let Item::Text { at: [x, y], text, size, .. } = item else { continue };
                    if text.starts_with('θ') {
                        let long = length(&style.font.face(), text) * size;
                        let under = |p: &&[f64; 2]| {
                            (*x..*x + long).contains(&p[0])
                                && (y - 0.8 * size..y + 0.2 * size).contains(&p[1])
                        };
                        assert_eq!(
                            lines.iter().find(under),
                            None,
                            "{text} at {x} {y}, {width} mm, case {case}"
                        );
                        written += 1;
                    }
                }
            }
        }
        // Of 40 × 3 × 6 words nearly all have room.
        assert!(written > 600, "{written}");
    }
}
