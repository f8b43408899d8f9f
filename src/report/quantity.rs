//! What columns are called where people read: symbol, unit, and whether their axis goes by decades.

use super::table::distinct;
use crate::figure::Axis;

/// Digits of a value that is said.
const DIGITS: i32 = 4;
/// Digits that part any two numbers.
const MOST: i32 = 17;

/// Column, label, unit, by decades.
const KNOWN: [(&str, &str, &str, bool); 59] = [
    ("D_mm", "base diameter D", "mm", false),
    ("d_mm", "tip diameter d", "mm", false),
    ("L_a_mm", "length L_a", "mm", false),
    ("x_ss_mm", "gauge place x_ss", "mm", false),
    ("l_mm", "grid length l", "mm", false),
    ("exponent", "exponent n", "", false),
    ("scale", "scale of the profile z", "", false),
    ("bore_mm", "bore b", "mm", false),
    ("core_mm", "core c", "mm", false),
    ("E_core_MPa", "modulus of the core E_c", "MPa", true),
    ("kappa_base_per_mm", "curvature κ_base", "1/mm", false),
    ("kappa_slope_per_mm2", "its slope κ_slope", "1/mm²", false),
    ("k_theta_Nmm_per_rad", "root k_θ", "N mm/rad", true),
    ("k_y_N_per_mm", "root k_y", "N/mm", true),
    ("k_x_N_per_mm", "root k_x", "N/mm", true),
    ("hub_mm", "hub r₀", "mm", false),
    ("E_MPa", "modulus E", "MPa", false),
    ("nu", "Poisson's ratio ν", "", false),
    ("pole_radius_mm", "pole radius ρ", "mm", false),
    ("mu", "friction μ", "", false),
    ("foil_N_per_mm", "foil stiffness S_f", "N/mm", true),
    ("noise", "noise σ", "", false),
    ("a_mm", "contact distance a", "mm", false),
    ("tilt_deg", "tilt β", "°", false),
    ("lean_deg", "lean γ", "°", false),
    ("theta_deg", "tap angle θ", "°", false),
    ("delta_mm", "displacement δ", "mm", false),
    ("strain", "gauge strain ε", "", false),
    ("strain_2", "strain of the second gauge ε₂", "", false),
    ("bending_azimuth_deg", "azimuth φ", "°", false),
    ("slide_mm", "slide λ", "mm", false),
    ("signal", "signal", "", false),
    ("signal_max", "largest signal", "", false),
    ("moment_Nmm", "moment on the root M₀", "N mm", false),
    ("force_N", "force on the root F_y", "N", false),
    ("reading", "reading", "as recorded", false),
    ("K", "K", "", false),
    ("K_mm", "K", "mm", false),
    ("K_mean", "mean of K", "", false),
    ("K_mean_mm", "mean of K", "mm", false),
    ("K_sd", "spread of K, SD", "", true),
    ("K_sd_mm", "spread of K, SD", "mm", true),
    ("distance_mm", "estimated distance â", "mm", false),
    ("error_mm", "error â − a", "mm", false),
    ("error_rms_mm", "bias, rms", "mm", true),
    ("error_max_mm", "bias, largest", "mm", true),
    ("bias_rms_mm", "bias, rms", "mm", true),
    ("noise_rms_mm", "noise, rms", "mm", true),
    ("total_rms_mm", "total error, rms", "mm", true),
    ("strain_max", "largest strain", "", false),
    ("force_max_N", "largest force", "N", false),
    ("weighted", "weighted objective", "", true),
    ("sigma_mm", "standard deviation σ_a", "mm", false),
    ("s_mm", "arc length s", "mm", false),
    ("x_mm", "x", "mm", false),
    ("y_mm", "y", "mm", false),
    ("psi_deg", "ψ", "°", false),
    ("line", "line of the file", "", false),
    ("residual", "residual", "", false),
];

/// The axis of `column`.
pub fn axis(column: &str) -> Axis {
    match KNOWN.iter().find(|(name, ..)| *name == column) {
        Some((_, label, unit, true)) => Axis::log(label, unit),
        Some((_, label, unit, false)) => Axis::new(label, unit),
        None => Axis::new(column, ""),
    }
}

/// A value of `column` in words: d = 4 mm.
pub fn said(column: &str, value: f64) -> String {
    said_to(column, value, DIGITS)
}

/// The same of each of `values`, with as many digits as it takes to tell them apart.
pub fn told_apart(column: &str, values: &[f64]) -> Vec<String> {
    apart(values, |x, digits| said_to(column, x, digits))
}

/// `values` alone, with as many digits as it takes to tell them apart.
pub fn numbers_apart(values: &[f64]) -> Vec<String> {
    apart(values, |x, digits| format!("{}{}", if x < 0.0 { "−" } else { "" }, short_to(x.abs(), digits)))
}

fn apart(values: &[f64], say: impl Fn(f64, i32) -> String) -> Vec<String> {
    let different = distinct(values.iter().copied()).len();
    let words = |digits| values.iter().map(|x| say(*x, digits)).collect::<Vec<_>>();
    let parted = |all: &Vec<String>| all.iter().collect::<std::collections::HashSet<_>>().len() >= different;
    (DIGITS..=MOST).map(words).find(parted).unwrap_or_else(|| words(MOST))
}

fn said_to(column: &str, value: f64, digits: i32) -> String {
    let axis = axis(column);
    let symbol = axis.label.rsplit(' ').next().unwrap_or_default();
    let unit = match axis.unit.as_str() {
        "" | "°" => axis.unit.clone(),
        unit => format!(" {unit}"),
    };
    let sign = if value < 0.0 { "−" } else { "" };
    format!("{symbol} = {sign}{}{unit}", short_to(value.abs(), digits))
}

/// A number to four digits.
pub fn short(x: f64) -> String {
    short_to(x, DIGITS)
}

/// A number as a sentence has it: three digits.
pub fn rounded(x: f64) -> String {
    format!("{}{}", if x < 0.0 { "−" } else { "" }, short_to(x.abs(), 3))
}

/// A share as a sentence has it, in per cent.
pub fn percent(x: f64) -> String {
    format!("{} %", rounded(100.0 * x))
}

fn short_to(x: f64, most: i32) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_said_with_symbol_and_unit() {
        assert_eq!(said("d_mm", 4.0), "d = 4 mm");
        assert_eq!(said("theta_deg", 0.5), "θ = 0.5°");
        assert_eq!(said("tilt_deg", -30.0), "β = −30°");
        assert_eq!(said("x_ss_mm", 5.12345), "x_ss = 5.123 mm");
        assert_eq!(told_apart("D_mm", &[8.0, 10.0, 8.0]), ["D = 8 mm", "D = 10 mm", "D = 8 mm"]);
        assert_eq!(told_apart("D_mm", &[10.0, 10.000_000_000_1]), ["D = 10 mm", "D = 10.0000000001 mm"]);
        assert_eq!(told_apart("theta_deg", &[1.0, 1.0 + f64::EPSILON])[1], "θ = 1.0000000000000002°");
        assert_eq!([short(0.0), short(1.25e-7), short(12345.6)], ["0", "1.250e-7", "12346"]);
    }
}
