//! Colours that most people tell apart, and a scale that reads the same in grey.

/// Okabe and Ito (2008), without their yellow, which vanishes on white: CSS names of lines and points.
pub const COLOURS: [&str; 8] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#56B4E9", "#E69F00", "#7F7F7F"];

/// Stops of cividis (Nuñez, Anderton and Renslow 2018), which is the same to readers with and without red–green deficiency.
const CIVIDIS: [[u8; 3]; 9] = [
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

/// Red, green, blue, 0 … 255.
pub type Rgb = [u8; 3];

/// Black.
pub const INK: Rgb = [0, 0, 0];
/// Of lines that only guide the eye.
pub const FAINT: Rgb = [222, 222, 222];
/// Of lines that are not meant to be read one by one.
pub const MUTED: Rgb = [190, 190, 190];

/// Colour number `n`, from the start again when there are no more.
pub fn of(n: usize) -> Rgb {
    let text = COLOURS[n % COLOURS.len()];
    let part = |i: usize| u8::from_str_radix(&text[i..i + 2], 16).unwrap_or(0);
    [part(1), part(3), part(5)]
}

/// Colour of `share` 0 … 1 of the scale of cells.
pub fn along(share: f64) -> Rgb {
    let last = CIVIDIS.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let i = (at as usize).min(last - 1);
    let t = at - i as f64;
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(CIVIDIS[i][k]), f64::from(CIVIDIS[i + 1][k]));
        (a + (b - a) * t).round() as u8
    })
}

/// As in CSS.
pub fn css([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_grows_lighter_throughout() {
        let light = |c: Rgb| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
        let steps: Vec<f64> = (0..=100).map(|i| light(along(f64::from(i) / 100.0))).collect();
        assert!(steps.windows(2).all(|w| w[1] > w[0]), "{steps:?}");
        assert_eq!((along(-1.0), along(2.0)), (CIVIDIS[0], CIVIDIS[8]));
        assert_eq!(of(9), of(1));
        assert_eq!(css(of(0)), "#0072b2");
    }
}
