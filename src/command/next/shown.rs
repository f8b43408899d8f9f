//! The next tap as a table, as JSON, in words and drawn.

use std::fmt::Write;

use crate::digits::short;
use crate::error::Error;
use crate::figure::{Axis, Figure, Mark, Marker, Panel, Path as Drawn};
use crate::locate::next::{Next, Tried};
use crate::locate::sequence::SHIFT;
use crate::scene::Drive;
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::table::drive_unit;
use crate::sink::values::Field;
use crate::status::Status;
use serde_json::json;

pub fn table(next: &Next, drive: Drive) -> Result<Frame, Error> {
    let mut table = heading("next").frame(&[drive.column()]);
    for t in &next.tried {
        let numbers = [t.drive, t.shift, t.signal, t.sigma].map(Field::Number);
        table.row(numbers.into_iter().chain([t.status.into()]))?;
    }
    Ok(table)
}

/// The next tap for programs; `lines` are those of the taps so far.
pub fn result(next: &Next, drive: Drive, lines: &[usize]) -> serde_json::Value {
    let best = next.best.map(|k| next.tried[k]);
    let known = next.taps > 0;
    json!({
        "taps": next.taps,
        "distance_mm": known.then_some(next.now[0]),
        "sigma_mm": next.now[1],
        "near_mm": next.near,
        "status": next.status.to_string(),
        "apart_line": next.apart.map(|(k, _)| lines[k]),
        "apart_sigmas": next.apart.map(|(_, by)| by),
        "left_out": next.left.len(),
        drive.column(): best.map(|b| b.drive),
        SHIFT: best.map(|b| b.shift),
        "expected_signal": best.map(|b| b.signal),
        "expected_sigma_mm": best.map(|b| b.sigma),
        "after_taps": next.more.iter().map(|(n, sigma)| json!({ "taps": n, "sigma_mm": sigma })).collect::<Vec<_>>(),
        "least_sigma_mm": next.floor,
        "enough": next.is_enough(),
    })
}

pub fn answer(next: &Next, drive: Drive, lines: &[usize]) -> String {
    let (symbol, unit) = drive_unit(drive);
    let [a, sigma] = next.now;
    let mut text = match next.taps {
        0 => format!("Nothing is known yet but the calibrated distances (σ {} mm). ", short(sigma)),
        n => format!("{n} tap{} so far: {a:.3} ± {} mm. ", if n == 1 { "" } else { "s" }, short(sigma)),
    };
    if let Some(near) = next.near {
        let _ = write!(text, "{near:.2} mm fits as well. ");
    }
    if let Some((k, by)) = next.apart.filter(|_| next.status.has(Status::INCONSISTENT)) {
        let (line, by) = (lines[k], by.abs());
        text += &format!(
            "They contradict each other: line {line} is {by:.1} standard deviations from what the others say. Mend that first; more taps do not. "
        );
    }
    if next.status.has(Status::OUTSIDE_CALIBRATION) {
        text += "That is outside of the calibrated distances. ";
    }
    let Some((best, floor)) = next.best.map(|k| next.tried[k]).zip(next.floor) else {
        let outside = |t: &Tried| t.status.has(Status::OUTSIDE_CALIBRATION);
        return text
            + if next.tried.iter().all(outside) {
                "From nowhere that the base may stand is the object within the calibrated distances."
            } else {
                "No drive is within the limits of the sensor."
            };
    };
    let floor = short(floor);
    if next.is_enough() {
        return text
            + &format!(
                "More taps bring nothing: what is left, {floor} mm, is the error of the calibration and of the run, which all taps share."
            );
    }
    let moved = if next.moves() {
        format!(" with the base {:.2} mm nearer than where distances are told from", best.shift)
    } else {
        String::new()
    };
    let (drive, sigma, (n, more)) = (best.drive, short(best.sigma), next.more[3]);
    let more = short(more);
    text + &format!(
        "Tap next by {symbol} = {drive:.3}{unit}{moved}: σ is expected to become {sigma} mm. {n} such taps would bring {more} mm, any number of them no less than {floor} mm."
    )
}

pub fn drawn(next: &Next, drive: Drive) -> Figure {
    let (symbol, unit) = drive_unit(drive);
    let curve = |own: &dyn Fn(&Tried) -> bool| -> Vec<(f64, f64)> {
        next.tried.iter().filter(|t| own(t)).map(|t| (t.drive, t.sigma)).collect()
    };
    let fine = |t: &Tried| t.status == Status::OK;
    let best = next.best.map(|k| (next.tried[k].drive, next.tried[k].sigma));
    let at = next.best.map_or(next.stands, |k| next.tried[k].shift);
    let here = |shift: f64| move |t: &Tried| t.shift == shift;
    let mut lines = vec![("after one tap more".to_owned(), 0, curve(&|t| fine(t) && here(at)(t)))];
    if next.moves() {
        lines[0].0 = format!("base {at:.1} mm nearer (best)");
        // And where it stands now, or nearest to that.
        let off = |t: &&Tried| (t.shift - next.stands).abs();
        let other = next.tried.iter().min_by(|p, q| off(p).total_cmp(&off(q))).map(|t| t.shift);
        let other = other.filter(|shift| *shift != at);
        let line = other
            .map(|shift| (format!("base {shift:.1} mm nearer"), 3, curve(&|t| fine(t) && here(shift)(t))));
        lines.extend(line.filter(|line| !line.2.is_empty()));
    }
    let beyond = curve(&|t| !fine(t) && t.sigma.is_finite() && here(at)(t));
    let ends = [next.tried.first(), next.tried.last()].map(|t| t.map_or(0.0, |t| t.drive));
    let now = Drawn::new("σ so far", 2, ends.map(|x| (x, next.now[1])));
    let panel = Panel::new(
        "",
        Axis::new(&format!("drive of the next tap {symbol}"), unit.trim()),
        Axis::log("expected σ", "mm"),
    )
    .with(Mark::points(Drawn::new("best", 0, best), Marker::Circle))
    .with(Mark::points(Drawn::new("beyond a limit of the sensor", 1, beyond), Marker::Cross))
    .with(Mark::line(now, 1));
    let line = |(name, colour, values): (String, usize, Vec<(f64, f64)>)| {
        Mark::line(Drawn::new(name, colour, values), 0)
    };
    let panel = lines.into_iter().map(line).fold(panel, Panel::with);
    let caption = "Standard deviation of the distance that is expected after one more tap, against its drive (next.csv).";
    Figure::new("next", "The next tap", caption, vec![panel])
}
