//! Writes a drawing as PNG.

use tiny_skia::{Color, FillRule, LineJoin, Mask, Paint, PathBuilder, Pixmap, StrokeDash, Transform};

use super::font::outline;
use super::{Drawing, Font, INK, Item, Rect, Rgb, Step, Stroke};
use crate::error::Error;

/// Pixels to the inch.
pub const DPI: f64 = 300.0;

/// The PNG file on white. Errors: a picture too large for memory.
pub fn write(drawing: &Drawing, font: &Font, dpi: f64) -> Result<Vec<u8>, Error> {
    let scale = dpi / 72.0;
    let [w, h] = drawing.size.map(|x| (x * scale).ceil().max(1.0) as u32);
    let large = || Error::Run(format!("a picture of {w} × {h} pixels is too large"));
    let mut map = Pixmap::new(w, h).ok_or_else(large)?;
    map.fill(Color::WHITE);
    let (face, transform) = (font.face(), Transform::from_scale(scale as f32, scale as f32));
    let mut held: Option<(Rect, Mask)> = None;
    for item in &drawing.items {
        match item {
            Item::Path { steps, fill, stroke, opacity, clip } => {
                if let Some(c) = clip
                    && held.as_ref().is_none_or(|(k, _)| k != c)
                {
                    let mut mask = Mask::new(w, h).ok_or_else(large)?;
                    if let Some(edge) = path(&c.steps()) {
                        mask.fill_path(&edge, FillRule::Winding, true, transform);
                    }
                    held = Some((*c, mask));
                }
                let mask = clip.and(held.as_ref().map(|(_, mask)| mask));
                let Some(course) = path(steps) else { continue };
                if let Some(fill) = fill {
                    map.fill_path(&course, &paint(*fill, *opacity), FillRule::Winding, transform, mask);
                }
                if let Some(stroke) = stroke {
                    map.stroke_path(&course, &paint(stroke.colour, *opacity), &line(stroke), transform, mask);
                }
            }
            Item::Text { at, text, size, anchor, upwards } => {
                if let Some(course) = path(&outline(&face, text, *at, *size, *anchor, *upwards)) {
                    map.fill_path(&course, &paint(INK, 1.0), FillRule::Winding, transform, None);
                }
            }
        }
    }
    encoded(&map, dpi).map_err(|e| Error::Run(e.to_string()))
}

fn encoded(map: &Pixmap, dpi: f64) -> Result<Vec<u8>, png::EncodingError> {
    let opaque: Vec<u8> = map.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, map.width(), map.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let (per_metre, unit) = ((dpi / 0.0254).round() as u32, png::Unit::Meter);
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit }));
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&opaque)?;
    writer.finish()?;
    Ok(bytes)
}

fn paint([r, g, b]: Rgb, opacity: f64) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * opacity).round() as u8);
    paint.anti_alias = true;
    paint
}

fn line(s: &Stroke) -> tiny_skia::Stroke {
    let lengths = (s.dash[0] > 0.0).then(|| s.dash.map(|x| x as f32).to_vec());
    let (width, dash) = (s.width as f32, lengths.and_then(|d| StrokeDash::new(d, 0.0)));
    tiny_skia::Stroke { width, dash, line_join: LineJoin::Round, ..Default::default() }
}

fn path(steps: &[Step]) -> Option<tiny_skia::Path> {
    let mut b = PathBuilder::new();
    let f = |p: &[f64; 2]| (p[0] as f32, p[1] as f32);
    for step in steps {
        match step {
            Step::To(p) => b.move_to(f(p).0, f(p).1),
            Step::Line(p) => b.line_to(f(p).0, f(p).1),
            Step::Curve([p, q, r]) => b.cubic_to(f(p).0, f(p).1, f(q).0, f(q).1, f(r).0, f(r).1),
            Step::Close => b.close(),
        }
    }
    b.finish()
}
