//! Figures: data ([`Figure`], also used by the page), layout on paper, and files.
//!
//! [`Figure`] → [`sheet`] (axes, ticks, key) → [`drawing::Drawing`], paths and texts → [`svg`], [`png`], [`pdf`], which write the same drawing.

mod axes;
mod data;
pub mod drawing;
pub mod font;
mod key;
mod marks;
pub mod pdf;
pub mod png;
mod scale;
pub mod sheet;
pub mod svg;

pub use data::{Along, Axis, Cells, Figure, Mark, Marker, NO_VALUE, Panel, Parallel, Path};
pub use scale::{LOOK, Rgb, SERIES, Scale, series};

use crate::error::{Error, InputError};
use drawing::{Anchor, Drawing, Item, MM, Rect, Step, Stroke, open};
use font::{Font, length, lines};
use scale::INK;

vibrissa_core::choices! {
    /// Format of a figure; its word is the file ending.
    #[derive(PartialOrd, Ord)]
    Format {
        Svg = "svg", "vector, for pages and editing";
        Png = "png", "pixels, 300 to the inch";
        Pdf = "pdf", "vector, for LaTeX";
    }
}

#[derive(Debug, Clone)]
pub struct Style {
    /// Width of a column, mm, and of a figure with one panel; others have two columns and their gap.
    pub width: f64,
    /// Text size, pt.
    pub size: f64,
    pub font: Font,
}

impl Style {
    /// `width` in mm and text `size` in pt, with the font of a file or the built-in one.
    /// Errors: sizes that are out of range; a file that is not a font.
    pub fn asked(width: f64, size: f64, font: Option<&std::path::Path>) -> Result<Self, InputError> {
        for (key, x, [from, to]) in [("--width", width, [40.0, 400.0]), ("--font-size", size, [4.0, 24.0])] {
            if !(from..=to).contains(&x) {
                let wrong = InputError::new("no figure can be set like this");
                return Err(wrong.key(key).value(x).allowed(format!("{from} … {to}")));
            }
        }
        Ok(Self { width, size, font: font.map_or_else(|| Ok(Font::built_in()), Font::read)? })
    }
}

impl Default for Style {
    /// A column of 88 mm, text of 8 pt.
    fn default() -> Self {
        Self { width: 88.0, size: 8.0, font: Font::built_in() }
    }
}

/// Name and bytes of `figure` in these formats. Errors: a picture too large for memory.
pub fn files(figure: &Figure, style: &Style, formats: &[Format]) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let drawing = sheet::lay(figure, style);
    let bytes = |format: &Format| match format {
        Format::Svg => Ok(svg::write(&drawing, &style.font, figure).into_bytes()),
        Format::Png => png::write(&drawing, &style.font, png::DPI),
        Format::Pdf => Ok(pdf::write(&drawing, &style.font, figure)),
    };
    formats.iter().map(|f| Ok((format!("{}.{}", figure.name, f.word()), bytes(f)?))).collect()
}
