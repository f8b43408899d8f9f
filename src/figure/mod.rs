//! Figures: what is drawn (data, of which the page draws too), where it lies on paper, and files of it.
//!
//! [`Figure`] → [`sheet`] (axes, ticks, legend) → [`drawing::Drawing`], a list of paths and texts → [`svg`], [`png`], [`pdf`]: three
//! writers of the same list, so that the files look alike. Text is measured and drawn with one font, which is built in, or of the user.

mod axes;
mod colour;
mod data;
pub mod drawing;
pub mod font;
mod key;
mod marks;
mod notes;
mod parallel;
pub mod pdf;
pub mod png;
mod scale;
pub mod sheet;
pub mod svg;

pub use colour::{COLOURS, DARK, MAP, MAP_DARK, Rgb, SERIES, series};
pub use data::{Along, Axis, Cells, Figure, Mark, Marker, NO_VALUE, Panel, Parallel, Path};
pub use scale::Scale;

use crate::error::Error;
use font::Font;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// Vector, for pages and editing.
    Svg,
    /// Pixels, 300 to the inch.
    Png,
    /// Vector, for LaTeX.
    Pdf,
}

impl Format {
    /// All, by name (which is the ending of the file) and what it is.
    pub const WORDS: [(&'static str, Self, &'static str); 3] = [
        ("svg", Self::Svg, "vector, for pages and editing"),
        ("png", Self::Png, "pixels, 300 to the inch"),
        ("pdf", Self::Pdf, "vector, for LaTeX"),
    ];

    /// Ending of its files.
    pub fn ending(self) -> &'static str {
        Self::WORDS[self as usize].0
    }
}

/// How figures are set.
#[derive(Debug, Clone)]
pub struct Style {
    /// Width of a column of the paper, mm: that of a figure with one panel; one with more is two columns and their gap wide.
    pub width: f64,
    /// Of all text, pt.
    pub size: f64,
    /// Of all text.
    pub font: Font,
}

impl Style {
    /// With a column of `width` mm, text of `size` pt, in the font of a file, or the built-in one; `keys` name the first two in complaints.
    ///
    /// # Errors
    /// Sizes that no figure can be set in; a file that is no font.
    pub fn asked(
        width: f64,
        size: f64,
        font: Option<&std::path::Path>,
        keys: [&str; 2],
    ) -> Result<Self, crate::error::InputError> {
        for (key, x, [from, to]) in [(keys[0], width, [40.0, 400.0]), (keys[1], size, [4.0, 24.0])] {
            if !(from..=to).contains(&x) {
                let wrong = crate::error::InputError::new("no figure can be set like this");
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

/// `figure` as files of these formats: name and bytes.
///
/// # Errors
/// A picture too large for memory.
pub fn files(figure: &Figure, style: &Style, formats: &[Format]) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let drawing = sheet::lay(figure, style);
    let bytes = |format: &Format| match format {
        Format::Svg => Ok(svg::write(&drawing, &style.font, figure).into_bytes()),
        Format::Png => png::write(&drawing, &style.font, png::DPI),
        Format::Pdf => Ok(pdf::write(&drawing, &style.font, figure)),
    };
    formats.iter().map(|f| Ok((format!("{}.{}", figure.name, f.ending()), bytes(f)?))).collect()
}
