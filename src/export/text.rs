//! What both languages say: where a file comes from, and for what it holds.

use super::{Export, Form, Side};
use crate::locate::Locator;
use crate::locate::opened::BEYOND;
use crate::measure::Unit;
use crate::measure::zero::{Tared, TaredBy};
use crate::scene::Drive;
use crate::status::Status;

/// A number as both languages read it.
pub(super) fn number(x: f64) -> String {
    format!("{x:e}")
}

/// A coefficient of a logarithm, to as many digits as count.
pub(super) fn short(x: f64) -> f64 {
    (x * 1e13).round() / 1e13
}

/// A number to so many significant digits.
pub(super) fn digits(x: f64, n: usize) -> f64 {
    format!("{x:.*e}", n - 1).parse().expect("it was just written")
}

/// Lines of text about `parts`, each at most so long.
pub(super) fn wrapped(parts: impl IntoIterator<Item = String>, indent: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for part in parts {
        match lines.last_mut().filter(|line| line.len() + part.len() < 110) {
            Some(line) => *line += &format!(" {part},"),
            None => lines.push(format!("{indent}{part},")),
        }
    }
    lines.join("\n")
}

/// A name from outside, as it can stand in any comment.
pub(super) fn harmless(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "._-/ ".contains(c) { c } else { '_' }).collect()
}

/// Unit of the signal.
pub(super) fn unit(locator: &Locator) -> &'static str {
    match locator.unit {
        Unit::Strain => "strain, tension positive",
        Unit::Microstrain => "microstrain, tension positive",
        Unit::Bridge => "mV/V of a quarter bridge, tension positive",
        Unit::Reading => "the reading of the calibration",
        Unit::Moment => "N mm, the moment on the root, counterclockwise",
        Unit::Force => "N, the force on the root, towards the object",
    }
}

/// What the drive is.
pub(super) fn drive(locator: &Locator) -> &'static str {
    match (locator.drive_recorded, locator.rig.setup.drive) {
        (false, _) => "was not recorded and is ignored",
        (true, Drive::Angle) => "tap angle, degrees",
        (true, Drive::Displacement) => "displacement, mm",
    }
}

/// The zero of taps of which no other is known, in the unit of the signal.
pub(super) fn zero(locator: &Locator) -> f64 {
    let fitted = |t: &&Tared| matches!(t.from, TaredBy::Fitted | TaredBy::Reference);
    let strain = locator.tared.as_ref().filter(fitted).map_or(0.0, |t| t.value);
    locator.unit.value(strain, locator.rig.setup.gauge.factor)
}

/// Where signals are counts that begin anew beyond their range: how far differences may lie below zero.
pub(super) fn wraps(locator: &Locator) -> Option<f64> {
    let wraps = locator.tared.as_ref().is_some_and(|t| t.wraps);
    let lean = if let [one] = locator.sides() { one.sign } else { 0.0 };
    wraps.then(|| crate::measure::counts::below(lean))
}

/// |signal| of the strain limit on a side with so many readings per strain; infinite where it is not known.
pub(super) fn limit(locator: &Locator, factor: f64) -> f64 {
    let limit = locator.rig.strain_limit();
    let limit = if locator.unit.is_absolute() { limit } else { limit * factor.abs() };
    if limit.is_nan() { f64::INFINITY } else { limit }
}

/// The whisker of a calibration.
pub(super) fn whisker(locator: &Locator) -> Option<String> {
    let t = &locator.rig.design.tuple;
    let whisker = format!("D = {} mm, d = {} mm, L_a = {} mm", t.D, t.d, t.L_a);
    let known = || format!("whisker      {whisker}; gauge x_ss = {} mm, l = {} mm", t.x_ss, t.l);
    locator.rig.known.then(known)
}

/// Lines of a comment without blanks at their ends.
pub(super) fn trimmed(lines: &[String]) -> String {
    lines.join("\n").lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// A comment of C.
pub(super) fn c_comment(text: &str) -> String {
    trimmed(&[format!("/* {}\n*/", text.replace('\n', "\n   "))])
}

impl Export<'_> {
    /// What the file is, line by line.
    pub(super) fn comment(&self, precision: &str) -> String {
        let (l, c) = (self.locator, self.calibration);
        let mut lines = vec![
            "Distance of a contact from the signal of a whisker: one calibration, one file, no dependency."
                .to_owned(),
            format!("Written by vibrissa {} (estimator: {}).", c.version, l.estimator.name()),
            String::new(),
        ];
        lines.extend(whisker(l));
        lines.push(format!("signal       {}", unit(l)));
        lines.push(format!("drive        {}", drive(l)));
        lines.extend(self.sides.iter().map(|side| self.domain(side)));
        let (noise, unit) = (l.noise(), l.unit.common());
        lines.push(format!(
            "sigma        noise of one reading ({noise:.3e} {unit}), of the calibration, bias; {BEYOND} sigma beyond the distances is outside"
        ));
        lines.push(format!("error        {}", self.precision(precision)));
        lines.push(format!("data         {}, SHA-256 {}", harmless(&c.data.file), harmless(&c.data.hash)));
        lines.push(format!("calibration  SHA-256 {}", harmless(&c.checksum)));
        trimmed(&lines)
    }

    fn precision(&self, float: &str) -> String {
        match self.error() {
            0.0 => format!("what `vibrissa locate` computes itself; rounding only{float}"),
            error => {
                format!("up to {error:.1e} mm to `vibrissa locate` among the calibrated distances{float}")
            }
        }
    }

    fn domain(&self, side: &Side<'_>) -> String {
        let [lo, hi] = side.of.distances;
        let drives = &side.of.drives;
        let sign = if side.of.sign > 0.0 { "signal > 0  " } else { "signal < 0  " };
        let unit = if self.locator.rig.setup.drive == Drive::Angle { "degrees" } else { "mm" };
        let origin = self.locator.drive_origin;
        let ends = format!("{} ... {} {unit}", origin + drives[0], origin + drives[drives.len() - 1]);
        let drives = if self.locator.drive_recorded { format!(", drives {ends}") } else { String::new() };
        let far = match &side.form {
            Form::Inverted { pieces, cut: true, .. } => {
                format!("; none is given beyond {:.2} mm", pieces.strips[0].pieces[0].a[1])
            }
            _ => String::new(),
        };
        format!("{sign} distances {lo} ... {hi} mm{drives}{far}")
    }
}

/// The number of a status in the files.
pub(super) fn code(status: Status) -> u8 {
    let bits = [
        (Status::NO_STRAIN, 1),
        (Status::STRAIN_LIMIT, 2),
        (Status::NO_ROOT, 4),
        (Status::AMBIGUOUS, 8),
        (Status::OUTSIDE_CALIBRATION, 16),
        (Status::BAD_INPUT, 32),
        (Status::INCONSISTENT, 64),
    ];
    bits.iter().filter(|(s, _)| status.has(*s)).map(|(_, bit)| bit).sum()
}
