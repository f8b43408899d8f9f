//! Writes a drawing as a one-page PDF. Text stays text, with an embedded font and its Unicode map.

use std::collections::{BTreeMap, BTreeSet};

use flate2::write::ZlibEncoder;
use pdf_writer::types::{CidFontType, FontFlags, LineJoinStyle, SystemInfo, UnicodeCmap};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr, writers::ExtGraphicsState};

use super::font::glyph;
use super::{Drawing, Figure, Font, INK, Item, Rgb, Step, length};

const FONT: Name<'static> = Name(b"F");
const POSTSCRIPT: Name<'static> = Name(b"Figure-Sans");
const SYSTEM: SystemInfo<'static> =
    SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };

pub fn write(drawing: &Drawing, font: &Font, figure: &Figure) -> Vec<u8> {
    let [catalog, pages, page, contents, type0, cid, descriptor, file, unicode, info] =
        std::array::from_fn(|i| Ref::new(i as i32 + 1));
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([page]).count(1);
    let mut about = pdf.document_info(info);
    about.title(TextStr(&figure.title)).subject(TextStr(&figure.caption)).creator(TextStr("vibrissa"));
    about.finish();
    let [w, h] = drawing.size.map(|x| x as f32);
    let (content, opacities, used) = content(drawing, font);
    {
        let mut p = pdf.page(page);
        p.media_box(Rect::new(0.0, 0.0, w, h)).parent(pages).contents(contents);
        let mut resources = p.resources();
        resources.fonts().pair(FONT, type0);
        let mut all = resources.ext_g_states();
        for percent in opacities {
            let (name, share) = (state(percent), percent as f32 / 100.0);
            let mut state = all.insert(Name(name.as_bytes())).start::<ExtGraphicsState>();
            state.non_stroking_alpha(share).stroking_alpha(share);
        }
    }
    pdf.stream(contents, &packed(&content)).filter(Filter::FlateDecode);
    embed(&mut pdf, font, used, [type0, cid, descriptor, file, unicode]);
    pdf.finish()
}

/// Name of the state of this opacity.
fn state(percent: u32) -> String {
    format!("O{percent}")
}

/// The content, the opacities below 100 % in it, and its glyphs with their characters.
fn content(drawing: &Drawing, font: &Font) -> (Vec<u8>, BTreeSet<u32>, BTreeMap<u16, char>) {
    let face = font.face();
    let (mut c, mut opacities, mut used) = (Content::new(), BTreeSet::new(), BTreeMap::new());
    c.transform([1.0, 0.0, 0.0, -1.0, 0.0, drawing.size[1] as f32]);
    let rgb = |[r, g, b]: Rgb| [r, g, b].map(|x| f32::from(x) / 255.0);
    for item in &drawing.items {
        match item {
            Item::Path { steps, fill, stroke, opacity, clip } => {
                c.save_state();
                if let Some(super::Rect { x, y, w, h }) = *clip {
                    c.rect(x as f32, y as f32, w as f32, h as f32).clip_nonzero().end_path();
                }
                let percent = (100.0 * opacity).round() as u32;
                if percent < 100 {
                    c.set_parameters(Name(state(percent).as_bytes()));
                    opacities.insert(percent);
                }
                if let Some([r, g, b]) = fill.map(rgb) {
                    c.set_fill_rgb(r, g, b);
                }
                if let Some(s) = stroke {
                    let [r, g, b] = rgb(s.colour);
                    c.set_stroke_rgb(r, g, b).set_line_width(s.width as f32);
                    c.set_line_join(LineJoinStyle::RoundJoin);
                    if s.dash[0] > 0.0 {
                        c.set_dash_pattern(s.dash.map(|x| x as f32), 0.0);
                    }
                }
                course(&mut c, steps);
                match (fill.is_some(), stroke.is_some()) {
                    (true, true) => c.fill_nonzero_and_stroke(),
                    (true, false) => c.fill_nonzero(),
                    _ => c.stroke(),
                };
                c.restore_state();
            }
            Item::Text { at: [x, y], text, size, anchor, upwards } => {
                let back = anchor.share() * length(&face, text) * size;
                let [r, g, b] = rgb(INK);
                used.extend(text.chars().map(|s| (glyph(&face, s).0, s)));
                let glyphs: Vec<u8> = text.chars().flat_map(|s| glyph(&face, s).0.to_be_bytes()).collect();
                c.begin_text().set_fill_rgb(r, g, b).set_font(FONT, *size as f32);
                let matrix = if *upwards {
                    [0.0, -1.0, -1.0, 0.0, *x, y + back]
                } else {
                    [1.0, 0.0, 0.0, -1.0, x - back, *y]
                };
                c.set_text_matrix(matrix.map(|x| x as f32)).show(Str(&glyphs)).end_text();
            }
        }
    }
    (c.finish().to_vec(), opacities, used)
}

fn course(c: &mut Content, steps: &[Step]) {
    for step in steps {
        let f = |p: &[f64; 2]| (p[0] as f32, p[1] as f32);
        match step {
            Step::To(p) => c.move_to(f(p).0, f(p).1),
            Step::Line(p) => c.line_to(f(p).0, f(p).1),
            Step::Curve([p, q, r]) => c.cubic_to(f(p).0, f(p).1, f(q).0, f(q).1, f(r).0, f(r).1),
            Step::Close => c.close_path(),
        };
    }
}

fn embed(pdf: &mut Pdf, font: &Font, used: BTreeMap<u16, char>, refs: [Ref; 5]) {
    let (face, [type0, cid, descriptor, file, unicode]) = (font.face(), refs);
    let units = 1000.0 / f32::from(face.units_per_em());
    pdf.type0_font(type0)
        .base_font(POSTSCRIPT)
        .encoding_predefined(Name(b"Identity-H"))
        .descendant_font(cid)
        .to_unicode(unicode);
    let mut f = pdf.cid_font(cid);
    f.subtype(CidFontType::Type2).base_font(POSTSCRIPT).system_info(SYSTEM).font_descriptor(descriptor);
    f.cid_to_gid_map_predefined(Name(b"Identity"));
    let mut widths = f.widths();
    for id in used.keys() {
        let advance = face.glyph_hor_advance(ttf_parser::GlyphId(*id)).unwrap_or(0);
        widths.consecutive(*id, [f32::from(advance) * units]);
    }
    widths.finish();
    f.finish();
    let b = face.global_bounding_box();
    let bounds = [b.x_min, b.y_min, b.x_max, b.y_max].map(|x| f32::from(x) * units);
    pdf.font_descriptor(descriptor)
        .name(POSTSCRIPT)
        .flags(FontFlags::SYMBOLIC)
        .bbox(Rect::new(bounds[0], bounds[1], bounds[2], bounds[3]))
        .italic_angle(0.0)
        .ascent(f32::from(face.ascender()) * units)
        .descent(f32::from(face.descender()) * units)
        .cap_height(f32::from(face.capital_height().unwrap_or(face.ascender())) * units)
        .stem_v(80.0)
        .font_file2(file);
    let bytes = packed(&font.bytes);
    pdf.stream(file, &bytes).filter(Filter::FlateDecode).pair(Name(b"Length1"), font.bytes.len() as i32);
    let mut map = UnicodeCmap::<u16>::new(Name(b"Figure-Unicode"), SYSTEM);
    used.into_iter().for_each(|(id, c)| map.pair(id, c));
    pdf.cmap(unicode, &map.finish());
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes everything")
}
