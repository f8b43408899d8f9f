//! Writes a drawing as SVG. Text stays text.

use std::fmt::Write;

use super::scale::{INK, css};
use super::{Drawing, Figure, Font, Item, Rect, Step};

pub fn write(drawing: &Drawing, font: &Font, figure: &Figure) -> String {
    let [w, h] = drawing.size;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w:.2}pt\" height=\"{h:.2}pt\" viewBox=\"0 0 {w:.2} {h:.2}\" font-family=\"{}, sans-serif\" role=\"img\">\n<title>{}</title>\n<desc>{}</desc>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
        escaped(&format!("'{}'", font.family)),
        escaped(&figure.title),
        escaped(&figure.caption)
    );
    let mut clips: Vec<Rect> = Vec::new();
    for item in &drawing.items {
        if let Item::Path { clip: Some(c), .. } = item
            && !clips.contains(c)
        {
            let (Rect { x, y, w, h }, name, n) = (c, &figure.name, clips.len());
            let rect = format!("<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{w:.2}\" height=\"{h:.2}\"/>");
            let _ = writeln!(text, "<clipPath id=\"{name}-{n}\">{rect}</clipPath>");
            clips.push(*c);
        }
    }
    drawing.items.iter().for_each(|item| one(&mut text, item, &clips, &figure.name));
    text + "</svg>\n"
}

fn one(out: &mut String, item: &Item, clips: &[Rect], name: &str) {
    match item {
        Item::Path { steps, fill, stroke, opacity, clip } => {
            let _ = write!(out, "<path d=\"{}\" fill=\"{}\"", course(steps), fill.map_or("none".into(), css));
            if let Some(s) = stroke {
                let (c, width) = (css(s.colour), s.width);
                let _ = write!(out, " stroke=\"{c}\" stroke-width=\"{width:.2}\" stroke-linejoin=\"round\"");
                if s.dash[0] > 0.0 {
                    let _ = write!(out, " stroke-dasharray=\"{:.2} {:.2}\"", s.dash[0], s.dash[1]);
                }
            }
            if *opacity < 1.0 {
                let _ = write!(out, " opacity=\"{opacity:.2}\"");
            }
            if let Some(n) = clip.as_ref().and_then(|c| clips.iter().position(|k| k == c)) {
                let _ = write!(out, " clip-path=\"url(#{name}-{n})\"");
            }
            out.push_str("/>\n");
        }
        Item::Text { at: [x, y], text, size, anchor, upwards } => {
            let (anchor, ink) = (anchor.word(), css(INK));
            let _ = write!(out, "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size:.2}\"");
            let _ = write!(out, " text-anchor=\"{anchor}\" fill=\"{ink}\"");
            if *upwards {
                let _ = write!(out, " transform=\"rotate(-90 {x:.2} {y:.2})\"");
            }
            let _ = writeln!(out, ">{}</text>", escaped(text));
        }
    }
}

fn course(steps: &[Step]) -> String {
    let mut d = String::new();
    for step in steps {
        let _ = match step {
            Step::To([x, y]) => write!(d, "M{x:.2} {y:.2}"),
            Step::Line([x, y]) => write!(d, "L{x:.2} {y:.2}"),
            Step::Curve([[a, b], [p, q], [x, y]]) => write!(d, "C{a:.2} {b:.2} {p:.2} {q:.2} {x:.2} {y:.2}"),
            Step::Close => write!(d, "Z"),
        };
    }
    d
}

/// Escapes text for XML and HTML.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
