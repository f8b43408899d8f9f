//! Colours that most people tell apart, and a scale that reads the same in grey.

use super::data::{Cells, Marker};
use super::scale::Scale;

/// Colours of lines and points on white: Okabe and Ito (2008), without their yellow, which vanishes on white. The least CIEDE2000 of two of
/// them is 22.2 with normal sight, and 12.2, 8.2 and 10.9 with protanopia, deuteranopia and tritanopia (Machado, Oliveira and Fernandes
/// 2009, full severity). The two of 8.2 are green and grey, which has markers of its own.
pub const COLOURS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#56b4e9", "#e69f00", "#7f7f7f"];

/// The same eight on the dark ground of a page: lighter, and chosen for the largest least distance. The least CIEDE2000 of two of them is
/// 26.7 with normal sight, and 15.9, 16.0 and 13.9 with the three deficiencies; the least contrast to the ground is 4.5 (WCAG).
pub const DARK: [&str; 8] =
    ["#7973f0", "#ef3b25", "#49b77c", "#f882bb", "#f6f4f4", "#32dffe", "#f1e266", "#828080"];

/// Colours of series beside each other. The ink is for what they are compared with, grey for what does not count.
const HUES: [usize; 6] = [0, 1, 2, 3, 5, 6];
/// How many series have a colour that no other has.
pub const SERIES: usize = HUES.len();

/// Looks of series number `i`: its colour and its marker. The first [`SERIES`] share neither; the first 24 do not share both.
pub fn series(i: usize) -> (usize, Marker) {
    (HUES[i % HUES.len()], Marker::SERIES[i % Marker::SERIES.len()])
}

/// Stops of the scale of maps: cividis (Nuñez, Anderton and Renslow 2018), which is the same to readers with and without red–green
/// deficiency.
pub const MAP: [Rgb; 9] = [
    [0, 34, 78],
    [18, 53, 112],
    [59, 73, 108],
    [87, 93, 109],
    [112, 113, 115],
    [138, 134, 120],
    [165, 156, 116],
    [195, 179, 105],
    [254, 232, 56],
];
/// The same on the dark ground of a page: from a blue that has a contrast of 4.0 to it. Its lightness grows by the same step in OKLab.
pub const MAP_DARK: [Rgb; 9] = [
    [61, 116, 224],
    [91, 133, 213],
    [119, 149, 200],
    [148, 162, 185],
    [176, 175, 169],
    [195, 190, 154],
    [215, 205, 135],
    [235, 220, 109],
    [255, 234, 70],
];

/// Red, green, blue, 0 … 255.
pub type Rgb = [u8; 3];

/// Black.
pub const INK: Rgb = [0, 0, 0];
/// Of lines that only guide the eye.
pub const FAINT: Rgb = [222, 222, 222];
/// Of lines that are not meant to be read one by one.
pub const MUTED: Rgb = [190, 190, 190];

/// Colour number `n` on white, from the start again when there are no more.
pub fn of(n: usize) -> Rgb {
    parsed(COLOURS[n % COLOURS.len()])
}

/// A colour as in CSS: six hexadecimal digits.
fn parsed(text: &str) -> Rgb {
    let part = |i: usize| u8::from_str_radix(&text[i..i + 2], 16).unwrap_or(0);
    [part(1), part(3), part(5)]
}

/// Colour of `share` 0 … 1 of the scale of cells.
pub fn along(share: f64) -> Rgb {
    let last = MAP.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let i = (at as usize).min(last - 1);
    let t = at - i as f64;
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(MAP[i][k]), f64::from(MAP[i + 1][k]));
        (a + (b - a) * t).round() as u8
    })
}

/// As in CSS.
pub fn css([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Different values of which each has a colour of its own; more are a scale.
const FEW: usize = 6;

/// Colours of values.
#[derive(Debug, Clone, PartialEq)]
pub enum Shades {
    /// Of any value between two ends.
    Scale(Scale),
    /// Of these values alone, ascending: equal steps of colour.
    Bands(Vec<f64>),
}

impl Shades {
    /// Those of a map: bands where it has few values.
    pub fn of(cells: &Cells) -> Self {
        let mut values: Vec<f64> = cells.z.iter().copied().filter(|z| z.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|b, a| *b - *a <= 1e-9 * a.abs().max(b.abs()));
        match values.len() {
            1..=FEW => Self::Bands(values),
            _ => Self::Scale(Scale::tight(&cells.of, cells.z.iter().copied())),
        }
    }

    /// Colour of `z`.
    pub fn colour(&self, z: f64) -> Rgb {
        along(match self {
            Self::Scale(scale) => scale.share(z),
            Self::Bands(values) => {
                let off = |i: &usize| (values[*i] - z).abs();
                let nearest = (0..values.len()).min_by(|i, j| off(i).total_cmp(&off(j))).unwrap_or(0);
                nearest as f64 / (values.len().max(2) - 1) as f64
            }
        })
    }
}
