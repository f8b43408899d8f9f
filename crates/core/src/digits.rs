//! Numbers as text for sentences and figures.

/// Significant digits of [`short`].
pub const DIGITS: i32 = 4;

/// A number to four digits.
pub fn short(x: f64) -> String {
    short_to(x, DIGITS)
}

/// A number to three digits, for sentences.
pub fn rounded(x: f64) -> String {
    format!("{}{}", if x < 0.0 { "−" } else { "" }, short_to(x.abs(), 3))
}

/// A share in per cent, for sentences.
pub fn percent(x: f64) -> String {
    format!("{} %", rounded(100.0 * x))
}

/// A number to `most` digits, without zeros at its end.
pub fn short_to(x: f64, most: i32) -> String {
    if x == 0.0 || !x.is_finite() {
        return if x == 0.0 { "0".into() } else { "–".into() };
    }
    if !(1e-4..1e6).contains(&x.abs()) {
        return format!("{x:.*e}", most as usize - 1);
    }
    let digits = (most - 1 - x.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
