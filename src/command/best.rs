//! The best rows of a sweep, as a table on the terminal.

use std::fmt::Write;

use super::grouped;
use crate::digits::short;
use crate::scene::{Per, RankBy, Spec};
use crate::sink::table::drive_unit;
use crate::sweep::{Kept, Report};

/// The best rows with the column that ranks them; with a noise of the gauge also what bias and noise come to together.
pub fn table(spec: &Spec, report: &Report) -> String {
    let output = &spec.study.output;
    let by = spec.study.listed_by();
    if report.highlights.is_empty() {
        return format!(
            "no complete row to rank by {}: in a complete row every distance counts, and this column has a value\n",
            by.word()
        );
    }
    let noisy = spec.study.setup.is_noisy() == Some(true);
    let columns = columns(by, noisy);
    let (symbol, unit) = drive_unit(spec.study.setup.drive);
    let (shown, ranked, by_name) = (report.highlights.len(), grouped(report.ranked), by.word());
    let what = match (output.top, output.per) {
        _ if report.by_design => {
            format!("{shown} designs of {ranked} complete rows, each at its best drive,")
        }
        (Some(_), Per::Design) => format!("{shown} of {ranked} designs, each at its best drive,"),
        _ => format!("{shown} of {ranked} complete rows"),
    };
    let mut text = format!("best {what} by {by_name}:\n");
    let _ = write!(text, "  {:>8} {:>8} {:>8} {:>8} {:>6}", "D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm");
    let rigs = spec.study.setup.rigs.as_ref();
    let properties = rigs.map_or(&[][..], |rigs| &rigs.properties);
    properties.iter().for_each(|property| text += &format!(" {:>9}", property.name()));
    let shown = spec.study.setup.directions;
    let angles = [(shown.tilt, "tilt"), (shown.lean, "lean")];
    angles.iter().filter(|(shown, _)| *shown).for_each(|(_, name)| text += &format!(" {name:>8}"));
    let _ = write!(text, " {symbol:>8}   {:>10}", "K_mean");
    columns.iter().for_each(|column| text += &format!(" {:>12}", column.word()));
    text.push('\n');
    for k in &report.highlights {
        let d = &k.design;
        let short = |x: f64| {
            let x = format!("{x:.4}");
            x.trim_end_matches('0').trim_end_matches('.').to_owned()
        };
        let drive = format!("{}{unit}", short(k.drive));
        let mean = k.row.mean.map_or(String::new(), |m| format!("{:.6}", (1.0 + m) * k.unit));
        let _ = write!(text, "  {:>8.4} {:>8.4} {:>8.4} {:>8.4} {:>6.3}", d.D, d.d, d.L_a, d.x_ss, d.l);
        for value in rigs.map_or(Vec::new(), |rigs| rigs.values(d.rig)) {
            text += &format!(" {:>9}", rough(value));
        }
        for (_, angle) in
            [(shown.tilt, k.direction.tilt), (shown.lean, k.direction.lean)].iter().filter(|x| x.0)
        {
            text += &format!(" {:>8}", short(*angle) + "°");
        }
        let _ = write!(text, " {drive:>8}   {mean:>10}");
        columns.iter().for_each(|column| text += &format!(" {:>12}", value(k, *column)));
        text += if k.row.status.is_strained() { "  beyond the strain limit\n" } else { "\n" };
    }
    text + &explained(&columns, by, noisy && by != RankBy::TotalRms && !output.by_said)
}

/// A value of any size in a few digits.
fn rough(x: f64) -> String {
    if x == 0.0 || (1e-2..1e5).contains(&x.abs()) { format!("{x:.4}") } else { format!("{x:.2e}") }
}

/// K_sd and the bias, beside them noise and total where there is noise, and the column that ranks.
fn columns(by: RankBy, noisy: bool) -> Vec<RankBy> {
    let mut columns = vec![RankBy::KSd, RankBy::ErrorRms];
    if noisy {
        columns.extend([RankBy::NoiseRms, RankBy::TotalRms]);
    }
    if !columns.contains(&by) {
        columns.push(by);
    }
    columns
}

fn value(k: &Kept, column: RankBy) -> String {
    k.row.value(column, k.unit).map_or(String::new(), short)
}

/// What the columns of millimetres are; `silent`: the ranking holds no noise although there is some, and nobody asked for that.
fn explained(columns: &[RankBy], by: RankBy, silent: bool) -> String {
    let mut text = "error_rms_mm is the bias of the distance".to_owned();
    if columns.contains(&RankBy::TotalRms) {
        text += ", noise_rms_mm what the noise of the gauge adds, total_rms_mm both in quadrature";
    }
    if silent {
        text += &format!(
            "\n{} holds no noise: `by = \"total_rms_mm\"` in [output] ranks by bias and noise",
            by.word()
        );
    }
    text + "\n"
}
