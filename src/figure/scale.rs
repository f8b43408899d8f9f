//! Scales of axes and positions of ticks; colours that most people can distinguish, and a scale that also works in grey.

use std::sync::LazyLock;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use super::{Axis, Cells, Marker};

/// Maps values to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Values at the two ends.
    pub ends: [f64; 2],
    pub log: bool,
}

impl Scale {
    /// A scale that holds all `values` valid on `axis`, with a margin.
    pub fn of(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        if !axis.words.is_empty() {
            return Self { ends: [-0.5, axis.words.len() as f64 - 0.5], log: false };
        }
        let (least, most) = reach(axis, values);
        if let Some(ends) = axis.ends {
            return Self { ends, log: axis.log };
        }
        let ends = match (axis.log, least < most) {
            _ if least > most => [if axis.log { 0.1 } else { 0.0 }, 1.0],
            (true, true) => {
                let room = (0.04 * (most.ln() - least.ln())).exp();
                [least / room, most * room]
            }
            (true, false) => [least / 2.0, most * 2.0],
            (false, true) => {
                let room = 0.04 * most - 0.04 * least;
                let low = if least >= 0.0 && least < 0.2 * most { 0.0 } else { least - room };
                [low, most + room]
            }
            (false, false) => {
                let room = if least == 0.0 { 1.0 } else { 0.1 * least.abs() };
                [least - room, most + room]
            }
        };
        // Widened ends may overflow.
        let ends = if axis.log { ends.map(|x| x.clamp(f64::MIN_POSITIVE, f64::MAX)) } else { ends };
        Self { ends, log: axis.log }
    }

    /// A scale from the least to the greatest of `values`, for colours.
    pub fn tight(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let (a, b) = reach(axis, values);
        if a < b { Self { ends: [a, b], log: axis.log } } else { Self::of(axis, [a, b].into_iter()) }
    }

    /// Position from 0 to 1; NaN for values that are not on the scale.
    pub fn share(&self, x: f64) -> f64 {
        let [a, b] = self.ends;
        if self.log {
            if x > 0.0 { (x.ln() - a.ln()) / (b.ln() - a.ln()) } else { f64::NAN }
        } else {
            (x - a) / (b - a)
        }
    }

    /// About `wanted` labelled ticks, and small ticks.
    pub fn ticks(&self, wanted: usize) -> (Vec<(f64, String)>, Vec<f64>) {
        if self.log { self.decades(wanted) } else { (self.even(wanted), Vec::new()) }
    }

    fn holds(&self, x: f64) -> bool {
        (-1e-9..=1.0 + 1e-9).contains(&self.share(x))
    }

    fn even(&self, wanted: usize) -> Vec<(f64, String)> {
        let [a, b] = self.ends;
        let raw = (b - a) / wanted.max(1) as f64;
        let unit = 10f64.powf(raw.log10().floor());
        let steps = [0.5, 1.0, 2.0, 5.0, 10.0].map(|m| m * unit);
        let fits = steps.iter().skip(1).position(|s| *s >= 0.9 * raw).map_or(1, |place| place + 1);
        let ticks = |step: f64| -> Vec<(f64, String)> {
            let from = (a / step - 1e-9).ceil() as i64;
            let values = (from..).map(|i| i as f64 * step).take_while(|x| *x <= b + 1e-9 * step).take(100);
            values.map(|x| (x, number(x, step))).collect()
        };
        let all = ticks(steps[fits]);
        if all.len() < 2 { ticks(steps[fits - 1]) } else { all }
    }

    fn decades(&self, wanted: usize) -> (Vec<(f64, String)>, Vec<f64>) {
        let [a, b] = self.ends.map(f64::log10);
        let whole: Vec<i32> = (a.floor().max(-308.0) as i32..=b.ceil().min(308.0) as i32).collect();
        let every = (whole.len() / wanted.max(1)).max(1) as i32;
        let each = |steps: &[f64], every: i32| -> Vec<f64> {
            let powers = whole.iter().filter(|n| *n % every == 0);
            let all = powers.flat_map(|n| steps.iter().map(move |s| s * 10f64.powi(*n)));
            all.filter(|x| self.holds(*x)).collect()
        };
        let (tens, within) = (each(&[1.0], every), |steps: &[f64]| each(steps, 1));
        let between = [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        let small = within(if b - a <= 6.0 { &between } else { &[1.0] });
        let named = match tens.len() {
            0 | 1 if within(&[1.0, 2.0, 5.0]).len() >= 2 => within(&[1.0, 2.0, 5.0]),
            0 | 1 if b - a < 0.7 => return (self.even(wanted.min(4)), small),
            _ => tens,
        };
        let plain = named.iter().all(|x| (1e-2..1e4).contains(&(x * 1.000_001)));
        (named.into_iter().map(|x| (x, decade(x, plain))).collect(), small)
    }
}

/// Least and greatest valid value on `axis`; an infinite pair without any. Limited to a quarter of f64::MAX, so that differences are finite.
fn reach(axis: &Axis, values: impl Iterator<Item = f64>) -> (f64, f64) {
    const FAR: f64 = 0.25 * f64::MAX;
    let least = if axis.log { 4.0 * f64::MIN_POSITIVE } else { -FAR };
    let usable = values.filter(|x| x.is_finite() && (!axis.log || *x > 0.0)).map(|x| x.clamp(least, FAR));
    usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
}

/// A multiple of `step` as text.
fn number(x: f64, step: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let text = if x.abs() >= 1e5 || x.abs() < 1e-3 && step < 1e-3 {
        let power = (x.abs().log10() + 1e-9).floor() as i32;
        // As many digits as the step has relative to the leading digit: 1.5·10⁻⁴ at steps of 5·10⁻⁵.
        let digits = (power - (step.log10() + 1e-9).floor() as i32).clamp(0, 6) as usize;
        let lead = trimmed(&format!("{:.digits$}", x / 10f64.powi(power))).to_owned();
        match lead.as_str() {
            "1" => ten(power),
            "-1" => format!("-{}", ten(power)),
            _ => format!("{lead}·{}", ten(power)),
        }
    } else {
        let digits = (-step.log10()).ceil().max(0.0) as usize;
        format!("{x:.digits$}")
    };
    text.replace('-', "−")
}

pub fn value(x: f64) -> String {
    let step = if x == 0.0 { 1.0 } else { 10f64.powf(x.abs().log10().floor() - 3.0) };
    let text = number(x, step);
    if text.contains('·') { text } else { trimmed(&text).to_owned() }
}

/// A number without zeros at the end of its decimals.
fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// Label on a logarithmic axis; `plain`: without powers of ten.
fn decade(x: f64, plain: bool) -> String {
    if plain {
        return format!("{}", (x * 1e6).round() / 1e6);
    }
    let power = (x.log10() + 1e-9).floor() as i32;
    let lead = (x / 10f64.powi(power)).round();
    if lead == 1.0 { ten(power) } else { format!("{lead}·{}", ten(power)) }
}

fn ten(power: i32) -> String {
    if power == 0 {
        return "1".into();
    }
    let digit = |c: char| c.to_digit(10).and_then(|d| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(d as usize));
    let raised: String = power.to_string().chars().map(|c| digit(c).unwrap_or('⁻')).collect();
    format!("10{raised}")
}

/// x and y, in sizes of the marker.
type Corner = [f64; 2];

/// The look of figures and pages, from `look.toml`.
#[derive(Debug, Deserialize)]
pub struct Look {
    /// Colours of series.
    pub colours: OnGround<[String; 8]>,
    /// Colours of maps.
    pub map: OnGround<[Rgb; 9]>,
    /// Corners and strokes of markers.
    pub markers: IndexMap<Marker, (Vec<Corner>, Vec<[Corner; 2]>)>,
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
    (HUES[i % HUES.len()], Marker::ALL[i % Marker::SERIES])
}

/// Red, green, blue from 0 to 255.
pub type Rgb = [u8; 3];

pub const INK: Rgb = [0, 0, 0];
pub const FAINT: Rgb = [222, 222, 222];
pub const MUTED: Rgb = [190, 190, 190];

pub fn of(n: usize) -> Rgb {
    let text = &LOOK.colours.light[n % LOOK.colours.light.len()];
    [1, 3, 5].map(|i| u8::from_str_radix(&text[i..i + 2], 16).unwrap_or(0))
}

/// Colour at `share` 0 … 1 of the map scale.
pub fn along(share: f64) -> Rgb {
    let map = &LOOK.map.light;
    let last = map.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let i = (at as usize).min(last - 1);
    let (from, to) = (map[i].map(f64::from), map[i + 1].map(f64::from));
    std::array::from_fn(|k| (from[k] + (to[k] - from[k]) * (at - i as f64)).round() as u8)
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
