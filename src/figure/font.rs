//! Fonts of figures: lengths of texts, and outlines.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use ttf_parser::{Face, GlyphId, OutlineBuilder, name_id::FAMILY};

use super::drawing::{Anchor, Step};
use crate::error::InputError;

/// DejaVu Sans 2.37, reduced to Latin, Greek and mathematical signs.
const BUILT_IN: &[u8] = include_bytes!("font/DejaVuSans.ttf");

#[derive(Debug, Clone)]
pub struct Font {
    pub(super) bytes: Arc<[u8]>,
    /// Family name for SVG.
    pub family: String,
    /// Font file; `None` for the built-in font.
    pub file: Option<PathBuf>,
}

const MOST: u64 = 64 << 20;

impl Font {
    pub fn built_in() -> Self {
        Self { bytes: BUILT_IN.into(), family: "DejaVu Sans".into(), file: None }
    }

    /// Reads a font file. Errors: a file that cannot be read or is not a TrueType font.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let refuse = |why: String| {
            InputError::new(why).key("--font").value(path.display()).allowed("a TrueType font file (.ttf)")
        };
        if !path.metadata().map_or(true, |m| m.is_file() && m.len() <= MOST) {
            return Err(refuse("this is no file of up to 64 MiB".to_owned()));
        }
        let bytes = std::fs::read(path).map_err(|e| refuse(format!("the font cannot be read: {e}")))?;
        let face = Face::parse(&bytes, 0).map_err(|e| refuse(format!("this is not a font: {e}")))?;
        if face.tables().glyf.is_none() {
            return Err(refuse("the outlines of this font are not those of TrueType".to_owned()));
        }
        if let Some(lacks) = "0123456789−ABCabcθ".chars().find(|c| face.glyph_index(*c).is_none()) {
            return Err(refuse(format!("this font has no sign {lacks:?}")));
        }
        let mut names = face.names().into_iter().filter(|n| n.name_id == FAMILY && n.is_unicode());
        let family = names.next().and_then(|n| n.to_string()).unwrap_or_else(|| "sans-serif".into());
        Ok(Self { bytes: bytes.into(), family, file: Some(path.to_owned()) })
    }

    pub fn face(&self) -> Face<'_> {
        Face::parse(&self.bytes, 0).expect("it was parsed when it was read")
    }
}

/// Glyph of a character, or that of an unknown one.
pub fn glyph(face: &Face<'_>, c: char) -> GlyphId {
    face.glyph_index(c).unwrap_or(GlyphId(0))
}

/// Length of `text`, as a multiple of the font size.
pub fn length(face: &Face<'_>, text: &str) -> f64 {
    let units = f64::from(face.units_per_em());
    text.chars().map(|c| f64::from(face.glyph_hor_advance(glyph(face, c)).unwrap_or(0)) / units).sum()
}

/// Breaks `text` at spaces into lines of at most `room` (a multiple of the font size), if its words allow it; “x_ss = 7 mm” stays together.
pub fn lines(face: &Face<'_>, text: &str, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for part in parts(text) {
        match lines.last_mut() {
            Some(line) if length(face, line) + length(face, " ") + length(face, &part) <= room => {
                *line += &format!(" {part}");
            }
            _ => lines.push(part),
        }
    }
    lines
}

/// Words; a value with symbol and unit is one.
fn parts(text: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    let mut open = false;
    for word in text.split(' ').filter(|w| !w.is_empty()) {
        let sign = matches!(word, "=" | "≈");
        match parts.last_mut() {
            Some(part) if open || sign => *part += &format!(" {word}"),
            _ => parts.push(word.to_owned()),
        }
        open = sign || open && word.parse::<f64>().is_ok();
    }
    parts
}

/// Outline of a text at `at`; `up` if it reads upwards.
pub fn outline(face: &Face<'_>, text: &str, at: [f64; 2], size: f64, anchor: Anchor, up: bool) -> Vec<Step> {
    let scale = size / f64::from(face.units_per_em());
    let along = -anchor.share() * length(face, text) * size;
    let mut pen = Pen { steps: Vec::new(), at, along, scale, up };
    for c in text.chars() {
        let id = glyph(face, c);
        face.outline_glyph(id, &mut pen);
        pen.along += f64::from(face.glyph_hor_advance(id).unwrap_or(0)) * scale;
    }
    pen.steps
}

struct Pen {
    steps: Vec<Step>,
    at: [f64; 2],
    /// Start of the glyph along the text, pt.
    along: f64,
    scale: f64,
    up: bool,
}

impl Pen {
    fn point(&self, x: f32, y: f32) -> [f64; 2] {
        let (along, above) = (self.along + f64::from(x) * self.scale, f64::from(y) * self.scale);
        let [x0, y0] = self.at;
        if self.up { [x0 - above, y0 - along] } else { [x0 + along, y0 - above] }
    }

    fn last(&self) -> [f64; 2] {
        match self.steps.last() {
            Some(Step::To(p) | Step::Line(p) | Step::Curve([_, _, p])) => *p,
            _ => self.at,
        }
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.steps.push(Step::To(self.point(x, y)));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.steps.push(Step::Line(self.point(x, y)));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (a, b, c) = (self.last(), self.point(x1, y1), self.point(x, y));
        let toward = |from: [f64; 2]| std::array::from_fn(|i| from[i] + 2.0 / 3.0 * (b[i] - from[i]));
        self.steps.push(Step::Curve([toward(a), toward(c), c]));
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.steps.push(Step::Curve([self.point(x1, y1), self.point(x2, y2), self.point(x, y)]));
    }

    fn close(&mut self) {
        self.steps.push(Step::Close);
    }
}
