//! Colours that most people can distinguish, and a scale that also works in grey.

use super::{Cells, Marker, Scale};

/// Colours on white: Okabe and Ito (2008) without yellow, which is hardly visible. The least CIEDE2000 distance is 22.2, and 12.2, 8.2, 10.9 with
/// protanopia, deuteranopia, tritanopia (Machado, Oliveira and Fernandes 2009, full severity). 8.2 is green and grey; grey has other markers.
pub const COLOURS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#56b4e9", "#e69f00", "#7f7f7f"];

/// The same on the dark ground of a page, with the least distance maximised: CIEDE2000 26.7, and 15.9, 16.0 and 13.9 with the three deficiencies; the
/// least contrast to the ground is 4.5 (WCAG).
pub const DARK: [&str; 8] =
    ["#7973f0", "#ef3b25", "#49b77c", "#f882bb", "#f6f4f4", "#32dffe", "#f1e266", "#828080"];

/// Colours of series. Black is for references, grey for what does not count.
const HUES: [usize; 6] = [0, 1, 2, 3, 5, 6];
/// Number of series with a unique colour.
pub const SERIES: usize = HUES.len();

/// Colour and marker of series `i`: unique each for the first [`SERIES`], as a pair for the first 24.
pub fn series(i: usize) -> (usize, Marker) {
    (HUES[i % HUES.len()], Marker::SERIES[i % Marker::SERIES.len()])
}

/// Colours of maps: cividis (Nuñez, Anderton and Renslow 2018), equal for readers with and without red–green deficiency.
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
/// The same on the dark ground of a page, with contrast 4.0 at the first colour and equal steps of lightness in OKLab.
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

/// Red, green, blue from 0 to 255.
pub type Rgb = [u8; 3];

pub const INK: Rgb = [0, 0, 0];
pub const FAINT: Rgb = [222, 222, 222];
pub const MUTED: Rgb = [190, 190, 190];

pub fn of(n: usize) -> Rgb {
    parsed(COLOURS[n % COLOURS.len()])
}

fn parsed(text: &str) -> Rgb {
    let part = |i: usize| u8::from_str_radix(&text[i..i + 2], 16).unwrap_or(0);
    [part(1), part(3), part(5)]
}

/// Colour at `share` 0 … 1 of the map scale.
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

pub fn css([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

const FEW: usize = 6;

#[derive(Debug, Clone, PartialEq)]
pub enum Shades {
    Scale(Scale),
    /// Equal steps for these ascending values.
    Bands(Vec<f64>),
}

impl Shades {
    /// Bands if the map has few values.
    pub fn of(cells: &Cells) -> Self {
        let mut values: Vec<f64> = cells.z.iter().copied().filter(|z| z.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|b, a| *b - *a <= 1e-9 * a.abs().max(b.abs()));
        match values.len() {
            1..=FEW => Self::Bands(values),
            _ => Self::Scale(Scale::tight(&cells.of, cells.z.iter().copied())),
        }
    }

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
