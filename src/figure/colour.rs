//! Colours that most people can distinguish, and a scale that also works in grey.

use std::sync::LazyLock;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use super::{Cells, Marker, Scale};

/// What figures and pages look like, from `look.toml`.
#[derive(Debug, Deserialize)]
pub struct Look {
    /// Colours of series.
    pub colours: OnGround<[String; 8]>,
    /// Colours of maps.
    pub map: OnGround<[Rgb; 9]>,
    /// Corners and strokes of markers.
    pub markers: IndexMap<Marker, (Vec<[f64; 2]>, Vec<[[f64; 2]; 2]>)>,
}

/// Colours on white, and on the dark ground of a page.
#[derive(Debug, Deserialize, Serialize)]
pub struct OnGround<T> {
    pub light: T,
    pub dark: T,
}

pub static LOOK: LazyLock<Look> =
    LazyLock::new(|| toml::from_str(include_str!("look.toml")).expect("look.toml is a look"));

/// Colours of series. Black is for references, grey for what does not count.
const HUES: [usize; 6] = [0, 1, 2, 3, 5, 6];
/// Number of series with a unique colour.
pub const SERIES: usize = HUES.len();

/// Colour and marker of series `i`: unique each for the first [`SERIES`], as a pair for the first 24.
pub fn series(i: usize) -> (usize, Marker) {
    (HUES[i % HUES.len()], Marker::SERIES[i % Marker::SERIES.len()])
}

/// Red, green, blue from 0 to 255.
pub type Rgb = [u8; 3];

pub const INK: Rgb = [0, 0, 0];
pub const FAINT: Rgb = [222, 222, 222];
pub const MUTED: Rgb = [190, 190, 190];

pub fn of(n: usize) -> Rgb {
    parsed(&LOOK.colours.light[n % LOOK.colours.light.len()])
}

fn parsed(text: &str) -> Rgb {
    let part = |i: usize| u8::from_str_radix(&text[i..i + 2], 16).unwrap_or(0);
    [part(1), part(3), part(5)]
}

/// Colour at `share` 0 … 1 of the map scale.
pub fn along(share: f64) -> Rgb {
    let map = &LOOK.map.light;
    let last = map.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let i = (at as usize).min(last - 1);
    let t = at - i as f64;
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(map[i][k]), f64::from(map[i + 1][k]));
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
