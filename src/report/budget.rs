//! Bias and noise of the distance against the drive.

use super::quantity::{self, said};
use crate::figure::{Along, Mark, Marker, Panel, Path};

/// One whisker's: bias, noise and total as (drive, mm), each by ascending drive, and the tap that is ringed, with its name.
pub fn budget(
    title: &str,
    drive: &str,
    [bias, noise, total]: [Vec<(f64, f64)>; 3],
    best: Option<(&str, (f64, f64))>,
) -> Panel {
    let mut y = quantity::axis("total_rms_mm");
    y.label = "error of the distance, rms".to_owned();
    let mut panel = Panel::new(title, quantity::axis(drive), y)
        .with(Mark::dotted(Path::new("bias", 0, bias), Marker::Circle))
        .with(Mark::dotted(Path::new("noise", 1, noise), Marker::Square))
        .with(Mark::dotted(Path::new("total", 4, total), Marker::Triangle));
    if let Some((name, (x, y))) = best {
        panel = panel
            .with(Mark::Rule { along: Along::Y, at: x, name: String::new(), colour: 7, dash: 2 })
            .with(Mark::points(Path::new(name, 4, [(x, y)]), Marker::Ring))
            .with(Mark::Note { x, y, text: said(drive, x) });
    }
    panel
}

/// The least of `points`.
pub fn least(points: impl Iterator<Item = (f64, f64)>) -> Option<(f64, f64)> {
    points.filter(|p| p.1.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1))
}
